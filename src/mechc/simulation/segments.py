"""Consecutive runs that are read as one."""

from __future__ import annotations

from typing import Any, Protocol

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
    """Pieces of one motion, each from where the last one ended; only the last still advances."""

    def __init__(self, first: Segment, last: Segment) -> None:
        self.first, self.last = first, last
        self.joint = float(first.t)

    @property
    def status(self) -> int:
        return self.last.status

    @property
    def t(self) -> float:
        return self.last.t

    @property
    def count(self) -> int:
        return self.first.count + self.last.count - 1

    @property
    def crossings(self) -> int:
        return self.first.crossings + self.last.crossings

    def advance(self, steps: int) -> int:
        return self.last.advance(steps)

    def stats(self) -> dict[str, Any]:
        """The sum of counters; the least of minima."""
        first, last = self.first.stats(), self.last.stats()
        told = {**last, **{name: first[name] + last[name] for name in ADDED}}
        for name, time in LEAST.items():
            if first[name] < last[name]:
                told |= {name: first[name], time: first[time]}
        return {**told, "rounding": max(first["rounding"], last["rounding"])}

    def states(self) -> tuple[Array, Array]:
        (t, y), (later, states) = self.first.states(), self.last.states()
        return np.append(t, later[1:]), np.vstack([y, states[1:]])

    def times(self, first: int) -> Array:
        """Accepted times from the index ``first`` on."""
        before = self.first.count
        if first >= before:
            return self.last.times(first - before + 1)
        return np.append(self.first.times(first), self.last.times(1))

    def tail(self, count: int) -> tuple[Array, Array]:
        """Of the last piece."""
        return self.last.tail(count)

    def change_points(self) -> tuple[Array, Array, Array]:
        parts = zip(self.first.change_points(), self.last.change_points(), strict=True)
        t, q, gap = (np.concatenate(pair) for pair in parts)
        return t, q, gap

    def interpolate(self, t: Array) -> Array:
        start = float(self.first.times(0)[0])
        early = np.abs(t - start) <= abs(self.joint - start)
        parts = [
            piece.interpolate(np.ascontiguousarray(t[own]))
            for piece, own in ((self.first, early), (self.last, ~early))
        ]
        out = np.empty((len(t), parts[0].shape[1]))
        out[early], out[~early] = parts
        return out
