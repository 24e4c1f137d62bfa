"""mechc_codegen: from a mechanism in ``sympy.physics.mechanics`` to C.

``build_scene`` reads like the table of contents: derive, differentiate, lower, optimize, emit.
A name is imported when it is first used: finding a compiled scene needs few of the modules.
"""

from importlib import import_module
from typing import Any

_PLACES = {
    "BallJoint": "joints.attitude",
    "SHIPPED": "library.catalogue",
    "Build": "extension.build",
    "Closure": "description.constraints",
    "CodegenError": "errors",
    "Constraint": "description.constraints",
    "Coordinate": "description.mechanism",
    "Coupling": "joints.couplings",
    "Cut": "description.joints.cuts",
    "Drawing": "description.mechanism",
    "ExpressionError": "errors",
    "FreeJoint": "joints.attitude",
    "InternalError": "errors",
    "Joint": "description.joints.tree",
    "Kind": "description.quantity",
    "Mechanism": "description.mechanism",
    "MechanismError": "errors",
    "Motor": "description.joints.motors",
    "Parameter": "description.mechanism",
    "Quantity": "description.quantity",
    "ScrewJoint": "joints.turning",
    "SkippedPartWarning": "errors",
    "Solid": "description.solid",
    "Speed": "description.mechanism",
    "State": "description.mechanism",
    "UniversalJoint": "joints.turning",
    "build_scene": "compiler",
    "from_equations": "frontend.from_equations",
    "from_joints": "frontend.sympy_joints",
    "from_mjcf": "mjcf.from_mjcf",
    "from_sdf": "robots.files.from_sdf",
    "from_urdf": "robots.files.from_urdf",
    "multiplier": "description.terms",
    "shipped_mechanism": "library.catalogue",
    "with_motors": "frontend.with_motors",
}

__all__ = list(_PLACES)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
