"""A scene for pages: the C that WebAssembly is compiled from, and what a page knows of it.

Input: a program's parts, the plan of its drawing, its start.  Output: the C, which is that of a
functional mock-up unit with functions for pages around it, and data for JSON.  Invariant: names of
users are data, not C.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mechc_codegen.derive.equations import Equations
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.units.scene_files import default_lines, listed_outputs
from mechc_codegen.export.fmu import FmuEvents, FmuOptions, event_parts, start_values, unit_sources
from mechc_codegen.export.placing import placing
from mechc_codegen.export.standalone import checked_name, fill_template
from mechc_codegen.export.variables import open_inputs
from mechc_codegen.ir.program import Program

if TYPE_CHECKING:
    from mechc_codegen.drawing.plan import Plan

SOURCE = "web.c"
RTOL = 1e-9  # where a start asks for none
_SHOWN = ("name", "kind", "unit", "description")


def web_scene(
    program: Program,
    equations: Equations,
    metadata: Mapping[str, Any],
    request: OutputRequest,
    plan: Plan,
    options: FmuOptions,
) -> tuple[dict[str, str], dict[str, Any]]:
    """Texts of files, of which :data:`SOURCE` becomes WebAssembly, and what the module around it
    knows: names, units, outputs, the drawing, the start.

    Raises
    ------
    CodegenError
        If the name cannot begin names of files, or a parameter has no value.
    """
    checked_name(options.name)
    functions = SceneFunctions(program, equations, request)
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
            "placing": placing(plan, parameters, metadata["fixed"]),
        },
    )
    about = {
        "title": metadata["title"] or metadata["name"],
        **{kind: _rows(metadata[kind]) for kind in ("coordinates", "speeds", "parameters")},
        "inputs": _inputs(metadata),
        "outputs": _outputs(outputs, metadata["shapes"], functions.request),
        "follows": [i for i, value, held in functions.defaults() if value is not None and held],
        "plain": bool(functions.equations.identity_kinematics),
        "drawing": _drawing(plan),
        "start": list(map(float, options.start)),
        "values": {key: float(value) for key, value in options.values.items()},
    }
    return texts, about


def _rows(quantities: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{key: quantity[key] for key in _SHOWN} for quantity in quantities]


def _inputs(metadata: Mapping[str, Any]) -> list[str]:
    """The names of the inputs; their rates are zero while they keep their values."""
    names = [each["name"] for each in metadata.get("inputs", ()) for _ in each["orders"]]
    return [names[place] for place in open_inputs(metadata)]


def _outputs(
    outputs: Sequence[tuple[str, int]], shapes: Mapping[str, Any], request: OutputRequest
) -> list[dict[str, Any]]:
    names = [(request.name_of(label), width) for label, width in outputs]
    return [{"name": n, "size": width, "shape": shapes.get(n, [width])} for n, width in names]


def _drawing(plan: Plan) -> dict[str, Any]:
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
