"""Stage 1: Mechanism -> Equations, by the form of Kane's method that is faster for it, with the
parameters that a run takes."""

from __future__ import annotations

from dataclasses import replace

from sympy import Expr, Symbol

from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.mechanism import Mechanism, Parameter
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest

LEAST_TREE = 7  # fewer speeds: straight-line code for M and F is faster (docs/growth.md)
LEAST_WRITTEN = 5  # speeds, and links in a row: fewer have fewer operations by partial velocities


def derive_equations(mechanism: Mechanism, request: OutputRequest = DEFAULT_REQUEST) -> Equations:
    """Derive link by link where there are many links and the description allows it.

    Fewer in a row, in space, are derived link by link too, and M and F then written out, unless
    speeds are constrained there.
    """
    speeds = len(mechanism.speeds)
    if speeds >= LEAST_WRITTEN:
        written = speeds < LEAST_TREE
        try:
            return derive_tree(mechanism, request, written=written, in_a_row=LEAST_WRITTEN)
        except NotATreeError:
            pass
    return derive(mechanism, request)


def drop_parameters(
    mechanism: Mechanism, equations: Equations, request: OutputRequest
) -> tuple[tuple[Parameter, ...], Equations]:
    """Remove fixed parameters, and unused parameters that have no default of their own."""
    symbols, (statements, used) = equations.symbols.parameters, _live_values(equations)
    kept = [
        i
        for i, parameter in enumerate(mechanism.parameters)
        if parameter.symbol not in request.fixed
        and (_has_own_default(parameter) or symbols[i] in used)
    ]
    left = replace(
        equations,
        intermediates=statements,
        symbols=replace(equations.symbols, parameters=tuple(symbols[i] for i in kept)),
        parameter_defaults=tuple(equations.parameter_defaults[i] for i in kept),
    )
    return tuple(mechanism.parameters[i] for i in kept), left


def _has_own_default(parameter: Parameter) -> bool:
    return parameter.preset or (parameter.default is not None and not parameter.given)


def _live_values(equations: Equations) -> tuple[tuple[tuple[Symbol, Expr], ...], set[Symbol]]:
    """The intermediate values that outputs and defaults need, and all symbols in these."""
    values: list[Expr] = [e for o in equations.outputs.values() for e in o.elements]
    values += [e for e in equations.parameter_defaults if e is not None]
    used = {symbol for value in values for symbol in value.free_symbols}
    statements = []
    for symbol, value in reversed(equations.intermediates):
        if symbol in used:
            statements.append((symbol, value))
            used |= value.free_symbols
    return tuple(reversed(statements)), used
