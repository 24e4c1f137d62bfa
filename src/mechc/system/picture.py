"""What a mechanism looks like: named points, lines between them, and where they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mechc.system.parameters import Array

Positions = Callable[[Array, Array, "float | Array"], Array]


@dataclass(frozen=True)
class Picture:
    """Attributes
    ----------
    point_names
        Names of the points, in the order of ``points``.
    skeleton
        The lines: (label, names of the points of a polyline).
    ground, traced
        Names of the points drawn as pivots on the ground, and of those whose path is drawn.
    view
        The axes to the right and up, such as ("x", "-y"); None for the widest.
    points
        Positions in m of states, all parameters and times: (..., points, 3).
    up
        The unit vector against the weight, where it is known.
    """

    point_names: Sequence[str]
    skeleton: Sequence[tuple[str, Sequence[str]]]
    ground: Sequence[str]
    traced: Sequence[str]
    view: tuple[str, str] | None
    points: Positions
    up: tuple[float, float, float] | None = None

    @property
    def is_complete(self) -> bool:
        """Whether there are lines, and all that they join has a place."""
        named = {name for _, line in self.skeleton for name in line}
        return bool(named) and {*named, *self.ground, *self.traced} <= {*self.point_names}
