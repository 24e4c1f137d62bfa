"""The drawing of a mechanism: named points, lines between them, and where they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mechc.system.parameters import Array

Positions = Callable[[Array, Array, "float | Array"], Array]


@dataclass(frozen=True)
class Solid:
    """A shape of a picture in space.

    Attributes
    ----------
    kind
        ``"ball"``, ``"box"``, ``"cylinder"``, ``"wheel"``, ``"mesh"``; ``"inertia"``: the uniform
        body with the same inertia; ``"mass"``: a particle.
    sizes
        Of parameters: in m; of ``"inertia"`` xx, yy, zz, xy, xz, yz per mass in m^2; of a
        ``"mesh"`` m per unit, one or along each axis.
    path, triangles
        Of a ``"mesh"``: its file, or the corners of its triangles in single precision.
    """

    kind: str
    label: str
    axis: str
    path: str
    triangles: bytes
    sizes: Callable[[Array], Array]


@dataclass(frozen=True)
class Strut:
    """A line of a picture between points that does not keep its length.

    Attributes
    ----------
    kind
        ``"spring"``, ``"damper"`` or ``"muscle"``.
    points
        Names of the points that it joins, two, or of a muscle those of its path.
    activation
        Of a muscle: from states, parameters and times, (...,), by which it is thicker; the name of
        an input that is given with a run; None where it is not known.
    """

    kind: str
    label: str
    points: Sequence[str]
    activation: Callable[[Array, Array, float | Array], Array] | str | None = None


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
        The axes to the right and up, such as ("x", "-y"); None for those of most spread.
    points
        Positions in m of states, all parameters and times: (..., points, 3).
    sliders, sliding
        The bodies that slide along a line: (label, name of the mass centre, whether a block stands
        for it), and of states, parameters and times points (..., sliders, 3) m at rest relative to
        the lines, and the directions of these, unit vectors (..., sliders, 3).
    solids, placed
        Of a picture in space: the solids, and of states, parameters and times the positions
        (..., solids, 3) m and the matrices (..., solids, 3, 3) that turn their axes to the
        inertial ones.
    struts
        The muscles; of a picture in space springs and dampers too.
    joints, acting
        Of a picture in space: names of the joints, and of states, parameters and times the points
        (..., joints, 3) m where their reactions act.
    loads, pushing
        Of a picture in space: the names of the points of the forces among the loads, and of states,
        parameters and times the points (..., loads, 3) m where they act, and the forces
        (..., loads, 3) N.
    weight
        Of parameters: the acceleration of free fall (3,) m/s^2; None where it is not known.
    """

    point_names: Sequence[str]
    skeleton: Sequence[tuple[str, Sequence[str]]]
    ground: Sequence[str]
    traced: Sequence[str]
    view: tuple[str, str] | None
    points: Positions
    solids: Sequence[Solid] = ()
    placed: Callable[[Array, Array, float | Array], tuple[Array, Array]] | None = None
    struts: Sequence[Strut] = ()
    weight: Callable[[Array], Array] | None = None
    joints: Sequence[str] = ()
    acting: Positions | None = None
    loads: Sequence[str] = ()
    pushing: Callable[[Array, Array, float | Array], tuple[Array, Array]] | None = None
    sliders: Sequence[tuple[str, str, bool]] = ()
    sliding: Callable[[Array, Array, float | Array], tuple[Array, Array]] | None = None

    @property
    def is_complete(self) -> bool:
        """Whether there are lines, and all that they join has a place."""
        named = {name for _, line in self.skeleton for name in line}
        return bool(named) and {*named, *self.ground, *self.traced} <= {*self.point_names}
