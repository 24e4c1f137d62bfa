"""Tests of repetition: motions that begin later, and angles by whole turns."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.periodic.shooting import Shooting, Trial
from mechc.system.parameters import Array
from mechc.system.quantity import ANGULAR

TURN = 2.0 * np.pi
SAME = 1e-6  # of the sizes: motions that differ by less are one
UNEVEN = 0.3718  # of the sizes: no part of what a motion is likely to repeat after
SMALL = 1e-3  # rad or lengths: motions of less are measured by it


def is_later_the_same(problem: Shooting, trial: Trial, delay: float) -> bool:
    """Whether the motion from a trial is the same where it begins later by a delay, s."""
    ends = []
    for asked in (problem, replace(problem, t0=problem.t0 + delay)):
        sol = asked.simulate(trial)
        if not sol.status.ok:
            return False
        ends.append(sol.record.ends()[1][1])
    return bool((np.abs(ends[1] - ends[0]) < SAME * problem.size).all())


def refuse_other_periods(problem: Shooting, trial: Trial) -> None:
    """Raise :class:`ValueOutOfBoundsError` if a driven motion is another one a period later."""
    if not (problem.autonomous or is_later_the_same(problem, trial, trial.period)):
        raise ValueOutOfBoundsError(
            f"what drives the motion does not repeat after {trial.period:.9g} s: give a whole "
            "number of its periods; where a parameter determines it, as an expression, "
            "period='2*pi/Omega'"
        )


def refuse_other_advances(sol: Any, gain: Array) -> None:
    """Raise :class:`ValueOutOfBoundsError` if a motion that is shifted by what coordinates grow by
    is another one; by anything where they need not return (NaN)."""
    shift = np.where(np.isnan(gain), UNEVEN * sizes_in(sol), gain)
    if not _same_shifted(sol, shift):
        names = [n for n, by in zip(sol.system.coordinates, shift, strict=False) if by]
        raise ValueOutOfBoundsError(
            f"advance: accelerations depend on {' or '.join(names)}, and differ after this "
            "advance: the motion does not repeat"
        )


def refuse_other_events(problem: Shooting, trial: Trial) -> None:
    """Raise :class:`ValueOutOfBoundsError` if a motion that begins farther by what coordinates grow
    by has other events or contacts."""
    shift = np.where(np.isnan(problem.gain), UNEVEN * problem.size, problem.gain)
    if not shift.any():
        return
    one, two = (
        problem.simulate(trial._replace(y=trial.y + by)).record.ends()[1][1]
        for by in (0.0 * shift, shift)
    )
    if not (np.abs(two - one - shift) < SAME * problem.size).all():
        raise ValueOutOfBoundsError(
            "what coordinates grow by in a period changes the motion, though no acceleration "
            "depends on it: an event or a contact does"
        )


def whole_turns(sol: Any) -> list[int]:
    """The angles whose whole turns change nothing along a motion."""
    turns = TURN * np.eye(sol.system.scene.width)
    kinds = [sol.system.quantities[name].kind for name in sol.system.coordinates]
    return [i for i, kind in enumerate(kinds) if kind in ANGULAR and _same_shifted(sol, turns[i])]


def _same_shifted(sol: Any, shift: Array) -> bool:
    """Whether the rates along a motion are the same where its states are shifted."""
    t, y = (part[:: max(1, len(part) // 8)] for part in sol.record.states())
    one, two = (sol.system.rates(states, sol.params, t) for states in (y, y + shift))
    return bool(np.allclose(one, two, rtol=SAME, atol=SAME * np.abs(one).max(initial=0.0)))


def sizes_in(sol: Any) -> Array:
    """Sizes of coordinates and of speeds in a motion (nq + nu,), from those of the mechanism."""
    nq, size = len(sol.system.coordinates), np.array(sol.system.scale(sol.params))
    states = sol.record.states()[1] / size
    size[:nq] *= np.clip(np.ptp(states[:, :nq], axis=0).max(initial=0.0), SMALL, 1.0)
    size[nq:] *= np.abs(states[:, nq:]).max(initial=0.0) or 1.0
    return size
