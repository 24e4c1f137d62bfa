"""The cause that limits the steps of a run that did not reach its end, by its last steps.

The steps of a slow run are limited by a jump of the equations, by a motion that grows without
bound, by stability, by the rounding of doubles, or by the accuracy requested.  Only a run that has
failed is examined, so that others cost nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mechc.errors import MechcError
from mechc.native._codes import (
    DEGREES,
    DISCONTINUITY,
    MEMORY_LIMIT,
    STEP_TOO_SMALL,
    TOO_MANY_STEPS,
)
from mechc.simulation.end_of_reach import SHRUNK_AWAY, status_beyond_reach
from mechc.simulation.record import Record
from mechc.simulation.settings import Policy
from mechc.simulation.status import CODES, SLIDING, Status
from mechc.system.parameters import Array
from mechc.system.system import System

LIMITED = frozenset((*SHRUNK_AWAY, TOO_MANY_STEPS, MEMORY_LIMIT))
TOO_SMALL = "the step size fell below the spacing of doubles"
TAIL = 48  # accepted steps that are examined
NOISE = 16.0  # times farther from a polynomial over four times the steps
MOST_NOISE = 100.0  # times rtol
EPS = float(np.finfo(float).eps)
DISTANCES = 4.0 ** np.arange(16)  # of the two sides of a jump, in spacings of the steps
JUMP = 1e-3  # of the largest rate, in units of each component's scale
SAME, LEVEL = 4, 0.1  # so many distances on, each side changes by less than this of the jump
GROWN, SHRUNK = 10.0, 1e-2  # rates and steps over the tail where the motion grows without bound
FAST = 0.5  # step times the fastest rate of decay or vibration, above which stability matters


class Limit(NamedTuple):
    """A limit of the steps, in words, and advice."""

    what: str
    advice: str


class _Last(NamedTuple):
    """The end of a run: accepted times and states, and what they are judged by."""

    system: System
    values: Array
    policy: Policy
    span: tuple[float, float]
    t: Array
    y: Array

    def rates(self, t: Array, y: Array) -> Array:
        """Rates (n, nq + nu) of states, at times that are kept within the span."""
        low, high = sorted(self.span)
        return self.system.rates(y, self.values, np.clip(t, low, high))

    @property
    def step(self) -> float:
        """The usual length of the last steps, s."""
        steps = np.abs(np.diff(self.t))
        return float(np.median(steps)) if len(steps) else 1e-6 * abs(self.span[1] - self.span[0])

    @property
    def scale(self) -> Array:
        """The size of each component."""
        size: Array = np.maximum(self.system.scale(self.values), np.abs(self.y).max(axis=0))
        return size


def with_limit(
    status: Status, code: int, system: System, record: Record, policy: Policy,
    span: tuple[float, float],
) -> Status:  # fmt: skip
    """The status of a failed run, with what limits its last steps."""
    piece = record.last
    if not piece.steps.count:
        return status
    last = _Last(system, piece.params, policy, span, *piece.steps.tail(TAIL))
    if code in SHRUNK_AWAY:
        beyond = status_beyond_reach(system, float(last.t[-1]), last.y[-1], piece.params)
        if beyond is not None:
            return replace(beyond, warnings=status.warnings)
    try:
        with np.errstate(all="ignore"):
            jump = _jump(last)
            limit = jump or _growth(last) or _not_accuracy(last)
    except (MechcError, np.linalg.LinAlgError):  # a user's input fails; no number is finite
        return status
    if jump and code in SHRUNK_AWAY:
        return replace(status, code=CODES[DISCONTINUITY][0], cause=jump.what, advice=jump.advice)
    if code == STEP_TOO_SMALL and limit:
        return replace(status, cause=f"{TOO_SMALL}: {limit.what}", advice=limit.advice)
    if code in (TOO_MANY_STEPS, MEMORY_LIMIT):
        limit = limit or _accuracy(last)
        cause, advice = f"{status.cause}; {limit.what}", f"{limit.advice}. {status.advice}"
        return replace(status, cause=cause, advice=advice)
    return status


def _jump(last: _Last) -> Limit | None:
    """A limit by a jump of the rates at the last state: without one, their difference between both
    sides falls with the distance."""
    t, y = last.t[-1], last.y[-1]
    rates = last.rates(last.t[-1:], last.y[-1:])[0]
    smallest = 16 * EPS * max(abs(t), abs(last.span[1] - t))
    ahead = np.concatenate([DISTANCES, -DISTANCES]) * smallest
    # a body at rest does not leave a jump by itself
    way = np.where(rates == 0.0, last.scale, rates)
    sides = last.rates(t + ahead, y + ahead[:, None] * way) / last.scale
    jumps = np.abs(sides[: len(DISTANCES)] - sides[len(DISTANCES) :])
    size = float(np.abs(rates / last.scale).max(initial=0.0))
    lasting = np.array([_lasts(sides, jumps, near, size) for near in range(len(jumps) - SAME)])
    found = np.flatnonzero(lasting.any(axis=1))
    if not len(found):
        return None
    near = int(found[0])
    which = int(np.argmax(np.where(lasting[near], jumps[near], 0.0)))
    name = (*last.system.coordinates, *last.system.speeds)[which]
    after, before = (sides[near + k, which] * last.scale[which] for k in (0, len(DISTANCES)))
    if last.span[1] < last.span[0]:
        before, after = after, before
    return Limit(
        f"the equations jump here: the rate of {name} is {before:.4g} on one side and {after:.4g} "
        "on the other, and no step is short enough for that",
        SLIDING,
    )


def _lasts(sides: Array, jumps: Array, near: int, size: float) -> Array:
    """Whether a component jumps, with each side unchanged from ``near`` on."""
    distances = slice(near, near + SAME + 1)
    spread = np.maximum(*(np.ptp(part[distances], axis=0) for part in np.split(sides, 2)))
    there: Array = (jumps[near] > JUMP * size) & (spread < LEVEL * jumps[near])
    return there


def _growth(last: _Last) -> Limit | None:
    """A limit by rates that grow while steps shrink: the motion goes to infinity in finite time."""
    steps = np.abs(np.diff(last.t))
    if len(steps) < 3 or not steps[-1] < SHRUNK * steps[0]:
        return None
    rates = np.abs(last.rates(last.t, last.y) / last.scale)
    which = int(np.argmax(rates[-1]))
    if not rates[-1, which] > GROWN * rates[0].max():
        return None
    name = (*last.system.coordinates, *last.system.speeds)[which]
    return Limit(
        f"the motion is singular here: the rate of {name} grows without bound, to "
        f"{rates[-1, which] * last.scale[which]:.3g}",
        "Look at the last states and the parameters: something is divided by what goes to zero, or "
        "a coordinate comes to a singular place of its kinematics",
    )


def _not_accuracy(last: _Last) -> Limit | None:
    """Steps over many of which the motion is a polynomial to the tolerance could be longer: what
    limits them is stability or, where the method is stable or slow enough, rounding."""
    # where stability limits the steps of "auto", the stiff method takes over
    method = "radau5" if last.policy.stiff_switch else last.policy.method
    if not _smooth(last, DEGREES[method], MOST_NOISE * last.policy.rtol):
        return None
    fastest = _fastest(last)
    if method != "radau5" and last.step * fastest > FAST:
        return Limit(
            f"stability limits the steps to {last.step:.2g} s: the fastest part of the motion "
            f"changes within {1 / fastest:.2g} s, though it has died away",
            "Take method='radau5' or 'auto', which do not follow it",
        )
    return Limit(
        f"rounding limits the steps to {last.step:.2g} s: the error of a step does not fall below "
        "the last digits of doubles, which stiffness or nearly dependent constraints magnify",
        f"Loosen rtol = {last.policy.rtol:g}: to about 1e-9 where the scene is stiff",
    )


def _smooth(last: _Last, degree: int, noise: float) -> bool:
    """Whether the motion is as near to a polynomial over all of the tail as over a quarter of it,
    so that what is left is noise: with steps limited by accuracy it is 4^(degree + 1) times off,
    or by more than noise in both."""
    if len(last.t) < TAIL:
        return False
    off = [_off(last.t[-n:], last.y[-n:] / last.scale, degree) for n in (TAIL, TAIL // 4)]
    return off[0] < min(NOISE * off[1] + 8 * EPS, noise)


def _off(t: Array, y: Array, degree: int) -> float:
    """The distance of states from the polynomial nearest to them."""
    powers = np.polynomial.legendre.legvander((2 * t - t[0] - t[-1]) / (t[-1] - t[0]), degree)
    nearest = np.linalg.lstsq(powers, y, rcond=None)[0]
    return float(np.abs(powers @ nearest - y).max())


def _fastest(last: _Last) -> float:
    """The largest eigenvalue of the rates' Jacobian at the last state, 1/s."""
    y, width = last.y[-1], last.y.shape[1]
    moved = np.cbrt(EPS) * np.diag(last.scale)
    sides = last.rates(np.full(2 * width, last.t[-1]), np.concatenate([y + moved, y - moved]))
    jacobian = ((sides[:width] - sides[width:]) / (2 * moved.diagonal()[:, None])).T
    if not np.isfinite(jacobian).all():
        return 0.0
    return float(np.abs(np.linalg.eigvals(jacobian)).max(initial=0.0))


def _accuracy(last: _Last) -> Limit:
    return Limit(
        f"accuracy limits the steps to {last.step:.2g} s: the motion itself changes so fast that "
        f"rtol = {last.policy.rtol:g} needs them",
        "Loosen rtol, or shorten the span",
    )
