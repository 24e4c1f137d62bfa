"""mechc_codegen: from a mechanism in ``sympy.physics.mechanics`` to C.

``build_scene`` reads like the table of contents: derive, differentiate, lower, optimize, emit.
"""

from mechc_codegen.errors import CodegenError, ExpressionError, InternalError, MechanismError
from mechc_codegen.extension import Build, build_scene
from mechc_codegen.mechanism import Mechanism
from mechc_codegen.mechanisms import SHIPPED, shipped_mechanism

__all__ = [
    "SHIPPED",
    "Build",
    "CodegenError",
    "ExpressionError",
    "InternalError",
    "Mechanism",
    "MechanismError",
    "build_scene",
    "shipped_mechanism",
]
