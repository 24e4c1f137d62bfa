"""A damped pendulum that strikes a wall three times under a torque that jumps: its end and, in two
ways, the derivatives of the end.

First way: the motion extrapolated, each strike by Newton's iteration, for differences.  Second:
its dual numbers by Gauss's collocation; at a strike they are moved to its own time, reflected, and
moved back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

from ..arithmetic import DIGITS, Vector, number
from ..extrapolation import Rates, extrapolated
from .dual_numbers import Dual, quick, sin, value_of
from .gauss import Equations, along

WALL, RESTITUTION = 0.1, 0.8
TIMES, TORQUES = (0.0, 0.5, 1.25, 3.0), (0.3, -0.8, 0.5, 0.5)  # each holds until the next
GIVEN = {"q": 0.7, "u": -0.5, "l": 0.8, "c": 0.4, "m": 1.3, "g": 9.81}
BY = ("q", "u", "l", "c", "F[1]")
END = 2.25
LONGEST = number("0.05")
Advance = Callable[[Equations, Vector, Vector, Any], Vector]
Reflect = Callable[[Rates, Vector], Vector]


def pushed_pendulum() -> KanesMethod:
    """The same for mechc: an angle q from downwards, damping c, the torque F."""
    q, u, torque = dynamicsymbols("q u F")
    m, l, g, c = (Symbol(name) for name in "mlgc")
    r, origin = ReferenceFrame("r"), Point("O")
    rod = r.orientnew("rod", "Axis", (q, r.z))
    rod.set_ang_vel(r, u * r.z)
    origin.set_vel(r, 0)
    tip = origin.locatenew("P", -l * rod.y)
    tip.v2pt_theory(origin, r, rod)
    kane = KanesMethod(r, [q], [u], [q.diff() - u])
    kane.kanes_equations(
        [Particle("bob", tip, m)], [(tip, -m * g * r.y), (rod, (torque - c * u) * r.z)]
    )
    return kane


def struck(given: Mapping[str, Any]) -> Vector:
    """The end for numbers."""
    return _motion(given, lambda rates, p, y, h: extrapolated(rates(p), y, h), _reflected)


def struck_in_dual_numbers(given: Mapping[str, Any], t: float) -> Vector:
    assert t == END
    return _motion(
        given, lambda *a: [quick(x) for x in along(*a, longest="0.05")], _reflected_moving
    )


def _motion(given: Mapping[str, Any], advance: Advance, reflected: Reflect) -> Vector:
    own = {name: quick(value) for name, value in given.items()}
    y, strikes = [own["q"], own["u"]], 0
    for k, begun in enumerate(TIMES[:-1]):
        parameters = [*(own[name] for name in "glcm"), own.get(f"F[{k}]", number(TORQUES[k]))]
        now, until = number(begun), number(min(TIMES[k + 1], END))
        while now < until:
            h = min(LONGEST, until - now)
            following = advance(_equations, parameters, y, h)
            if value_of(following[0]) < WALL and value_of(y[1]) < 0:
                h, following = _strike(parameters, y, h, advance)
                following = reflected(_equations(parameters), following)
                strikes += 1
            y, now = following, now + h
    assert strikes == 3
    return y


def _equations(parameters: Vector) -> Rates:
    g, l, c, m, torque = parameters
    inertia = m * l * l
    pull, damping, push = g / l, c / inertia, torque / inertia
    return lambda y: [y[1], push - pull * sin(y[0]) - damping * y[1]]


def _strike(parameters: Vector, y: Vector, h: Any, advance: Advance) -> tuple[Any, Vector]:
    """The time from y to the wall, and the state there."""
    for _ in range(60):
        there = advance(_equations, parameters, y, h)
        gap = value_of(there[0]) - number(WALL)
        if abs(gap) < 10.0 ** (8 - DIGITS):
            return h, there
        h -= gap / value_of(there[1])
    raise ArithmeticError("the strike was not found")


def _reflected(rates: Rates, y: Vector) -> Vector:
    return [y[0], y[1] * -number(RESTITUTION)]


def _reflected_moving(rates: Rates, y: Vector) -> Vector:
    """At the strike's own time, which moves by a dual number of value 0, and back."""
    shift = Dual(number(0), [-d / y[1].value for d in y[0].slopes])
    there = [a + f * shift for a, f in zip(y, rates(y), strict=True)]
    after = _reflected(rates, there)
    return [a - f * shift for a, f in zip(after, rates(after), strict=True)]
