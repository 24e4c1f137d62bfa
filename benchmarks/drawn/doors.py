"""The doors: ways that lead to a scene's numbers, each beside another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import mechc
from mechc.native import _codes

from .judge import RTOL, TOLD, Case, Difference, Fault, Run, allowed, apart
from .reference import FINE

Told = Difference | Fault
BACKWARD = 500 * np.finfo(float).eps  # relative change of all numbers that rounding may be
METHODS = ("dopri5", "dop853", "gauss8", "radau5", "taylor")
IN_PYTHON = 3  # runs that SciPy follows too
FINER = 1e-11  # rtol of the run beside which others are seen


def rates(case: Case) -> Iterator[Told]:
    """``model.rhs`` at the starts, beside SymPy's matrices in 30 digits."""
    for run in case.runs:
        t = float(case.rng.uniform(0.0, 2.0))
        y = case.to_reference(run.y0)
        expected = case.reference.exact(t, y, run.params)
        spread = case.reference.spread(t, y, run.params, case.rng)
        found = case.to_reference(case.model.rhs(t, run.y0, run.params))
        limit = BACKWARD * (spread + np.abs(expected).max() + 1.0)
        off = np.abs(found - expected)
        worst = int(np.argmax(off / limit))
        told = f"{case.reference.names[worst]}' = {found[worst]!r}, exactly {expected[worst]!r}"
        size = float("inf") if np.isnan(off).any() else float(off[worst])
        yield Difference("rhs", size, float(limit[worst]), f"{told} at t = {t}, {run.numbers}")


def in_python(case: Case) -> Iterator[Told]:
    """SciPy's motion of SymPy's equations, beside ``dop853``'s."""
    for run in case.whole[:IN_PYTHON]:
        found = case.reference.motion(case.times, case.to_reference(run.y0), run.params)
        if isinstance(found, str):
            yield Fault("SciPy", f"ended where dop853 finishes: {found}; {run.numbers}")
        else:
            yield _beside("SciPy", run, found[:, case.order], FINE)


def ends(case: Case) -> Iterator[Told]:
    """Motions that end by ``dop853`` beside SciPy, which has to end too."""
    for run in case.runs:
        if run.status:
            found = case.reference.motion(case.times, case.to_reference(run.y0), run.params)
            if not isinstance(found, str):
                yield Fault("ends", f"dop853: {run.status}, where SciPy finishes; {run.numbers}")


def _beside(door: str, run: Run, states: Any, rtol: float) -> Difference:
    assert run.states is not None
    size, limit = apart(np.asarray(states), run.states), allowed(run, rtol, FINER)
    return Difference(door, size, limit, f"growth {run.growth:.2g}, {run.numbers}")


def single(method: str) -> Callable[[Case], Iterator[Told]]:
    """Runs by a method, one by one."""

    def found(case: Case) -> Iterator[Told]:
        for run in case.whole:
            sol = case.model.simulate(
                (0.0, case.times[-1]), run.y0, run.params, method=method, rtol=RTOL,
                t_eval=case.times, dense=False,
            )  # fmt: skip
            if not sol.status.ok:
                yield Fault(method, f"{sol.status}, where dop853 finishes; {run.numbers}")
                continue
            yield _beside(method if method != "auto" else f"auto: {sol.method}", run, sol.y, RTOL)

    return found


def batch(method: str) -> Callable[[Case], Iterator[Told]]:
    """A batch whose members have the numbers of the runs."""

    def found(case: Case) -> Iterator[Told]:
        runs = case.whole
        if not runs:
            return
        params = {n: np.array([run.params[n] for run in runs]) for n in runs[0].params}
        many = case.model.simulate_batch(
            (0.0, case.times[-1]), np.array([run.y0 for run in runs]), params, method=method,
            rtol=RTOL, t_eval=case.times, progress=False, threads=1,
        )  # fmt: skip
        door = f"batch {method}: {many.method}"
        for k, run in enumerate(runs):
            if not many.status(k).ok:
                yield Fault(door, f"member {k}: {many.status(k)}; {run.numbers}")
            else:
                yield _beside(door, run, many.y_eval[k], RTOL)

    return found


DOORS: dict[str, tuple[float, Callable[[Case], Iterator[Told]]]] = {
    "rhs": (1.0, rates),
    "SciPy": (1.0, in_python),
    "ends": (1.0, ends),
    "auto": (1.0, single("auto")),
    "batch auto": (1.0, batch("auto")),
    **{method: (0.6, single(method)) for method in METHODS},
    **{f"batch {method}": (0.4, batch(method)) for method in METHODS},
}
assert set(METHODS) <= set(_codes.METHODS)


def begin(case: Case, run: Run) -> None:
    """The motion beside which the others are seen, and its growth."""
    from .judge import growth

    sol = case.model.simulate(
        (0.0, case.times[-1]), run.y0, run.params, method="dop853", rtol=FINER,
        t_eval=case.times, dense=False,
    )  # fmt: skip
    if not sol.status.ok:
        run.ended, run.status = sol.status.code, str(sol.status)
        return
    run.states = sol.y
    run.growth = growth(case.model, run, case.times, case.rng)
    if not allowed(run, RTOL, FINER) < TOLD:
        run.states, run.ended = None, "grows"


def refused(error: BaseException) -> bool:
    """Whether it is an error in words of mechc."""
    return isinstance(error, (mechc.MechcError, ValueError))
