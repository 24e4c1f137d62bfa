"""A case judged by what any right motion keeps: its loops, its energy, its way back, and its end by
another method.

The last two are judged as far as the motion can be told at all: the growth of a small change of
the start is measured.  Words are those of stability/judge.py; ``warned``: finished, and the status
warns.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import mechc

from ..timing.cases import Array
from .draw import Case, model_of
from .exact import end

CLOSED = 1e-11  # of the largest length
SHARES, ROUNDING = 300.0, 1e-8  # of rtol, and of what rounding near change points leaves
SHIFT = 1e-7  # of the start
TOLD = 0.1  # an error that tells one motion from another
MAX_STEPS = 100_000
OTHER, FINER, FINEST = "dop853", 0.01, 1e-13  # of the case's tolerance; at the least


class Judged(NamedTuple):
    """The word and what went wrong."""

    word: str
    why: str = ""


def judged(case: Case) -> Judged:
    """What became of a case."""
    model = model_of(case)
    try:
        y0 = _closed(model, case)
        sol = _run(model, case, y0)
    except (mechc.MechcError, ValueError) as error:
        return Judged("refused", str(error))
    if not sol.status.ok:
        return Judged("flagged", sol.status.code)
    why = _not_kept(model, case, sol) or _not_told_alike(model, case, sol)
    if not why:
        return Judged("right")
    return Judged("warned" if sol.status.warnings else "WRONG", why)


def in_digits(case: Case) -> str:
    """How far the run and the other method end from the motion in 50 digits."""
    model = model_of(case)
    runs = {"auto": _run(model, case, _closed(model, case))}
    start = runs["auto"].y[0]
    runs[OTHER] = _run(model, case, start, method=OTHER, share=FINER)
    exact = end(case, start)
    told = (f"{name} {_apart(run.y[-1], exact):.2g}" for name, run in runs.items())
    return "from the motion in 50 digits: " + ", ".join(told)


def _closed(model: mechc.Model, case: Case) -> Array:
    """The start, its speeds projected."""
    count = len(model.coordinates)
    named = dict(zip(model.coordinates, case.y0[:count].tolist(), strict=True))
    speeds = dict(zip(model.speeds, case.y0[count:].tolist(), strict=True))
    return model.assemble(named, speeds, params=case.params) if speeds else case.y0


def _run(
    model: mechc.Model, case: Case, y0: Array, *, method: str = "auto", back: bool = False,
    share: float = 1.0,
) -> mechc.Solution:  # fmt: skip
    """``share``: of the tolerance of the case."""
    span = (case.t_end, 0.0) if back else (0.0, case.t_end)
    rtol = max(share * case.rtol, FINEST)
    policy = {"method": method, "max_steps": MAX_STEPS, "dense": False}
    return model.simulate(span, y0, case.params, rtol=rtol, **policy)


def _not_kept(model: mechc.Model, case: Case, sol: mechc.Solution) -> str:
    """Whether loops open or energy is made."""
    length = model.system.length(sol.params)
    gap = float(sol.closure.max(initial=0.0))
    if not gap <= CLOSED * length:
        return f"closure {gap:.2g} m"
    energy, kinetic = sol.energy, sol.model.kinetic_energy(sol.y, sol.params, sol.t)
    size = max(float(kinetic.max()), float(np.ptp(energy - kinetic)), 1e-12)
    drift = float(np.abs(energy - energy[0]).max()) / size
    rounding = ROUNDING + _energy_of_rounding(model, sol, length) / size
    allowed = SHARES * case.rtol * max(1.0, sol.stats["steps"] / 30.0) + rounding
    return "" if drift <= allowed else f"energy off by {drift:.2g}, allowed {allowed:.2g}"


def _energy_of_rounding(model: mechc.Model, sol: mechc.Solution, length: float) -> float:
    """What the last digits of the states of all steps do to the energy, J.

    Those of the energy itself, and of coordinates that loops close to rounding, magnified as the
    rows of their Jacobian are short.
    """
    step, count = 1e-6, len(model.coordinates)
    moved = sol.y[:, None] + step * np.eye(sol.y.shape[1])[:count]
    flat = moved.reshape(-1, sol.y.shape[1])
    energies = model.energy(flat, sol.params).reshape(-1, count)
    slope = float(np.abs(energies - sol.energy[:, None]).max()) / step
    singular = np.linalg.svd(model.constraint_jacobian(sol.y, sol.params), compute_uv=False)
    least = singular[singular > 1e-9 * singular.max()].min()
    eps = float(np.finfo(float).eps)
    digit = float(np.spacing(np.abs(sol.energy).max()))
    return len(sol.t) * (slope * eps * max(1.0, length / float(least)) + digit)


def _not_told_alike(model: mechc.Model, case: Case, sol: mechc.Solution) -> str:
    """Whether another method ends elsewhere, or the way back does not lead to the start."""
    other = _run(model, case, sol.y[0], method=OTHER, share=FINER)
    back = _run(model, case, sol.y[-1], back=True)
    growth = _growth(model, case, sol)
    allowed = 2 * (SHARES * case.rtol + ROUNDING) * growth
    if not allowed < TOLD or sol.change_points:
        return ""
    if other.status.ok and not _apart(other.y[-1], sol.y[-1]) <= allowed:
        return f"{OTHER} ends {_apart(other.y[-1], sol.y[-1]):.2g} apart, allowed {allowed:.2g}"
    if back.status.ok and not _apart(back.y[-1], sol.y[0]) <= allowed:
        return f"back at {_apart(back.y[-1], sol.y[0]):.2g} from the start, allowed {allowed:.2g}"
    return ""


def _growth(model: mechc.Model, case: Case, sol: mechc.Solution) -> float:
    """Of a change of the start in the way it moves, and of one of its energy; both ways."""
    size, most = len(model.coordinates), 1.0
    for later, first, last in ((False, sol.y[0], sol.y[-1]), (True, sol.y[-1], sol.y[0])):
        moved = first.copy()
        moved[size:] *= 1 + SHIFT
        speed = np.abs(first[size:]).max(initial=0.0)
        if speed < 1e-3:
            return np.inf if later else most
        end = _run(model, case, moved, back=later)
        if not end.status.ok:
            return np.inf
        most = max(most, _apart(end.y[-1], last) / (SHIFT * max(speed, 1.0)))
    return most


def _apart(a: Array, b: Array) -> float:
    half = len(a) // 2
    speeds = max(1.0, float(np.abs(b[half:]).max(initial=0.0)))
    return float(max(np.abs(a[:half] - b[:half]).max(), np.abs(a[half:] - b[half:]).max() / speeds))
