"""Dot products as SymPy forms them, without its products with zero.

Of each of those SymPy asks the assumptions whether the other factor is finite, which takes most of
the time.  Vectors that hold an infinity are left to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from sympy import Add, Basic, Expr, S
from sympy.physics.vector import Dyadic, ReferenceFrame, Vector

from mechc_codegen.description.terms import entries_of

INFINITE = (S.Infinity, S.NegativeInfinity, S.ComplexInfinity, S.NaN)
KNOWN = 1 << 16


def dot(one: Vector, other: Vector) -> Expr:
    """``one.dot(other)``, each vector in the frames it was written in."""
    if _infinite(one) or _infinite(other) or Vector.simp:
        return one.dot(other)
    total: Expr = S.Zero
    for first, frame in one.args:
        for second, own in other.args:
            total += _inner(_in_frame(list(second), own, frame), list(first))
    return total


def dyadic_dot(dyadic: Dyadic, vector: Vector) -> Vector:
    """``dyadic.dot(vector)``, as an inertia and an angular velocity."""
    found = Vector(0)
    for scale, one, other in dyadic.args:
        found += scale * one * dot(other, vector)
    return found


def _in_frame(components: Sequence[Expr], own: ReferenceFrame, frame: ReferenceFrame) -> list[Expr]:
    if own is frame:
        return list(components)
    turned = own.dcm(frame).flat()
    return [_inner(components, turned[column::3]) for column in range(3)]


def _inner(one: Sequence[Expr], other: Sequence[Expr]) -> Expr:
    pairs = zip(one, other, strict=True)
    return Add(*(a * b for a, b in pairs if a is not S.Zero and b is not S.Zero))


def _infinite(vector: Vector) -> bool:
    return any(map(_holds_infinity, entries_of(vector)))


@lru_cache(maxsize=KNOWN)
def _holds_infinity(expression: Basic) -> bool:
    return expression in INFINITE or any(map(_holds_infinity, expression.args))
