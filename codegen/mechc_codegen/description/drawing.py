"""The picture of a mechanism: names of points, and what is drawn between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mechc_codegen.description.muscle import Muscle
from mechc_codegen.description.solid import Solid
from mechc_codegen.errors import MechanismError

Link = tuple[str, tuple[str, ...]]


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


NO_DRAWING = Drawing()
