"""Events and laws of contacts as expressions -> one C unit with their functions.

Input: expressions over the symbols t, y0, y1, ..., p0, p1, ...  Output: the text of a unit that
offers ``mechc_events`` (``runtime/hybrid/events/functions.h``).  Invariant: only names of ours
become code.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template

from sympy import Expr, Symbol, cse, diff, numbered_symbols

from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.terms import bottom_up
from mechc_codegen.emit.expressions import Line, Value, let, named, put, texts
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups, table_text
from mechc_codegen.errors import InternalError

_OURS = re.compile(r"t|[yp][0-9]+")
_ARGUMENTS = "void *context, double t, const double *y, const double *p"


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


def event_unit(
    events: Sequence[EventExpressions], contacts: Sequence[Expr], width: int, parameters: int
) -> str:
    """The C text for states of ``width`` components and so many parameters.

    ``contacts``: the quantities of all contacts, row after row; () without any.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    """
    text = files("mechc_codegen.emit").joinpath("templates", "events.c.in").read_text("utf-8")
    return Template(text).substitute(
        functions=event_functions(events, contacts, width), width=width, parameters=parameters,
        count=len(events), contacts="mechc_contact_quantities" if contacts else "NULL",
    )  # fmt: skip


def event_functions(
    events: Sequence[EventExpressions], contacts: Sequence[Expr], width: int
) -> str:
    """The C of the functions: the array ``mechc_functions``, and any ``mechc_contact_quantities``.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    """
    functions, table, every = list[str](), list[str](), [*contacts]
    for number, event in enumerate(events):
        names = ["NULL"] * 4
        if event.value is not None:
            names[:2] = f"mechc_value_{number}", f"mechc_slopes_{number}"
            (value,), lines = _statements([event.value])
            head = f"static double {names[0]}({_ARGUMENTS})"
            functions.append(_function(head, [*texts(lines), f"return {value};"]))
            slopes = _slopes_of(event.value, width)
            functions.append(_assigning("void", names[1], "slopes", dict(enumerate(slopes))))
            every += [event.value, *slopes]
        if event.reset is not None:  # it reads the state and parameters before the event
            names[2] = f"mechc_reset_{number}"
            functions.append(_assigning("int", names[2], "after", event.reset, "return 1;"))
            every += event.reset.values()
        table.append(f"    {{{', '.join(names)}}},")
    if contacts:
        quantities = dict(enumerate(contacts))
        name = "mechc_contact_quantities"
        functions.append(_assigning("int", name, "table", quantities, "return 1;"))
    samples = table_text(lookups(every))
    array = "\n".join(["static const mechc_event_functions mechc_functions[] = {", *table, "};"])
    return "\n\n".join([*([samples] if samples else []), *functions, array])


def _slopes_of(value: Expr, width: int) -> list[Expr]:
    by = [Symbol("t", real=True), *(Symbol(f"y{k}", real=True) for k in range(width))]
    return [diff(value, x) for x in by]


def _assigning(kind: str, name: str, array: str, values: Mapping[int, Expr], *end: str) -> str:
    """A function of this type that assigns the values to places of an array."""
    results, lines = _statements(list(values.values()))
    lines += [put(named(array)[k], result) for k, result in zip(values, results, strict=True)]
    return _function(f"static {kind} {name}({_ARGUMENTS}, double *{array})", [*texts(lines), *end])


def _function(head: str, lines: Sequence[str]) -> str:
    unused = "(void)context, (void)t, (void)y, (void)p;"
    body = "\n".join(f"    {line}" for line in [unused, *lines])
    return f"{head}\n{{\n{body}\n}}"


def _statements(values: Sequence[Expr]) -> tuple[list[Value], list[Line]]:
    """The C of each value, and the statements before them."""
    plain = [bottom_up(value, without_corners, {}) for value in values]
    shared, results = cse(plain, numbered_symbols("x", real=True))
    printer = RealPrinter(tables=True)
    symbols = sorted({s for value in plain for s in value.free_symbols}, key=str)
    lines = list(_loads(symbols))
    lines += [let(symbol.name, printer.real(value), "const double") for symbol, value in shared]
    return [printer.real(value) for value in results], lines


def _loads(symbols: Sequence[Symbol]) -> Iterator[Line]:
    for symbol in symbols:
        name = str(symbol)
        if not _OURS.fullmatch(name):
            raise InternalError(f"{name!r} is no name of ours")
        if name != "t":
            yield let(name, named(name[0])[int(name[1:])], "const double")
