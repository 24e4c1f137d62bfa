"""The steps by which the points of a picture are placed, as expressions of small matrices.

Input: a mechanism, what the user adds to its drawing, and the names of the parameters whose values
are known.  Output: a PicturePlan.  Invariant: steps are listed after those that they start from, so
that they can be followed in one pass, for many states at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from sympy import Expr
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.drawing import Drawing, Muscle, Wrap
from mechc_codegen.description.placement import way_to
from mechc_codegen.drawing.infer import infer_drawing
from mechc_codegen.drawing.places import Places
from mechc_codegen.drawing.sliders import Slider, sliders
from mechc_codegen.drawing.solids import Shape, shapes, weight
from mechc_codegen.drawing.struts import inferred_struts
from mechc_codegen.errors import MechanismError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from mechc_codegen.description.mechanism import Mechanism

Arm = tuple[int, tuple[Expr, Expr, Expr]]  # the number of a frame, components in it
ARC = 24


@dataclass
class PicturePlan:
    """The steps by which the points of a drawing are found from a state.

    Attributes
    ----------
    names, places
        The drawing's points, and the number of each in ``points``.
    arguments
        Time, the coordinates, the parameters that entries may contain.
    frames
        For every frame but the inertial one the number of the frame before it, and the nine
        entries, row after row, by which components in it become components in that frame.
    sliders
        The bodies that slide along a line: label, name of the mass centre, whether a block stands
        for it, no solid being drawn, and the numbers of a point at rest relative to the line
        and of one beside it in the direction of the line.
    points
        For every point but the origin the number of the point before it, and the way from there.
    wraps
        The parts of muscles' paths that go around something: the numbers of the points before and
        after it, of the centre, and the axis, empty on a sphere.  After all ``points`` come those
        that divide each of these arcs into ``ARC`` equal parts.
    muscles
        Each with its label, the names of its points, and its activation; where it is known
        only with a run: then the name of that input; None where it is not known at all.
    solids
        Of a plan in space: each shape with the numbers of its point and of its frame.
    joints
        Of a plan in space: names of the joints, with the number of the point where their reactions
        act.
    weight
        Of a plan in space: the acceleration of free fall, along the inertial axes.
    speeds, loads
        The speeds.  Of a plan in space: the forces among the loads, each with the name and the
        number of its point and its components, which may contain the speeds besides the arguments.
    """

    drawing: Drawing
    arguments: tuple[Any, tuple[Any, ...], tuple[Any, ...]]
    names: tuple[str, ...] = ()
    places: tuple[int, ...] = ()
    frames: list[tuple[int, tuple[Expr, ...]]] = field(default_factory=list)
    points: list[tuple[int, tuple[Arm, ...]]] = field(default_factory=list)
    sliders: list[tuple[str, str, bool, int, int]] = field(default_factory=list)
    wraps: list[tuple[int, int, int, tuple[Arm, ...]]] = field(default_factory=list)
    muscles: list[tuple[str, tuple[str, ...], Expr | str | None]] = field(default_factory=list)
    solids: list[tuple[Shape, int, int]] = field(default_factory=list)
    joints: list[tuple[str, int]] = field(default_factory=list)
    weight: tuple[Expr, Expr, Expr] | None = None
    speeds: tuple[Any, ...] = ()
    loads: list[tuple[str, int, tuple[Arm, ...]]] = field(default_factory=list)


def picture_plan(
    mechanism: Mechanism, added: Drawing, known: Collection[str], *, in_space: bool = False
) -> PicturePlan:
    """The plan of a mechanism's own drawing, or of what can be inferred, and of what is added.

    ``in_space``: with solids, springs, dampers and the weight.

    Raises
    ------
    MechanismError
        If what the user added names a point that is not there.
    """
    places = Places(mechanism, known)
    own = mechanism.drawing
    placed = set(own.names) <= set(places.names)
    base = (
        own
        if own.links and placed
        else _of_known_points(infer_drawing(places).plus(own), places.names)
    )
    _refuse_unknown(added, places.names)
    drawing = base.plus(_rods(base, places)).plus(added)
    if in_space:
        drawing = _with_struts(drawing, places)
    state = (*mechanism.q, *mechanism.x)
    arguments = (dynamicsymbols._t, state, tuple(places.parameters))
    plan = PicturePlan(drawing, arguments, speeds=tuple(mechanism.u))
    muscles = [muscle for muscle in drawing.muscles if _is_placed(muscle, places)]
    stops = [places.name_of(p) for m in muscles for p in m.path if isinstance(p, Point)]
    found = sliders(places, {places.same.get(places.names[n]) for n in _on_lines(drawing)})
    names = [next(n for n, p in places.names.items() if p is slider.at) for slider in found]
    plan.names = tuple(dict.fromkeys((*drawing.names, *stops, *names)))
    steps = _PlanBuilder(places, plan)
    solids = drawing.solids if in_space else ()
    given = {places.same.get(solid.at, solid.at) for solid in solids}
    steps.add_sliders(found, names, given)
    if in_space:
        steps.add(shapes(places, drawing.solids))
        steps.add_joints()
        steps.add_loads()
        plan.weight = weight(places)
    steps.add_muscles(muscles)
    return plan


def _is_placed(muscle: Muscle, places: Places) -> bool:
    """Whether all points of its path, and the axes it goes around, are known."""
    wraps = [stop for stop in muscle.path if isinstance(stop, Wrap)]
    points = [*(wrap.centre for wrap in wraps), *(p for p in muscle.path if isinstance(p, Point))]
    axes = [part for wrap in wraps if wrap.axis is not None for part in wrap.axis.args]
    return {*points} <= {*places.same} and all(places.is_given(*axis) for axis in axes)


def _on_lines(drawing: Drawing) -> set[str]:
    return {name for _, line in drawing.links if len(line) > 1 for name in line}


def _with_struts(drawing: Drawing, places: Places) -> Drawing:
    """The drawing with the springs and dampers among the loads, where none joins their points."""
    lines = [ends for _, ends in (*drawing.springs, *drawing.dampers)]
    taken = {frozenset(places.same[places.names[n]] for n in ends) for ends in lines}
    paths = (muscle.path for muscle in drawing.muscles if _is_placed(muscle, places))
    taken |= {
        frozenset(places.same[point] for point in pair)
        for path in paths
        for pair in pairwise(path)
        if all(isinstance(stop, Point) for stop in pair)
    }
    found: dict[str, list[tuple[str, tuple[str, ...]]]] = {"spring": [], "damper": []}
    for kind, label, ends in inferred_struts(places, taken):
        found[kind].append((label, tuple(map(places.name_of, ends))))
    return drawing.plus(Drawing(springs=tuple(found["spring"]), dampers=tuple(found["damper"])))


def _rods(drawing: Drawing, places: Places) -> Drawing:
    """The rods of a mechanism that a drawing does not have."""
    name = {point: name for name, point in reversed(places.names.items())}
    every = [(rod, (name[one], name[other])) for rod, one, other in places.rods]
    drawn = {label for label, _ in drawing.links}
    return Drawing(links=tuple(link for link in every if link[0] not in drawn))


def _of_known_points(drawing: Drawing, names: Collection[str]) -> Drawing:
    """The drawing without the points that are not known."""
    links = tuple((label, line) for label, line in drawing.links if {*line} <= {*names})
    ground, traced = ([n for n in kind if n in names] for kind in (drawing.ground, drawing.traced))
    return replace(drawing, links=links, ground=tuple(ground), traced=tuple(traced))


def _refuse_unknown(added: Drawing, names: Mapping[str, Point]) -> None:
    for name in added.names:
        if name not in names:
            raise MechanismError(
                f"drawing: there is no point {name!r} whose position is known; the points are "
                f"{', '.join(names) or 'none: locate them from a point at rest'}"
            )


class _PlanBuilder:
    """Frames and points in the order in which they are reached."""

    def __init__(self, places: Places, plan: PicturePlan) -> None:
        self.places, self.plan = places, plan
        self._frames = {places.mechanism.frame: 0}
        self._points = {places.mechanism.origin: 0}
        plan.places = tuple(self._point(places.names[name]) for name in plan.names)

    def add(self, found: Iterable[Shape]) -> None:
        """Add these shapes to the plan."""
        for shape in found:
            self.plan.solids.append((shape, self._point(shape.at), self._frame(shape.frame)))

    def add_sliders(
        self, found: Sequence[Slider], names: Sequence[str], given: Collection[Point]
    ) -> None:
        """Add these bodies, and on the line of each a point beside it."""
        for slider, name in zip(found, names, strict=True):
            base = self._point(slider.base)
            self.plan.points.append((base, ((self._frame(slider.frame), slider.along),)))
            is_block = slider.is_block and self.places.same[slider.at] not in given
            self.plan.sliders.append((slider.label, name, is_block, base, len(self.plan.points)))

    def add_joints(self) -> None:
        """Add the joints, if all of them can be placed."""
        joints = self.places.mechanism.joints
        if all(self.places.is_placed(joint.child_point) for joint in joints):
            self.plan.joints = [(j.name, self._point(j.child_point)) for j in joints]

    def add_loads(self) -> None:
        """Add the forces whose values follow from the state; torques are not drawn."""
        mechanism = self.places.mechanism
        for place, vector in mechanism.loads:
            if isinstance(place, Point) and self.places.is_placed(place) and vector != 0:
                parts = [
                    (tuple(self.places.load(e) for e in entries), f) for entries, f in vector.args
                ]
                if all(self.places.is_given(entries, frame) for entries, frame in parts):
                    arms = tuple((self._frame(frame), entries) for entries, frame in parts)
                    self.plan.loads.append((place.name, self._point(place), arms))

    def add_muscles(self, muscles: Iterable[Muscle]) -> None:
        """Add these muscles, and after all other points those of their arcs."""
        plan = self.plan
        for muscle in muscles:
            line: list[str] = []
            for k, stop in enumerate(muscle.path):
                if isinstance(stop, Point):
                    line.append(self.places.name_of(stop))
                    continue
                before, after = (self._point(muscle.path[j]) for j in (k - 1, k + 1))
                axis = () if stop.axis is None else self._components(stop.axis)
                plan.wraps.append((before, after, self._point(stop.centre), axis))
                line += [f".{muscle.label} {k} {part}" for part in range(1, ARC)]
            activation = self.places.activation(muscle.activation)
            plan.muscles.append((muscle.label, tuple(line), activation))
        arcs = [name for _, line, _ in plan.muscles for name in line if name[0] == "."]
        first = 1 + len(plan.points)
        plan.names += tuple(arcs)
        plan.places += tuple(range(first, first + len(arcs)))

    def _frame(self, frame: ReferenceFrame) -> int:
        for step in way_to(frame, self.places.frames, self._frames):
            before = self.places.frames[step]
            turn = tuple(map(self.places.expression, before.dcm(step)))
            self.plan.frames.append((self._frames[before], turn))
            self._frames[step] = len(self.plan.frames)
        return self._frames[frame]

    def _point(self, point: Point) -> int:
        way = []
        while point not in self._points:
            way.append(point)
            point = self._before(point)
        for step in reversed(way):
            self.plan.points.append((self._points[point], self._arms(step, point)))
            self._points[step] = len(self.plan.points)
            point = step
        return self._points[point]

    def _before(self, point: Point) -> Point:
        """The point from which a point is placed; for a renamed copy any point that is placed."""
        known = self.places.points
        return known[point] if point in known else next(p for p in point._pos_dict if p in known)

    def _arms(self, point: Point, before: Point) -> tuple[Arm, ...]:
        return self._components(point._pos_dict[before])

    def _components(self, vector: Vector) -> tuple[Arm, ...]:
        arms = []
        for matrix, frame in vector.args:
            x, y, z = map(self.places.expression, matrix)
            arms.append((self._frame(frame), (x, y, z)))
        return tuple(arms)
