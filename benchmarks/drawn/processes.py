"""Cases in processes of their own, forked from one that has imported everything."""

from __future__ import annotations

import faulthandler
import os
import pickle
import select
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

LONGEST = 300  # processor seconds of one case
LATEST = 600.0  # s of one case, on a machine that does other things too
TAIL = 2000  # characters of stderr


class Child(NamedTuple):
    """A process, the pipe it answers through, and when it began."""

    process: int
    pipe: int
    begun: float
    case: int
    got: list[bytes]


def each(
    cases: Iterator[int], judge: Callable[[int], Any], jobs: int, errors: Path
) -> Iterator[tuple[int, Any, float]]:
    """Cases with their outcomes and seconds; an outcome that is a text says how the process ended.

    What a process writes to stderr goes into a file of ``errors``; its end is part of the text.
    """
    running: list[Child] = []
    try:
        while True:
            while len(running) < jobs:
                case = next(cases, None)
                if case is None:
                    break
                running.append(_started(case, judge, errors))
            if not running:
                return
            ready, _, _ = select.select([c.pipe for c in running], [], [], 0.5)
            for child in list(running):
                late = time.monotonic() - child.begun > LATEST
                if child.pipe in ready and (block := os.read(child.pipe, 1 << 16)):
                    child.got.append(block)
                elif child.pipe in ready or late:
                    running.remove(child)
                    outcome = _ended(child, late)
                    written = errors / f"{child.case}.err"
                    if isinstance(outcome, str):
                        outcome += "; stderr: " + written.read_text("utf-8", "replace")[-TAIL:]
                    written.unlink()
                    yield child.case, outcome, time.monotonic() - child.begun
    finally:
        for child in running:
            _ended(child, True)


def _started(case: int, judge: Callable[[int], Any], errors: Path) -> Child:
    reading, writing = os.pipe()
    process = os.fork()
    if process:
        os.close(writing)
        return Child(process, reading, time.monotonic(), case, [])
    status = 1
    try:
        os.setsid()  # with the compilers that it starts
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 1))
        os.close(reading)
        os.dup2(os.open(errors / f"{case}.err", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), 2)
        faulthandler.enable(file=2)  # a crash tells its frames there, not in the caller's output
        faulthandler.register(
            signal.SIGXCPU, all_threads=True
        )  # tells where; a second later it ends
        with os.fdopen(writing, "wb") as stream:
            pickle.dump(judge(case), stream)
        status = 0
    finally:
        os._exit(status)


def _ended(child: Child, late: bool) -> Any:
    """The outcome; or a text, where there is none."""
    os.close(child.pipe)
    for end in (os.killpg, os.kill):  # its compilers, and a child that has no group yet
        with suppress(ProcessLookupError, PermissionError):
            end(child.process, signal.SIGKILL)
    _, status = os.waitpid(child.process, 0)
    if late:
        return f"took longer than {LATEST:.0f} s"
    with suppress(Exception):
        return pickle.loads(b"".join(child.got))
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGKILL:
        return f"took more than {LONGEST} processor seconds, or too much memory"
    return f"the process ended with {signal.Signals(-code).name if code < 0 else code}"
