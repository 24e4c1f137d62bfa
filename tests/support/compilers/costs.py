"""Where the processor time of a run of the tests went: printed at its end."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import wraps
from typing import Any

import mechc_codegen.compiler
import pytest

from mechc.compilation import toolchain
from tests.support import ROOT

COLLECTION, COMPILERS, DERIVATION = "collection and imports", "compilers", "derivation"
PROCESSES, REST = "other processes", "the tests themselves"
SLOWEST = 10


class Costs:
    """A plugin of pytest, of the process that runs tests and of the one that prints."""

    def __init__(self) -> None:
        self.stages, self.counts, self.files = Counter[str](), Counter[str](), Counter[str]()
        self._began = False

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        if not self._began:
            self._began = True
            self.stages[COLLECTION] += time.process_time()
            self._measure(toolchain, "_output", COMPILERS, of_children)
            self._measure(mechc_codegen.compiler, "build_scene", DERIVATION, time.thread_time)
        before = Counter(self.stages)
        own, children = time.process_time(), of_children()
        try:
            return (yield)
        finally:
            own, children = time.process_time() - own, of_children() - children
            spent = self.stages - before
            self.stages[PROCESSES] += max(children - spent[COMPILERS], 0.0)
            self.stages[REST] += own - spent[DERIVATION]
            self.files[item.path.relative_to(ROOT).as_posix()] += own + children

    def _measure(self, owner: Any, name: str, stage: str, clock: Callable[[], float]) -> None:
        """Add the time of each call of a function to a stage."""
        function = getattr(owner, name)

        @wraps(function)
        def measured(*given: Any, **named: Any) -> Any:
            started = clock()
            try:
                return function(*given, **named)
            finally:
                self.stages[stage] += clock() - started
                self.counts[stage] += 1

        setattr(owner, name, measured)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if hasattr(session.config, "workeroutput"):
            mine = [dict(each) for each in (self.stages, self.counts, self.files)]
            session.config.workeroutput["costs"] = mine

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        for mine, other in zip(
            (self.stages, self.counts, self.files),
            getattr(node, "workeroutput", {}).get("costs", ()), strict=False,
        ):  # fmt: skip
            mine.update(other)

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        write = terminalreporter.write_line
        write(f"processor time: {sum(self.stages.values()):.0f} s")
        for stage, seconds in self.stages.most_common():
            often = f" ({self.counts[stage]} times)" if self.counts[stage] else ""
            write(f"{seconds:8.1f} s  {stage}{often}")
        write("the slowest files:")
        for name, seconds in self.files.most_common(SLOWEST):
            write(f"{seconds:8.1f} s  {name}")


def of_children() -> float:
    """Processor time of the processes that this one has waited for, in seconds."""
    times = os.times()
    return times.children_user + times.children_system
