"""Loads on auxiliary speeds that are unknowns -> loads without them, and each load per unit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from sympy import Add, Expr, S
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.algebra import rank
from mechc_codegen.convert.classify_constraints import RateRows, Rates, SpeedRows
from mechc_codegen.description.mechanism import Reaction, printed_name
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import Load, velocity_of
from mechc_codegen.errors import MechanismError

_NOTHING = 1e-9


def split_reactions(source: Source, symbols: Sequence[Expr]) -> tuple[Source, tuple[Reaction, ...]]:
    """The source with these symbols zero in its loads, and the loads per unit of each.

    Raises
    ------
    MechanismError
        If there are no auxiliary speeds, more than loads contain them, or loads are not linear
        in them.
    """
    if not symbols:
        return source, ()
    _refuse_elsewhere(source, symbols)
    absent = dict.fromkeys(symbols, S.Zero)
    per_unit = {symbol: list[Load]() for symbol in symbols}
    for place, vector in source.loads:
        for symbol in symbols:
            part = _part(place, vector, symbol, symbols)
            if part != 0:
                per_unit[symbol].append((place, part))
    loads = tuple((place, vector.xreplace(absent)) for place, vector in source.loads)
    found = tuple(Reaction(symbol, tuple(each)) for symbol, each in per_unit.items())
    return replace(source, loads=loads), found


def _part(
    place: Point | ReferenceFrame, vector: Vector, symbol: Expr, symbols: Iterable[Expr]
) -> Vector:
    """The derivative of a load by a symbol, which must not contain any of them."""
    parts = [(matrix.diff(symbol), frame) for matrix, frame in vector.args]
    if any(matrix.has(*symbols) for matrix, _ in parts):
        raise MechanismError(
            f"reactions: the load on {place.name} is not linear in {printed_name(symbol)}"
        )
    return Vector([part for part in parts if any(part[0])])


def _refuse_elsewhere(source: Source, symbols: Sequence[Expr]) -> None:
    if not source.auxiliary:
        raise MechanismError(
            f"reactions: this {source.kind} has no auxiliary speeds; give it one along each force "
            "that is wanted (u_auxiliary of KanesMethod)"
        )
    others = [*source.kinematics, *source.configuration, *source.motion]
    for symbol in symbols:
        if any(expression.has(symbol) for expression in others):
            raise MechanismError(
                f"reactions: {printed_name(symbol)} is in kinematics or constraints; only loads "
                "may contain it"
            )


def constraints_with_auxiliary(source: Source) -> tuple[Expr, ...]:
    """All constraints on the speeds, if an auxiliary speed is in one of them."""
    rates = () if source.mixed else (e.diff(dynamicsymbols._t) for e in source.configuration)
    every = (*rates, *source.motion)
    return every if any(e.has(*source.auxiliary) for e in every) else ()


def refuse_contributing(
    source: Source, reactions: Sequence[Reaction], rates: Rates, held: Sequence[Expr]
) -> None:
    """Refuse reactions that have power in a motion which satisfies the constraints.

    ``held``: all constraints on the speeds.
    """
    if not reactions:
        return
    powers = SpeedRows(rates, [rates.in_symbols(_power(source, r, rates)) for r in reactions])
    rows = SpeedRows(rates, [rates.in_symbols(e) for e in held])
    configuration = RateRows(rates, [rates.in_symbols(e) for e in source.configuration])
    for point in configuration.points():
        constrained = rows.at(point) if held else []
        for reaction, row in zip(reactions, powers.at(point), strict=True):
            if max(map(abs, row)) > _NOTHING and rank([*constrained, row]) > rank(constrained):
                raise MechanismError(
                    f"reactions: {printed_name(reaction.symbol)} acts on the motion and not on "
                    "auxiliary speeds alone; give it as an input or a parameter"
                )


def _power(source: Source, reaction: Reaction, rates: Rates) -> Expr:
    """The power per unit of the reaction, with auxiliary speeds zero."""
    speeds = ((velocity_of(place, source.frame), vector) for place, vector in reaction.per_unit)
    return Add(*(vector.dot(velocity).xreplace(rates.moving) for velocity, vector in speeds))
