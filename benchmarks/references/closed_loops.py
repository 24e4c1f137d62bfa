"""Bennett's and Bricard's loops on their closed curves, in 30 digits computed in two ways.

The curves of configurations are known in closed form, f(a, b) = 0 with every other angle a multiple
of a or b.  The motion along one needs no constraint: with ds^2 = 2 T dt^2 measured by the rods'
kinetic energy, d^2 s / dt^2 = -dV/ds.  Positions are chains of rotations, of the links' geometry
alone.  First way: Gragg's extrapolation; second: Gauss's collocation of order 40; what both agree
on is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from mpmath import mpf

from ..problems.closed_loops import BENNETT, BENNETT_WEIGHT, BRICARD, BRICARD_WEIGHT, Link
from .arithmetic import DIGITS, Vector, agreed, cos, dot, number, numbers, of_mpmath, sin, sqrt
from .extrapolation import by_extrapolation
from .sensitivities.gauss import along

T_END, LONGEST = 10.0, ("0.05", "0.1")  # s; steps of the two ways
X, Y, Z = range(3)
UNIT = [numbers(int(i == j) for j in range(3)) for i in range(3)]


@dataclass(frozen=True)
class Loop:
    """Rods of 1 kg in a ring, the last of them the ground.

    Parameters
    ----------
    slopes
        Of f by a and by b.
    pattern
        By angle: what multiples of a and b it is.
    first
        a and b of the start, from rest.
    """

    links: Sequence[tuple[Any, Any]]
    gravity: Vector
    slopes: Callable[[Any, Any], tuple[Any, Any]]
    pattern: Sequence[tuple[int, int]]
    first: tuple[Any, Any]

    def angles(self, a: Any, b: Any) -> Vector:
        return [m * a + n * b for m, n in self.pattern]

    def rates(self, y: Vector) -> Vector:
        """Of (a, b, ds/dt)."""
        by_a, by_b = self.slopes(y[0], y[1])
        twice, power = self._moving(self.angles(y[0], y[1]), self.angles(-by_b, by_a))
        pace = y[2] / sqrt(twice)
        return [-by_b * pace, by_a * pace, power / sqrt(twice)]

    def _moving(self, q: Vector, rates: Vector) -> tuple[Any, Any]:
        """Twice the kinetic energy, and the power of the weights."""
        frame, (none, *_) = UNIT, UNIT[1]
        spin, velocity, twice, power = [none] * 3, [none] * 3, none, none
        angle = self.links[-1][1]
        for k, (length, after) in enumerate(self.links[:-1]):
            frame = _turned(_turned(frame, X, angle), Z, q[k])
            spin = [w + rates[k] * z for w, z in zip(spin, _column(frame, Z), strict=True)]
            half = _cross(spin, [length / 2 * x for x in _column(frame, X)])
            moving = [v + h for v, h in zip(velocity, half, strict=True)]
            own = [dot(spin, _column(frame, axis)) for axis in (X, Y, Z)]
            across = own[1] * own[1] + own[2] * own[2]
            turning = length**2 * (own[0] * own[0] / 50 + across / 12)
            twice = twice + dot(moving, moving) + turning
            power = power + dot(self.gravity, moving)
            velocity, angle = [v + 2 * h for v, h in zip(velocity, half, strict=True)], after
        return twice, power

    def state(self, y: Vector) -> Vector:
        """All angles and their rates, of (a, b, ds/dt)."""
        by_a, by_b, _ = self.rates(y)
        return [*self.angles(y[0], y[1]), *self.angles(by_a, by_b)]


def _turned(frame: Sequence[Vector], axis: int, angle: Any) -> list[Vector]:
    """The frame (rows by inertial axes) turned about its own axis."""
    c, s, i, j = cos(angle), sin(angle), (axis + 1) % 3, (axis + 2) % 3
    turned = [list(row) for row in frame]
    for row in turned:
        row[i], row[j] = c * row[i] + s * row[j], c * row[j] - s * row[i]
    return turned


def _column(frame: Sequence[Vector], axis: int) -> Vector:
    return [row[axis] for row in frame]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


# -- the two loops --------------------------------------------------------------------------------


def bennett() -> Loop:
    """tan(a/2) tan(b/2) = sin 60 / -sin 30 degrees; the third angle is -a."""
    k, first = -mpmath.sqrt(3), mpf(1)
    ratio = number(k)

    def slopes(a: Any, b: Any) -> tuple[Any, Any]:
        """Of sin(a/2) sin(b/2) - k cos(a/2) cos(b/2)."""
        a, b = a / 2, b / 2
        return cos(a) * sin(b) + ratio * sin(a) * cos(b), sin(a) * cos(b) + ratio * cos(a) * sin(b)

    other = 2 * mpmath.atan(k / mpmath.tan(first / 2))
    return _loop(BENNETT, BENNETT_WEIGHT, slopes, [(1, 0), (0, 1), (-1, 0)], (first, other))


def bricard() -> Loop:
    """cos a + cos b + cos a cos b = 0, every other angle the same."""
    first = mpf("1.2")

    def slopes(a: Any, b: Any) -> tuple[Any, Any]:
        return -sin(a) * (1 + cos(b)), -sin(b) * (1 + cos(a))

    other = mpmath.acos(-mpmath.cos(first) / (1 + mpmath.cos(first)))
    pattern = [(1, 0), (0, 1)] * 2 + [(1, 0)]
    return _loop(BRICARD, BRICARD_WEIGHT, slopes, pattern, (first, other))


def _loop(links: Sequence[Link], weight: Sequence[Any], *rest: Any) -> Loop:
    numbers = [(_number(length), _number(angle)) for length, angle in links]
    return Loop(numbers, [_number(g) for g in weight], *rest)


def _number(exact: Any) -> Any:
    """Of an int or an exact number of SymPy."""
    return number(exact if isinstance(exact, int) else exact._to_mpmath(mpmath.mp.prec))


LOOPS = {"bennett": bennett, "bricard": bricard}


# -- computed again -------------------------------------------------------------------------------


def closed_loops() -> dict[str, Any]:
    """By loop: the start and the end at 10 s as text, angles and rates."""
    found: dict[str, Any] = {"t_end": T_END, "digits": DIGITS}
    for name, build in LOOPS.items():
        loop = build()
        start = numbers([*loop.first, 0])
        last = along(lambda _, loop=loop: loop.rates, [], start, mpf(T_END), LONGEST[1])
        both = [
            by_extrapolation(loop.rates, start, [T_END], LONGEST[0])[-1],
            numbers(x.value for x in last),
        ]
        ends = [[of_mpmath(x) for x in loop.state(end)] for end in both]
        digits = agreed(*([end] for end in ends))
        print(f"{name}: both ways agree on {digits} digits", flush=True)
        found["digits"] = min(digits, found["digits"])
        rows = {"start": [of_mpmath(x) for x in loop.state(start)], "end": ends[0]}
        found[name] = {at: [mpmath.nstr(x, digits) for x in row] for at, row in rows.items()}
    return found
