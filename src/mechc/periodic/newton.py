"""Newton's method for cycles: least steps by singular values, halved until the motion closes more.

The equations may depend on each other (a conserved energy), and be fewer than the unknowns (the
phase of a free motion): the step is then the least one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechc.errors import AssemblyError, MechcError
from mechc.periodic.shooting import Shooting, Shot, Trial
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in

LONGEST = 0.3  # of one step, in units of the sizes
HALVINGS = 6  # of a whole step: shorter ones bring the motion no nearer
EXACT, ROUGH = 1e-8, 1e-4  # singular values below, over the largest, are rounding
HALVED = 0.5  # of an error: a step by all singular values that brings less may follow rounding
SETTLED = 0.25  # an error that a step shrinks by less is rounding, where it is tolerated
PERIODS = 0.3, 3.0  # of the period guessed; shorter ones shrink to none
STILL = 1e-6  # of the sizes: a motion of less is at rest


class NoCycleError(MechcError):
    """No cycle was found; internal, told to users as a :class:`MechcError`."""


def search(
    problem: Shooting, trial: Trial, tol: float, most: int, row: Array | None = None
) -> Shot:
    """The cycle near a trial; ``row``: a direction of the trial's coordinates that is not moved in.

    Raises :class:`NoCycleError` where none is found, with what was nearest.
    """
    shot = problem.shoot(trial)
    if shot is None:
        raise NoCycleError(
            f"the motion from the guess does not last a period of {trial.period:.6g} s: "
            f"{problem.simulate(trial).status.headline}. Begin nearer to the cycle"
        )
    level = 0.0 if row is None else float(row @ problem.coordinates(trial))

    def residual(one: Shot) -> Array:
        beyond = [] if row is None else [row @ problem.coordinates(one.trial) - level]
        return np.append(one.residual, beyond)

    def error(one: Shot) -> float:
        within = PERIODS[0] < one.trial.period / trial.period < PERIODS[1]
        return _largest(residual(one)) if within else np.inf

    for _ in range(most):
        rows = shot.jacobian if row is None else np.vstack([shot.jacobian, row @ shot.columns[2]])
        found = list[Shot]()
        for least in (rounding(problem), ROUGH):
            step = shot.columns[2] @ np.linalg.lstsq(rows, -residual(shot), rcond=least)[0]
            found += _nearer(shot, step, error, tol)
            if found and error(found[0]) < HALVED * error(shot):
                break
        if not found:
            break
        shot = min(found, key=error)
    if not error(shot) < tol:
        raise NoCycleError(_in_words(shot))
    if problem.autonomous and (np.ptp(shot.sol.y, axis=0) < STILL * problem.size).all():
        raise NoCycleError(
            "the search ended at an equilibrium, which every period fits. Begin farther from it"
        )
    return shot


def rounding(problem: Shooting) -> float:
    """The singular values, over the largest, that are rounding."""
    return ROUGH if problem.reasons else EXACT


def _nearer(shot: Shot, step: Array, error: Callable[[Shot], float], tol: float) -> list[Shot]:
    """The motion after a step, halved until it closes more; none where no step is long enough for
    that, or what is left is rounding."""
    tolerated = error(shot) < tol
    limit = error(shot) * (SETTLED if tolerated else 1.0)
    share = min(1.0, LONGEST / (_largest(step) or LONGEST))
    for _ in range(1 if tolerated else HALVINGS):
        found = _try_step(shot, share * step)
        if found is not None and error(found) < limit:
            return [found]
        share *= 0.5
    return []


def _try_step(shot: Shot, change: Array) -> Shot | None:
    """The motion after a change of the trial's coordinates; None where there is none."""
    try:
        trial = shot.after(change)
    except AssemblyError:  # so far the loops do not close
        return None
    return shot.problem.shoot(trial) if trial.period > 0.0 else None


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _in_words(shot: Shot) -> str:
    """How near the best motion came, and what may help."""
    problem, system = shot.problem, shot.sol.system
    names, told = (*system.coordinates, *system.speeds), []
    worst = np.argsort(-np.abs(np.where(problem.returning, shot.gap, 0.0)))[:3].tolist()
    for i in worst:
        unit, factor = shown_in(system.quantities[names[i]].kind, system.quantities[names[i]].unit)
        missed = shot.gap[i] * problem.size[i] * factor
        told.append(f"{names[i]} by {missed:+.3g} {unit}".rstrip())
    advice = "Begin nearer to a cycle, as where a simulated motion nearly repeats"
    if worst[0] < len(system.coordinates):
        name = names[worst[0]]
        advice += f". If {name} need not return, give advance={{{name!r}: None}}"
    return (
        f"no cycle was found: the nearest motion, over {shot.trial.period:.6g} s, misses its start "
        f"in {', '.join(told)}. {advice}"
    )
