"""Constraints besides the tree: scalar ones, closures of cut joints, and contacts."""

from __future__ import annotations

from dataclasses import dataclass

from sympy import Expr
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector


@dataclass(frozen=True)
class Constraint:
    """``expression = 0``; ``name`` is for messages, ``unit`` that of the expression."""

    name: str
    expression: Expr
    unit: str


@dataclass(frozen=True)
class Contact:
    """A stop, whose ``gap`` never closes further than to zero, or dry friction at a ``slip``.

    Polynomials in coordinates, speeds and parameters.  At the stop speeds are lost; friction
    against the slip, a speed, is at most ``force``.
    """

    gap: Expr | None = None
    slip: Expr | None = None
    force: Expr | float = 0


@dataclass(frozen=True)
class Closure:
    """Constraints of a cut joint: ``point`` at ``target`` along ``axes``, or at a ``length`` from
    it, and perpendicular axes.

    Attributes
    ----------
    axes
        One constraint each: the vector from ``target`` to ``point`` has no component along it.
    unit
        The unit of this vector.
    perpendicular
        One constraint each: the first axis, fixed on the side of ``point``, stays perpendicular
        to the second one, fixed on the side of ``target``.
    aligned
        Pairs of axes, as long as that their product is 1 where they point the same way.  Axes held
        perpendicular to others may also point against them; such a configuration is none.
    labels
        Names of the constraints; by default the closure's name with their axes.
    length
        That of a rod from ``target`` to ``point``, in the unit; None: there is no rod.  Its one
        constraint is (d^2 - length^2) / (2 length) = 0 with the distance d of the two points.
    """

    name: str
    point: Point
    target: Point
    axes: tuple[Vector, ...]
    unit: str = "m"
    perpendicular: tuple[tuple[Vector, Vector], ...] = ()
    aligned: tuple[tuple[Vector, Vector], ...] = ()
    labels: tuple[str, ...] = ()
    length: Expr | None = None

    def constraints(self) -> tuple[Constraint, ...]:
        """The scalar constraints, expanded through all frames between the two sides."""
        gap = self.gap
        values = [gap.dot(axis) for axis in self.axes]
        if self.length is not None:
            values.append((gap.dot(gap) - self.length**2) / (2 * self.length))
        values += [one.dot(other) for one, other in self.perpendicular]
        return tuple(
            Constraint(name, value, unit)
            for (name, unit), value in zip(self.rows, values, strict=True)
        )

    @property
    def gap(self) -> Vector:
        """The vector from ``target`` to ``point``; zero where no constraint contains it."""
        held = self.axes or self.length is not None
        return self.point.pos_from(self.target) if held else Vector(0)

    @property
    def directions(self) -> tuple[Vector, ...]:
        """The axes, or along a rod: unit vectors, which forces between the two points have."""
        return self.axes if self.length is None else (*self.axes, self.gap / self.length)

    @property
    def rows(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of every constraint: those along axes first, then that of a rod."""
        held = len(self.axes) + (self.length is not None)
        units = [self.unit] * held + ["1"] * len(self.perpendicular)
        return tuple(zip(self.names, units, strict=True))

    @property
    def names(self) -> tuple[str, ...]:
        if self.labels:
            return self.labels
        along = [f"{self.name} along {axis}" for axis in self.axes]
        along += [] if self.length is None else [self.name]
        square = (f"{self.name}, {one} across {other}" for one, other in self.perpendicular)
        return (*along, *square)
