"""A scene as a functional mock-up unit: the files of its archive but the compiled one.

Input: an optimised program, its metadata, start values.  Output: path -> content.  Invariant: the C
holds names of ours alone; those of users are text of the description, which is escaped.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any
from uuid import UUID

from sympy import diff

from mechc_codegen.description.quantity import PURE, Kind
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.c import CWriter, program_texts
from mechc_codegen.emit.definition import plain_words
from mechc_codegen.emit.expressions import Line, let, named, put, texts, total
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups
from mechc_codegen.emit.units.event_functions import event_functions
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.amalgamate import included_headers
from mechc_codegen.export.description import build_description, model_description
from mechc_codegen.export.standalone import checked_name, fill_template
from mechc_codegen.export.variables import (
    VERSIONS,
    StartValues,
    open_inputs,
    output_sizes,
    variables,
)
from mechc_codegen.export.variables import FmuEvents as FmuEvents
from mechc_codegen.export.variables import FmuOptions as FmuOptions
from mechc_codegen.extension.flags import FLAGS, RUNTIME

SOURCE = "fmu.c"


def fmu_request(request: OutputRequest, derivatives: bool) -> OutputRequest:
    """The request with the derivatives that a unit offers."""
    if not derivatives:
        return request
    return replace(request, outputs=request.outputs | {"sensitivities"})


def fmu_files(
    functions: SceneFunctions, metadata: Mapping[str, Any], options: FmuOptions
) -> dict[str, bytes]:
    """A dict from paths in the archive to content, without binaries.

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
    outputs = functions.program.named_values()
    every = [[each, len(outputs[each])] for each in functions.request.of_mechanism(outputs)]
    metadata = {**metadata, "differentiated": every}
    values, events = start_values(functions, metadata, options), options.events(metadata)
    parts = {
        "what": f"a functional mock-up unit by FMI {options.version}",
        "interface": f"fmu/fmi{options.version[0]}.h",
        "declarations": "",
        **event_parts(functions, events),
    }
    sources = unit_sources(functions, metadata, values, options, parts)
    token = _token(sources, metadata)
    sources[SOURCE] = sources[SOURCE].replace("@TOKEN@", token)
    found = {f"sources/{path}": text.encode() for path, text in sources.items()}
    listed = variables(metadata, values, events.titles)
    title = metadata["title"] or metadata["name"]
    indicators = None if len(events.has_gap) else len(events.titles)
    found["modelDescription.xml"] = model_description(
        options, title, token, listed, SOURCE, indicators
    )
    if options.version == "3.0":
        found["sources/buildDescription.xml"] = build_description(name, SOURCE, FLAGS)
    return found


def _token(sources: Mapping[str, str], metadata: Mapping[str, Any]) -> str:
    """A hash of all that the unit does, in the form that FMI asks for."""
    told = [*(f"{path}\n{text}" for path, text in sorted(sources.items())), repr(metadata)]
    digest = hashlib.sha256("\n".join(told).encode("utf-8", "surrogatepass")).hexdigest()
    return f"{{{UUID(hex=digest[:32])}}}"


def start_values(
    functions: SceneFunctions, metadata: Mapping[str, Any], options: FmuOptions
) -> StartValues:
    """Start values of all parameters; dependent ones are calculated."""
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
    return StartValues(options.start, numbers, calculated, options.drift)


def unit_sources(
    functions: SceneFunctions,
    metadata: Mapping[str, Any],
    values: StartValues,
    options: FmuOptions,
    parts: Mapping[str, Any],
) -> dict[str, str]:
    """The unit's file, the scene's headers, and those of the runtime that they include.

    ``parts``: what the file is, the header of its interface, how parameters are completed, events.
    """
    generated = program_texts(CWriter(functions, metadata), metadata)
    head = {
        "title": plain_words(metadata["title"] or metadata["name"]),
        "name": options.name,
        "lanes": 2,
        "token": "@TOKEN@",
        "method": "GAUSS8" if metadata["smooth"] else "DOP853",
        "rtol": repr(float(options.rtol)),
        "drift": repr(float(options.drift)),
    }
    lists = _lists(functions, metadata, values)
    generated[SOURCE] = fill_template("fmu.c.in", head, lists, parts)
    runtime = included_headers(SOURCE, generated, RUNTIME)
    return generated | {path: (RUNTIME / path).read_text("utf-8") for path in runtime}


def _lists(
    functions: SceneFunctions, metadata: Mapping[str, Any], values: StartValues
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
    } | _dependent_parameters(functions, values)


def event_parts(functions: SceneFunctions, events: FmuEvents) -> dict[str, Any]:
    """The functions of the events, and the tables that lead to them."""
    count, contacts = len(events.titles), len(events.has_gap)
    found = {"event_count": count, "contact_count": contacts}
    if not count:
        return {**found, "events": "", "event_table": "0, 0, {0}"}
    if lookups(events.every_expression()):
        raise CodegenError("events of a functional mock-up unit hold no tables")
    symbols = functions.program.symbols
    width = len(symbols.q) + len(symbols.u)
    policies = zip(events.directions, events.contacts, strict=True)
    policy = _array(f"{{{_c_number(direction)}, 0, {contact}}}" for direction, contact in policies)
    table = "mechc_contact_quantities" if contacts else "0"
    numbers = [list(events.contacts).index(k) for k in range(contacts)]
    tables = [
        f"static const mechc_event_policy policy[] = {{{policy}}};",
        f"static const unsigned char has_gap[] = {{{_array(map(int, events.has_gap))}}},",
        f"    has_friction[] = {{{_array(map(int, events.has_friction))}}},",
        f"    is_linear[] = {{{_array(map(int, events.is_linear))}}};",
        f"static const int events_of_contacts[] = {{{_array(numbers)}}};",
    ]
    law = int(events.poisson)
    of_contacts = "has_gap, has_friction, is_linear, events_of_contacts"
    laws = f"{{{contacts}, {of_contacts}, {law}, {table}, 0}}"
    text = event_functions(events.expressions, events.quantities, width)
    return {
        **found,
        "events": "\n\n".join([text, "\n".join(tables)]),
        "event_table": f"mechc_functions, policy, {laws}",
    }


def _array(values: Iterable[Any]) -> str:
    """The initialiser of a C array, which must not be empty."""
    return ", ".join(map(str, values)) or "0"


def _c_number(value: float) -> str:
    return repr(float(value))


def _dependent_parameters(functions: SceneFunctions, values: StartValues) -> dict[str, str]:
    """Statements that compute dependent parameters, and statements for their changes."""
    symbols, real = functions.program.symbols.parameters, RealPrinter().real
    complete, follow, p, along = list[str](), list[str](), named("p"), named("along")
    for i, default, held in functions.defaults():
        if values.calculated[i]:
            loads = [let(symbols[j].name, p[j], "const double") for j in held]
            loads += [Line((f"(void){symbols[j].name};",)) for j in held]
            change = total(real(diff(default, symbols[j])) * along[j] for j in held)
            for lines, own in (complete, put(p[i], real(default))), (follow, put(along[i], change)):
                lines.append(f"    {{ {' '.join(texts([*loads, own]))} }}")
    return {"complete": "\n".join(complete), "follow": "\n".join(follow)}
