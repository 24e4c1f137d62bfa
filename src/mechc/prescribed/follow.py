"""Positions, speeds and accelerations of a mechanism of which a path prescribes all freedoms.

Positions solve Phi(q, t) = 0 and g(q) = r(t) by Newton's method, from each time to the next.
Speeds and accelerations solve the derivatives of both.  These are linear, J u = -b and
A u = r' - c, then J u' = gamma and A u' = r'' - h, and compiled code gives every term: rates of
coordinates and velocities of points are linear in u, so their values at unit speeds are A and c;
the motion's own u' gives gamma and, with the accelerations that go with it, h.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from mechc.assembly.closed import inverse, rank
from mechc.assembly.sizes import sizes
from mechc.assembly.speeds import in_words
from mechc.errors import AssemblyError, MechcError
from mechc.prescribed.path import Path
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 30  # Newton's steps
SETTLED, NEAR = 1e-13, 1e-9  # steps over sizes: at rounding; where steps no longer fall
CLOSED = 1e-11  # gaps over sizes: on the path
JUMP = 0.05  # of the sizes: a correction that large may lead to another assembly
MOST_STEPS = 500  # between two times
SMALLEST = 1e-10  # of the time: a step that small is none
FAST = "the path moves too far between two times (give more of them)"
LOST, ANOTHER = "the path leaves the reach of the mechanism", "two ways on meet: links are in line"


class Rows(NamedTuple):
    """Rows over speeds, of constraints (nc, nu) and of the path (n, nu), and their values at speeds
    of zero; the rates of coordinates (nq, nu), (nq,)."""

    constraints: Array
    of_constraints: Array
    path: Array
    of_path: Array
    kinematics: Array
    of_kinematics: Array


@dataclass
class Follower:
    """A mechanism on a path; ``system`` has the outputs of its points."""

    system: System
    path: Path
    p: Array
    _last: tuple[Any, Rows] | None = None

    @cached_property
    def speed_sizes(self) -> Array:
        """Sizes of the speeds (nu,)."""
        return self.system.scale(self.p)[len(self.system.coordinates) :]

    @cached_property
    def row_sizes(self) -> Array:
        """Sizes of the numbers of the path (n,)."""
        scale, length = self.system.scale(self.p), self.system.length(self.p)
        return np.array([scale[q.entry] if q.of_state else length for q in self.path.quantities])

    @property
    def _holonomic(self) -> int:
        return int(self.system.scene.holonomic)

    # -- of a state ------------------------------------------------------------------------------

    def _of_path(self, y: Array, coordinates: Array, points: Array) -> Array:
        """The numbers of the path (..., n) among those of coordinates and of points."""
        flat = points.reshape(*y.shape[:-1], -1)
        parts = [(coordinates if q.of_state else flat)[..., q.entry] for q in self.path.quantities]
        return np.stack(parts, axis=-1)

    def _points(self, name: str, y: Array, t: float) -> Array:
        if all(q.of_state for q in self.path.quantities):
            return np.zeros((*y.shape[:-1], 0))
        return self.system.evaluate(name, y, self.p, t)

    def _state(self, q: Array) -> Array:
        return np.concatenate([q, np.zeros(len(self.system.speeds))])

    def rows(self, q: Array, t: float) -> Rows:
        """The linear equations of the speeds at a configuration (nq,); the last ones are kept."""
        key = q.tobytes(), t
        if self._last is None or self._last[0] != key:
            self._last = key, self._rows(q, t)
        return self._last[1]

    def _rows(self, q: Array, t: float) -> Rows:
        system, (nq, nu) = self.system, (len(q), len(self.system.speeds))
        y = np.vstack([self._state(q)] * (nu + 1))
        y[1:, nq:] = np.eye(nu)
        rates = system.rates(y, self.p, t)[:, :nq]
        moved = self._of_path(y, rates, self._points("point_velocities", y, t))
        jacobian = system.constraint_jacobian(y[0], self.p, t)
        return Rows(
            jacobian, system.velocity_constraints(y[0], self.p, t), (moved[1:] - moved[0]).T,
            moved[0], (rates[1:] - rates[0]).T, rates[0],
        )  # fmt: skip

    def _every(self, rows: Array, path: Array) -> Array:
        """Rows of constraints and of the path over speeds of size 1."""
        return np.concatenate([rows, path / self.row_sizes[:, None]]) * self.speed_sizes

    def _solve(self, rows: Array, path: Array, right: Array, of_path: Array) -> Array:
        """The speeds, or their changes, (nu,) that satisfy rows and those of the path."""
        every = inverse(self._every(rows, path))
        return np.asarray(self.speed_sizes * (every @ np.append(right, of_path / self.row_sizes)))

    # -- positions ---------------------------------------------------------------------------------

    def close(self, q: Array, t: float) -> Array | None:
        """The configuration (nq,) on the path near another; None where there is none."""
        system, held, before = self.system, self._holonomic, np.inf
        target = self.path.at(t)[0]
        for _ in range(MOST):
            rows, y = self.rows(q, t), self._state(q)
            gap = self._of_path(y, q, self._points("points", y, t)) - target
            left = system.constraints(y, self.p, t)[:held]
            step = self._solve(rows.constraints[:held], rows.path, -left, -gap)
            size = float(np.abs(step / self.speed_sizes).max(initial=0.0))
            if not np.isfinite(size):
                return None
            if size <= SETTLED or (0.5 * before <= size <= NEAR):
                open_by = np.append(left / sizes(system, self.p, t).rows, gap / self.row_sizes)
                return q if np.abs(open_by).max() <= CLOSED else None
            q = q + min(1.0, 0.5 / max(size, 0.5)) * (rows.kinematics @ step)
            for places in system.attitudes.quaternions:
                q[[*places]] /= np.linalg.norm(q[[*places]])
            before = size
        return None

    def first(self, q: Array, t: float) -> Array:
        """The configuration at the first time, from one near it.

        Raises :class:`AssemblyError`, :class:`MechcError` if there is none, or the path does not
        prescribe every freedom once.
        """
        found = self.close(q, t)
        rows = self.rows(q if found is None else found, t)
        self._check_freedoms(rows)
        if found is None:
            raise AssemblyError(
                f"no configuration on the path was found at {self._in_words(t)}: change the path, "
                "or give a guess near it (guess={...})"
            )
        return found

    def _check_freedoms(self, rows: Rows) -> None:
        freedoms = len(self.system.speeds) - int(rank(rows.constraints * self.speed_sizes))
        given = len(self.path.quantities)
        if given != freedoms:
            raise MechcError(
                f"the path prescribes {given} numbers and the mechanism has {freedoms} freedoms: "
                "prescribe as many, which are independent"
            )
        if rank(rows.constraints[: self._holonomic] * self.speed_sizes) < rank(
            rows.constraints * self.speed_sizes
        ):
            raise MechcError(
                "positions follow from this path by integration only, for some constraints are on "
                "speeds (rolling, a motor's speed): simulate, with the path as a constraint"
            )

    def step(self, q: Array, t: float, later: float) -> tuple[Array, str]:
        """The configuration at a later time, on the same assembly; or why there is none."""
        rows, still = self.rows(q, t), self.path.at(t)
        speeds = self._solve(
            rows.constraints, rows.path, -rows.of_constraints, still[1] - rows.of_path
        )
        near = q + (later - t) * (rows.kinematics @ speeds + rows.of_kinematics)
        found = self.close(near, later)
        if found is None:
            return q, LOST
        scale = self.system.scale(self.p)[: len(q)]
        corrected = np.abs((found - near) / scale).max()
        turned = self._orientation(self.rows(found, later)) * self._orientation(rows) < 0.0
        return found, ANOTHER if turned or corrected > JUMP else ""

    def _orientation(self, rows: Rows) -> float:
        """The sign of the determinant of all rows; it differs between assemblies that meet."""
        every = self._every(rows.constraints, rows.path)
        return float(np.sign(np.linalg.det(every))) if len(every) == every.shape[1] else 0.0

    def positions(self, first: Array, times: Array) -> Array:
        """Configurations (nt, nq) at times that rise, on the assembly of the first.

        Raises :class:`MechcError` where the path cannot be followed: when and where.
        """
        found, smallest = [first], SMALLEST * max(np.ptp(times), np.abs(times).max(initial=0.0))
        for t, end in pairwise(times.tolist()):
            q, step, tried = found[-1], end - t, 0
            while t < end:
                tried += 1
                later = min(t + step, end)
                moved, why = self.step(q, t, later)
                if not why:
                    q, t, step = moved, later, 2.0 * (later - t)
                elif step > smallest and tried < MOST_STEPS:
                    step *= 0.5
                else:
                    why = FAST if tried >= MOST_STEPS else why
                    raise MechcError(f"{why} at {self._in_words(t)}. End the path before it")
            found.append(q)
        return np.stack(found)

    def _in_words(self, t: float) -> str:
        values = zip(self.path.quantities, self.path.at(t)[0], strict=True)
        return f"t = {t:.9g} s, " + ", ".join(in_words(q.meaning, float(x)) for q, x in values)

    # -- speeds and accelerations ----------------------------------------------------------------

    def motion(self, q: Array, t: float) -> tuple[Array, Array]:
        """The state (nq + nu,) and the rates of the speeds (nu,) at a configuration on the path.

        Raises :class:`MechcError` at a singular one.
        """
        system, nq, rows, (_, rate, second) = self.system, len(q), self.rows(q, t), self.path.at(t)
        u = self._solve(rows.constraints, rows.path, -rows.of_constraints, rate - rows.of_path)
        if rank(self._every(rows.constraints, rows.path)) < len(u):
            raise MechcError(
                f"the mechanism is singular at {self._in_words(t)}: links are in line, or an arm "
                "is stretched, and the path does not determine the speeds"
            )
        y = np.concatenate([q, u])
        own = system.rates(y, self.p, t)
        bent = self._bent(y, own[:nq], t)
        passed = self._of_path(
            y, rows.kinematics @ own[nq:] + bent, self._points("point_accelerations", y, t)
        )
        rest = passed - rows.path @ own[nq:]
        given = rows.constraints @ own[nq:], second - rest
        return y, self._solve(rows.constraints, rows.path, *given)

    def _bent(self, y: Array, rates: Array, t: float) -> Array:
        """The second rates (nq,) of coordinates at constant speeds."""
        nq = len(rates)
        of_points = not any(one.of_state for one in self.path.quantities)
        if of_points or self.system.data["identity_kinematics"]:
            return np.zeros(nq)
        by_state = self.system.evaluate("state_jacobian", y, self.p, t)
        return np.asarray(by_state[:nq, :nq] @ rates)
