"""Sines and cosines of two angles -> those of their sum or difference, for readers.

Input and output: SymPy expressions of equal value.  Only products of exactly two sines or
cosines that are terms of one sum are joined; nothing is expanded or simplified.
"""

from __future__ import annotations

from typing import Any

from sympy import Add, Derivative, Mul, cos, sin
from sympy.core.function import AppliedUndef


def join_angles(expression: Any) -> Any:
    """Replace cos a cos b + sin a sin b by cos(a - b), and its three relatives, everywhere."""
    if not expression.args or isinstance(expression, (AppliedUndef, Derivative)):
        return expression
    rebuilt = expression.func(*map(join_angles, expression.args))
    if not isinstance(rebuilt, Add):
        return rebuilt
    done: list[Any] = []
    waiting: dict[frozenset[Any], Any] = {}
    for term in rebuilt.args:
        halves = _halves(term)
        for one, other in (halves, halves[::-1]) if halves else ():
            if waiting.pop(frozenset((one, -other)), None) is not None:
                done.append(2 * one)
                break
        else:
            waiting[frozenset(halves or (term,))] = term
    return Add(*done, *waiting.values())


def _halves(term: Any) -> tuple[Any, Any] | None:
    """A product of two sines or cosines as the sum that it is: of a - b and of a + b."""
    turning = [f for f in Mul.make_args(term) if isinstance(f, (sin, cos))]
    if len(turning) != 2:
        return None
    first, second = sorted(turning, key=lambda f: isinstance(f, cos))
    half = term / first / second / 2
    a, b = first.args[0], second.args[0]
    if isinstance(first, cos):
        return half * cos(a - b), half * cos(a + b)
    if isinstance(second, cos):
        return half * sin(a - b), half * sin(a + b)
    return half * cos(a - b), -half * cos(a + b)
