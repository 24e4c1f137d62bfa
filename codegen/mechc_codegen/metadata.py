"""What the runtime is told about a scene: names, units, descriptions, drawing, operation counts.

Input: the mechanism and the program before and after optimisation.  Output: plain data for JSON.
Invariant: no SymPy object is left in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from sympy import Abs

from mechc_codegen.equations import Output
from mechc_codegen.mechanism import Mechanism, Quantity, printed_name
from mechc_codegen.program import Program, operations, slice_statements, symbols_of


def scene_metadata(mechanism: Mechanism, lowered: Program, program: Program) -> dict[str, Any]:
    """Everything that a model says about itself, as JSON-ready data."""
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "coordinates": [
            _described(printed_name(c.symbol), c.quantity) for c in mechanism.coordinates
        ],
        "speeds": [_described(printed_name(s.symbol), s.quantity) for s in mechanism.speeds],
        "parameters": [_described(str(p.symbol), p.quantity) for p in mechanism.parameters],
        "points": [point.name for point in mechanism.points],
        "bodies": [body.name for body in mechanism.bodies],
        "constraints": [
            {"name": c.name, "unit": c.unit}
            for c in (*mechanism.configuration_constraints, *mechanism.motion_constraints)
        ],
        "links": [[label, list(points)] for label, points in mechanism.drawing.links],
        "ground": list(mechanism.drawing.ground),
        "traced": list(mechanism.drawing.traced),
        "start": dict(mechanism.start),
        "shapes": {o.name: list(o.shape) for o in program.outputs},
        "skipped": list(mechanism.skipped),
        "smooth": not any(statement.value.has(Abs) for statement in program.body),
        "operations": _operation_counts(lowered, program),
    }


def _described(name: str, quantity: Quantity) -> dict[str, Any]:
    return {
        "name": name,
        "unit": quantity.unit,
        "description": quantity.description,
        "lower": _finite(quantity.lower),
        "upper": _finite(quantity.upper),
        "closed": quantity.closed,
    }


def _finite(bound: float) -> float | None:
    return bound if math.isfinite(bound) else None


def _operation_counts(lowered: Program, program: Program) -> dict[str, Any]:
    return {
        "before": _cost(lowered, lowered.outputs),
        "after": _cost(program, program.outputs),
        "once_per_run": operations(program.hoisted),
        "outputs": {
            output.name: [
                _cost(lowered, [output]),
                _cost(program, [program.output(output.name)]),
            ]
            for output in lowered.outputs
        },
    }


def _cost(program: Program, outputs: Iterable[Output]) -> int:
    elements = [element for output in outputs for element in output.elements]
    return operations(slice_statements(program.body, symbols_of(elements)), elements)
