"""The motion of one degree of freedom from a change point on, until it is far enough from it.

On its branch the configuration is a smooth function q(x) of the distance x along the branch's
tangent, although the Jacobian loses rank at x = 0.  It is interpolated between configurations near
the change point on both sides, which the closure determines; then
q'^T M (q' x" + q" x'^2) = q'^T F is an equation without constraints, solved by Chebyshev
collocation (Clenshaw & Norton 1963: Picard iteration of the integrated interpolant).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

from mechc.assembly import tangent_branches as branches
from mechc.native._codes import FINISHED
from mechc.system.parameters import Array
from mechc.system.system import System

REACH = 0.15  # of the curve, on both sides; rad, or of the model's length
CLEAR = 0.08  # where the compiled integrators take over
NODES, TIMES = 14, 20
SHORTENED = 24
ON_BRANCH = 1e-6  # of the speeds: tolerance of the closure to second order
BESIDE = 0.01  # of the largest singular value, and rad: a start so near is followed along the curve
TURNS = 100.0  # the speeds' direction turns no more per unit along the branch
AHEAD = 0.1  # as BESIDE, of a change point that a run is to end at
DISTINCT = 0.03  # along the curve: from a state so far an end is followed, if there is one
ON_CURVE = 1e-6  # of the scale: states on another branch are farther off
EPS = float(np.finfo(float).eps)


class Passage(NamedTuple):
    """A change point passed: when, its coordinates (nq,), its gap in m."""

    t: float
    q: Array
    gap: float


@dataclass(frozen=True)
class SingularStart:
    """A finished run over a short span, which is its own steps."""

    system: System
    t0: float
    t: float
    curve: _Curve
    path: Chebyshev
    evaluations: int
    passed: Passage | None = None
    status: int = FINISHED
    count: int = 2

    @property
    def steps(self) -> SingularStart:
        return self

    def advance(self, steps: int) -> int:
        """Do nothing: the run is finished."""
        return self.status

    def stats(self) -> dict[str, Any]:
        return {
            "steps": 1, "rejected": 0, "rhs_evaluations": self.evaluations,
            "closure_iterations": 0, "least_singular": np.inf, "least_singular_time": self.t0,
            "coordinate": -1, "examined": 0, "critical_gap": np.inf, "critical_time": self.t0,
            "rounding": 0.0,
        }  # fmt: skip

    def times(self, first: int) -> Array:
        return np.array([self.t0, self.t])[first:]

    def states(self) -> tuple[Array, Array]:
        t = self.times(0)
        return t, self.interpolate(t)

    def tail(self, count: int) -> tuple[Array, Array]:
        t, y = self.states()
        return t[-count:], y[-count:]

    def ends(self) -> tuple[Array, Array]:
        return self.states()

    @property
    def span(self) -> tuple[float, float]:
        return self.t0, self.t

    @property
    def crossings(self) -> int:
        return 0 if self.passed is None else 1

    def change_points(self) -> tuple[Array, Array, Array]:
        """The change point, where the motion starts before it; a start at it is no crossing."""
        if self.passed is None:
            return np.zeros(0), np.zeros((0, len(self.system.coordinates))), np.zeros(0)
        t, q, gap = self.passed
        return np.array([t]), q[None], np.array([gap])

    def interpolate(self, t: Array) -> Array:
        x = self.path(t)
        speeds = self.curve.deriv()(x) * self.path.deriv()(t)[:, None]
        return np.hstack([self.curve(x), speeds])


class _Curve:
    """A polynomial of x with values (n, nq)."""

    def __init__(self, x: Array, q: Array) -> None:
        self.parts = [
            Chebyshev.fit(x, column, len(x) - 1, domain=[-REACH, REACH]) for column in q.T
        ]

    def __call__(self, x: Array) -> Array:
        return np.stack([part(x) for part in self.parts], axis=-1)

    def deriv(self, order: int = 1) -> _Curve:
        other = object.__new__(_Curve)
        other.parts = [part.deriv(order) for part in self.parts]
        return other


def singular_start(
    system: System, y0: Array, values: Array, span: tuple[float, float]
) -> SingularStart | None:
    """The motion from a change point y0 on, or from a little beside it, along the branch of its
    speeds.

    None if y0 is not one, is at rest, or is on no branch, or if the mechanism has more than one
    degree of freedom, velocity constraints, or constraints that depend on time.
    """
    width = len(system.coordinates)
    at = branches.find(system, y0, values, span[0])
    at = at or branches.find(system, y0, values, span[0], BESIDE, BESIDE)
    if at is None or not _is_supported(system, at, y0, values, span):
        return None
    u = y0[width:]
    size = float(np.abs(u).max())
    off = branches.second_order(system, at, u, values, span[0])
    scale = system.length(values) * size**2
    if size == 0:
        return None
    x0 = _along(system, at.q, u, y0, values)
    if np.abs(off).max() > (ON_BRANCH + TURNS * abs(x0)) * scale:
        return None
    curve = _branch(system, at, u, values, span[0])
    if curve is None:
        return None
    motion = _motion(system, curve, x0, y0, values, span)
    return motion and replace(motion, passed=_passage(motion, at, x0, values))


def singular_end(
    system: System, times: Array, states: Array, values: Array, t_end: float
) -> SingularStart | None:
    """The motion from one of the states (n, nq + nu) to an end beside the change point ahead.

    It starts at the last state that is clear of the change point.  None where the start above would
    give none, or where the states are not on the curve of configurations that is found.
    """
    width = len(system.coordinates)
    t, y = float(times[-1]), states[-1]
    at = branches.find(system, y, values, t, AHEAD, AHEAD)
    if at is None or not y[width:].any() or not _is_supported(system, at, y, values, (t, t_end)):
        return None
    curve = _branch(system, at, y[width:], values, t)
    if curve is None:
        return None
    x = np.array([_along(system, at.q, y[width:], each, values) for each in states])
    within = np.where(np.abs(x) <= CLEAR, np.abs(x), 0.0)
    clear = np.flatnonzero(within >= DISTINCT)
    k = int(clear[-1] if len(clear) else np.argmax(within))
    if not _on_curve(system, curve, x[k:], states[k:], values):
        return None
    motion = _motion(system, curve, float(x[k]), states[k], values, (float(times[k]), t_end))
    if motion is None or motion.t != t_end:
        return None
    return replace(motion, passed=_passage(motion, at, float(x[k]), values))


def _on_curve(system: System, curve: _Curve, x: Array, states: Array, values: Array) -> bool:
    """Whether states at x along the curve lie on it, their speeds along it."""
    width = len(system.coordinates)
    scale = system.scale(values)[:width]
    slope, u = curve.deriv()(x) / scale, states[:, width:] / scale
    speed = (slope * u).sum(axis=1) / (slope * slope).sum(axis=1)
    off = np.abs(curve(x) - states[:, :width]).max(initial=0.0) / scale.min()
    astray = np.abs(slope * speed[:, None] - u).max(initial=0.0)
    return bool(off <= ON_CURVE and astray <= ON_CURVE * np.abs(u).max())


def _passage(
    motion: SingularStart, at: branches.SingularConfiguration, x0: float, values: Array
) -> Passage | None:
    """The change point, if the motion comes from clearly before it."""
    if abs(x0) <= branches.SNAP or x0 * motion.path(motion.t) > 0:
        return None
    ends = sorted((motion.t0, motion.t))
    t = float(brentq(motion.path, *ends, xtol=1e-14))
    state = np.append(at.q, np.zeros(len(motion.system.speeds)))
    gap = np.abs(motion.system.constraints(state, values, t)).max()
    return Passage(t, at.q, float(gap))


def _along(system: System, q: Array, u: Array, y0: Array, values: Array) -> float:
    """The distance of the start from the change point, along the tangent."""
    scale = system.scale(values)[: len(q)]
    tangent = u / scale / np.linalg.norm(u / scale)
    return float(tangent @ ((y0[: len(q)] - q) / scale))


def _is_supported(
    system: System,
    at: branches.SingularConfiguration,
    y0: Array,
    values: Array,
    span: tuple[float, float],
) -> bool:
    speeds = len(system.speeds)
    still = np.append(at.q, np.zeros(speeds))
    rank = branches.generic_rank(system, still, values, span[0])
    moving = [system.velocity_constraints(still, values, t) for t in (span[0], sum(span) / 2)]
    plain = system.rates(y0, values, span[0])[: len(at.q)]
    return (
        rank == speeds - 1
        and system.scene.rows == system.scene.holonomic
        and not np.any(moving)
        and np.array_equal(plain, y0[len(at.q) :])
    )


def _branch(
    system: System, at: branches.SingularConfiguration, u: Array, values: Array, t: float
) -> _Curve | None:
    """The branch through the change point with the tangent u, x from -REACH to REACH."""
    scale = system.scale(values)[: len(system.coordinates)]
    tangent = u / scale / np.linalg.norm(u / scale)
    x = REACH * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    q = np.zeros((NODES, len(scale)))
    for side in (1.0, -1.0):
        bend = np.zeros(len(scale))
        for i in sorted(np.flatnonzero(side * x > 0), key=lambda i: abs(x[i])):
            guess = at.q + scale * tangent * x[i] + bend * x[i] ** 2
            found = _closed_configuration(system, at, tangent, scale, x[i], guess, values, t)
            if found is None:
                return None
            q[i] = found
            bend = (found - at.q - scale * tangent * x[i]) / x[i] ** 2
    curve = _Curve(x, q)
    through = np.abs((curve(np.zeros(1))[0] - at.q) / scale).max()
    return curve if through < 1e-10 else None  # else the two sides are on different branches


def _closed_configuration(
    system: System, at: branches.SingularConfiguration, tangent: Array, scale: Array, x: float,
    q: Array, values: Array, t: float,
) -> Array | None:  # fmt: skip
    """The closed configuration at the distance x along the tangent, near q."""
    best, least = q, np.inf
    for _ in range(12):
        still = np.append(q, np.zeros(len(system.speeds)))
        gap = system.constraints(still, values, t)
        residual = np.append(gap, tangent @ ((q - at.q) / scale) - x)
        size = float(np.abs(residual).max())
        if size < least:
            best, least = q, size
        rows = np.vstack([system.constraint_jacobian(still, values, t) * scale, tangent])
        q = q - scale * np.linalg.lstsq(rows, residual, rcond=1e-8)[0]
    return best if least <= 64 * EPS * max(1.0, float(np.abs(scale).max())) else None


def _motion(
    system: System,
    curve: _Curve,
    x0: float,
    y0: Array,
    values: Array,
    span: tuple[float, float],
) -> SingularStart | None:
    width = len(system.coordinates)
    slope = curve.deriv()(np.full(1, x0))[0]
    speed = float(slope @ y0[width:] / (slope @ slope))
    length = min(CLEAR / abs(speed), abs(span[1] - span[0]))
    for attempt in range(SHORTENED):
        t1 = span[0] + np.copysign(length, span[1] - span[0])
        if abs(span[1] - t1) < 1e-9 * length:
            t1 = span[1]
        path = _path(system, curve, x0, speed, values, span[0], t1)
        if path is not None:
            last = float(abs(path(t1)))
            if last >= 0.1 * CLEAR or t1 == span[1]:
                evaluations = TIMES * (attempt + 1)
                return SingularStart(system, span[0], float(t1), curve, path, evaluations)
        length *= 0.7
    return None


def _path(
    system: System, curve: _Curve, x0: float, speed: float, values: Array, t0: float, t1: float
) -> Chebyshev | None:
    """x(t) from the start x0 on; None where it leaves the curve or does not converge."""
    grid = np.cos(np.pi * (np.arange(TIMES) + 0.5) / TIMES)
    t = 0.5 * (t0 + t1) + 0.5 * (t1 - t0) * grid
    first, second = curve.deriv(), curve.deriv(2)
    x, rate = x0 + speed * (t - t0), np.full(TIMES, speed)
    change = np.inf
    for _ in range(80):
        if not np.abs(x).max() <= REACH:
            return None
        along, bend = first(x), second(x)
        y = np.hstack([curve(x), along * rate[:, None]])
        mass = system.mass_matrix(y, values, t)
        force = system.forcing(y, values, t)
        pull = force - (mass @ bend[:, :, None])[:, :, 0] * rate[:, None] ** 2
        inertia = np.einsum("ni,nij,nj->n", along, mass, along)
        acceleration = np.einsum("ni,ni->n", along, pull) / inertia
        domain = sorted((t0, t1))
        rates = Chebyshev.fit(t, acceleration, TIMES - 1, domain=domain).integ(lbnd=t0) + speed
        path = rates.integ(lbnd=t0) + x0
        change, before = float(np.abs(path(t) - x).max()), change
        x, rate = path(t), rates(t)
        if change <= 4 * EPS * REACH or (change <= 1e-12 * REACH and change >= before):
            return path
    return None
