"""The equations of motion at one state, as the contacts there act on them.

M u' + J^T lambda = F + W^T f for forces f along the rows W of contacts.  With M = L L^T and what
lies along J L^-T taken out of the rows W L^-T =: R, the forces change u' by L^-T R^T f, and the
accelerations of gaps and slips by R R^T f.  In compiled code: ``runtime/events/contact.h``.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechc.native._contact import NO_LAW, NO_MASS, ContactEquations
from mechc.simulation.contact.laws import Laws, Numbers, has_plain_kinematics
from mechc.simulation.events.event import FunctionFailedError
from mechc.system.parameters import Array
from mechc.system.system import System

EPS = float(np.finfo(float).eps)
DEPENDENT = 1e-12  # of the largest singular value: a smaller one is zero
SOON = 1e-3  # of a run: inputs are known there


class Free(NamedTuple):
    """Accelerations without forces of contacts: rates (nq + nu,), of gaps and of slips (n,)."""

    rates: Array
    normal: Array
    tangent: Array


class Place(NamedTuple):
    """What contacts need at one state.

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
    free: Free = Free(*np.zeros((3, 0)))  # as it is known

    @property
    def rounding(self) -> Array:
        """Of the values of the gaps (n,): that of their terms."""
        slopes, q = self.numbers.slopes, self.y[: len(self.v)]
        by_time = (self.numbers.rate - slopes @ self.v) * self.t
        return np.asarray(EPS * (np.abs(by_time) + np.abs(slopes) @ np.abs(q)))

    def speeds(self, change: Array) -> Array:
        """Speeds (nu,) for a change along rows R."""
        return np.asarray(np.linalg.solve(self.root.T, change))


class Contacts:
    """The contacts of one run of a system with parameters p (np,), between two times."""

    def __init__(self, laws: Laws, system: System, p: Array, span: tuple[float, float]) -> None:
        self.laws, self.system, self.p, self.span = laws, system, p, span
        self.split = len(system.coordinates)

    @cached_property
    def plain(self) -> bool:
        """Whether q' = u."""
        start, end = self.span
        return has_plain_kinematics(self.system, self.p, (start, start + SOON * (end - start)))

    @cached_property
    def equations(self) -> ContactEquations:
        """In compiled code."""
        system, inputs = self.system, None
        scene = system.scene
        if system.driven is not None:
            inputs, scene = scene.given_to(tuple(scene.outputs), self.span[0]), scene.without_inputs
        return ContactEquations(
            scene, self.laws.function, self.laws.has_gap.astype(np.uint8),
            np.ascontiguousarray(self.p), np.ascontiguousarray(system.scale(self.p)), self.plain,
            inputs,
        )  # fmt: skip

    def place(self, t: float, y: Array) -> Place:
        """
        Raises
        ------
        numpy.linalg.LinAlgError
            If the mass matrix is not positive definite.
        """
        status, table, v, root, normal, tangent, kinematic, jacobian, *free = self.equations.place(
            t, np.ascontiguousarray(y, np.float64)
        )
        self.check(status, t)
        return Place(
            t, y, v, self.laws.numbers(table), root, normal, tangent,
            None if self.plain else kinematic, jacobian, Free(*free),
        )  # fmt: skip

    def check(self, status: int, t: float) -> None:
        """Raise what is wrong where :class:`ContactEquations` find no mass or no laws."""
        if status == NO_MASS:
            raise np.linalg.LinAlgError
        if status == NO_LAW:
            if self.equations.failure is not None:
                raise self.equations.failure
            raise FunctionFailedError(
                f"the contact of event {self.laws.laws[self.equations.failed].number} has no rate, "
                f"slip or friction at t = {t:.9g} s: its expressions are not finite there"
            )
