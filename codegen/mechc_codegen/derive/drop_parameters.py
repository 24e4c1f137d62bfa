"""Equations -> Equations whose parameters are those that a run takes."""

from __future__ import annotations

from dataclasses import replace

from sympy import Expr, Symbol

from mechc_codegen.derive.equations import Equations
from mechc_codegen.description.mechanism import Mechanism, Parameter
from mechc_codegen.description.request import OutputRequest


def drop_parameters(
    mechanism: Mechanism, equations: Equations, request: OutputRequest
) -> tuple[tuple[Parameter, ...], Equations]:
    """Remove fixed parameters, and unused parameters that have no default."""
    symbols, used = equations.symbols.parameters, _used(equations)
    kept = [
        i
        for i, parameter in enumerate(mechanism.parameters)
        if parameter.symbol not in request.fixed
        and (parameter.default is not None or parameter.preset or symbols[i] in used)
    ]
    left = replace(
        equations,
        symbols=replace(equations.symbols, parameters=tuple(symbols[i] for i in kept)),
        parameter_defaults=tuple(equations.parameter_defaults[i] for i in kept),
    )
    return tuple(mechanism.parameters[i] for i in kept), left


def _used(equations: Equations) -> set[Symbol]:
    values: list[Expr] = [e for o in equations.outputs.values() for e in o.elements]
    values += [value for _, value in equations.intermediates]
    values += [e for e in equations.parameter_defaults if e is not None]
    return {symbol for value in values for symbol in value.free_symbols}
