"""Which tolerances a slow tool can be given: those at which one run takes seconds, not minutes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import inf
from typing import Any

from _problem import Problem
from _timing import Case
from peers.scipy_ivp import cases

LIMIT = 10.0  # s of one run: a suite of ten problems has thousands of runs
QUICK_LIMIT = 1.0
ORDER = {"RK45": 5, "DOP853": 8, "LSODA": 6, "Radau": 5}  # of LSODA: the usual one when tight

Rates = Callable[..., Any]


class TookTooLongError(RuntimeError):
    """A run was cut off."""


def affordable(
    run: Callable[[Rates, float], Any], rates: Rates, method: str, tolerances: Sequence[float],
    limit: float = LIMIT,
) -> list[float]:  # fmt: skip
    """The tolerances at which ``run(rates, tolerance)`` takes less than ``limit``.

    It is run once at the loosest and at the tightest that it should reach by then, as the steps of
    a method of order p grow as tolerance^(-1/p).  Where that one is cut off, which happens where a
    constraint Jacobian is singular, the next looser one is tried.
    """
    loosest = max(tolerances)
    seconds = _seconds(run, rates, loosest, limit)
    growth = lambda tol: (loosest / tol) ** (1 / ORDER[method])  # noqa: E731
    found = sorted((tol for tol in tolerances if seconds * growth(tol) < limit), reverse=True)
    while len(found) > 1 and _seconds(run, rates, found[-1], limit) == inf:
        found.pop()
    return found


def _seconds(
    run: Callable[[Rates, float], Any], rates: Rates, tolerance: float, limit: float
) -> float:
    """What a run takes; infinity where it was cut off."""
    start = time.perf_counter()

    def watched(*arguments: Any) -> Any:
        if time.perf_counter() - start > limit:
            raise TookTooLongError(f"one run takes more than {limit:g} s")
        return rates(*arguments)

    try:
        run(watched, tolerance)
    except TookTooLongError:
        return inf
    except (ArithmeticError, ValueError, RuntimeError):
        pass  # it ended early, which is for the judge to see
    return time.perf_counter() - start


def affordable_cases(
    tool: str, rates: Rates, problem: Problem, tolerances: Sequence[float],
    methods: Sequence[str], limit: float = LIMIT,
) -> list[Case]:  # fmt: skip
    """``solve_ivp`` by the methods that suit the problem, as tight as one run stays in ``limit``.

    Where nothing is left, one case that says so.
    """
    found: list[Case] = []
    for method in methods:
        if not cases(tool, rates, problem, tolerances, (method,)):
            continue  # an explicit method and a stiff problem

        def run(watched: Rates, tol: float, method: str = method) -> Any:
            return cases(tool, watched, problem, [tol], (method,))[0].run()

        tight = affordable(run, rates, method, tolerances, limit)
        found += cases(tool, rates, problem, tight, (method,))
    if found:
        return found
    stiff = "its methods are explicit and the problem is stiff"
    reason = stiff if problem.stiff else f"one run takes more than {limit:g} s"
    return [left_out(tool, methods[0], reason)]


def left_out(tool: str, method: str, reason: str, tol: float = 1e-6) -> Case:
    """A case that is flagged with the reason instead of run."""

    def run() -> None:
        raise RuntimeError(f"left out: {reason}")

    return Case(tool, method, tol, run, lambda _: None)
