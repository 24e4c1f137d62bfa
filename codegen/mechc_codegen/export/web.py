"""A scene for pages: the C that WebAssembly is compiled from, and what a page knows of it.

Input: a program's parts, the plan of its drawing, its start.  Output: the C, which is that of a
functional mock-up unit with functions for pages around it, and data for JSON.  Invariant: names of
users are data, not C.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from sympy import Expr, Float, Symbol

from mechc_codegen.emit.expressions import let, named
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.units.scene_files import default_lines, listed_outputs
from mechc_codegen.export.fmu import FmuEvents, FmuOptions, event_parts, start_values, unit_sources
from mechc_codegen.export.standalone import checked_name, fill_template
from mechc_codegen.export.variables import open_inputs

if TYPE_CHECKING:
    from mechc_codegen.drawing.plan import PicturePlan

SOURCE = "web.c"
RTOL = 1e-9  # where a start asks for none
_IDENTITY = "{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}"
_SHOWN = ("name", "kind", "unit", "description")


def web_scene(
    functions: SceneFunctions, metadata: Mapping[str, Any], plan: PicturePlan, options: FmuOptions
) -> tuple[dict[str, str], dict[str, Any]]:
    """Texts of files, of which :data:`SOURCE` becomes WebAssembly, and what the module around it
    knows: names, units, outputs, the drawing, the start.

    Raises
    ------
    CodegenError
        If the name cannot begin names of files, or a parameter has no value.
    """
    checked_name(options.name)
    outputs = listed_outputs(functions)
    parameters = [quantity["name"] for quantity in metadata["parameters"]]
    values = start_values(functions, metadata, options)
    free = replace(values, calculated=[False] * len(parameters))  # a page may give any
    parts = {
        "what": "a mechanism for WebAssembly",
        "interface": "fmu/advance.h",
        "declarations": "static unsigned char given[MECHC_AT_LEAST_ONE(MECHC_NP)];\n\n",
        "complete": "\n".join(default_lines(functions)),
        **event_parts(functions, FmuEvents()),
    }
    texts = unit_sources(functions, {**metadata, "differentiated": []}, free, options, parts)
    texts[SOURCE] = fill_template(
        "web.c.in",
        {
            "most": max([1, 3 * len(plan.names), *(width for _, width in outputs)]),
            "outputs": "\n".join(
                f"    case {i}: mechc_standalone_{label}(model, t, state, out); break;"
                for i, (label, _) in enumerate(outputs)
            ),
            "placing": _placing(plan, parameters, metadata["fixed"]),
        },
    )
    about = {
        "title": metadata["title"] or metadata["name"],
        **{
            kind: [{key: row[key] for key in _SHOWN} for row in metadata[kind]]
            for kind in ("coordinates", "speeds", "parameters")
        },
        "inputs": _inputs(metadata),
        "outputs": [
            {"name": n, "size": width, "shape": metadata["shapes"].get(n, [width])}
            for n, width in ((functions.request.name_of(label), w) for label, w in outputs)
        ],
        "follows": [i for i, value, held in functions.defaults() if value is not None and held],
        "plain": bool(functions.equations.identity_kinematics),
        "drawing": _drawing(plan),
        "start": list(map(float, options.start)),
        "values": {key: float(value) for key, value in options.values.items()},
    }
    return texts, about


def _inputs(metadata: Mapping[str, Any]) -> list[str]:
    """The names of the inputs; their rates are zero while they keep their values."""
    names = [each["name"] for each in metadata.get("inputs", ()) for _ in each["orders"]]
    return [names[place] for place in open_inputs(metadata)]


def _drawing(plan: PicturePlan) -> dict[str, Any]:
    """Lines, pivots and paths by the numbers of their points."""
    number = {name: i for i, name in enumerate(plan.names)}
    drawing = plan.drawing
    return {
        "points": list(plan.names),
        "links": [[label, [number[n] for n in line]] for label, line in drawing.links],
        "ground": [number[n] for n in drawing.ground],
        "traced": [number[n] for n in drawing.traced],
        "view": list(drawing.view) if drawing.view else None,
    }


def _placing(plan: PicturePlan, parameters: Sequence[str], fixed: Mapping[str, float]) -> str:
    """Statements that write x, y, z of the drawing's points to ``places``, of ``t``, ``y`` and
    ``p``: each is placed from the one before it; ``fixed``: values of parameters."""
    return "\n".join(f"    {line}" for line in _lines(plan, parameters, fixed))


def _lines(
    plan: PicturePlan, parameters: Sequence[str], fixed: Mapping[str, float]
) -> Iterator[str]:
    time, state, values = plan.arguments
    names: dict[Expr, Expr] = {time: Symbol("t")}
    printer = RealPrinter(tables=True)

    def array(entries: Sequence[Expr], size: int) -> str:
        printed = (str(printer.real(entry.xreplace(names))) for entry in entries)
        return f"(const double[{size}]){{{', '.join(printed)}}}"

    for i, symbol in enumerate(state):
        names[symbol] = Symbol(f"x{i}")
        yield from let(f"x{i}", named("y")[i], "const double").text
    for i, symbol in enumerate(values):
        if symbol.name in fixed:
            names[symbol] = Float(fixed[symbol.name])
        else:
            names[symbol] = Symbol(f"v{i}")
            given = named("p")[parameters.index(symbol.name)]
            yield from let(f"v{i}", given, "const double").text
    used = [str(name) for name in names.values() if isinstance(name, Symbol)]
    yield f"{', '.join(f'(void){name}' for name in used)};"
    yield f"double turn[{len(plan.frames) + 1}][9] = {{{_IDENTITY}}};"
    yield f"double point[{len(plan.points) + 1}][3] = {{{{0.0}}}};"
    for i, (before, entries) in enumerate(plan.frames, 1):
        yield f"multiply_turns(turn[{before}], {array(entries, 9)}, turn[{i}]);"
    for i, (before, arms) in enumerate(plan.points, 1):
        yield f"memcpy(point[{i}], point[{before}], sizeof point[{i}]);"
        for frame, arm in arms:
            yield f"add_arm(turn[{frame}], {array(arm, 3)}, point[{i}]);"
    for i, place in enumerate(plan.places):
        yield f"memcpy(&places[{3 * i}], point[{place}], sizeof point[{place}]);"
