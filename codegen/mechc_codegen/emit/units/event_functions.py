"""Events and laws of contacts as expressions -> the statements of their functions.

Input: expressions over the symbols t, y0, y1, ..., p0, p1, ...  Output: C, for tapes and for
exports: ``runtime/hybrid/events/functions.h``.  Invariant: only names of ours become code.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from sympy import Add, Expr, Symbol, cse, diff, numbered_symbols

from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.tables import Lookup
from mechc_codegen.description.terms import bottom_up
from mechc_codegen.emit.expressions import Line, Value, let, named, put, texts
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups
from mechc_codegen.errors import InternalError

_OURS = re.compile(r"t|[yp][0-9]+")
_ARGUMENTS = "void *context, double t, const double *y, const double *p"
MOST_TERMS = 64  # of a sum in one statement
KINDS = ("value", "slopes", "reset")  # in the order of mechc_event_functions
_HEADS = {
    "value": ("double", "", ()),
    "slopes": ("void", ", double *out", ()),
    "reset": ("int", ", double *out", ("return 1;",)),
    "contacts": ("int", ", double *out", ("return 1;",)),
}


@dataclass(frozen=True)
class EventExpressions:
    """An event, zero where ``value`` is, and what its reset assigns.

    Attributes
    ----------
    value
        None for an event that has no function in C.
    reset
        Place among the components of the state, and then the parameters -> its value after the
        event, all others stay; None without a reset.
    """

    value: Expr | None
    reset: Mapping[int, Expr] | None = None


@dataclass(frozen=True)
class EventFunction:
    """A function of time, state and parameters: what it is of, its statements, and their tables.

    ``kind``: ``value``, ``slopes``, ``reset``, or ``contacts`` for the quantities of all contacts.
    """

    kind: str
    event: int
    lines: Sequence[Line]
    tables: Sequence[type[Lookup]]


def functions_of(
    events: Sequence[EventExpressions], contacts: Sequence[Expr], width: int
) -> Iterator[EventFunction]:
    """The functions of events, and of contacts if there are any.

    ``contacts``: the quantities of all, row after row.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    """
    for number, event in enumerate(events):
        if event.value is not None:
            (value,), lines = _statements([event.value])
            lines.append(Line((f"return {value};",), (), value.reads))
            yield EventFunction("value", number, lines, lookups([event.value]))
            slopes = dict(enumerate(_slopes_of(event.value, width)))
            yield EventFunction("slopes", number, *_assigning(slopes))
        if event.reset is not None:  # it reads the state and parameters before the event
            yield EventFunction("reset", number, *_assigning(event.reset))
    if contacts:
        yield EventFunction("contacts", 0, *_assigning(dict(enumerate(contacts))))


def event_functions(
    events: Sequence[EventExpressions], contacts: Sequence[Expr], width: int
) -> str:
    """The C of the functions: the array ``mechc_functions``, and any ``mechc_contact_quantities``.

    Raises
    ------
    MechanismError
        As :func:`functions_of`.
    """
    text, names = list[str](), {number: ["NULL"] * 4 for number in range(len(events))}
    for each in functions_of(events, contacts, width):
        name = f"mechc_{each.kind}_{each.event}"
        if each.kind == "contacts":
            name = "mechc_contact_quantities"
        else:
            names[each.event][KINDS.index(each.kind)] = name
        text.append(_function(each, name))
    rows = [f"    {{{', '.join(row)}}}," for row in names.values()]
    array = ["static const mechc_event_functions mechc_functions[] = {", *rows, "};"]
    return "\n\n".join([*text, "\n".join(array)])


def _slopes_of(value: Expr, width: int) -> list[Expr]:
    by = [Symbol("t", real=True), *(Symbol(f"y{k}", real=True) for k in range(width))]
    return [diff(value, x) for x in by]


def _assigning(values: Mapping[int, Expr]) -> tuple[list[Line], list[type[Lookup]]]:
    """Statements that assign the values to places of ``out``, and their tables."""
    results, lines = _statements(list(values.values()))
    lines += [put(named("out")[k], x) for k, x in zip(values, results, strict=True)]
    return lines, lookups(values.values())


def _function(function: EventFunction, name: str) -> str:
    result, more, end = _HEADS[function.kind]
    unused = "(void)context, (void)t, (void)y, (void)p;"
    body = "\n".join(f"    {line}" for line in [unused, *texts(function.lines), *end])
    return f"static {result} {name}({_ARGUMENTS}{more})\n{{\n{body}\n}}"


def _statements(values: Sequence[Expr]) -> tuple[list[Value], list[Line]]:
    """The C of each value, and the statements before them."""
    plain = [bottom_up(value, without_corners, {}) for value in values]
    shared, results = cse(plain, numbered_symbols("x", real=True))
    printer = RealPrinter(tables=True)
    symbols = sorted({s for value in plain for s in value.free_symbols}, key=str)
    lines, sums = list(_loads(symbols)), numbered_symbols("s", real=True)

    def short(value: Expr) -> Expr:
        """The expression with sums of many terms in parts: no compiler nests them without end."""
        terms = value.args
        while value.is_Add and len(terms) > MOST_TERMS:
            own = [terms[k : k + MOST_TERMS] for k in range(0, len(terms), MOST_TERMS)]
            terms = [next(sums) for _ in own]
            for part, some in zip(terms, own, strict=True):
                lines.append(let(part.name, printer.real(Add(*some)), "const real"))
        return value if terms is value.args else Add(*terms)

    for symbol, value in shared:
        lines.append(let(symbol.name, printer.real(bottom_up(value, short, {})), "const real"))
    return [printer.real(bottom_up(value, short, {})) for value in results], lines


def _loads(symbols: Sequence[Symbol]) -> Iterator[Line]:
    for symbol in symbols:
        name = str(symbol)
        if not _OURS.fullmatch(name):
            raise InternalError(f"{name!r} is no name of ours")
        if name != "t":
            yield let(name, named(name[0])[int(name[1:])], "const real")
