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
    "CodegenError": "errors",
    "ExpressionError": "errors",
    "InternalError": "errors",
    "Mechanism": "mechanism",
    "MechanismError": "errors",
    "build_scene": "extension",
    "multiplier": "terms",
    "shipped_mechanism": "mechanisms",
}

__all__ = [
    "SHIPPED",
    "Build",
    "CodegenError",
    "ExpressionError",
    "InternalError",
    "Mechanism",
    "MechanismError",
    "build_scene",
    "multiplier",
    "shipped_mechanism",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
