"""Parts that the mechanisms share: points that move with a body, weight, names and units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sympy import Expr, Symbol
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
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
