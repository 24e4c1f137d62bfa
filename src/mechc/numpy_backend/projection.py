"""States moved onto the constraints, and accelerations there, without C."""

from __future__ import annotations

from copy import copy
from typing import Any, NamedTuple

import numpy as np

from mechc.native._codes import NOT_CLOSED, NOT_FINITE, RUNNING, SINGULAR_MASS
from mechc.numpy_backend.equations import ArrayEquations, Place, accelerations, rows_of
from mechc.numpy_backend.linear import EPS, Rows, diagonal, times
from mechc.system.parameters import Array

ITERATIONS = 20
TURN = 1e-3  # rad
OF_A_RADIAN = 0.1  # of the change of a row by a radian: an ordinary row is no shorter


class Closed(NamedTuple):
    """Configurations (n, nq) and their quantities; status: ``RUNNING`` where the loops close."""

    q: Array
    place: Place
    rows: Rows | None
    status: Any
    iterations: int


class Manifold:
    """The constraints of a scene with one set of parameters (np,)."""

    def __init__(self, equations: ArrayEquations, p: Array) -> None:
        self.equations, self.listing = equations, equations.listing
        self.p = np.array(p, dtype=np.float64).reshape(1, -1)
        self.k = equations.constants(self.p)
        self.ordinary_sum = 0.0

    def measured_at(self, t: float, q: Array, angles: Any) -> Manifold:
        """The same constraints, with the least sum of the entries of an ordinary row.

        Where links come in line a row may vanish, but not the rounding of its gap: see
        ``singularities/ordinary_rows.h`` of the compiled run.
        """
        if not len(angles) or not self.listing.holonomic:
            return self
        turned = q + TURN * np.eye(len(q))[angles]
        rows = self.equations.place(np.array([t]), np.vstack([q, turned]), self.p, self.k).jacobian
        sums = np.abs(rows[1:] - rows[0])[:, : self.listing.holonomic].sum(axis=2) / TURN
        other = copy(self)
        other.ordinary_sum = OF_A_RADIAN * float(sums[np.isfinite(sums)].max(initial=0.0))
        return other

    def with_inputs(self, inputs: Any) -> Manifold:
        """The same constraints with these values of the inputs."""
        other = copy(self)
        other.equations = self.equations.with_inputs(inputs)
        return other

    def at(self, t: Array, q: Array) -> tuple[Place, Rows | None]:
        place = self.equations.place(t, q, self.p, self.k)
        return place, rows_of(place) if self.listing.rows else None

    def close(self, t: Array, q: Array) -> Closed:
        """The nearest configurations that close the loops, by Gauss-Newton in the metric of M."""
        q, before = q.copy(), np.full(len(q), np.inf)
        for iteration in range(1, ITERATIONS + 1):
            place, rows = self.at(t, q)
            heavy = (diagonal(place.mass) > 0).all(axis=1)
            if not self.listing.holonomic or rows is None:
                status = np.where(heavy, RUNNING, SINGULAR_MASS)
                return Closed(q, place, rows, status, iteration)
            gap, rounding = self._gap(place, q)
            near = (gap <= 16 * rounding) & (gap >= 0.25 * before)
            settled = (gap <= rounding) | near | ~np.isfinite(gap) | ~heavy
            if settled.all() or iteration == ITERATIONS:
                break
            before = np.where(settled, before, gap)
            step = rows.least_change(self._gap_values(place))
            q[~settled] += self._displacement(t, q, step)[~settled]
        status = np.where(settled, RUNNING, NOT_CLOSED)
        status = np.where(np.isfinite(gap), status, NOT_FINITE)
        return Closed(q, place, rows, np.where(heavy, status, SINGULAR_MASS), iteration)

    def steady(self, closed: Closed, u: Array) -> Array:
        """The nearest speeds that keep the constraints."""
        if closed.rows is None:
            return u
        return np.asarray(u + closed.rows.least_change(-residual(closed.place, u)))

    def accelerate(self, t: Array, u: Array, closed: Closed) -> Array:
        """State rates (n, nq + nu) at closed configurations."""
        q, p, k = closed.q, self.p, self.k
        forcing, gamma = self.equations.terms(t, q, u, p, k, closed.place)
        found, _ = accelerations(closed.place, forcing, gamma, closed.rows)
        return np.hstack([self.equations.coordinate_rates(t, q, u, p, k), found])

    def settle(self, t: Array, y: Array) -> tuple[Array, Closed]:
        """States moved onto the constraints, position first."""
        width = self.listing.coordinates
        closed = self.close(t, y[:, :width])
        return np.hstack([closed.q, self.steady(closed, y[:, width:])]), closed

    def project(self, t: float, y: Array) -> tuple[int, Array, float, float]:
        """One state (nq + nu,): status, state, largest gap and velocity residual before."""
        time, width = np.array([t]), self.listing.coordinates
        finite = bool(np.isfinite(y).all())
        gap = float(np.abs(self.at(time, y[None, :width])[0].gap).max(initial=0.0))
        closed = self.close(time, y[None, :width])
        status = int(closed.status[0])
        off = residual(closed.place, y[None, width:])
        drift = float(np.abs(off).max(initial=0.0)) if status == RUNNING else 0.0
        if status == RUNNING:
            y = np.hstack([closed.q, self.steady(closed, y[None, width:])])[0]
        else:
            y = np.append(closed.q[0], y[width:])
        return status, y, gap if finite else np.nan, drift

    def moved(self, t: float, q: Array, changes: Array) -> Closed:
        """Configurations near one (nq,), each closed again: changes (n, nu)."""
        rows = np.repeat(q[None], len(changes), axis=0)
        time = np.array([t])
        return self.close(time, rows + self._displacement(time, rows, changes))

    def _gap(self, place: Place, q: Array) -> tuple[Array, Array]:
        """The largest gap (n,), and the rounding that it is compared with."""
        size = place.gap.shape[1]
        sums = np.abs(place.jacobian[:, :size]).sum(axis=2).max(axis=1)
        terms = np.maximum(sums, self.ordinary_sum)
        turn = np.maximum(1.0, np.abs(q).max(axis=1))
        return np.abs(place.gap).max(axis=1), 2 * EPS * terms * turn

    def _gap_values(self, place: Place) -> Array:
        """The changes of the rows; velocity constraints do not take part in closing."""
        values = np.zeros((len(place.gap), self.listing.rows))
        values[:, : self.listing.holonomic] = -place.gap
        return values

    def _displacement(self, t: Array, q: Array, step: Array) -> Array:
        """The step of the coordinates (n, nq) for one of the speeds (n, nu)."""
        if self.listing.identity_kinematics:
            return step
        still = np.zeros((len(q), self.listing.speeds))
        flat = self.equations.written("kinematic_matrix", t, q, still, self.p, self.k)
        return np.asarray(times(flat.reshape(len(q), q.shape[1], -1), step))


def residual(place: Place, u: Array) -> Array:
    """J u + b (n, nc)."""
    return np.asarray(place.bias + times(place.jacobian, u))
