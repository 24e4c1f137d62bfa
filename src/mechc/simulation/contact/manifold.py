"""The motion in one mode of contact, integrated with every stage on its constraints."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from mechc.native._codes import NOT_FINITE, RUNNING, SINGULAR_MASS
from mechc.numpy_backend.integrator import NumpyRun, RunLimits
from mechc.numpy_backend.linear import Rows
from mechc.simulation.contact.modes import Answer, Mode, Problem, State
from mechc.simulation.contact.place import Contacts, Free, Place
from mechc.simulation.contact.recorded import record_of
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array

MOST_KEPT = 4096  # answers


class Settled(NamedTuple):
    """States on the constraints of a mode, as :class:`mechc.numpy_backend.projection.Closed`."""

    status: Array
    place: Any
    rows: Rows | None
    iterations: int
    places: list[Place | None]


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
        self.stuck = states == State.STICKS

    def settled(self, t: float, y: Array) -> tuple[int, Array, Place | None]:
        """One state moved onto the mode's constraints: status, state, what contacts need there."""
        try:
            status, place = self.contacts.on_gaps(t, y, self.closed)
            if status == RUNNING:
                place = self.contacts.with_speeds(place, self.closed, self.stuck)
            return status, place.y, place
        except np.linalg.LinAlgError:
            return (SINGULAR_MASS if np.isfinite(y).all() else NOT_FINITE), y, None

    def settle(self, t: Array, y: Array) -> tuple[Array, Settled]:
        """States (n, nq + nu) at times (n,) moved onto the mode's constraints."""
        found = [self.settled(float(at), row) for at, row in zip(t, y, strict=True)]
        status = np.array([code for code, _, _ in found], dtype=int)
        rows = np.array([row for _, row, _ in found]).reshape(y.shape)
        sizes = SimpleNamespace(mass=np.full((len(y), 1, 1), np.nan))
        places = [place for _, _, place in found]
        return rows, Settled(status, sizes, self._loops(places), len(y), places)

    def _loops(self, places: list[Place | None]) -> Rows | None:
        """The rows of the loops, whose conditioning the run monitors; J u = 0 at a failed state."""
        if not self.listing.rows:
            return None
        shape = self.listing.rows, self.listing.speeds
        jacobians = [np.zeros(shape) if place is None else place.jacobian for place in places]
        masses = [
            np.ones(shape[1]) if place is None else (place.root**2).sum(axis=1) for place in places
        ]
        return Rows(np.array(jacobians), np.array(masses))

    def moved(self, t: float, q: Array, changes: Array) -> Settled:
        """Configurations near one (nq,), each closed again: changes of the speeds (n, nu)."""
        system, width = self.contacts.system, self.listing.coordinates
        rest = np.append(q, np.zeros(self.listing.speeds))
        kinematic = self.contacts.place(t, rest).kinematic
        near = np.tile(rest, (len(changes), 1))
        near[:, :width] += changes if kinematic is None else changes @ kinematic.T
        closed = [system.scene.project(t, y, self.contacts.p)[:2] for y in near]
        places = [self.contacts.place(t, y) if status == RUNNING else None for status, y in closed]
        status = np.array([status for status, _ in closed])
        return Settled(status, None, self._loops(places), 0, places)

    def accelerate(self, t: Array, u: Array, closed: Settled) -> Array:
        """Their rates (n, nq + nu)."""
        return np.array([self._rates(place) for place in closed.places if place is not None])

    def rates(self, t: float, y: Array) -> Array:
        """At one state on the constraints."""
        return self._rates(self.contacts.place(t, y))

    def _rates(self, place: Place) -> Array:
        answer, free = self._answer(place)
        rates = free.rates.copy()
        rates[self.contacts.split :] += place.speeds(answer.along)
        return rates

    def _answer(self, place: Place) -> tuple[Answer, Free]:
        free = self.contacts.free(place)
        return Problem.of_forces(place, free, self.has_gap).answer(self.mode), free

    def answer(self, t: float, y: Array) -> tuple[Place, Answer]:
        """The forces of the mode at one state."""
        place = self.contacts.place(t, y)
        return place, self._answer(place)[0]


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
        free = np.abs(self.contacts.free(place).rates[self.width :])
        free += np.abs(place.speeds(answer.given))
        return np.asarray(np.maximum(super()._accelerations(), free))

    def _speeds(self) -> Array:
        return np.asarray(np.maximum(super()._speeds(), self.met))

    def record(self) -> dict[str, Any]:
        """Its steps as JSON data."""
        return record_of(*self.states(), self._dense)


class Forces:
    """The answers along a run in one mode, kept by their time."""

    def __init__(self, manifold: ContactManifold) -> None:
        self.manifold = manifold
        self.kept: dict[float, tuple[Place, Answer]] = {}

    def __call__(self, t: float, y: Array) -> tuple[Place, Answer]:
        if t not in self.kept:
            if len(self.kept) >= MOST_KEPT:
                self.kept.clear()
            self.kept[t] = self.manifold.answer(t, y)
        return self.kept[t]
