"""What holds a mechanism together besides its tree: scalar constraints and cut joints' closures."""

from __future__ import annotations

from dataclasses import dataclass

from sympy import Expr
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector


@dataclass(frozen=True)
class Constraint:
    """``expression = 0``; ``name`` is what messages call it, ``unit`` that of the expression."""

    name: str
    expression: Expr
    unit: str


@dataclass(frozen=True)
class Closure:
    """What a cut joint holds: ``point`` at ``target`` along ``axes``, and pairs of axes square.

    Attributes
    ----------
    axes
        One constraint each: the way from ``target`` to ``point`` has no part along it.
    unit
        That of the way.
    perpendicular
        One constraint each: the first axis, fixed on the side of ``point``, stays perpendicular
        to the second one, fixed on the side of ``target``.
    labels
        What the constraints are called, where not by the closure's name and their axes.
    """

    name: str
    point: Point
    target: Point
    axes: tuple[Vector, ...]
    unit: str = "m"
    perpendicular: tuple[tuple[Vector, Vector], ...] = ()
    labels: tuple[str, ...] = ()

    def constraints(self) -> tuple[Constraint, ...]:
        """The scalar constraints it stands for, written out through all frames between."""
        gap = self.point.pos_from(self.target) if self.axes else Vector(0)
        values = [gap.dot(axis) for axis in self.axes]
        values += [one.dot(other) for one, other in self.perpendicular]
        return tuple(
            Constraint(name, value, unit)
            for (name, unit), value in zip(self.rows, values, strict=True)
        )

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of every constraint: those along axes first."""
        units = [self.unit] * len(self.axes) + ["1"] * len(self.perpendicular)
        return tuple(zip(self.names, units, strict=True))

    @property
    def names(self) -> tuple[str, ...]:
        if self.labels:
            return self.labels
        along = (f"{self.name} along {axis}" for axis in self.axes)
        square = (f"{self.name}, {one} across {other}" for one, other in self.perpendicular)
        return (*along, *square)
