"""Lookup tables in C: their data, and a function for each derivative that a program contains.

Input: expressions.  Output: C text.  Invariant: lanes call the function that a single double does,
so both have the same bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from math import perm
from textwrap import fill

from sympy import Expr

from mechc_codegen.description.tables import Lookup, TableData
from mechc_codegen.emit.expressions import (
    Line,
    Value,
    call,
    let,
    named,
    number,
    put,
    stride,
    texts,
    total,
    without_unused,
)

_PIECE = """\
/* The last piece that begins at x or below; the first one for all that is below. */
MECHC_ONCE int mechc_piece_at(const double *starts, int count, double x)
{
    int low = 0, high = count;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (x >= starts[middle])
            low = middle;
        else
            high = middle;
    }
    return low;
}
"""


def lookups(expressions: Iterable[Expr]) -> list[type[Lookup]]:
    """The functions of tables in expressions, sorted by name."""
    found = {type(each) for e in expressions for each in e.atoms(Lookup)}
    return sorted(found, key=lambda each: str(each.__name__))


def table_text(functions: Sequence[type[Lookup]]) -> str:
    """C data and functions, for one unit; an empty text without tables."""
    if not functions:
        return ""
    tables = {each.table.digest: each.table for each in functions}
    parts = [_PIECE, *map(_data, tables.values()), *map(_function, functions)]
    return "\n".join(["#ifndef MECHC_LOOKUP", "#define MECHC_LOOKUP", *parts, "#endif\n"])


def _data(table: TableData) -> str:
    name = f"table_{table.digest}"
    rows = [(f"{name}_{axis}", starts) for axis, starts in zip("xy", table.starts, strict=False)]
    return "".join(_array(*row) for row in (*rows, (f"{name}_c", table.coefficients)))


def _array(name: str, values: Sequence[float]) -> str:
    listed = fill(", ".join(map(repr, values)), 96, break_long_words=False)
    return f"static const double {name}[{len(values)}] = {{\n{listed}\n}};\n"


def _function(function: type[Lookup]) -> str:
    table, name = function.table, f"table_{function.table.digest}"
    axes = "xy"[: len(table.starts)]
    lines = [line for k, axis in enumerate(axes) for line in _piece_lines(table, k, axis)]
    place = total([named(f"{name}_c"), *_strides(table, axes)])
    lines.append(let("c", place, "const double *const"))
    arguments = ", ".join(f"double {axis}" for axis in axes)
    value = _polynomial(table, function.orders, axes)
    lines = without_unused([*lines, Line((f"return {value};",), (), value.reads)])
    body = "\n".join(f"    {line}" for line in texts(lines))
    return f"MECHC_ONCE double {function.__name__}({arguments})\n{{\n{body}\n}}\n"


def _piece_lines(table: TableData, k: int, axis: str) -> Iterator[Line]:
    array, starts, period = named(f"table_{table.digest}_{axis}"), table.starts[k], table.periods[k]
    x, piece = named(axis), f"piece_{axis}"
    if period is not None:
        yield put(x, x - period * call("floor", (x - starts[0]) / period))
    found = call("mechc_piece_at", array, number(len(starts)), x)
    yield let(piece, found, "const int")
    yield let(f"h_{axis}", x - array[named(piece)], "const double")


def _strides(table: TableData, axes: str) -> Iterator[Value]:
    width = (table.degree + 1) ** len(axes)
    for k, axis in enumerate(axes):
        inner = 1
        for starts in table.starts[k + 1 :]:
            inner *= len(starts)
        yield stride(named(f"piece_{axis}"), width * inner)


def _polynomial(table: TableData, orders: Sequence[int], axes: str, first: int = 0) -> Value:
    """A polynomial, by Horner's rule in each argument."""
    if not axes:
        return named("c")[first]
    inner = (table.degree + 1) ** (len(axes) - 1)
    terms = list[Value]()
    for n in range(table.degree, orders[0] - 1, -1):
        factor = _polynomial(table, orders[1:], axes[1:], first + n * inner)
        weight = perm(n, orders[0])
        terms.append(factor if weight == 1 else float(weight) * factor)
    return reduce(lambda sum_, term: sum_ * named(f"h_{axes[0]}") + term, terms)
