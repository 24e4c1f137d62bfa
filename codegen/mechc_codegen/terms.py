"""What mechanisms and the readers of SymPy's objects both call things; quick to import."""

from __future__ import annotations

from sympy import Expr, Function, Integer, Symbol
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Vector

Load = tuple[Point | ReferenceFrame, Vector]


class Multiplier(Function):  # type: ignore[misc]
    """lambda_k of M u' + J^T lambda = F; the argument is k, or the row's name as a symbol."""

    nargs = 1
    is_real = True


def multiplier(row: int | str) -> Expr:
    """The multiplier of a constraint row, for outputs of one's own.

    Parameters
    ----------
    row
        Its number in ``model.constraint_names`` (from 0) or its name there.
    """
    return Multiplier(Symbol(row) if isinstance(row, str) else Integer(row))


def printed_name(symbol: Expr) -> str:
    """The name a person sees for a symbol or a function of time: ``theta_0``."""
    return str(symbol.func.__name__ if isinstance(symbol, AppliedUndef) else symbol)


def is_rigid(body: RigidBody | Particle) -> bool:
    """Whether a body has an inertia; SymPy's deprecated ``Body`` is of both classes."""
    return isinstance(body, RigidBody) and bool(getattr(body, "is_rigidbody", True))
