"""Lookup tables in C and in tapes: their data, and each derivative that a program contains.

Input: expressions.  Output: C text, or numbers.  Invariant: ``runtime/simd/lookup.h`` evaluates
both, in lanes too, so that all have the same bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain
from textwrap import fill

from sympy import Expr

from mechc_codegen.description.tables import Lookup, TableData


def lookups(expressions: Iterable[Expr]) -> list[type[Lookup]]:
    """The functions of tables in expressions, sorted by name."""
    found = {type(each) for e in expressions for each in e.atoms(Lookup)}
    return sorted(found, key=lambda each: str(each.__name__))


def table_text(functions: Sequence[type[Lookup]]) -> str:
    """C data and functions, for one unit; an empty text without tables."""
    if not functions:
        return ""
    tables = {each.table.digest: each.table for each in functions}
    parts = [*map(_data, tables.values()), *map(_function, functions)]
    head = ["#ifndef MECHC_LOOKUP", "#define MECHC_LOOKUP", '#include "simd/lookup.h"']
    return "\n".join([*head, *parts, "#endif\n"])


def _data(table: TableData) -> str:
    name, axes = f"table_{table.digest}", list[str]()
    text = _array(f"{name}_c", table.coefficients)
    for axis, starts, period in zip("xy", table.starts, table.periods, strict=False):
        text += _array(f"{name}_{axis}", starts)
        axes.append(f"{{{name}_{axis}, {len(starts)}, {period or 0.0!r}}}")
    values = f"{len(axes)}, {table.degree}, {{{', '.join(axes)}}}, {name}_c"
    return f"{text}static const mechc_table {name} = {{{values}}};\n"


def _array(name: str, values: Sequence[float]) -> str:
    listed = fill(", ".join(map(repr, values)), 96, break_long_words=False)
    return f"static const double {name}[{len(values)}] = {{\n{listed}\n}};\n"


def _function(function: type[Lookup]) -> str:
    orders, arguments = (*function.orders, 0)[:2], ["x", "y"][: len(function.orders)]
    head = f"MECHC_ONCE double {function.__name__}({', '.join(f'double {x}' for x in arguments)})"
    given = [f"&table_{function.table.digest}", *map(str, orders), *arguments, "0.0"][:5]
    return f"{head}\n{{\n    return mechc_lookup({', '.join(given)});\n}}\n"


def table_rows(
    functions: Sequence[type[Lookup]],
) -> tuple[list[tuple[int, ...]], list[float]]:
    """The same as data for tapes: ``mechc_tape_table`` of each function, and the numbers."""
    rows, numbers, begin = list[tuple[int, ...]](), list[float](), dict[str, list[int]]()
    for each in functions:
        table = each.table
        if table.digest not in begin:
            begin[table.digest] = []
            lists = [
                [*starts, period or 0.0]
                for starts, period in zip(table.starts, table.periods, strict=True)
            ]
            for values in (*lists, table.coefficients):
                begin[table.digest].append(len(numbers))
                numbers += values
        *starts, coefficients = begin[table.digest]
        pieces = map(len, table.starts)
        pairs = chain.from_iterable((*two, 0)[:2] for two in (each.orders, pieces, starts))
        rows.append((len(starts), table.degree, *pairs, coefficients))
    return rows, numbers
