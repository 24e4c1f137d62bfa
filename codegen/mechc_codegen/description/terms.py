"""Terms that mechanisms and the readers of SymPy objects share; fast to import."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from sympy import (
    Expr,
    Function,
    Integer,
    Matrix,
    MatrixBase,
    Max,
    Min,
    Symbol,
    SympifyError,
    sympify,
)
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Vector

from mechc_codegen.errors import MechanismError

Rewrite = Callable[[Expr], Expr]
Load = tuple[Point | ReferenceFrame, Vector]


class Multiplier(Function):  # type: ignore[misc]
    """lambda_k of M u' + J^T lambda = F; the argument is k, or the row's name as a symbol."""

    nargs = 1
    is_real = True


def multiplier(row: int | str) -> Expr:
    """The multiplier of a constraint row, for user-defined outputs.

    Parameters
    ----------
    row
        Its number in ``model.constraint_names`` (from 0) or its name there.
    """
    return Multiplier(Symbol(row) if isinstance(row, str) else Integer(row))


def printed_name(symbol: Expr) -> str:
    """The printed name of a symbol or a function of time: ``theta_0``."""
    return str(symbol.func.__name__ if isinstance(symbol, AppliedUndef) else symbol)


def velocity_of(at: Point | ReferenceFrame, frame: ReferenceFrame) -> Vector:
    """The velocity of a point, or the angular velocity of a frame.

    That of a point is the one that the user set, or else the one that the nearest point with one
    determines, as ``Point.vel`` does, which would store the result in the user's point, and warn if
    several points are equally near.

    Raises
    ------
    MechanismError
        If no point that it is located from has a velocity in ``frame``.
    """
    if isinstance(at, ReferenceFrame):
        return at.ang_vel_in(frame)
    waiting = [at]
    for place in waiting:
        if frame in place._vel_dict:
            velocity = place._vel_dict[frame]
            return velocity if place is at else at.pos_from(place).dt(frame) + velocity
        waiting += [other for other in place._pos_dict if other not in waiting]
    raise MechanismError(
        f"the velocity of point {at.name} in frame {frame.name} is not known: give it one "
        "(set_vel, v2pt_theory), or locate it from a point that has one (set_pos)"
    )


def vector_along(components: Iterable[Any], frame: ReferenceFrame) -> Vector:
    """The vector with these components along the axes of a frame."""
    return Vector([(Matrix([sympify(each) for each in components]), frame)])


def entries_of(vector: Vector) -> Iterator[Expr]:
    """The components of a vector in the frames that it was written in; SymPy makes one number of
    a matrix that nan or infinity multiplies."""
    for matrix, _ in vector.args:
        yield from matrix if isinstance(matrix, MatrixBase) else [matrix]


def is_rigid(body: RigidBody | Particle) -> bool:
    """Whether a body has inertia; SymPy's deprecated ``Body`` may be either."""
    return isinstance(body, RigidBody) and bool(getattr(body, "is_rigidbody", True))


def as_expression(value: Any, place: str) -> Expr:
    """A number or an expression; text is refused, since SymPy would execute it.

    Raises
    ------
    MechanismError
        If it is neither; the message says where it was given.
    """
    try:
        expression = sympify(value, strict=True)
    except SympifyError:
        expression = None
    if not isinstance(expression, Expr):
        raise MechanismError(
            f"{place}: {value!r} is not an expression; write one with SymPy's symbols and "
            "functions (text is never evaluated)"
        )
    return expression


def within(bounds: tuple[Any, Any] | None, value: Expr) -> Expr:
    """The value, or the nearer of two bounds that it is beyond."""
    return value if bounds is None else Max(bounds[0], Min(value, bounds[1]))


def refuse_no_vector(gravity: Any) -> None:
    """Refuse a gravitational acceleration that has no direction.

    Raises
    ------
    MechanismError
        The message shows a vector.
    """
    if gravity is not None and not isinstance(gravity, Vector):
        raise MechanismError(f"gravity is a vector, such as -9.81 * frame.y, not {gravity!r}")


def bottom_up(expression: Expr, rewrite: Rewrite, done: dict[Expr, Expr]) -> Expr:
    """Rewrite arguments first, each shared subexpression once; ``done`` remembers them."""
    if expression in done:
        return done[expression]
    if not expression.args:
        result = rewrite(expression)
    else:
        args = [bottom_up(a, rewrite, done) for a in expression.args]
        rebuilt = expression if tuple(args) == expression.args else expression.func(*args)
        if rebuilt.func == expression.func:
            result = rewrite(rebuilt)
        else:  # SymPy made another one of it, as -sign(x) of sign(-x)
            result = bottom_up(rebuilt, rewrite, done)
    done[expression] = result
    return result
