"""Program -> recurrences of the Taylor coefficients of a motion.

Input: an optimised program.  Output: its operations one by one, or None where one has no recurrence
here.  Invariant: at order k every recurrence is linear in the coefficients of that order, and what
is left of it are sums over products of lower ones, ``sum_j a_j b_(k-j)`` with 0 < j < k.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from mechc_codegen.derive.equations import Equations
from mechc_codegen.ir.momenta import fewest, in_momenta
from mechc_codegen.ir.program import (
    Operation,
    Program,
    Series,
    slice_statements,
    symbols_in,
    targets_of,
)
from mechc_codegen.ir.recurrences import NotAnalyticError, Recurrences

MOST_SUMMED = 128  # operations with sums over lower orders: rows of all lanes stay in the cache


def add_series(program: Program, equations: Equations) -> Program:
    """The program with the recurrences of its motion; unchanged where rows constrain it, M and F
    are not written out, inputs are given at run time, or an operation has no recurrence or too many
    sums."""
    if equations.holonomic + equations.nonholonomic or equations.tree or program.symbols.inputs:
        return program
    names = ["mass_matrix", "forcing"]
    names += [] if equations.identity_kinematics else ["coordinate_rates"]
    try:
        series = _read(program, names)
    except NotAnalyticError:
        return program
    if series.sums > MOST_SUMMED:
        return program
    return replace(program, series=fewest([series, *in_momenta(series, len(program.symbols.q))]))


def _read(program: Program, names: Sequence[str]) -> Series:
    symbols, elements = program.symbols, [program.output(name).elements for name in names]
    made = Recurrences({*symbols.parameters, *targets_of(program.hoisted)})
    for state in (*symbols.q, *symbols.u):
        made.known[state] = made.add("state", value=state)
    made.known[symbols.time] = made.add("time", value=symbols.time)
    made.read(slice_statements(program.body, symbols_in(chain.from_iterable(elements))))
    mass, forcing, *own = (tuple(made.of(e) for e in each) for each in elements)
    rates = own[0] if own else ()
    integrals = () if rates else made.integrals(len(symbols.q))
    return _with_quotients(Series(tuple(made.operations), mass, forcing, rates, integrals))


def _with_quotients(series: Series) -> Series:
    """The series with products by 1/b, used only once, as quotients: one sum less."""
    operations, needed = list(series.operations), series.needed_operations
    uses = Counter(series.ends) + Counter(a for n in needed for a in operations[n].args)
    for number in needed:
        each = operations[number]
        for a, q in (each.args, each.args[::-1]) if each.kind == "product" else ():
            inverse = operations[q]
            if inverse.kind == "quotient" and uses[q] == 1 and series.is_number(inverse.args[0], 1):
                operations[number] = Operation("quotient", (a, inverse.args[1]))
                break
    return replace(series, operations=tuple(operations))
