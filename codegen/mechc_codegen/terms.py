"""What mechanisms and the readers of SymPy's objects both call things; quick to import."""

from __future__ import annotations

from sympy import Expr
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Vector

Load = tuple[Point | ReferenceFrame, Vector]


def printed_name(symbol: Expr) -> str:
    """The name a person sees for a symbol or a function of time: ``theta_0``."""
    return str(symbol.func.__name__ if isinstance(symbol, AppliedUndef) else symbol)


def is_rigid(body: RigidBody | Particle) -> bool:
    """Whether a body has an inertia; SymPy's deprecated ``Body`` is of both classes."""
    return isinstance(body, RigidBody) and bool(getattr(body, "is_rigidbody", True))
