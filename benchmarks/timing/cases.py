"""Cases timed in turns in one process, so that noise and clock changes affect all equally."""

from __future__ import annotations

import gc
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .processes import clocked

Array = NDArray[np.float64]
WRONG = 0.1  # of a scale: beyond this it is another motion, not an inaccurate one
SHORT, RUNS_OF_A_TURN = 1e-3, 5  # seconds of a run below which a turn has several


def nothing() -> None:
    """A case's preparation before a run."""


@dataclass
class Case:
    """One tool, method and tolerance on one problem.

    ``run`` is what is timed; its value goes to ``state``, which gives what is observed of the final
    state, or None where the run ended with a status, and to ``word``, which gives that status.
    Where a run integrates several ``trajectories`` in lockstep, the time of one is reported.
    Errors beyond ``wrong`` are those of another motion.
    """

    tool: str
    method: str
    tol: float
    run: Callable[[], Any]
    state: Callable[[Any], Array | None]
    word: Callable[[Any], str] = lambda _: "finished"
    prepare: Callable[[], None] = nothing
    trajectories: int = 1
    seconds: list[float] = field(default_factory=list)
    error: float = np.inf
    status: str = ""
    wrong: float = WRONG

    @property
    def label(self) -> str:
        """Right, another motion without a warning, or ended with a status."""
        if not np.isfinite(self.error):
            return "flagged"
        return "right" if self.error <= self.wrong else "wrong"

    def record(self) -> dict[str, Any]:
        """One row of the JSON; ``spread`` is the interquartile range over the median."""
        ok, seconds = np.isfinite(self.error), np.array(self.seconds) / self.trajectories
        low, median, high = np.percentile(seconds, (25, 50, 75))
        return {
            "tool": self.tool, "method": self.method, "tol": self.tol, "label": self.label,
            "error": float(self.error) if ok else None, "status": self.status,
            "seconds": float(seconds.min()), "median": float(median),
            "spread": float((high - low) / median), "repeats": len(seconds),
            "first": float(seconds[0]),
        }  # fmt: skip


def grid(
    tool: str, methods: Iterable[str], tolerances: Iterable[float],
    run: Callable[[str, float], Any], state: Callable[[Any], Array | None],
    word: Callable[[Any], str], **more: Any,
) -> list[Case]:  # fmt: skip
    """A case of each method at each tolerance; ``run(method, tolerance)`` is what is timed."""
    tolerances = list(tolerances)
    return [
        Case(tool, method, tol, partial(run, method, tol), state, word, **more)
        for method in methods
        for tol in tolerances
    ]


@dataclass(frozen=True)
class Effort:
    """How much time measuring may take.

    Attributes
    ----------
    longest
        Seconds of one run; where a tool's method takes longer, its tighter tolerances are left out.
    cut
        Seconds after which a first run is interrupted, and its case says so.
    rounds, budget
        Each case runs as many times, unless its runs take as many seconds before.
    total
        Seconds for all repeats together; the first runs come on top of them.
    clock
        Of the runs; the time on the wall by default.  The processor's tells methods of one process
        apart beside other work.
    """

    longest: float = 10.0
    cut: float = 30.0
    rounds: int = 40
    budget: float = 1.0
    total: float = np.inf
    clock: Callable[[], float] | None = None


def measure(
    cases: Sequence[Case],
    error_of: Callable[[Array], float],
    effort: Effort,
    about_to_run: Callable[[Case], None] = lambda _: None,
) -> list[Case]:
    """Run every case once for its error, then in turns; gives the cases that were run.

    ``about_to_run`` is told every case before it runs, outside what is timed.
    """
    measured: list[Case] = []
    slow: set[tuple[str, str]] = set()
    for case in sorted(cases, key=lambda case: -case.tol):
        if (case.tool, case.method) not in slow:
            about_to_run(case)
            _judge(case, error_of, effort)
            measured.append(case)
            if case.seconds[0] > effort.longest:
                slow.add((case.tool, case.method))
    order = {id(case): k for k, case in enumerate(cases)}
    measured.sort(key=lambda case: order[id(case)])
    _repeat(measured, effort, about_to_run)
    return measured


def _repeat(cases: Sequence[Case], effort: Effort, about_to_run: Callable[[Case], None]) -> None:
    until = time.perf_counter() + effort.total
    gc.collect()
    gc.disable()
    try:
        for _ in range(effort.rounds):
            for case in cases:
                if sum(case.seconds) < effort.budget and time.perf_counter() < until:
                    about_to_run(case)
                    _turn(case, effort.clock)
    finally:
        gc.enable()


def _turn(case: Case, clock: Callable[[], float] | None) -> None:
    """One run, or several short ones: the first finds the caches full of another tool's data."""
    for _ in range(RUNS_OF_A_TURN if min(case.seconds) < SHORT else 1):
        case.prepare()
        case.seconds.append(clocked(case.run, clock))


class TookTooLongError(RuntimeError):
    """A run was cut off."""


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    """Raise TookTooLongError in what takes longer, at its next Python instruction."""

    def interrupt(*_: Any) -> None:
        raise TookTooLongError(f"cut off after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _judge(case: Case, error_of: Callable[[Array], float], effort: Effort) -> None:
    """The first run: its error or its status; its time counts too."""
    case.prepare()
    clock = effort.clock or time.perf_counter
    start = clock()
    try:
        with interrupted_after(effort.cut):
            value = case.run()
        case.seconds.append(clock() - start)
        final, case.status = case.state(value), case.word(value)
    except Exception as error:  # a peer may raise anything; it is shown in its row
        if not case.seconds:
            case.seconds.append(clock() - start)
        case.status = f"{type(error).__name__}: {error}".splitlines()[0]
        case.run = nothing
        return
    if final is not None and np.isfinite(final).all():
        case.error = error_of(final)
    elif not case.status or case.status == "finished":
        case.status = "not finite"
