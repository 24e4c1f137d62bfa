"""A motion as it was computed: its pieces, which are read as one.

A piece is what one run computed from a state on: its steps, the parameters that held, the contacts
that lasted, and the events whose resets made its first state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from mechc.system.parameters import Array
from mechc.system.system import System

ADDED = ("steps", "rejected", "rhs_evaluations", "closure_iterations", "examined")
LEAST = {"least_singular": "least_singular_time", "critical_gap": "critical_time"}


def added_stats(before: Mapping[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """Counters of two motions: sums, and the least of minima; ``before`` may be empty."""
    if not before:
        return after
    both = {**after, **{name: before[name] + after[name] for name in ADDED}}
    for name, when in LEAST.items():
        least = min((before, after), key=lambda stats: stats[name])
        both |= {name: least[name], when: least[when]}
    left = before["left_series"] | after["left_series"]
    return {**both, "rounding": max(before["rounding"], after["rounding"]), "left_series": left}


class Steps(Protocol):
    """The steps of a run: accepted states and dense output between them."""

    @property
    def count(self) -> int: ...
    @property
    def crossings(self) -> int: ...
    @property
    def span(self) -> tuple[float, float]: ...
    def states(self) -> tuple[Array, Array]: ...
    def times(self, first: int) -> Array: ...
    def tail(self, count: int) -> tuple[Array, Array]: ...
    def ends(self) -> tuple[Array, Array]: ...
    def change_points(self) -> tuple[Array, Array, Array]: ...
    def interpolate(self, t: Array) -> Array: ...
    def forces(self, t: Array, y: Array) -> Array: ...
    def read_by(self, scene: Any, inputs: Any) -> Steps: ...


class SmoothPart(NamedTuple):
    """A part of a motion between two jumps of its state.

    Attributes
    ----------
    t0, t1
        Its first and last time, s.
    y0, y1 : (nq + nu,)
        The states at them: after the jump before, and before the jump after.
    contacts
        Of each event the state of its contact: "open", "held", "sticks", "slides +", "slides -";
        "" for other events; empty where no contact lasted until then.
    params : (np,)
        The parameters that hold in it.
    """

    t0: float
    t1: float
    y0: Array
    y1: Array
    contacts: tuple[str, ...] = ()
    params: Any = None


class Piece:
    """A part of a motion that one run computed.

    Attributes
    ----------
    steps
        The steps of that run, which may be under way.
    params : (np,)
        The parameters that hold.
    jumps
        Whether the state jumps at its start.
    causes
        The events whose resets made that jump, in order.
    contacts
        The states of contacts, as of :class:`SmoothPart`.
    cut
        The time within a step at which an event ended it; None: it counts to its last state.
    """

    __slots__ = ("causes", "contacts", "cut", "jumps", "params", "steps")

    def __init__(
        self, steps: Steps, params: Array, jumps: bool = False, causes: tuple[int, ...] = (),
        contacts: tuple[str, ...] = (), cut: float | None = None,
    ) -> None:  # fmt: skip
        self.steps = steps
        self.params = params
        self.jumps = jumps
        self.causes = causes
        self.contacts = contacts
        self.cut = cut

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time, s."""
        first, last = self.steps.span
        return first, last if self.cut is None else self.cut

    @property
    def lasts(self) -> bool:
        """Whether any contact lasts."""
        return any(word not in ("", "open") for word in self.contacts)

    def times(self) -> Array:
        """Times (nt,) of its states."""
        t = self.steps.times(0)
        return t if self.cut is None else np.append(t[: self._before_cut(t)], self.cut)

    def states(self) -> tuple[Array, Array]:
        """Times (nt,) and states (nt, nq + nu)."""
        t, y = self.steps.states()
        if self.cut is None:
            return t, y
        whole, end = self._before_cut(t), np.array([self.cut])
        return np.append(t[:whole], end), np.vstack([y[:whole], self.steps.interpolate(end)])

    def _before_cut(self, t: Array) -> int:
        assert self.cut is not None
        return int((np.abs(t - t[0]) < abs(self.cut - t[0])).sum())

    def change_points(self) -> tuple[Array, Array, Array]:
        """Times (n,), configurations (n, nq) and gaps (n,) of the change points crossed."""
        t, q, gap = self.steps.change_points()
        if self.cut is None:
            return t, q, gap
        start = self.span[0]
        early = np.abs(t - start) <= abs(self.cut - start)
        return t[early], q[early], gap[early]


class Record:
    """A motion: pieces, each from the time where the one before it ends.

    At a jump the time is there twice, with the state before and the one after it; elsewhere a piece
    begins with the last state of the one before.

    Attributes
    ----------
    pieces
        Of which the last may be under way.
    stats
        Counters of all steps, and the least conditioning met.
    """

    __slots__ = ("pieces", "stats")

    def __init__(self, pieces: list[Piece], stats: dict[str, Any] | None = None) -> None:
        self.pieces = pieces
        self.stats = {} if stats is None else stats

    def read_by(self, system: System) -> Record:
        """This motion, read by the functions of another system of the same mechanism."""
        inputs = None if system.driven is None else system.driven.native_inputs()
        pieces = [
            Piece(
                piece.steps.read_by(system.scene.evaluator, inputs), piece.params, piece.jumps,
                piece.causes, piece.contacts, piece.cut,
            )
            for piece in self.pieces
        ]  # fmt: skip
        return Record(pieces, self.stats)

    @property
    def last(self) -> Piece:
        return self.pieces[-1]

    def share_params(self) -> None:
        """Let pieces with the parameters of the one before have the same array."""
        params = self.pieces[0].params
        for piece in self.pieces:
            if piece.params is not params and not np.array_equal(piece.params, params):
                params = piece.params
            piece.params = params

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time, s."""
        return self.pieces[0].span[0], self.last.span[1]

    def _concatenate(self, parts: Sequence[Array]) -> Array:
        """Rows of all pieces; a state shared by two pieces appears once."""
        return np.concatenate([
            part[int(k > 0 and not self.pieces[k].jumps) :] for k, part in enumerate(parts)
        ])  # fmt: skip

    def times(self, first: int = 0) -> Array:
        """Times (nt - first,) of the accepted states."""
        return self._concatenate([piece.times() for piece in self.pieces])[first:]

    def states(self) -> tuple[Array, Array]:
        """Accepted times (nt,) and states (nt, nq + nu)."""
        parts = [piece.states() for piece in self.pieces]
        if len(parts) == 1:
            return parts[0]
        return self._concatenate([t for t, _ in parts]), self._concatenate([y for _, y in parts])

    def ends(self) -> tuple[Array, Array]:
        """The first and the last time (2,), and the states there (2, nq + nu)."""
        t, y = (np.array(each) for each in self.pieces[0].steps.ends())
        if self.last.cut is not None:
            t[1] = self.last.cut
            y[1] = self.last.steps.interpolate(t[1:])[0]
        elif len(self.pieces) > 1:
            t[1], y[1] = (each[1] for each in self.last.steps.ends())
        return t, y

    def change_points(self) -> tuple[Array, Array, Array]:
        """Times (n,), configurations (n, nq) and gaps (n,) of the change points crossed."""
        parts = zip(*(piece.change_points() for piece in self.pieces), strict=True)
        t, q, gap = (np.concatenate(part) for part in parts)
        return t, q, gap

    def _numbers(self, t: Array) -> Any:
        """The number of the piece at each time: at a jump that of the piece after it, but the
        first of two equal times in a row there has the piece before."""
        starts = np.array([piece.span[0] for piece in self.pieces])
        forwards = 1.0 if self.span[1] >= starts[0] else -1.0
        numbers = np.searchsorted(forwards * starts[1:], forwards * t, side="right")
        twice = np.flatnonzero(t[1:] == t[:-1])
        jumps = np.array([piece.jumps for piece in self.pieces])
        numbers[twice[(starts[numbers[twice]] == t[twice]) & jumps[numbers[twice]]]] -= 1
        return numbers

    def interpolate(self, t: Array) -> Array:
        """States (nt, nq + nu) at times of the motion, on the constraints.

        At a jump the state after it; of two equal times in a row there, the first before it.
        """
        if len(self.pieces) == 1 or not len(t):
            return self.last.steps.interpolate(t)
        numbers, rows = self._numbers(t), None
        for number in np.unique(numbers):
            own = np.flatnonzero(numbers == number)
            found = self.pieces[number].steps.interpolate(np.ascontiguousarray(t[own]))
            rows = np.empty((len(t), found.shape[1])) if rows is None else rows
            rows[own] = found
        return np.asarray(rows)

    def contact_forces(self, t: Array, y: Array) -> Array | None:
        """Generalized forces (nt, nu) of contacts at times and states (nt, nq + nu) of the motion.

        Zero where no contact lasts; NaN where their laws are not known.  None where none ever does.
        """
        if not any(piece.lasts for piece in self.pieces):
            return None
        numbers, forces = self._numbers(t), np.zeros((len(t), 0))
        for number, piece in enumerate(self.pieces):
            own = np.flatnonzero(numbers == number)
            if not piece.lasts or not len(own):
                continue
            found = piece.steps.forces(np.ascontiguousarray(t[own]), np.ascontiguousarray(y[own]))
            if not forces.shape[1]:
                forces = np.zeros((len(t), found.shape[1]))
            forces[own] = found
        return forces if forces.shape[1] else None

    def params_along(self, t: Array) -> Array:
        """The parameters (np,); where resets have changed them, those at each time (nt, np)."""
        first = self.pieces[0].params
        if all(piece.params is first for piece in self.pieces):
            return first
        every = np.stack([piece.params for piece in self.pieces])
        return np.asarray(every[self._numbers(t)])

    @property
    def changes_params(self) -> bool:
        """Whether resets have changed parameters."""
        return any(piece.params is not self.pieces[0].params for piece in self.pieces)

    def in_contact(self) -> Array:
        """Flags (nt - 1,) of the steps between states during which a contact lasted."""
        lasting = [np.full(len(piece.times()), piece.lasts) for piece in self.pieces]
        return self._concatenate(lasting)[1:]

    def smooth_parts(self) -> tuple[SmoothPart, ...]:
        """The parts between jumps."""
        parts: list[SmoothPart] = []
        for piece in self.pieces:
            t, y = piece.states()
            end = {"t1": float(t[-1]), "y1": y[-1]}
            if parts and not piece.jumps:
                parts[-1] = parts[-1]._replace(**end)
            else:
                part = SmoothPart(float(t[0]), **end, y0=y[0], contacts=piece.contacts)
                parts.append(part._replace(params=piece.params))
        return tuple(parts)
