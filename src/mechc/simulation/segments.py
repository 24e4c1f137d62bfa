"""Consecutive runs that are read as one."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from mechc.system.parameters import Array

ADDED = ("steps", "rejected", "rhs_evaluations", "closure_iterations", "examined")
LEAST = {"least_singular": "least_singular_time", "critical_gap": "critical_time"}


class Segment(Protocol):
    """The interface of a run: compiled, or that of :mod:`mechc.simulation.singular_start`."""

    @property
    def status(self) -> int: ...
    @property
    def t(self) -> float: ...
    @property
    def count(self) -> int: ...
    @property
    def crossings(self) -> int: ...
    def advance(self, steps: int) -> int: ...
    def stats(self) -> dict[str, Any]: ...
    def states(self) -> tuple[Array, Array]: ...
    def times(self, first: int) -> Array: ...
    def tail(self, count: int) -> tuple[Array, Array]: ...
    def change_points(self) -> tuple[Array, Array, Array]: ...
    def interpolate(self, t: Array) -> Array: ...


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


def lasts(contacts: tuple[str, ...]) -> bool:
    """Whether any contact lasts, in the words of :class:`SmoothPart`."""
    return any(word not in ("", "open") for word in contacts)


class Until:
    """A piece up to a time within it, where an event ended it."""

    def __init__(self, piece: Segment, t: float) -> None:
        times = piece.times(0)
        self.piece, self.t, self.status = piece, t, piece.status
        self.start = float(times[0])
        self.count = int((np.abs(times - self.start) < abs(t - self.start)).sum()) + 1

    @property
    def crossings(self) -> int:
        """Change points crossed until the event."""
        return len(self.change_points()[0])

    def advance(self, steps: int) -> int:
        """The piece is complete: status finished."""
        return self.status

    def stats(self) -> dict[str, Any]:
        return self.piece.stats()

    def interpolate(self, t: Array) -> Array:
        return self.piece.interpolate(t)

    def times(self, first: int) -> Array:
        """Accepted times from the index ``first`` on, the last one the time of the event."""
        return np.append(self.piece.times(0)[: self.count - 1], self.t)[first:]

    def states(self) -> tuple[Array, Array]:
        y = self.piece.states()[1][: self.count - 1]
        return self.times(0), np.vstack([y, self.interpolate(np.array([self.t]))])

    def tail(self, count: int) -> tuple[Array, Array]:
        t, y = self.states()
        return t[-count:], y[-count:]

    def change_points(self) -> tuple[Array, Array, Array]:
        t, q, gap = self.piece.change_points()
        early = np.abs(t - self.start) <= abs(self.t - self.start)
        return t[early], q[early], gap[early]


class Segments:
    """Pieces of one motion, each from the time where the last one ended; only the last advances.

    At a jump the time is there twice, with the state before and the one after it; elsewhere a piece
    begins with the last state of the one before.
    """

    def __init__(self, *pieces: Segment) -> None:
        self.pieces: list[Segment] = []
        self.jumps: list[bool] = []  # whether a piece begins with a jump
        self.causes: list[tuple[int, ...]] = []  # the events whose resets made it, in order
        self.contacts: list[tuple[str, ...]] = []  # of each piece, as in SmoothPart
        self.values: list[Array | None] = []  # parameters of each piece; None: those of the run
        self._rows: list[int] = []  # states before those of a piece
        self._starts: list[float] = []  # times
        for piece in pieces:
            self.add(piece)

    def add(
        self, piece: Segment, *, jump: bool = False, causes: tuple[int, ...] = (),
        contacts: tuple[str, ...] = (), values: Array | None = None,
    ) -> None:  # fmt: skip
        """Go on with a piece, or with several that are one motion; ``values``: its parameters
        (np,), where they are others than those of the run."""
        if isinstance(piece, Segments):
            told = (piece.pieces, piece.jumps, piece.causes, piece.contacts, piece.values)
            for part, jumps, by, states, own in zip(*told, strict=True):
                held = values if own is None else own
                self.add(part, jump=jump or jumps, causes=by, contacts=states, values=held)
                jump = False
            return
        self.contacts.append(contacts)
        self.values.append(values)
        self.causes.append(causes)
        self._rows.append(self.count if self.pieces else 0)
        self._starts.append(float(piece.times(0)[0]))
        self.pieces.append(piece)
        self.jumps.append(jump)

    def end_at(self, t: float) -> None:
        """The last piece counts until a time within it."""
        self.pieces[-1] = Until(self.pieces[-1], t)

    def replace_last(self, piece: Segment, contacts: tuple[str, ...]) -> None:
        """Another piece from the start of the last one, which has not advanced."""
        before = self.contacts[-2] if len(self.pieces) > 1 else contacts
        self.pieces[-1], self.contacts[-1] = piece, contacts
        if before != contacts and (lasts(before) or lasts(contacts)):
            self.jumps[-1] = True  # a run that is continued goes on in other contact

    @property
    def last(self) -> Segment:
        return self.pieces[-1]

    def _left_out(self, number: int) -> int:
        """How many of the first states of a piece are those of the piece before."""
        return int(number > 0 and not self.jumps[number])

    @property
    def status(self) -> int:
        return self.last.status

    @property
    def t(self) -> float:
        return self.last.t

    @property
    def count(self) -> int:
        return self._rows[-1] + self.last.count - self._left_out(len(self.pieces) - 1)

    @property
    def crossings(self) -> int:
        return sum(piece.crossings for piece in self.pieces)

    def advance(self, steps: int) -> int:
        return self.last.advance(steps)

    def stats(self) -> dict[str, Any]:
        """The sum of counters; the least of minima."""
        parts = [piece.stats() for piece in self.pieces]
        told = {**parts[-1], **{name: sum(part[name] for part in parts) for name in ADDED}}
        for name, time in LEAST.items():
            least = min(parts, key=lambda part: part[name])
            told |= {name: least[name], time: least[time]}
        return {**told, "rounding": max(part["rounding"] for part in parts)}

    def states(self) -> tuple[Array, Array]:
        parts = [piece.states() for piece in self.pieces]
        cut = [self._left_out(k) for k in range(len(parts))]
        t = np.concatenate([times[n:] for (times, _), n in zip(parts, cut, strict=True)])
        return t, np.vstack([states[n:] for (_, states), n in zip(parts, cut, strict=True)])

    def times(self, first: int) -> Array:
        """Accepted times from the index ``first`` on."""
        number = len(self.pieces) - 1
        if first >= self._rows[-1]:
            return self.last.times(first - self._rows[-1] + self._left_out(number))
        parts = [piece.times(self._left_out(k)) for k, piece in enumerate(self.pieces)]
        return np.concatenate(parts)[first:]

    def tail(self, count: int) -> tuple[Array, Array]:
        """Of the last piece."""
        return self.last.tail(count)

    def change_points(self) -> tuple[Array, Array, Array]:
        parts = zip(*(piece.change_points() for piece in self.pieces), strict=True)
        t, q, gap = (np.concatenate(part) for part in parts)
        return t, q, gap

    def _numbers(self, t: Array) -> Any:
        """The piece at each time; at a jump the one after it, of two equal times in a row there
        the first the one before."""
        starts = np.array(self._starts)
        forwards = 1.0 if self.t >= starts[0] else -1.0
        numbers = np.searchsorted(forwards * starts[1:], forwards * t, side="right")
        twice = np.flatnonzero(t[1:] == t[:-1])
        at_jump = (starts[numbers[twice]] == t[twice]) & np.array(self.jumps)[numbers[twice]]
        numbers[twice[at_jump]] -= 1
        return numbers

    def values_at(self, t: Array, values: Array) -> Array:
        """Parameters (nt, np) that hold at these times, of a run that began with ``values``."""
        every = np.array([values if own is None else own for own in self.values])
        return np.asarray(every[self._numbers(t)])

    def interpolate(self, t: Array) -> Array:
        """At a jump the state after it; of two equal times in a row there, the first before it."""
        numbers = self._numbers(t)
        parts = {int(number): np.flatnonzero(numbers == number) for number in np.unique(numbers)}
        rows = {k: self.pieces[k].interpolate(np.ascontiguousarray(t[own]))
                for k, own in parts.items()}  # fmt: skip
        if not rows:
            return self.last.interpolate(t)
        out = np.empty((len(t), next(iter(rows.values())).shape[1]))
        for number, own in parts.items():
            out[own] = rows[number]
        return out

    def in_contact(self) -> Array:
        """Of each step between two states whether a contact lasted in it."""
        counts = [
            piece.count - 1 + int(k > 0 and self.jumps[k]) for k, piece in enumerate(self.pieces)
        ]
        return np.repeat([lasts(words) for words in self.contacts], counts)

    def smooth_parts(self) -> tuple[SmoothPart, ...]:
        """The parts between jumps."""
        t, y = self.states()
        pieces = [0, *(k for k, jump in enumerate(self.jumps) if jump and k)]
        rows = [self._rows[k] for k in pieces]
        bounds = zip(rows, [*rows[1:], len(t)], pieces, strict=True)
        return tuple(
            SmoothPart(
                float(t[first]), float(t[end - 1]), y[first], y[end - 1], self.contacts[k],
                self.values[k],
            )
            for first, end, k in bounds
        )  # fmt: skip


def values_along(run: Any, values: Array, t: Array) -> Array:
    """The parameters ``values`` (np,) that a run began with, or, where resets have changed them,
    those that hold at times (nt,), a row each (nt, np)."""
    if isinstance(run, Segments) and any(own is not None for own in run.values):
        return run.values_at(t, values)
    return values
