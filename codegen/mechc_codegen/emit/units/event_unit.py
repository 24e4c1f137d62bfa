"""Events as expressions -> one C unit with their values, slopes and resets.

Input: expressions over the symbols t, y0, y1, ..., p0, p1, ...  Output: the text of a unit that
offers ``mechc_events`` (``runtime/events/functions.h``).  Invariant: only names of ours become
code.
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
_ARGUMENTS = "double t, const double *y, const double *p"


@dataclass(frozen=True)
class EventExpressions:
    """An event, zero where ``value`` is, and what its reset assigns.

    Attributes
    ----------
    reset
        Place in the state -> its value after the event, all others stay; None without a reset.
    restitution
        Of a stop, whose gap is the value; None for other events.
    poisson
        Whether a stop follows Poisson's law of restitution, not Newton's.
    """

    value: Expr
    reset: Mapping[int, Expr] | None = None
    restitution: Expr | None = None
    poisson: bool = False


def event_unit(events: Sequence[EventExpressions], width: int, parameters: int) -> str:
    """The C text for states of ``width`` components and so many parameters.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    """
    text = files("mechc_codegen.emit").joinpath("templates", "events.c.in").read_text("utf-8")
    return Template(text).substitute(
        functions=event_functions(events, width), width=width, parameters=parameters,
        count=len(events),
    )  # fmt: skip


def event_functions(events: Sequence[EventExpressions], width: int) -> str:
    """The C of the functions, and of the array ``mechc_functions`` of them.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    """
    samples = table_text(lookups(x for event in events for x in _expressions(event, width)))
    functions, table = _functions_and_table(events, width)
    array = "\n".join(["static const mechc_event_functions mechc_functions[] = {", *table, "};"])
    return "\n\n".join([*([samples] if samples else []), *functions, array])


def _functions_and_table(
    events: Sequence[EventExpressions], width: int
) -> tuple[list[str], list[str]]:
    functions, table = [], []
    for number, event in enumerate(events):
        names = [f"mechc_value_{number}", f"mechc_slopes_{number}"]
        functions += [_value(names[0], event.value), _slopes(names[1], event.value, width)]
        names += ["NULL", "NULL"]
        if event.reset is not None:
            names[2] = f"mechc_reset_{number}"
            functions.append(_reset(names[2], event.reset, width))
        if event.restitution is not None:
            names[3] = f"mechc_restitution_{number}"
            functions.append(_value(names[3], event.restitution))
        table.append(f"    {{{', '.join([*names, str(int(event.poisson))])}}},")
    return functions, table


def _expressions(event: EventExpressions, width: int) -> Iterator[Expr]:
    yield event.value
    yield from _slopes_of(event.value, width)
    yield from (event.reset or {}).values()
    if event.restitution is not None:
        yield event.restitution


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


def _reset(name: str, reset: Mapping[int, Expr], width: int) -> str:
    places = sorted(reset)
    results, lines = _statements([reset[k] for k in places])
    lines += [f"for (int i = 0; i < {width}; i++) after[i] = y[i];"]
    lines += [f"after[{k}] = {result};" for k, result in zip(places, results, strict=True)]
    return _function(f"static void {name}({_ARGUMENTS}, double *after)", lines)


def _function(head: str, lines: Sequence[str]) -> str:
    body = "\n".join(f"    {line}" for line in ["(void)t, (void)y, (void)p;", *lines])
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
