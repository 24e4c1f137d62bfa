"""Functions of time, their rates and inputs -> the symbols that equations are derived in."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import replace

from sympy import Derivative, Expr, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols

from mechc_codegen.derive.equations import Output, Symbols
from mechc_codegen.description.mechanism import Mechanism, printed_name
from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.description.terms import Multiplier, bottom_up
from mechc_codegen.errors import MechanismError

MOST_RATES = 5  # derivatives of an input given at run time: what a quintic spline can give


def state_symbols(mechanism: Mechanism) -> Symbols:
    def make_symbols(prefix: str, count: int) -> tuple[Symbol, ...]:
        return tuple(Symbol(f"{prefix}{k}", real=True) for k in range(count))

    return Symbols(
        Symbol("t", real=True),
        make_symbols("q", len(mechanism.coordinates) + len(mechanism.states)),
        make_symbols("u", len(mechanism.speeds)),
        make_symbols("p", len(mechanism.parameters)),
        make_symbols("a", len(mechanism.speeds)),
        make_symbols("l", len(mechanism.rows)),
        tuple(make_symbols(f"r{k}_", MOST_RATES + 1) for k in range(len(mechanism.open_inputs))),
    )


class StateSymbols:
    """Functions of time, rates and parameters -> symbols; fixed parameters -> numbers."""

    def __init__(self, mechanism: Mechanism, symbols: Symbols, request: OutputRequest) -> None:
        named = [
            *mechanism.q,
            *mechanism.x,
            *mechanism.u,
            *(p.symbol for p in mechanism.parameters),
        ]
        plain = [*symbols.q, *symbols.u, *symbols.parameters]
        self.symbols = dict(zip(named, plain, strict=True)) | {dynamicsymbols._t: symbols.time}
        self.symbols |= request.fixed
        self.motion = _solved_motion(mechanism, symbols)
        for function, chain in zip(mechanism.open_inputs, symbols.inputs, strict=True):
            self.symbols |= {_rate(function, n): value for n, value in enumerate(chain)}
        self.inputs = {f: e for f, e in mechanism.inputs.items() if e is not None}
        self.open = frozenset(mechanism.open_inputs)
        self.rates, self.second_rates = mechanism.rates, mechanism.second_rates

    def output(self, output: Output) -> Output:
        elements = tuple(self.expression(sympify(e)) for e in output.elements)
        return Output(output.name, output.equation, elements, output.shape, output.labels)

    def expression(self, value: Expr) -> Expr:
        if self.inputs:
            specified = specified_values(value, self.inputs, self.open)
            value = value.xreplace(specified).xreplace(self.rates)
        _refuse_functions(value, self.symbols)
        return value.xreplace(self.symbols)

    def motion_output(self, output: Output) -> Output:
        """The output over symbols, where it may contain accelerations and multipliers."""
        elements = (sympify(e).xreplace(self.second_rates) for e in output.elements)
        of_speeds = (e.xreplace(self.rates).xreplace(self.motion) for e in elements)
        return self.output(replace(output, elements=tuple(of_speeds)))

    def defaults(self, mechanism: Mechanism) -> tuple[Expr | None, ...]:
        """The default of each parameter."""
        given = (None if p.default is None else sympify(p.default) for p in mechanism.parameters)
        return tuple(
            None if value is None else bottom_up(value.xreplace(self.symbols), without_corners, {})
            for value in given
        )


def _solved_motion(mechanism: Mechanism, symbols: Symbols) -> dict[Expr, Expr]:
    """A dict from accelerations and multipliers (by name and by number) to symbols."""
    time = dynamicsymbols._t
    rates = (u.diff(time) for u in mechanism.u)
    found: dict[Expr, Expr] = dict(zip(rates, symbols.accelerations, strict=True))
    for k, (name, symbol) in enumerate(zip(mechanism.rows, symbols.multipliers, strict=True)):
        found |= {Multiplier(k): symbol, Multiplier(Symbol(name)): symbol}
    return found


def _rate(function: AppliedUndef, order: int) -> Expr:
    return function.diff((dynamicsymbols._t, order)) if order else function


def specified_values(
    value: Expr, inputs: Mapping[AppliedUndef, Expr], open_inputs: Set[AppliedUndef] = frozenset()
) -> dict[Expr, Expr]:
    """The expressions of specified functions and of their derivatives in ``value``.

    Raises
    ------
    MechanismError
        For the derivative of a function given by more than time: it would depend on accelerations,
        which are not known yet.
    """
    values: dict[Expr, Expr] = dict(inputs)
    for derivative in value.atoms(Derivative):
        function = derivative.expr
        if function not in inputs:
            continue
        if dynamicsymbols._t not in derivative.variables:  # a function of a coordinate, by it
            values[derivative] = inputs[function].diff(*derivative.variables)
            continue
        if inputs[function].atoms(AppliedUndef) - open_inputs:
            raise MechanismError(
                f"the rate of {printed_name(function)} is needed, so {printed_name(function)} "
                "must be given as an expression of time and parameters only, not of "
                f"{', '.join(sorted(map(printed_name, inputs[function].atoms(AppliedUndef))))}"
            )
        values[derivative] = inputs[function].diff(*derivative.variables)
    return values


def _refuse_functions(value: Expr, known: Mapping[Expr, Expr]) -> None:
    if value.atoms(Derivative, AppliedUndef) <= known.keys():
        return
    outside = value.xreplace({x: known[x] for x in value.atoms(Derivative) if x in known})
    left = outside.atoms(Derivative) or outside.atoms(AppliedUndef) - known.keys()
    if not left:
        return
    what = min(left, key=str)
    function = what.expr if isinstance(what, Derivative) else what
    name = printed_name(function)
    if function in known:
        raise MechanismError(
            f"the rate of {name} is not allowed in "
            f"{str(value)[:80]!r}: loads and constraints may contain coordinates and speeds only"
        )
    raise MechanismError(
        f"{name} depends on time but is neither a coordinate nor a speed, in "
        f"{str(value)[:80]!r}; give it with inputs={{{name!r}: expression}}"
    )
