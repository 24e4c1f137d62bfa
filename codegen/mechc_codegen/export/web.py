"""A scene for pages: the C that WebAssembly is compiled from, and what a page is told of it.

Input: a program's parts, the files of its export, the plan of its drawing.  Output: the C, which
includes the exported file, and data for JSON.  Invariant: names of users are data, not C.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.units.scene_files import default_lines, listed_outputs
from mechc_codegen.export.placing import placing
from mechc_codegen.export.standalone import code, filled

if TYPE_CHECKING:
    from mechc_codegen.drawing.plan import Plan

_SHOWN = ("name", "kind", "unit", "description")
_FAILURES = {
    "MECHC_NOT_CLOSED": "the loops cannot be closed near this state",
    "MECHC_NOT_FINITE": "a value is NaN or infinite",
    "MECHC_SINGULAR_MASS": "a speed moves no mass",
}


@dataclass(frozen=True)
class WebScene:
    """Attributes
    ----------
    c
        Compiled to WebAssembly; it includes the exported file.
    about
        For the module around it: names, units, outputs, the drawing, the start.
    """

    c: str
    about: dict[str, Any]


def web_scene(
    functions: SceneFunctions,
    metadata: Mapping[str, Any],
    plan: Plan,
    name: str,
    start: Sequence[float],
    values: Mapping[str, float],
) -> WebScene:
    """``name``: of the exported file; arguments as those of :func:`standalone`."""
    outputs = listed_outputs(functions)
    parameters = [quantity["name"] for quantity in metadata["parameters"]]
    c = filled(
        "web.c.in",
        {
            "name": name,
            "prefix": name.upper(),
            "most": max([1, 3 * len(plan.names), *(width for _, width in outputs)]),
            "outputs": "\n".join(
                f"    case {i}: {name}_{label}(&model, t, y, out); break;"
                for i, (label, _) in enumerate(outputs)
            ),
            "defaults": "\n".join(default_lines(functions)),
            "placing": placing(plan, parameters, metadata["fixed"]),
        },
    )
    about = {
        "title": metadata["title"] or metadata["name"],
        **{kind: _told(metadata[kind]) for kind in ("coordinates", "speeds", "parameters")},
        "inputs": _inputs(metadata),
        "outputs": _outputs(outputs, metadata["shapes"], functions.request),
        "follows": [i for i, value, held in functions.defaults() if value is not None and held],
        "plain": bool(functions.equations.identity_kinematics),
        "loops": functions.rows > 0,
        "failures": {code(name): text for name, text in _FAILURES.items()},
        "drawing": _drawing(plan),
        "start": list(map(float, start)),
        "values": {key: float(value) for key, value in values.items()},
    }
    return WebScene(c, about)


def _told(quantities: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{key: quantity[key] for key in _SHOWN} for quantity in quantities]


def _inputs(metadata: Mapping[str, Any]) -> list[str]:
    """The name of every value that the scene is given."""
    return [
        f"{each['name']}{chr(39) * order}"
        for each in metadata.get("inputs", ())
        for order in each["orders"]
    ]


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
