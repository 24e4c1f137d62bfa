"""Positions and orientations as numbers, at random values of all symbols.

For decisions about mechanisms whose full expressions would be long: each step from frame to frame
and from point to point is evaluated separately.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from sympy import Derivative, Expr, Float, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

Number3 = tuple[float, float, float]
Place = TypeVar("Place", Point, ReferenceFrame)
ZERO: Number3 = (0.0, 0.0, 0.0)
_UNIT: tuple[Number3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Placement:
    """Places for one random choice of values, which ``seed`` determines; along inertial axes."""

    def __init__(self, frame: ReferenceFrame, origin: Point, seed: int) -> None:
        self.is_real = True  # until a value has an imaginary part
        self._random = random.Random(seed)
        self._values: dict[Expr, Expr] = {}
        self._start = frame, origin
        self._frames = {frame: _UNIT}
        self._points = {origin: ZERO}
        self._frames_before = steps_from(frame, lambda f: f._dcm_dict)
        self._points_before = steps_from(origin, lambda p: p._pos_dict)

    def value(self, expression: Expr) -> float:
        """An expression, with a random number for every symbol and function of time.

        The root of a negative number counts with its imaginary part: the question is whether
        a value is zero.
        """
        expression = sympify(expression)
        atoms = expression.atoms(Derivative) | expression.atoms(AppliedUndef)
        for symbol in sorted(atoms | expression.free_symbols, key=str):
            if symbol not in self._values:
                self._values[symbol] = Float(self._random.uniform(0.4, 1.7))
        found = expression.xreplace(self._values)
        try:
            number = complex(found)
        except TypeError:  # SymPy's curves of muscles are written without being evaluated
            number = complex(found.doit())
        self.is_real = self.is_real and number.imag == 0.0
        return number.real + number.imag

    def assume(self, symbol: Expr, value: float) -> None:
        """Give a symbol, or a derivative, this value from now on."""
        self._values[symbol] = Float(value)

    def moved(self, seed: int) -> Placement:
        """Another choice for functions of time; constants keep the values that they have so far."""
        other = Placement(*self._start, seed)
        other._values = {s: x for s, x in self._values.items() if isinstance(s, Symbol)}
        return other

    def vector(self, vector: Vector) -> Number3:
        total = ZERO
        for matrix, frame in vector.args:
            entries = [self.value(entry) for entry in matrix]
            total = plus(total, apply(self.rotation(frame), entries))
        return total

    def rotation(self, frame: ReferenceFrame) -> tuple[Number3, ...]:
        """Rows that turn components in ``frame`` into inertial ones."""
        for step in way_to(frame, self._frames_before, self._frames):
            before = self._frames_before[step]
            turn = [[self.value(e) for e in row] for row in before.dcm(step).T.tolist()]
            rows = [apply(turn, row) for row in self._frames[before]]
            self._frames[step] = tuple((a, b, c) for a, b, c in rows)
        return self._frames[frame]

    def position(self, point: Point) -> Number3:
        """The position of a point relative to the origin.

        Raises
        ------
        KeyError
            If no chain of positions leads there from the origin.
        """
        for step in way_to(point, self._points_before, self._points):
            before = self._points_before[step]
            self._points[step] = plus(self._points[before], self.vector(step._pos_dict[before]))
        return self._points[point]


def steps_from(start: Place, neighbours: Callable[[Place], Iterable[Place]]) -> dict[Place, Place]:
    """The previous place on the shortest path from ``start``, for all connected places."""
    before: dict[Place, Place] = {}
    waiting = [start]
    for place in waiting:
        for other in neighbours(place):
            if other is not start and other not in before:
                before[other] = place
                waiting.append(other)
    return before


def reachable(starts: Iterable[Any], relation: str = "_pos_dict") -> list[Any]:
    """These points (or frames) and all placed relative to one of them, each once."""
    found = list(dict.fromkeys(starts))
    seen = set(found)
    for place in found:
        new = [other for other in getattr(place, relation) if other not in seen]
        seen.update(new)
        found += new
    return found


def way_to(place: Place, before: dict[Place, Place], known: dict[Place, Any]) -> Iterator[Place]:
    """The places on the way from the nearest known one to ``place``, which is the last of them."""
    way = []
    while place not in known:
        way.append(place)
        place = before[place]
    yield from reversed(way)


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """The scalar product of components, numbers or expressions."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any]:
    """The vector product of components, numbers or expressions."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def plus(*vectors: Sequence[Any]) -> tuple[Any, Any, Any]:
    """The sum of vectors given by components, numbers or expressions."""
    x, y, z = (sum(parts) for parts in zip(*vectors, strict=True))
    return x, y, z


def minus(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any]:
    """The difference of two vectors given by components."""
    x, y, z = (one - other for one, other in zip(a, b, strict=True))
    return x, y, z


def apply(rows: Sequence[Sequence[Any]], vector: Sequence[Any]) -> list[Any]:
    """Matrix times vector."""
    return [dot(row, vector) for row in rows]


def product(a: Sequence[Sequence[Any]], b: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Matrix times matrix."""
    columns = list(zip(*b, strict=True))
    return [apply(columns, row) for row in a]
