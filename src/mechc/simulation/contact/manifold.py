"""The motion in one mode of contact, integrated with every stage on its constraints."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from mechc.native._codes import NOT_FINITE, SINGULAR_MASS
from mechc.native._contact import NO_LAW, NO_MASS
from mechc.numpy_backend.integrator import NumpyRun, RunLimits
from mechc.numpy_backend.linear import Rows
from mechc.simulation.contact.modes import Answer, Mode, Problem, State
from mechc.simulation.contact.place import Contacts, Place
from mechc.simulation.contact.recorded import record_of
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array

MOST_KEPT = 4096  # answers
_NO_SIZES = SimpleNamespace(mass=np.full((1, 1, 1), np.nan))


class Settled(NamedTuple):
    """States on the constraints of a mode, as :class:`mechc.numpy_backend.projection.Closed`."""

    status: Array
    place: Any
    rows: Rows | None
    iterations: int
    rates: Array


class ContactManifold:
    """What :class:`mechc.numpy_backend.integrator.NumpyRun` integrates."""

    def __init__(self, contacts: Contacts, mode: Mode) -> None:
        self.contacts, self.mode = contacts, mode
        system = contacts.system
        self.listing = SimpleNamespace(
            coordinates=len(system.coordinates), speeds=len(system.speeds),
            rows=system.scene.rows, holonomic=system.scene.holonomic,
        )  # fmt: skip
        states = np.array(mode)
        self.has_gap = contacts.laws.has_gap
        self.closed = self.has_gap & (states != State.OPEN)
        stuck = states == State.STICKS
        way = np.array([state.way for state in mode])
        self._constraints = self.closed.astype(np.uint8), stuck.astype(np.uint8), way
        none = np.zeros(len(mode), np.uint8)
        self._loops_alone = none, none, np.zeros(len(mode))

    def settled(self, t: float, y: Array) -> tuple[int, Array]:
        """One state moved onto the mode's constraints: status, state."""
        moved, closed = self.settle(np.array([t]), y[None])
        return int(closed.status[0]), moved[0]

    def settle(self, t: Array, y: Array) -> tuple[Array, Settled]:
        """States (n, nq + nu) at times (n,) moved onto the mode's constraints."""
        return self._put(t, y, self._constraints)

    def _put(self, t: Array, y: Array, mode: tuple[Any, ...]) -> tuple[Array, Settled]:
        equations = self.contacts.equations
        status, moved, rates, jacobians, masses = equations.settle(t, y, *mode)
        if (status == NO_LAW).any():
            self.contacts.check(NO_LAW, float(t[np.argmax(status == NO_LAW)]))
        massless = status == NO_MASS
        if massless.any():
            status[massless] = np.where(
                np.isfinite(y[massless]).all(axis=1), SINGULAR_MASS, NOT_FINITE
            )
        rows = Rows(jacobians, masses) if self.listing.rows else None
        return moved, Settled(status, _NO_SIZES, rows, len(y), rates)

    def moved(self, t: float, q: Array, changes: Array) -> Settled:
        """Configurations near one (nq,), each closed again: changes of the speeds (n, nu)."""
        width = self.listing.coordinates
        rest = np.append(q, np.zeros(self.listing.speeds))
        kinematic = self.contacts.place(t, rest).kinematic
        near = np.tile(rest, (len(changes), 1))
        near[:, :width] += changes if kinematic is None else changes @ kinematic.T
        return self._put(np.full(len(near), t), near, self._loops_alone)[1]

    def accelerate(self, t: Array, u: Array, closed: Settled) -> Array:
        """Their rates (n, nq + nu)."""
        return closed.rates

    def rates(self, t: float, y: Array) -> Array:
        """At one state on the constraints."""
        place, answer = self.answer(t, y)
        rates = place.free.rates.copy()
        rates[self.contacts.split :] += place.speeds(answer.along)
        return rates

    def answer(self, t: float, y: Array) -> tuple[Place, Answer]:
        """The forces of the mode at one state."""
        place = self.contacts.place(t, y)
        return place, Problem.of_forces(place, place.free, self.has_gap).answer(self.mode)


class ContactRun(NumpyRun):
    """A run in one mode of contact, by Dormand & Prince's pair of order 8(5,3).

    ``met`` (nu,): the size of speeds before; what rests has none but rounding.
    """

    def __init__(
        self, manifold: ContactManifold, span: tuple[float, float], y0: Array, policy: Policy,
        met: Array,
    ) -> None:  # fmt: skip
        self.contact, self.contacts, self.met = manifold, manifold.contacts, met
        limits = RunLimits(
            span[1], policy.rtol, policy.atol, policy.max_step, policy.max_steps, True,
            policy.max_bytes,
        )  # fmt: skip
        scale = self.contacts.system.scale(self.contacts.p)
        super().__init__(manifold, span[0], y0, scale, policy.first_step, limits)  # type: ignore[arg-type]

    def _accelerations(self) -> Array:
        """Those without what holds: with it they may be rounding."""
        place, answer = self.contact.answer(self.t, self.y)
        free = np.abs(place.free.rates[self.width :])
        free += np.abs(place.speeds(answer.given))
        return np.asarray(np.maximum(super()._accelerations(), free))

    def _speeds(self) -> Array:
        return np.asarray(np.maximum(super()._speeds(), self.met))

    def record(self) -> dict[str, Any]:
        """The steps as JSON data."""
        return record_of(*self.states(), self._dense)


class Found(NamedTuple):
    """Forces at one state, and their ``limits`` as of :meth:`Answer.limits`."""

    place: Place
    answer: Answer
    limits: list[tuple[str, int, Array, float]]


class Forces:
    """The answers along a run in one mode, kept by their time."""

    def __init__(self, manifold: ContactManifold) -> None:
        self.manifold = manifold
        self.kept: dict[float, Found] = {}

    def __call__(self, t: float, y: Array) -> Found:
        if t not in self.kept:
            if len(self.kept) >= MOST_KEPT:
                self.kept.clear()
            place, answer = self.manifold.answer(t, y)
            self.kept[t] = Found(place, answer, answer.limits())
        return self.kept[t]
