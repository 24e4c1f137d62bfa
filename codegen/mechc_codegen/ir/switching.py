"""After stage 4: Program -> Program with the switching functions of the equations.

Input: an optimised program.  Output: the same with one more output.  The functions at whose
zeros an equation has a corner or a jump: the arguments of Abs and Step, sin(pi x) for Floor(x), y
for the cut of atan2(y, x), poles in atan and tanh, and what changes its sign where a root or the
argument of asin and acos touches the end of its range.  After these the arguments of tables
(knots.py), with their knots instead of zero, and the edges of narrow features (features.py).
Invariant: the program is as before where there is none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from sympy import (
    Abs,
    Add,
    Expr,
    Function,
    Mul,
    Pow,
    S,
    acos,
    asin,
    atan,
    atan2,
    cos,
    exp,
    factor_terms,
    fraction,
    pi,
    sin,
    tanh,
    together,
)

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.piecewise import Floor, Step
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.definitions import Definitions
from mechc_codegen.ir.factors import as_product
from mechc_codegen.ir.features import edges
from mechc_codegen.ir.knots import table_knots
from mechc_codegen.ir.operations import count_operations
from mechc_codegen.ir.program import FEATURE, SWITCHING, Program, equation_values

_TO_FACTOR = 30  # operations: of longer sums factors are not looked for, which takes long


def add_switching(program: Program, request: OutputRequest) -> Program:
    """Add the output of the switching functions; user-defined outputs are not looked at."""
    values = list(equation_values(program, request.expressions))
    jumps, features = switching_functions(program, values), feature_edges(program, values)
    knots = tuple(table_knots(values, Definitions.of(program)))
    elements = (*jumps, *(each.argument for each in knots), *features)
    if not elements:
        return program
    labels = [f"switch {i}" for i in range(len(jumps))]
    labels += [f"argument of a table {i}" for i in range(len(knots))]
    labels += [f"{FEATURE} {i}" for i in range(len(features))]
    equation = "functions at whose zeros the equations change their form"
    output = Output(SWITCHING, equation, elements, (len(labels),), tuple(labels))
    return replace(program, outputs=(*program.outputs, output), knots=knots).verify()


def switching_functions(program: Program, values: Iterable[Expr]) -> tuple[Expr, ...]:
    """The switching functions of expressions, each with one sign; none of parameters alone."""
    definitions = Definitions.of(program)
    return definitions.varying(
        function
        for value in values
        for part in sorted(value.atoms(Function, Pow), key=str)
        for function in _vanishing(part, definitions)
    )


def feature_edges(program: Program, values: Iterable[Expr]) -> tuple[Expr, ...]:
    """The edges of the narrow features of expressions."""
    definitions = Definitions.of(program)
    return definitions.varying(
        edge
        for value in values
        for part in sorted(value.atoms(Function, Pow), key=str)
        for edge in edges(part, definitions)
    )


def _vanishing(part: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Expressions that vanish where one function or power has a corner or a jump."""
    if isinstance(part, Pow):
        if part.exp.is_integer is not True and part.base is not S.Exp1:
            yield from _touching(part.base, definitions)
            yield from definitions.divisors(part.base)  # 1/sqrt(1 + 1/x^2) is |x|/sqrt(1 + x^2)
    elif isinstance(part, (Abs, Step, atan2)):
        yield from _without_poles(part.args[0], definitions)
    elif isinstance(part, Floor):
        yield sin(pi * part.args[0])
        yield from definitions.divisors(part.args[0])
    elif isinstance(part, (atan, tanh)):
        yield from definitions.divisors(part.args[0])
        if definitions.exponentials(part.args[0]):  # a jump where these are large
            factors = map(definitions.look_up, Mul.make_args(definitions.look_up(part.args[0])))
            yield Mul(*(x for x in factors if not isinstance(x, exp)))
    elif isinstance(part, (asin, acos)):
        yield from _turning(part.args[0], definitions)


def _without_poles(e: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Expressions without the poles of one, at which its sign changes too: its numerator, and what
    it is divided by."""
    divisors = [x for x in definitions.divisors(e) if not definitions.is_fixed(x)]
    yield fraction(together(definitions.with_definitions(e)))[0] if divisors else e
    yield from divisors


def _touching(e: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Sign changes where an expression touches zero: the bases of its even powers."""
    e = factor_terms(definitions.with_definitions(e))
    if isinstance(e, Add):
        found = list(_half_angle(e, definitions))
        yield from found
        if found or count_operations(e) > _TO_FACTOR:
            return
        e = as_product(e)  # (u - 0.3)^2 written out
        if isinstance(e, Add):
            return
    for part in Mul.make_args(e):
        base, exponent = part.as_base_exp()
        if exponent.is_even:
            yield base
        elif part != e:
            yield from _touching(base, definitions)


def _half_angle(e: Add, definitions: Definitions) -> Iterator[Expr]:
    """Sign changes where 1 - cos(x), 1 + cos(x) or 1 - cos(x)^2 touch zero, or such a sum of
    sines."""
    number, rest = e.as_coeff_Add()
    size, wave = rest.as_coeff_Mul()
    base, exponent = wave.as_base_exp()
    wave = definitions.look_up(base)
    if exponent == 2 and number == -size and isinstance(wave, (cos, sin)):
        yield (sin if isinstance(wave, cos) else cos)(wave.args[0])
    elif exponent != 1:
        return
    elif isinstance(wave, (cos, sin)) and abs(number) == abs(size):
        angle = wave.args[0] - (pi / 2 if isinstance(wave, sin) else 0)
        yield sin(angle / 2) if number == -size else cos(angle / 2)


def _turning(e: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Sign changes where the argument of asin or acos touches 1 or -1: its derivative."""
    waves = [x for x in Mul.make_args(definitions.look_up(e)) if not definitions.is_fixed(x)]
    wave = definitions.look_up(waves[0]) if len(waves) == 1 else None
    if isinstance(wave, sin):
        yield cos(wave.args[0])
    elif isinstance(wave, cos):
        yield sin(wave.args[0])
    else:
        rate = definitions.rate(e)
        if rate is not None:
            yield rate
            return
        for side in (1 - e, 1 + e):
            yield from _touching(
                fraction(together(definitions.with_definitions(side)))[0], definitions
            )
