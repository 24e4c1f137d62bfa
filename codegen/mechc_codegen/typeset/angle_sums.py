"""Sines and cosines of two angles -> those of their sum or difference, for readers.

Input and output: SymPy expressions of equal value.  Only products of exactly two sines or
cosines that are terms of one sum are joined; nothing is expanded or simplified.
"""

from __future__ import annotations

from typing import Any

from sympy import Add, Derivative, Mul, cos, default_sort_key, sin
from sympy.core.function import AppliedUndef

_Pair = tuple[str, Any, Any]


def join_angles(expression: Any) -> Any:
    """Replace cos a cos b + sin a sin b by cos(a - b), and its three relatives, everywhere."""
    if not expression.args or isinstance(expression, (AppliedUndef, Derivative)):
        return expression
    rebuilt = expression.func(*map(join_angles, expression.args))
    return _joined_sum(rebuilt) if isinstance(rebuilt, Add) else rebuilt


def _joined_sum(total: Any) -> Any:
    done: list[Any] = []
    waiting: list[tuple[Any, _Pair, Any]] = []
    for term in total.args:
        rest, pair = _split(term)
        partner = next((w for w in waiting if pair and _fits(rest, pair, w)), None)
        if pair is None:
            done.append(term)
        elif partner is None:
            waiting.append((rest, pair, term))
        else:
            waiting.remove(partner)
            done.append(_united(partner[0], partner[1], rest))
    return Add(*done, *(term for _, _, term in waiting))


def _split(term: Any) -> tuple[Any, _Pair | None]:
    """A term as rest times two of sin, cos: kind ``cc``, ``ss`` or ``sc`` and its two angles."""
    factors = Mul.make_args(term)
    turning = [f for f in factors if isinstance(f, (sin, cos))]
    if len(turning) != 2:
        return term, None
    rest = Mul(*(f for f in factors if f not in turning))
    first, second = sorted(turning, key=lambda f: default_sort_key(f.args[0]))
    a, b = first.args[0], second.args[0]
    if type(first) is type(second):
        return rest, ("cc" if isinstance(first, cos) else "ss", a, b)
    return rest, ("sc", a, b) if isinstance(first, sin) else ("sc", b, a)


def _fits(rest: Any, pair: _Pair, other: tuple[Any, _Pair, Any]) -> bool:
    kind, a, b = pair
    wanted = ("sc", b, a) if kind == "sc" else ("ss" if kind == "cc" else "cc", a, b)
    return other[1] == wanted and other[0] in (rest, -rest)


def _united(rest: Any, pair: _Pair, other_rest: Any) -> Any:
    """``rest`` times ``pair`` plus ``other_rest``, equal or opposite, times its partner."""
    kind, a, b = pair
    same = rest == other_rest
    if kind == "sc":
        return rest * (sin(a + b) if same else sin(a - b))
    sign = -1 if kind == "ss" and not same else 1
    return sign * rest * (cos(a - b) if same else cos(a + b))
