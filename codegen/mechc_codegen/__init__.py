"""mechc_codegen: from a mechanism in ``sympy.physics.mechanics`` to C.

``build_scene`` reads like the table of contents: derive, differentiate, lower, optimize, emit.
A name is imported when it is first used: to find a scene that is compiled already takes few of
the modules.
"""

from importlib import import_module
from typing import Any

_PLACES = {
    "SHIPPED": "mechanisms",
    "Build": "extension",
    "Closure": "constraints",
    "CodegenError": "errors",
    "Constraint": "constraints",
    "Coordinate": "mechanism",
    "Cut": "cuts",
    "Drawing": "mechanism",
    "ExpressionError": "errors",
    "InternalError": "errors",
    "Joint": "joints",
    "Mechanism": "mechanism",
    "MechanismError": "errors",
    "Parameter": "mechanism",
    "Quantity": "mechanism",
    "Speed": "mechanism",
    "State": "mechanism",
    "build_scene": "extension",
    "from_joints": "from_sympy_joints",
    "multiplier": "terms",
    "shipped_mechanism": "mechanisms",
}

__all__ = [
    "SHIPPED",
    "Build",
    "Closure",
    "CodegenError",
    "Constraint",
    "Coordinate",
    "Cut",
    "Drawing",
    "ExpressionError",
    "InternalError",
    "Joint",
    "Mechanism",
    "MechanismError",
    "Parameter",
    "Quantity",
    "Speed",
    "State",
    "build_scene",
    "from_joints",
    "multiplier",
    "shipped_mechanism",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
