"""A process that measures constants one after the other, with scenes that are compiled once.

    python -m benchmarks.thresholds.worker FOLDER RESULTS SIZE TASK ...

SIZE is ``full`` or ``short``.  A task is NAME:FACTOR, and ``:1`` that of all constants as they are;
its result is a line of JSON in the file RESULTS.  Each is measured in a process forked from this
one, which has loaded all code: a wild value may end it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

from .constants import constants
from .varied import CLOSING, FILE_VARIABLE, write_factors

LONGEST = 2.0  # times as long as the first pass, which compiles and computes judges' motions too


class _OtherCloser:
    """Finds the closer of loops that has factors in place of the runtime's."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if name != CLOSING:
            return None
        return importlib.util.spec_from_file_location(name, self._path)


def main(arguments: Sequence[str]) -> int:
    folder, results, size, *tasks = arguments
    (closing,) = Path(folder).rglob("_closing*.so")
    sys.meta_path.insert(0, _OtherCloser(closing))  # before mechc is imported
    from mechc.compilation import find

    from . import cases

    find.COMPILED_AT_INSTALL = ()
    cases.remember_judges()
    known = {each.name: each for each in constants()}
    places = {name: k + 1 for k, name in enumerate(known)}
    began = time.monotonic()
    every = [*cases.CASES] if size == "full" else [*cases.SHORT_CASES]
    cases.measured(every)
    longest = LONGEST * (time.monotonic() - began)
    for task in tasks:
        name, _, factor = task.partition(":")
        chosen = cases.cases_of(known[name], size == "full") if name else every
        place = places.get(name, 0)
        write_factors(Path(os.environ[FILE_VARIABLE]), len(known), place, float(factor))
        found = _forked(partial(cases.measured, chosen), longest)
        with Path(results).open("a", encoding="utf-8") as file:
            file.write(json.dumps({"name": name, "factor": float(factor), **found}) + "\n")
    return 0


def _forked(measure: Callable[[], Any], longest: float) -> dict[str, Any]:
    """What is measured in a child of this process; ``broke``: why it did not come to an end."""
    source, sink = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(int(longest) + 1)  # ends it
        with os.fdopen(sink, "w") as out:
            json.dump(measure(), out)
        os._exit(0)
    os.close(sink)
    with os.fdopen(source) as told:
        text = told.read()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return {"broke": signal.Signals(os.WTERMSIG(status)).name}
    found: dict[str, Any] = json.loads(text) if text else {"broke": "no figures"}
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
