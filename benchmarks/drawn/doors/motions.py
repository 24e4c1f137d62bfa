"""Motions: by SciPy, by every method, in batches, in steps, saved and opened."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import mechc

from ..judge import (
    MOST_STEPS,
    RTOL,
    SHARE,
    SHIFT,
    TOLD,
    Case,
    Difference,
    Fault,
    Run,
    Told,
    allowed,
    apart,
    growth,
)
from ..reference import FINE

METHODS = ("dopri5", "dop853", "gauss8", "radau5", "taylor")
IN_PYTHON = 3  # runs that SciPy follows too
FINER = 1e-11  # rtol of the run beside which others are seen


def in_python(case: Case) -> Iterator[Told]:
    """SciPy's motion of SymPy's equations, beside ``dop853``'s."""
    if "events" in case.names and case.reference.stop is None:
        return  # dry friction: SciPy does not know it
    for run in case.whole[:IN_PYTHON]:
        found = case.reference.motion(case.times, case.to_reference(run.y0), run.params)
        if isinstance(found, str):
            yield Fault("SciPy", f"ended where dop853 finishes: {found}; {run.numbers}")
        else:
            reached = np.isfinite(found).all(axis=1)
            yield _beside("SciPy", run, found[reached][:, case.order], FINE, reached)


def ends(case: Case) -> Iterator[Told]:
    """Motions that end by ``dop853`` beside SciPy, which has to end too."""
    for run in case.runs:
        if run.status and not ("events" in case.names and case.reference.stop is None):
            found = case.reference.motion(case.times, case.to_reference(run.y0), run.params)
            if not isinstance(found, str) and np.isfinite(found).all():
                yield Fault("ends", f"dop853: {run.status}, where SciPy finishes; {run.numbers}")


def _beside(door: str, run: Run, states: Any, rtol: float, at: Any = slice(None)) -> Difference:
    """The states of a door, ``at`` some of the times or all."""
    assert run.states is not None
    size, limit = apart(np.asarray(states), run.states[at]), allowed(run, rtol, FINER)
    return Difference(door, size, limit, f"growth {run.growth:.2g}, {run.numbers}")


def single(method: str) -> Callable[[Case], Iterator[Told]]:
    """Runs by a method, one by one."""

    def found(case: Case) -> Iterator[Told]:
        for run in case.whole:
            sol = case.model.simulate(
                case.span, run.y0, run.params, method=method, rtol=RTOL,
                t_eval=case.times, dense=False, **case.more,
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
            case.span, np.array([run.y0 for run in runs]), params, method=method,
            rtol=RTOL, t_eval=case.times, progress=False, threads=1, **case.more,
        )  # fmt: skip
        door = f"batch {method}: {many.method}"
        for k, run in enumerate(runs):
            if not many.status(k).ok:
                yield Fault(door, f"member {k}: {many.status(k)}; {run.numbers}")
            else:
                yield _beside(door, run, many.y_eval[k], RTOL)

    return found


def begin(case: Case, run: Run) -> None:
    """The motion beside which the others are seen, and its growth."""
    sol = case.model.simulate(
        case.span, run.y0, run.params, method="dop853", rtol=FINER,
        t_eval=case.times, dense=False, max_steps=MOST_STEPS, **case.more,
    )  # fmt: skip
    if not sol.status.ok:
        run.ended, run.status = sol.status.code, str(sol.status)
        return
    run.states = sol.y
    run.growth = growth(case, run)
    if not allowed(run, RTOL, FINER) < TOLD:
        run.states, run.ended = None, "grows"


def between_steps(case: Case) -> Iterator[Told]:
    """The dense output of a run, by the method that ``auto`` takes."""
    for run in case.whole[:IN_PYTHON]:
        sol = case.model.simulate(case.span, run.y0, run.params, rtol=RTOL, **case.more)
        if sol.status.ok:
            yield _beside("dense output", run, sol(case.times), RTOL)
        else:
            yield Fault("dense output", f"{sol.status}; {run.numbers}")


def back(case: Case) -> Iterator[Told]:
    """From the end of a motion back to its start, with the growth of that way."""
    begin, end = case.span
    for run in case.whole[: 0 if case.more else IN_PYTHON]:
        assert run.states is not None
        y, scale = run.states[-1], np.maximum(1.0, np.abs(run.states).max(axis=0))
        aside = case.moved(run, y, end, SHIFT * case.rng.choice([-1.0, 1.0], len(y)) * scale)
        sol, moved = (
            case.model.simulate(
                (end, begin), there, run.params, rtol=RTOL, t_eval=case.times[::-1], dense=False
            )
            for there in (y, aside)
        )
        if not moved.status.ok:
            continue
        grown = max(1.0, apart(moved.y[::-1], run.states) / SHIFT)
        limit = SHARE * (RTOL + FINER * run.growth) * grown
        if limit < TOLD and not sol.status.ok:
            yield Fault("back in time", f"{sol.status}; {run.numbers}")
        elif limit < TOLD:
            size = apart(sol.y[::-1], run.states)
            yield Difference("back in time", size, limit, f"growth {grown:.2g}, {run.numbers}")


def stepped(case: Case) -> Iterator[Told]:
    """A stepper that goes to the times, then is set to another run's numbers."""
    stepper: Any = None
    for run in case.whole[:IN_PYTHON]:
        if stepper is None:
            stepper = case.model.stepper(run.y0, run.params, rtol=RTOL, **case.more)
        else:
            stepper.set(run.y0, t=0.0, params=run.params)
        states = [run.y0]
        for step in np.diff(case.times):
            states.append(np.array(stepper.step(float(step))))
        yield _beside("stepper", run, states, RTOL)


def saved(case: Case) -> Iterator[Told]:
    """A run that is saved and opened, to the last bit; and with a file of its states."""
    for run in case.whole[:1]:
        sol = case.model.simulate(case.span, run.y0, run.params, t_eval=case.times, **case.more)
        with tempfile.TemporaryDirectory() as folder:
            opened = mechc.open(sol.save(Path(folder) / "run.nc"))
        size = float(np.abs(opened.y - sol.y).max())
        moved = case.reference.closes or case.more  # a start closed again, a step to each jump
        again = allowed(run, FINER) if moved else 1e-300
        yield Difference("saved and opened", size, again, str(run.numbers))
        yield _beside("saved and opened", run, opened(case.times), RTOL)
