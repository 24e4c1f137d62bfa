"""A muscle of a picture: its path from point to point and around wrapped surfaces.

Input: muscles of ``sympy.physics.biomechanics``, or paths by hand.  Output: :class:`Muscle`.
Nothing of it is compiled: its force is among the loads, its activation among states or inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from sympy import Expr, sympify
from sympy.physics.mechanics import Point, WrappingCylinder, WrappingSphere
from sympy.physics.vector import Vector

from mechc_codegen.errors import MechanismError


@dataclass(frozen=True)
class Wrap:
    """The part of a path on a surface around ``centre``, between the points before and after it.

    On a cylinder it turns about ``axis`` by the right-hand rule, as in SymPy; without an axis it is
    the short way on a sphere.
    """

    centre: Point
    axis: Vector | None = None


@dataclass(frozen=True)
class Muscle:
    """A line along a path, the thicker the more active it is.

    Attributes
    ----------
    label
        Its name in the picture.
    path
        Points, and a :class:`Wrap` between two of them where the path goes around something.
    activation
        From 0 to 1: an expression, a state or an input.

    Raises
    ------
    MechanismError
        If the path does not begin and end at points, or has something else in it.
    """

    label: str
    path: tuple[Point | Wrap, ...]
    activation: Expr

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", tuple(self.path))
        object.__setattr__(self, "activation", sympify(self.activation))
        are_points = [isinstance(stop, Point) for stop in self.path]
        whole = len(are_points) > 1 and are_points[0] and are_points[-1]
        apart = all(one or other for one, other in pairwise(are_points))  # no wrap after another
        known = all(isinstance(stop, (Point, Wrap)) for stop in self.path)
        if not (whole and apart and known):
            raise MechanismError(
                f"muscle {self.label}: its path is two points or more, with wraps between them, "
                f"not {self.path!r}"
            )

    @classmethod
    def of(cls, given: Any) -> Muscle:
        """A muscle of a picture from one of SymPy, or as it is.

        A pathway of a class of your own is drawn straight from one attachment to the next.

        Raises
        ------
        MechanismError
            If it is neither.
        """
        if isinstance(given, Muscle):
            return given
        if not _is_muscle(given):
            raise MechanismError(
                f"{given!r} is not a muscle: give one of sympy.physics.biomechanics, with a "
                "pathway and an activation"
            )
        path: list[Any] = list(given.pathway.attachments)
        surface = getattr(given.pathway, "geometry", None)
        if isinstance(surface, WrappingCylinder):
            path.insert(1, Wrap(surface.point, surface.axis))
        elif isinstance(surface, WrappingSphere):
            path.insert(1, Wrap(surface.point))
        return cls(str(given.name), tuple(path), given.activation)


def muscles_in(given: Any) -> tuple[Muscle, ...]:
    """The muscles among loads, actuators, or states as they are given; each once."""
    several = given if isinstance(given, Iterable) and not isinstance(given, Mapping) else [given]
    return tuple(dict.fromkeys(Muscle.of(one) for one in several if _is_muscle(one)))


def _is_muscle(given: Any) -> bool:
    return all(hasattr(given, name) for name in ("name", "pathway", "activation"))
