"""Options of ``mechc.compile`` for a mechanism, which has them in its description too.

Input: a Mechanism and the user's options.  Output: the mechanism with its name, defaults, inputs,
states and units as they are given; those that change what it is are refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from sympy import Expr, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols

from mechc_codegen.convert.convert import find_symbol, functions_in, start_of
from mechc_codegen.description.mechanism import Mechanism, Parameter, State
from mechc_codegen.description.quantity import Quantity, in_si
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.description.terms import as_expression, printed_name
from mechc_codegen.errors import MechanismError

TAKEN = ("name", "defaults", "inputs", "parameters", "states", "units")


def with_settings(mechanism: Mechanism, settings: ConversionSettings) -> Mechanism:
    """The mechanism with the options that are given.

    Symbols in the expressions of inputs and in rates of states that it does not have become
    parameters, functions of time in them inputs, and inputs with a rate states.

    Raises
    ------
    MechanismError
        For an option that it has in its description alone, and a name that it does not have.
    """
    usual = ConversionSettings()
    given = [
        f.name for f in fields(settings) if getattr(settings, f.name) != getattr(usual, f.name)
    ]
    other = next((name for name in given if name not in TAKEN), None)
    if other is not None:
        raise MechanismError(
            f"{other} is an option for SymPy objects; a Mechanism has it in its description"
        )
    if not given:
        return mechanism
    states, inputs = _states_and_inputs(mechanism, settings)
    for key, value in settings.inputs.items():
        inputs[find_symbol(key, list(inputs), "inputs", "specified function of time")] = value
    named = [Symbol(each) if isinstance(each, str) else each for each in settings.parameters]
    known = {p.symbol for p in mechanism.parameters}
    rates = (state.rate for state in states)
    new = [s for s in (*named, *_constants((*inputs.values(), *rates))) if s not in known]
    parameters = [
        *mechanism.parameters,
        *(Parameter(s, None, Quantity("", ""), preset=s in named) for s in dict.fromkeys(new)),
    ]
    name = settings.name or mechanism.name
    kinds = mechanism.coordinates, mechanism.speeds, states, parameters
    symbols: list[Any] = [*(each.symbol for kind in kinds for each in kind), *inputs]
    units = {find_symbol(k, symbols, "units", "symbol"): u for k, u in settings.units.items()}
    coordinates, speeds, states, parameters = ([_with_unit(x, units) for x in k] for k in kinds)
    started = {key for each in states for key in (each.symbol, printed_name(each.symbol))}
    starts = {k: x for k, x in settings.defaults.items() if k in started}
    defaults = {k: x for k, x in settings.defaults.items() if k not in starts}
    return replace(
        mechanism,
        coordinates=tuple(coordinates),
        speeds=tuple(speeds),
        states=tuple(_with_start(state, starts) for state in states),
        input_units={**mechanism.input_units, **{f: units[f] for f in inputs if f in units}},
        name=name,
        title=mechanism.title if name == mechanism.name else name,
        inputs=inputs,
        parameters=tuple(_with_defaults(parameters, defaults)),
    )


def _states_and_inputs(
    mechanism: Mechanism, settings: ConversionSettings
) -> tuple[list[State], dict[Any, Expr | None]]:
    """The states, with those that are given, and the other functions of time."""
    found = {state.symbol: state for state in mechanism.states}
    expressions = (*settings.states.values(), *settings.inputs.values())
    given = [key for key in settings.states if isinstance(key, AppliedUndef)]
    functions = dict.fromkeys((*mechanism.inputs, *found, *given, *functions_in(expressions)))
    for key, rate in settings.states.items():
        x = find_symbol(key, list(functions), "states", "function of time")
        found[x] = replace(found.get(x, State(x, rate, Quantity("", ""))), rate=rate)
    own = {*mechanism.q, *mechanism.u, *mechanism.auxiliary, *found}
    return list(found.values()), {f: mechanism.inputs.get(f) for f in functions if f not in own}


def _with_start(state: State, starts: Mapping[Any, Any]) -> State:
    for key in (state.symbol, printed_name(state.symbol)):
        if key in starts:
            return replace(state, start=start_of(state.symbol, starts[key], state.quantity))
    return state


def _with_unit(described: Any, units: Mapping[Any, str]) -> Any:
    """A coordinate, speed, state or parameter, with the unit that is given for it."""
    unit = units.get(described.symbol)
    if unit is None:
        return described
    return replace(described, quantity=described.quantity.with_unit(unit))


def _constants(expressions: Iterable[Expr | None]) -> list[Symbol]:
    """The symbols in expressions, by name."""
    found = {s for e in expressions if e is not None for s in sympify(e).free_symbols}
    return sorted(found - {dynamicsymbols._t}, key=str)


def _with_defaults(
    parameters: Sequence[Parameter], defaults: Mapping[Any, Any]
) -> Iterable[Parameter]:
    quantities = {p.symbol: p.quantity for p in parameters}
    values = dict[Any, Expr]()
    for key, value in defaults.items():
        symbol, place = find_symbol(key, [*quantities], "defaults", "parameter"), f"defaults: {key}"
        values[symbol] = as_expression(in_si(value, place, quantities[symbol]), place)
    return (replace(p, default=values.get(p.symbol, p.default)) for p in parameters)
