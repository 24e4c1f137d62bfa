"""Configuration constraints that hold only where they have no gradient.

A distance, an absolute value, the square of an expression and 1 - cos are at their least where
they are zero: there the gradient is zero or does not exist, and the constraint's rate says nothing
of the motion.  So it is with powers such as x^3.  Each row is examined alone, at random places
where it is zero: it is sound if along some coordinate it changes sign in proportion to the way.
"""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Expr, Mul, Pow

from mechc_codegen.convert.algebra import Evaluate, evaluator, normalise, random_point
from mechc_codegen.convert.classify_constraints import Rates
from mechc_codegen.description.mechanism import Constraint, Mechanism
from mechc_codegen.errors import MechanismError

_SEEDS, _DRAWS = (1, 2, 3), range(24)
_ROUNDING = 1e-14
_STEP = 1e-2  # coordinates are drawn from 0.4 to 1.7
_LEAST_ORDER, _HIGHEST_ORDER = 2**0.5, 4.0  # of what twice the step changes: once and a half twice


def check_gradients(mechanism: Mechanism) -> None:
    """Refuse a mechanism with such a constraint, see :func:`refuse_without_gradient`."""
    if mechanism.configuration_constraints:
        given = {f: e for f, e in mechanism.inputs.items() if e is not None}
        parameters = [parameter.symbol for parameter in mechanism.parameters]
        rates = Rates((mechanism.q, mechanism.u), mechanism.kinematics, parameters, given)
        refuse_without_gradient(mechanism.configuration_constraints, rates)


def refuse_without_gradient(constraints: Sequence[Constraint], rates: Rates) -> None:
    """Refuse configuration constraints that hold only where they have no gradient.

    Raises
    ------
    MechanismError
        With the name of the first of them, and what to write in its place.
    """
    for i in without_gradient([c.expression for c in constraints], rates):
        if not rates.in_symbols(constraints[i].expression).free_symbols & {*rates.q}:
            raise MechanismError(
                f"{constraints[i].name} contains no coordinate: it holds no motion, but asks for "
                "certain values of parameters.  Leave it out"
            )
        raise MechanismError(
            f"{constraints[i].name} is zero only where it has no gradient, as a distance, an "
            "absolute value or a square is: its rate says nothing of the motion there. Write its "
            "components, such as position.dot(N.x) and position.dot(N.y), each as a constraint"
        )


def without_gradient(configuration: Sequence[Expr], rates: Rates) -> list[int]:
    """The places of those constraints."""
    if not configuration:
        return []
    plain = [rates.in_symbols(e) for e in configuration]
    places = [rates.symbols.index(q) for q in rates.q]
    suspects = _of_one_sign(plain, rates) | {i for i, e in enumerate(plain) if _has_power(e)}
    return [i for i in sorted(suspects) if _fails(plain[i], rates, places)]


def _of_one_sign(rows: Sequence[Expr], rates: Rates) -> set[int]:
    """The rows that are never negative, or never positive, at random places, and not zero
    everywhere, as a redundant constraint may be."""
    evaluate, size = evaluator(rates.symbols, list(rows)), len(rates.symbols)
    signs = [set[bool]() for _ in rows]
    for seed in _DRAWS:
        try:
            values = evaluate(*(random_point(None, size, seed) or ()))
        except (ValueError, ZeroDivisionError, OverflowError, TypeError):
            continue
        for seen, value in zip(signs, values, strict=True):
            seen |= {value > 0.0} if abs(value) > _ROUNDING else set()
    return {i for i, seen in enumerate(signs) if len(seen) == 1}


def _has_power(row: Expr) -> bool:
    return any(isinstance(f, Pow) and f.exp.is_number for f in Mul.make_args(row))


def _fails(row: Expr, rates: Rates, places: Sequence[int]) -> bool:
    """Whether the row has no gradient at any of some places where it is zero."""
    size = len(rates.symbols)
    gap = normalise(evaluator(rates.symbols, [row]), size, places)
    points = [random_point(gap, size, seed, places) for seed in _SEEDS]
    closed = [point for point in points if point is not None]
    return bool(closed) and not any(_crosses(gap, point, k) for point in closed for k in places)


def _crosses(gap: Evaluate, point: Sequence[float], place: int) -> bool:
    """Whether the row changes sign along a coordinate, in proportion to the way."""

    def at(way: float) -> float:
        moved = list(point)
        moved[place] += way
        return gap(*moved)[0]

    try:
        odd, even, farther = (
            0.5 * (at(_STEP) - at(-_STEP)),
            0.5 * (at(_STEP) + at(-_STEP)) - at(0.0),
            0.5 * (at(2.0 * _STEP) - at(-2.0 * _STEP)),
        )
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return False  # a root that does not exist on one side
    in_proportion = _LEAST_ORDER * abs(odd) < abs(farther) < _HIGHEST_ORDER * abs(odd)
    return abs(odd) > 2.0 * abs(even) and in_proportion
