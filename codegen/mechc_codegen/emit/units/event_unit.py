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
    every = [*(x for event in events for x in _expressions(event, width)), *contacts]
    samples = table_text(lookups(every))
    functions, table = _functions_and_table(events, width)
    if contacts:
        functions.append(_contacts(contacts))
    array = "\n".join(["static const mechc_event_functions mechc_functions[] = {", *table, "};"])
    return "\n\n".join([*([samples] if samples else []), *functions, array])


def _functions_and_table(
    events: Sequence[EventExpressions], width: int
) -> tuple[list[str], list[str]]:
    functions, table = [], []
    for number, event in enumerate(events):
        names = ["NULL"] * 4
        if event.value is not None:
            names[:2] = f"mechc_value_{number}", f"mechc_slopes_{number}"
            functions += [_value(names[0], event.value), _slopes(names[1], event.value, width)]
        if event.reset is not None:
            names[2] = f"mechc_reset_{number}"
            functions.append(_reset(names[2], event.reset))
        table.append(f"    {{{', '.join(names)}}},")
    return functions, table


def _expressions(event: EventExpressions, width: int) -> Iterator[Expr]:
    if event.value is not None:
        yield event.value
        yield from _slopes_of(event.value, width)
    yield from (event.reset or {}).values()


def _value(name: str, value: Expr) -> str:
    (result,), lines = _statements([value])
    return _function(f"static double {name}({_ARGUMENTS})", [*lines, f"return {result};"])


def _slopes_of(value: Expr, width: int) -> list[Expr]:
    by = [Symbol("t", real=True), *(Symbol(f"y{k}", real=True) for k in range(width))]
    return [diff(value, x) for x in by]


def _slopes(name: str, value: Expr, width: int) -> str:
    results, lines = _statements(_slopes_of(value, width))
    lines += [f"slopes[{k}] = {result};" for k, result in enumerate(results)]
    return _function(f"static void {name}({_ARGUMENTS}, double *slopes)", lines)


def _reset(name: str, reset: Mapping[int, Expr]) -> str:
    """Lines of one reset; it reads components of the state and parameters before the event."""
    results, lines = _statements(list(reset.values()))
    lines += [f"after[{k}] = {result};" for k, result in zip(reset, results, strict=True)]
    return _function(f"static int {name}({_ARGUMENTS}, double *after)", [*lines, "return 1;"])


def _contacts(quantities: Sequence[Expr]) -> str:
    results, lines = _statements(quantities)
    lines += [f"table[{k}] = {result};" for k, result in enumerate(results)]
    head = f"static int mechc_contact_quantities({_ARGUMENTS}, double *table)"
    return _function(head, [*lines, "return 1;"])


def _function(head: str, lines: Sequence[str]) -> str:
    unused = "(void)context, (void)t, (void)y, (void)p;"
    body = "\n".join(f"    {line}" for line in [unused, *lines])
    return f"{head}\n{{\n{body}\n}}"


def _statements(values: Sequence[Expr]) -> tuple[list[str], list[str]]:
    """The C text of each value, and the statements before them."""
    plain = [bottom_up(value, without_corners, {}) for value in values]
    shared, results = cse(plain, numbered_symbols("x", real=True))
    printer = RealPrinter(tables=True)
    symbols = sorted({s for value in plain for s in value.free_symbols}, key=str)
    lines = list(_loads(symbols))
    lines += [f"const double {name} = {printer.real(value)};" for name, value in shared]
    return [printer.real(value) for value in results], lines


def _loads(symbols: Sequence[Symbol]) -> Iterator[str]:
    for symbol in symbols:
        name = str(symbol)
        if not _OURS.fullmatch(name):
            raise InternalError(f"{name!r} is no name of ours")
        if name != "t":
            yield f"const double {name} = {name[0]}[{name[1:]}];"
