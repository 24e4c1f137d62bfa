"""Dot products are the expressions that SymPy forms, infinities included."""

from __future__ import annotations

from mechc_codegen.derive.dot_products import dot, dyadic_dot
from sympy import S, nan, oo, symbols
from sympy.physics.mechanics import ReferenceFrame, dynamicsymbols, inertia
from sympy.physics.vector import Vector

a, b, c = symbols("a b c", real=True)
N = ReferenceFrame("N")
A = N.orientnew("A", "Axis", [dynamicsymbols("q"), N.z])
B = A.orientnew("B", "Axis", [dynamicsymbols("r"), A.x])
VECTORS = [
    Vector(0), N.x, a * N.x + b * N.z, 2 * A.y - A.z, a * B.x + (b + c) * B.y, 0.0 * N.x + B.z,
    N.x + a * A.y - b * B.z, S(2) / 3 * B.y + c * N.y,
]  # fmt: skip


def test_products_are_those_of_sympy() -> None:
    """As expressions, not by value alone: operations and roundings of a scene follow from them."""
    for one in VECTORS:
        for other in VECTORS:
            assert dot(one, other) == one.dot(other)


def test_inertias_turn_angular_velocities_as_in_sympy() -> None:
    body = inertia(B, a, b, c, a * b) + inertia(A, 1, 2, 3)
    for vector in VECTORS:
        assert dyadic_dot(body, vector) == body.dot(vector)


def test_an_infinity_that_nothing_multiplies_is_not_dropped() -> None:
    assert dot(oo * N.x, N.y) is nan
    assert dot(N.y, (a + oo) * N.x) is nan
