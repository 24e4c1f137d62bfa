"""Cases timed in turns in one process, so that noise and clock changes hit all alike."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
WRONG = 0.1  # of a scale: beyond this it is another motion, not an inaccurate one


def nothing() -> None:
    """What most cases need before a run."""


@dataclass
class Case:
    """One tool, method and tolerance on one problem.

    ``run`` is what is timed; its value goes to ``state``, which gives the final state, or None
    where the run ended with a status, and to ``word``, which gives that status.  Where a run
    integrates several ``trajectories`` abreast, what is reported is the time of one.
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

    @property
    def label(self) -> str:
        """Right within WRONG, another motion without a word, or ended with a status."""
        if not np.isfinite(self.error):
            return "flagged"
        return "right" if self.error <= WRONG else "wrong"

    def record(self) -> dict[str, Any]:
        """One row of the JSON."""
        ok, seconds = np.isfinite(self.error), np.array(self.seconds) / self.trajectories
        return {
            "tool": self.tool, "method": self.method, "tol": self.tol, "label": self.label,
            "error": float(self.error) if ok else None, "status": self.status,
            "seconds": float(seconds.min()), "median": float(np.median(seconds)),
            "repeats": len(seconds),
        }  # fmt: skip


def measure(
    cases: list[Case], error_of: Callable[[Array], float], rounds: int, budget: float
) -> None:
    """Run every case once for its error, then in turns: ``rounds`` times, ``budget`` s a case.

    A case that alone takes longer than its budget is run once.
    """
    for case in cases:
        _judge(case, error_of)
    gc.collect()
    gc.disable()
    try:
        for _ in range(rounds):
            for case in cases:
                if sum(case.seconds) < budget:
                    case.prepare()
                    case.seconds.append(_once(case.run))
    finally:
        gc.enable()


def _judge(case: Case, error_of: Callable[[Array], float]) -> None:
    """The first run: its error or its status; its time counts too."""
    case.prepare()
    start = time.perf_counter()
    try:
        value = case.run()
        case.seconds.append(time.perf_counter() - start)
        final, case.status = case.state(value), case.word(value)
    except (ArithmeticError, ValueError, RuntimeError) as error:
        case.seconds.append(time.perf_counter() - start)
        case.status = f"{type(error).__name__}: {error}".splitlines()[0]
        case.run = nothing
        return
    if final is not None and np.isfinite(final).all():
        case.error = error_of(final)
    elif not case.status or case.status == "finished":
        case.status = "not finite"


def _once(run: Callable[[], Any]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start
