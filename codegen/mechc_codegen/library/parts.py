"""Parts that the mechanisms share: points that move with a body, weight, names and units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sympy import Expr, S, Symbol, sqrt
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dot, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.mechanism import Coordinate, Load, Parameter, Quantity, Speed

t = dynamicsymbols._t


def fixed_point(name: str, frame: ReferenceFrame) -> Point:
    """A point at rest in ``frame``, from which others are located."""
    point = Point(name)
    point.set_vel(frame, 0)
    return point


def locate(
    name: str, start: Point, arm: Vector, body: ReferenceFrame, inertial: ReferenceFrame
) -> Point:
    """The point at ``arm`` from ``start``, both fixed to ``body``."""
    point = start.locatenew(name, arm)
    point.v2pt_theory(start, inertial, body)
    return point


def turn_frame(
    name: str, parent: ReferenceFrame, angle: Expr, rate: Expr, axis: Vector
) -> ReferenceFrame:
    """A frame that turns in ``parent`` by an angle about an axis, at this rate."""
    frame = parent.orientnew(name, "Axis", (angle, axis))
    frame.set_ang_vel(parent, rate * axis)
    return frame


def spring(
    upper: Point, lower: Point, stiffness: Expr, rest: Expr, body: RigidBody, damping: Expr = S.Zero
) -> tuple[Load, Load]:
    """A pair of forces between two points, and its potential, which is added to the body's.

    ``damping``: the force against the stretching, besides.
    """
    arm = upper.pos_from(lower)
    length = sqrt(dot(arm, arm))
    body.potential_energy += stiffness * (length - rest) ** 2 / 2
    force = -(stiffness * (length - rest) + damping) / length * arm
    return (upper, force), (lower, -force)


def weight(body: RigidBody | Particle, origin: Point, g: Expr, up: Vector) -> Load:
    """The body's weight as a load; adds its potential energy to the body's."""
    centre = body.masscenter
    body.potential_energy += body.mass * g * centre.pos_from(origin).dot(up)
    return (centre, -body.mass * g * up)


def coordinates(symbols: Sequence[Expr], unit: str, *descriptions: str) -> tuple[Coordinate, ...]:
    return tuple(
        Coordinate(symbol, Quantity(unit, description))
        for symbol, description in zip(symbols, descriptions, strict=True)
    )


def speeds(symbols: Sequence[Expr], unit: str, *descriptions: str) -> tuple[Speed, ...]:
    return tuple(
        Speed(symbol, Quantity(unit, description))
        for symbol, description in zip(symbols, descriptions, strict=True)
    )


def joint_angles(
    angles: Sequence[Expr], rates: Sequence[Expr], named: Sequence[str], rate: str = "rate"
) -> dict[str, Any]:
    """Coordinates, speeds and kinematics of a mechanism whose speeds are the rates of its angles.

    ``named`` says of what each is the angle: ``"of link 0"``.
    """
    return {
        "coordinates": coordinates(angles, "rad", *[f"angle {each}" for each in named]),
        "speeds": speeds(rates, "rad/s", *[f"{rate} {each}" for each in named]),
        "kinematics": tuple(rates),
    }


def parameter(
    symbol: Symbol, default: Expr | float, unit: str, description: str, *, positive: bool = False
) -> Parameter:
    quantity = Quantity(unit, description, lower=0) if positive else Quantity(unit, description)
    return Parameter(symbol, default, quantity)
