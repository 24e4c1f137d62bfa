"""The picture of a mechanism: names of points, and what is drawn between them.

A muscle is drawn along its path, from point to point and around wrapped surfaces.  Nothing of it is
compiled: its force is among the loads, its activation among the states or inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from sympy import Expr, sympify
from sympy.physics.mechanics import Point, WrappingCylinder, WrappingSphere
from sympy.physics.vector import Vector

from mechc_codegen.description.solid import Solid
from mechc_codegen.errors import MechanismError

Link = tuple[str, tuple[str, ...]]


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


@dataclass(frozen=True)
class Drawing:
    """The picture: polylines through named points, pivots on the ground, traced points.

    ``links``: pairs of a label and the points of a polyline.  A point is a ``Point`` of SymPy or
    its name.  ``view``: the axes to the right and up in pictures of a spatial motion, ``"x"``,
    ``"-x"`` and so on; without it the two between which the motion spreads most.

    ``muscles``: those of ``sympy.physics.biomechanics``, drawn as lines along their paths.

    For pictures in space alone: ``solids``, of :class:`Solid`; ``springs`` and ``dampers``, pairs
    of a label and the two points that they join.

    Raises
    ------
    MechanismError
        For a view that is not two different axes, a spring without two ends, a solid or a muscle
        that is none.
    """

    links: tuple[Link, ...] = ()
    ground: tuple[str, ...] = ()
    traced: tuple[str, ...] = ()
    view: tuple[str, str] | None = None
    solids: tuple[Solid, ...] = ()
    springs: tuple[Link, ...] = ()
    dampers: tuple[Link, ...] = ()
    muscles: tuple[Muscle, ...] = ()

    def __post_init__(self) -> None:
        axes = [axis.removeprefix("-") for axis in self.view or ("x", "y")]
        if len(axes) != 2 or len({*axes, *"xyz"}) > 3 or axes[0] == axes[1]:
            raise MechanismError(
                f"a view is two different axes out of x, y, z, -x, -y, -z, not {self.view!r}"
            )
        links = tuple((label, _names(points)) for label, points in self.links)
        object.__setattr__(self, "links", links)
        object.__setattr__(self, "ground", _names(self.ground))
        object.__setattr__(self, "traced", _names(self.traced))
        for kind in ("springs", "dampers"):
            object.__setattr__(self, kind, _between_two(getattr(self, kind), kind))
        object.__setattr__(self, "muscles", tuple(map(Muscle.of, self.muscles)))
        object.__setattr__(self, "solids", tuple(self.solids))
        for solid in self.solids:
            if not isinstance(solid, Solid):
                raise MechanismError(f"{solid!r} is not a Solid: make one by Solid.box or another")

    def plus(self, other: Drawing) -> Drawing:
        """Both drawings in one, with the view of the other if it has one."""
        return Drawing(
            links=tuple(dict.fromkeys((*self.links, *other.links))),
            ground=tuple(dict.fromkeys((*self.ground, *other.ground))),
            traced=tuple(dict.fromkeys((*self.traced, *other.traced))),
            view=other.view or self.view,
            solids=tuple(dict.fromkeys((*self.solids, *other.solids))),
            springs=tuple(dict.fromkeys((*self.springs, *other.springs))),
            dampers=tuple(dict.fromkeys((*self.dampers, *other.dampers))),
            muscles=tuple(dict.fromkeys((*self.muscles, *other.muscles))),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """All points that the drawing names, each once."""
        lines = (*self.links, *self.springs, *self.dampers)
        linked = (name for _, points in lines for name in points)
        return tuple(dict.fromkeys((*linked, *self.ground, *self.traced)))


def _names(points: Any) -> tuple[str, ...]:
    """A tuple of point names, also from a single name."""
    several = (points,) if isinstance(points, str) or hasattr(points, "name") else points
    return tuple(point if isinstance(point, str) else str(point.name) for point in several)


def _between_two(given: Any, kind: str) -> tuple[Link, ...]:
    found = tuple((label, _names(points)) for label, points in given)
    for label, points in found:
        if len(points) != 2:
            raise MechanismError(f"{kind}: {label!r} joins two points, not {len(points)}")
    return found


def muscles_in(given: Any) -> tuple[Muscle, ...]:
    """The muscles among loads, actuators, or states as they are given; each once."""
    several = given if isinstance(given, Iterable) and not isinstance(given, Mapping) else [given]
    return tuple(dict.fromkeys(Muscle.of(one) for one in several if _is_muscle(one)))


def _is_muscle(given: Any) -> bool:
    return all(hasattr(given, name) for name in ("name", "pathway", "activation"))


NO_DRAWING = Drawing()
