"""Positions and orientations as numbers, at random values of all symbols.

For decisions about mechanisms whose full expressions would be long: each step from frame to frame
and from point to point is evaluated separately.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from sympy import Derivative, Expr, Float, sympify
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
        self._random = random.Random(seed)
        self._values: dict[Expr, Expr] = {}
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
        number = complex(expression.xreplace(self._values))
        return number.real + number.imag

    def assume(self, symbol: Expr, value: float) -> None:
        """Give a symbol, or a derivative, this value from now on."""
        self._values[symbol] = Float(value)

    def vector(self, vector: Vector) -> Number3:
        total = ZERO
        for matrix, frame in vector.args:
            entries = [self.value(entry) for entry in matrix]
            x, y, z = (
                a + dot(row, entries) for a, row in zip(total, self.rotation(frame), strict=True)
            )
            total = (x, y, z)
        return total

    def rotation(self, frame: ReferenceFrame) -> tuple[Number3, ...]:
        """Rows that turn components in ``frame`` into inertial ones."""
        for step in _ways(frame, self._frames_before, self._frames):
            before = self._frames_before[step]
            turn = [[self.value(e) for e in row] for row in before.dcm(step).T.tolist()]
            rows = [[dot(row, column) for column in turn] for row in self._frames[before]]
            self._frames[step] = tuple((a, b, c) for a, b, c in rows)
        return self._frames[frame]

    def position(self, point: Point) -> Number3:
        """The position of a point relative to the origin.

        Raises
        ------
        KeyError
            If no chain of positions leads there from the origin.
        """
        for step in _ways(point, self._points_before, self._points):
            before = self._points_before[step]
            arm = self.vector(step._pos_dict[before])
            x, y, z = (a + b for a, b in zip(self._points[before], arm, strict=True))
            self._points[step] = (x, y, z)
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


def _ways(place: Place, before: dict[Place, Place], known: dict[Place, Any]) -> Iterator[Place]:
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
