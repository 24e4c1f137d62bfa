"""A scene as a functional mock-up unit: the files of its archive but the compiled one.

Input: an optimised program, its metadata, start values.  Output: path -> content.  Invariant: the C
holds names of ours alone; those of users are text of the description, which is escaped.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from string import Template
from typing import Any

from sympy import diff

from mechc_codegen.derive.equations import Equations
from mechc_codegen.description.quantity import PURE, Kind
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.c import program_texts
from mechc_codegen.emit.definition import plain_words
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups
from mechc_codegen.emit.units.event_unit import EventExpressions, event_functions
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.amalgamate import included_headers
from mechc_codegen.export.description import Unit, build_description, model_description
from mechc_codegen.export.standalone import checked_name
from mechc_codegen.export.variables import Values, open_inputs, output_sizes, variables
from mechc_codegen.extension.flags import FLAGS, RUNTIME
from mechc_codegen.ir.program import Program

VERSIONS = ("3.0", "2.0")
SOURCE = "fmu.c"
METHODS, OUTPUTS = 15, 16  # parts of a unit: runtime/abi/parts.h
_METHODS = {"dopri5": 0, "dop853": 1, "radau5": 2, "gauss8": 3}


@dataclass(frozen=True)
class FmuOptions:
    """What an export is asked for.

    Attributes
    ----------
    name
        Begins names of files.
    version
        Of FMI, one of :data:`VERSIONS`.
    start
        State (nq + nu), SI units.
    values
        Parameters that were given, by name; the others have their defaults, and follow.
    end
        Of the default experiment, s.
    rtol, drift
        Of co-simulation; the least drift that model exchange projects away.
    tool
        Name and version of what exports.
    derivatives
        Whether the unit offers derivatives, which take most of the time of a large mechanism.
    events
        The events over the symbols t, y0, y1, ..., p0, p1, ... of a scene with this metadata.
    """

    name: str
    version: str
    start: Sequence[float]
    values: Mapping[str, float]
    end: float
    rtol: float
    drift: float
    tool: str
    derivatives: bool = True
    events: Callable[[Mapping[str, Any]], Sequence[FmuEvent]] = lambda metadata: ()


@dataclass(frozen=True)
class FmuEvent:
    """An event, what it is called, and the direction in which its zero is crossed; 0: both."""

    title: str
    direction: float
    expressions: EventExpressions


def fmu_request(request: OutputRequest, derivatives: bool) -> OutputRequest:
    """With the derivatives that a unit offers."""
    if not derivatives:
        return request
    return replace(request, outputs=request.outputs | {"sensitivities"})


def fmu_files(
    program: Program,
    equations: Equations,
    metadata: Mapping[str, Any],
    request: OutputRequest,
    options: FmuOptions,
) -> dict[str, bytes]:
    """Path in the archive -> content, without binaries.

    Raises
    ------
    CodegenError
        If the name is no identifier or there is no such version.
    """
    if options.version not in VERSIONS:
        raise CodegenError(
            f"FMI {plain_words(options.version)!r} is not known: {', '.join(VERSIONS)}"
        )
    name = checked_name(options.name)
    functions = SceneFunctions(program, equations, request)
    metadata = {**metadata, "differentiated": _outputs(program, request)}
    values, events = _values(functions, metadata, options), options.events(metadata)
    sources = _sources(functions, metadata, values, events, options)
    unit = Unit(
        name, metadata["title"] or metadata["name"], _token(sources, metadata), options.version,
        options.end, options.rtol, options.tool, options.derivatives, len(events),
    )  # fmt: skip
    sources[SOURCE] = sources[SOURCE].replace("@TOKEN@", unit.token)
    found = {f"sources/{path}": text.encode() for path, text in sources.items()}
    titles = [event.title for event in events]
    listed = variables(metadata, values, titles)
    found["modelDescription.xml"] = model_description(unit, listed, SOURCE)
    if options.version == "3.0":
        found["sources/buildDescription.xml"] = build_description(unit, SOURCE, FLAGS)
    return found


def _outputs(program: Program, request: OutputRequest) -> list[list[Any]]:
    """Name and size of outputs besides the user's own, differentiated or not."""
    values = program.named_values()
    return [[name, len(values[name])] for name in request.of_mechanism(values)]


def _token(sources: Mapping[str, str], metadata: Mapping[str, Any]) -> str:
    """A hash of all that the unit does, in the form that FMI asks for."""
    told = [*(f"{path}\n{text}" for path, text in sorted(sources.items())), repr(metadata)]
    digest = hashlib.sha256("\n".join(told).encode("utf-8", "surrogatepass")).hexdigest()
    parts = digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]
    return "{" + "-".join(parts) + "}"


def _values(functions: SceneFunctions, metadata: Mapping[str, Any], options: FmuOptions) -> Values:
    """Start values of every parameter; those that follow others are calculated."""
    names = [told["name"] for told in metadata["parameters"]]
    numbers, calculated = [math.nan] * len(names), [False] * len(names)
    symbols = functions.program.symbols.parameters
    for i, default, held in functions.defaults():
        if names[i] in options.values:
            numbers[i] = float(options.values[names[i]])
        elif default is not None:
            known = {symbols[j]: numbers[j] for j in held}
            numbers[i], calculated[i] = float(default.subs(known)), bool(held)
    missing = [name for name, x in zip(names, numbers, strict=True) if math.isnan(x)]
    if missing:
        raise CodegenError(f"give values for the parameters {', '.join(map(plain_words, missing))}")
    return Values(options.start, numbers, calculated, options.drift)


def _sources(
    functions: SceneFunctions,
    metadata: Mapping[str, Any],
    values: Values,
    events: Sequence[FmuEvent],
    options: FmuOptions,
) -> dict[str, str]:
    """The unit's file, the scene's headers, and those of the runtime that they include."""
    generated = program_texts(functions, metadata)
    lists = _lists(functions, metadata, values) | _events(functions, events)
    generated[SOURCE] = _filled(lists | _head(metadata, options))
    runtime = included_headers(SOURCE, generated, RUNTIME)
    return generated | {path: (RUNTIME / path).read_text("utf-8") for path in runtime}


def _filled(values: Mapping[str, Any]) -> str:
    text = files("mechc_codegen.export").joinpath("templates", "fmu.c.in").read_text("utf-8")
    return Template(text).substitute(values)


def _head(metadata: Mapping[str, Any], options: FmuOptions) -> dict[str, Any]:
    return {
        "title": plain_words(metadata["title"] or metadata["name"]),
        "name": options.name,
        "version": options.version,
        "major": options.version[0],
        "lanes": 2,
        "token": "@TOKEN@",
        "method": _METHODS["gauss8" if metadata["smooth"] else "dop853"],
        "rtol": repr(float(options.rtol)),
        "drift": repr(float(options.drift)),
    }


def _lists(
    functions: SceneFunctions, metadata: Mapping[str, Any], values: Values
) -> dict[str, Any]:
    labels = [*functions.request.expressions, *dict(metadata["differentiated"])]
    outputs = zip(labels, output_sizes(metadata), strict=True)
    kinds = [told["kind"] for told in (*metadata["coordinates"], *metadata["speeds"])]
    lengths = [i for i, p in enumerate(metadata["parameters"]) if p["kind"] == Kind.LENGTH]
    last = len(metadata["coordinates"])
    states = range(last - functions.equations.states, last)
    return {
        "inputs": len(open_inputs(metadata)),
        "places": _array(open_inputs(metadata)),
        "outputs": " ".join(f"X({label}, {size})" for label, (_, size) in outputs),
        "output_count": sum(size for _, size in output_sizes(metadata)),
        "states": _array(map(_c_number, values.states)),
        "parameters": _array(map(_c_number, values.parameters)),
        "calculated": _array(map(int, values.calculated)),
        "dimensionless": _array(int(k in PURE or i in states) for i, k in enumerate(kinds)),
        "length_count": len(lengths),
        "lengths": _array(lengths),
        "complete": "\n".join(_completing(functions, values)),
        "follow": "\n".join(_following(functions, values)),
    }


def _events(functions: SceneFunctions, events: Sequence[FmuEvent]) -> dict[str, Any]:
    """The functions of the events, and the tables that lead to them."""
    told = [event.expressions for event in events]
    found = {"event_count": len(told), "resets": int(any(e.reset is not None for e in told))}
    if not told:
        return {**found, "parts": METHODS, "events": "", "event_table": "0, 0,"}
    if lookups(x for e in told for x in (e.value, *(e.reset or {}).values())):
        raise CodegenError("events of a functional mock-up unit hold no tables")
    symbols = functions.program.symbols
    width = len(symbols.q) + len(symbols.u)
    count = len(symbols.parameters)
    directions = _array(_c_number(event.direction) for event in events)
    unit = f"MECHC_EVENTS_ABI, {width}, {count}, {len(told)}, mechc_functions"
    tables = [
        f"static const double directions[] = {{{directions}}};",
        f"static const mechc_event_unit event_unit = {{{unit}}};",
    ]
    text = "\n\n".join([event_functions(told, width), "\n".join(tables)])
    more = {"parts": METHODS | OUTPUTS, "events": text, "event_table": "&event_unit, directions,"}
    return found | more


def _array(values: Iterable[Any]) -> str:
    """No array in C is empty."""
    return ", ".join(map(str, values)) or "0"


def _c_number(value: float) -> str:
    return repr(float(value))


def _completing(functions: SceneFunctions, values: Values) -> Iterator[str]:
    """Statements that compute the parameters that follow others."""

    def value(default: Any, i: int, held: Sequence[int], real: Callable[[Any], str]) -> list[str]:
        return [f"p[{i}] = {real(default)};"]

    yield from _calculated(functions, values, value)


def _following(functions: SceneFunctions, values: Values) -> Iterator[str]:
    """Statements that compute how they change along a direction."""
    symbols = functions.program.symbols.parameters

    def changes(default: Any, i: int, held: Sequence[int], real: Callable[[Any], str]) -> list[str]:
        terms = [f"{real(diff(default, symbols[j]))} * along[{j}]" for j in held]
        return [f"along[{i}] = {' + '.join(terms)};"]

    yield from _calculated(functions, values, changes)


def _calculated(
    functions: SceneFunctions,
    values: Values,
    statements: Callable[[Any, int, Sequence[int], Callable[[Any], str]], Iterable[str]],
) -> Iterator[str]:
    symbols, printer = functions.program.symbols.parameters, RealPrinter()
    for i, default, held in functions.defaults():
        if values.calculated[i]:
            loads = "".join(f"const double {symbols[j].name} = p[{j}]; " for j in held)
            unused = "".join(f"(void){symbols[j].name}; " for j in held)
            body = " ".join(statements(default, i, held, printer.real))
            yield f"    {{ {loads}{unused}{body} }}"
