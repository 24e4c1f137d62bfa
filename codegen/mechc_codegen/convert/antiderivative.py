"""An elementary function from its partial derivatives.

Sums of powers, exponentials, sines and cosines of arguments linear in a variable are integrated
term by term, and terms of the form f' f^n.  What is found is compared with the derivatives at
random points.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from sympy import Add, Derivative, Dummy, Expr, Float, Mul, Pow, S, cancel, cos, exp, expand, sin
from sympy.core.function import AppliedUndef
from sympy.simplify.fu import TR8

MOST_WORK = 200_000  # operations of all derivatives, times four for each angle: some seconds
POINTS, ROUNDING = 3, 1e-9


def antiderivative(slopes: Sequence[Expr], variables: Sequence[Expr]) -> Expr | None:
    """V with dV/dx = slope for each variable x and its slope; None where none was found."""
    if _work(slopes, variables) > MOST_WORK:
        return None
    plain = {x: Dummy(f"x{i}", real=True) for i, x in enumerate(variables)}
    places, wanted = list(plain.values()), [slope.xreplace(plain) for slope in slopes]
    if any(slope.has(AppliedUndef, Derivative) for slope in wanted):
        return None
    total: Expr = S.Zero
    for i, (slope, x) in enumerate(zip(wanted, places, strict=True)):
        part = _integral(_sum_of_terms(slope - total.diff(x)), x)
        if part is None or part.has(*places[:i]):
            return None
        total += part
    if not _has_slopes(total, wanted, places):
        return None
    return total.xreplace({place: x for x, place in plain.items()})


def _work(slopes: Sequence[Expr], variables: Sequence[Expr]) -> int:
    """An estimate of the work: products of sines and cosines of n angles become up to 2^n terms."""
    turned = set[Expr]().union(*(slope.atoms(sin, cos) for slope in slopes))
    angles = sum(any(part.has(x) for part in turned) for x in variables)
    operations = sum(int(slope.count_ops()) for slope in slopes)
    return int(operations * 4**angles)


def _sum_of_terms(expression: Expr) -> Expr:
    """Products of sines and cosines as sums, roots kept whole, so that equal terms cancel."""
    roots = {
        power: Pow(expand(TR8(expand(power.base))), power.exp)
        for power in expression.atoms(Pow)
        if power.base.is_Add and power.exp.is_Rational and not power.exp.is_Integer
    }
    held = {root: Dummy(f"root{i}") for i, root in enumerate(dict.fromkeys(roots.values()))}
    outer = expression.xreplace({power: held[root] for power, root in roots.items()})
    return expand(TR8(expand(outer))).xreplace({name: root for root, name in held.items()})


def _integral(expression: Expr, x: Expr) -> Expr | None:
    parts = []
    powers: dict[Expr, Expr] = {}
    for term in Add.make_args(expression):
        factor, rest = term.as_independent(x, as_Add=False)
        part = _elementary(rest, x)
        if part is not None:
            parts.append(factor * part)
            continue
        power = next((f for f in Mul.make_args(rest) if _is_inner_power(f, x)), None)
        if power is None:
            return None
        powers[power] = powers.get(power, S.Zero) + term / power
    for power, outer in powers.items():
        part = _of_inner_power(power, outer, x)
        if part is None:
            return None
        parts.append(part)
    return Add(*parts)


def _elementary(term: Expr, x: Expr) -> Expr | None:
    """The integral of a power, exponential, sine or cosine of an argument linear in x."""
    if not term.has(x):
        return term * x
    base, exponent = term.as_base_exp()
    if isinstance(term, (sin, cos, exp)):
        slope = term.args[0].diff(x)
        if slope.has(x) or slope == 0:
            return None
        whole = {sin: lambda a: -cos(a), cos: sin, exp: exp}[type(term)](term.args[0])
        return whole / slope
    slope = base.diff(x)
    if not exponent.is_number or exponent == -1 or slope.has(x):
        return None
    return base ** (exponent + 1) / (slope * (exponent + 1))


def _is_inner_power(factor: Expr, x: Expr) -> bool:
    if not isinstance(factor, Pow) or not factor.base.has(x):
        return False
    return bool(factor.exp.is_number and factor.exp != -1 and factor.base.is_Add)


def _of_inner_power(power: Expr, outer: Expr, x: Expr) -> Expr | None:
    """The integral of c f' f^n, where the outer factor is c f'."""
    inner = _sum_of_terms(power.base.diff(x))
    constant = cancel(_sum_of_terms(outer) / inner) if inner != 0 else x
    if constant.has(x):
        return None
    return constant * power.base ** (power.exp + 1) / (power.exp + 1)


def _has_slopes(total: Expr, slopes: Sequence[Expr], variables: Sequence[Expr]) -> bool:
    draw = Random(20)
    names = sorted(total.free_symbols.union(*(s.free_symbols for s in slopes)), key=str)
    for _ in range(POINTS):
        at = {name: Float(draw.uniform(0.3, 1.7), 30) for name in names}
        for slope, x in zip(slopes, variables, strict=True):
            found, wanted = (complex(e.xreplace(at).evalf(20)) for e in (total.diff(x), slope))
            if not abs(found - wanted) <= ROUNDING * (1.0 + abs(wanted)):
                return False
    return True
