"""The equations of motion at one state, as the contacts there act on them.

M u' + J^T lambda = F + W^T f for forces f along the rows W of contacts.  With M = L L^T and what
lies along J L^-T taken out of the rows W L^-T =: R, the forces change u' by L^-T R^T f, and the
accelerations of gaps and slips by R R^T f.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechc.native._codes import RUNNING
from mechc.simulation.balance import EIGHTH, PLACES
from mechc.simulation.contact.laws import Laws, Mask, Numbers, has_plain_kinematics
from mechc.system.parameters import Array
from mechc.system.system import System

EPS = float(np.finfo(float).eps)
DEPENDENT = 1e-12  # of the largest singular value: a smaller one is zero
APART = 1e-3  # of the size of a state: between neighbours of a difference along the motion
ITERATIONS = 20
SOON = 1e-3  # of a run: inputs are known there


class Place(NamedTuple):
    """What contacts need at one state, without its accelerations.

    ``root``: L (nu, nu); ``normal`` and ``tangent``: rows R of the gaps and of the slips (n, nu);
    ``jacobian``: J of the loops (nc, nu).
    """

    t: float
    y: Array
    v: Array
    numbers: Numbers
    root: Array
    normal: Array
    tangent: Array
    kinematic: Array | None
    jacobian: Array

    @property
    def rounding(self) -> Array:
        """Of the values of the gaps (n,): that of their terms."""
        slopes, q = self.numbers.slopes, self.y[: len(self.v)]
        by_time = (self.numbers.rate - slopes @ self.v) * self.t
        return np.asarray(EPS * (np.abs(by_time) + np.abs(slopes) @ np.abs(q)))

    def speeds(self, change: Array) -> Array:
        """Speeds (nu,) for a change along rows R."""
        return np.asarray(np.linalg.solve(self.root.T, change))


class Free(NamedTuple):
    """Accelerations without forces of contacts: rates (nq + nu,), of gaps and of slips (n,)."""

    rates: Array
    normal: Array
    tangent: Array


class Contacts:
    """The contacts of one run of a system with parameters p (np,), between two times."""

    def __init__(self, laws: Laws, system: System, p: Array, span: tuple[float, float]) -> None:
        self.laws, self.system, self.p, self.span = laws, system, p, span
        self.split = len(system.coordinates)
        self.closes_loops = bool(system.scene.rows)

    @cached_property
    def plain(self) -> bool:
        """Whether q' = u."""
        start, end = self.span
        return has_plain_kinematics(self.system, self.p, (start, start + SOON * (end - start)))

    def place(self, t: float, y: Array) -> Place:
        """
        Raises
        ------
        numpy.linalg.LinAlgError
            If the mass matrix is not positive definite.
        """
        system, p, split = self.system, self.p, self.split
        v = y[split:] if self.plain else system.rates(y, p, t)[:split]
        numbers = self.laws.at(t, y, v)
        root = np.asarray(np.linalg.cholesky(system.mass_matrix(y, p, t)), np.float64)
        kinematic = None if self.plain else self._kinematic(t, y, v)
        gaps = numbers.slopes if kinematic is None else numbers.slopes @ kinematic
        rows = np.asarray(np.linalg.solve(root, np.vstack([gaps, numbers.rows]).T).T, np.float64)
        jacobian = system.constraint_jacobian(y, p, t) if self.closes_loops else root[:0]
        rows, n = _without_loops(rows, root, jacobian), len(self.laws)
        return Place(t, y, v, numbers, root, rows[:n], rows[n:], kinematic, jacobian)

    def _kinematic(self, t: float, y: Array, v: Array) -> Array:
        """N of q' = N u + b (nq, nu)."""
        nu = len(self.system.speeds)
        moved = np.repeat(y[None], nu, axis=0)
        moved[:, self.split :] += np.eye(nu)
        return np.asarray((self.system.rates(moved, self.p, t)[:, : self.split] - v).T)

    def free(self, place: Place) -> Free:
        """The accelerations without forces of contacts."""
        t, y, split, numbers = place.t, place.y, self.split, place.numbers
        rates = self.system.rates(y, self.p, t)
        later = rates[split:] if self.plain else self._second_rates(t, y, rates)
        normal = numbers.bend + numbers.slopes @ later
        return Free(rates, normal, numbers.drift + numbers.rows @ rates[split:])

    def _second_rates(self, t: float, y: Array, rates: Array) -> Array:
        """q'' (nq,) along the motion, by central differences of eighth order."""
        size = np.maximum(np.abs(y), self.system.scale(self.p))
        step = APART / max(float((np.abs(rates) / size).max()), 1.0)
        moved = y + step * PLACES[:, None] * rates
        around = self.system.rates(moved, self.p, t + step * PLACES)
        return np.asarray(EIGHTH @ around[:, : self.split] / step)

    # -- states put onto contacts ---------------------------------------------------------------

    def on_gaps(self, t: float, y: Array, closed: Mask) -> tuple[int, Place]:
        """The nearest coordinates, in the metric of M, at which these gaps (n,) are closed."""
        y, status = np.array(y, dtype=np.float64), RUNNING
        for _ in range(ITERATIONS):
            if self.closes_loops:
                status, y, _, _ = self.system.scene.project(t, y, self.p)
            place = self.place(t, y)
            if status != RUNNING or not closed.any():
                break
            gaps, rows = place.numbers.gap[closed], place.normal[closed]
            terms = np.abs(place.numbers.slopes[closed]) @ np.maximum(np.abs(y[: self.split]), 1.0)
            if (np.abs(gaps) <= 4 * EPS * np.maximum(terms, 1.0)).all():
                break
            step = place.speeds(least_change(rows, -gaps))
            y = y.copy()
            y[: self.split] += step if place.kinematic is None else place.kinematic @ step
        return status, place

    def with_speeds(self, place: Place, held: Mask, stuck: Mask) -> Place:
        """With the nearest speeds at which gaps ``held`` keep and ``stuck`` do not slip."""
        if not held.any() and not stuck.any():
            return place
        rows = np.vstack([place.normal[held], place.tangent[stuck]])
        off = np.concatenate([place.numbers.rate[held], place.numbers.slip[stuck]])
        y = place.y.copy()
        y[self.split :] += place.speeds(least_change(rows, -off))
        v = y[self.split :] if self.plain else self.system.rates(y, self.p, place.t)[: self.split]
        return place._replace(y=y, v=v, numbers=self.laws.at(place.t, y, v))


def _without_loops(rows: Array, root: Array, jacobian: Array) -> Array:
    """The rows (n, nu) without what lies along those of J L^-T."""
    if not len(jacobian):
        return rows
    _, sizes, along = np.linalg.svd(np.linalg.solve(root, jacobian.T).T, full_matrices=False)
    along = along[sizes > DEPENDENT * sizes.max(initial=0.0)]
    return np.asarray(rows - (rows @ along.T) @ along)


def least_change(rows: Array, values: Array) -> Array:
    """The shortest x with rows x = values; rows may be redundant."""
    if len(rows) == 1 and (size := float(rows[0] @ rows[0])) > 0.0:
        return np.asarray(rows[0] * (values[0] / size))
    return np.asarray(np.linalg.lstsq(rows, values, rcond=DEPENDENT)[0])
