"""A robot -> Mechanism: :func:`mechanism_of`.

Links that are fixed to each other are one body.  Each body's frame is oriented against the one
before it in one step, in which the constant rotations are multiplied out.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import hypot
from textwrap import shorten
from typing import Any

from sympy import Expr, S, Symbol, sympify
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, inertia
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.description.constraints import Contact
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.joints.loops import loop_joints
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.mechanism import Limits, Load, Mechanism, Parameter, Quantity
from mechc_codegen.description.placement import apply
from mechc_codegen.description.solid import Solid
from mechc_codegen.description.terms import vector_along, within
from mechc_codegen.errors import MechanismError, SkippedPartWarning
from mechc_codegen.robots.closing import Side, cut_joint, cut_place
from mechc_codegen.robots.geometry import (
    IDENTITY,
    Inertia,
    Place,
    about,
    combine,
    of_angles,
    place_of,
)
from mechc_codegen.robots.graph import resolve_graph
from mechc_codegen.robots.moving import JointMotion, motion_of, of_time, orient
from mechc_codegen.robots.reasons import cut_reasons
from mechc_codegen.robots.robot import V3, Robot, RobotJoint, RobotLink, unused_name
from mechc_codegen.robots.spanning import SpanningTree, TreeJoint, spanning_tree
from mechc_codegen.robots.values import ACTING, RobotValues

WORLD, BASE = "world", "base"  # what a floating base is joined to, and its joint
DOWN: V3 = (0, 0, -1)
LISTED, WIDEST = 6, 160  # parts that are not taken, in a warning, and letters of each


def mechanism_of(
    robot: Robot,
    symbolic: Iterable[Any] = (),
    *,
    cut: Iterable[str] | str = (),
    floating: bool = False,
) -> Mechanism:
    """The mechanism of a robot as its file has it; parameters as in :func:`from_urdf`.

    Raises
    ------
    MechanismError
        If the robot contradicts itself, nothing of it moves, or ``cut`` names a joint that closes
        no loop.

    Warns
    -----
    SkippedPartWarning
        Of what the file has and the mechanism does not.
    """
    robot = resolve_graph(robot)
    robot = _with_floating_base(robot) if floating else robot
    if all(joint.kind == "fixed" for joint in robot.joints):
        raise MechanismError(
            f"{robot.name}: no joint of the file moves; floating=True frees the root"
        )
    values = RobotValues(robot, symbolic)
    named = [cut] if isinstance(cut, str) else [*cut]
    tree = spanning_tree(robot, named, _with_coordinate(robot))
    builder = _MechanismBuilder(tree, values)
    mechanism = builder.mechanism()
    body_of = {
        name: part.body.name if part.body else "" for name, (part, _) in builder.parts.items()
    }
    mechanism = replace(
        mechanism,
        links={name: (body_of[name], x.mass, x.inertia) for name, x in robot.links.items()},
        cut_reasons=cut_reasons(tree, loop_joints(mechanism)),
    )
    _warn_of_skipped(mechanism)
    return mechanism


def _warn_of_skipped(mechanism: Mechanism) -> None:
    """Warn the caller of a reader of what the file has and the mechanism does not."""
    if not mechanism.skipped:
        return
    more = len(mechanism.skipped) - LISTED
    listed = (shorten(each, WIDEST, placeholder=" ...") for each in mechanism.skipped[:LISTED])
    told = "; ".join(listed) + (f"; and {more} more" if more > 0 else "")
    warnings.warn(
        f"{mechanism.name}: not taken from the file, though it may matter to the motion or its "
        f"picture: {told}. All of it is in the mechanism's field skipped",
        SkippedPartWarning,
        stacklevel=4,
    )


def _with_floating_base(robot: Robot) -> Robot:
    """The robot with a floating joint between the ground and its root."""
    if WORLD in robot.links or BASE in {joint.name for joint in robot.joints}:
        raise MechanismError(
            f"{robot.name}: a floating base adds the link {WORLD!r} and the joint {BASE!r}, but "
            "the file has one of these names"
        )
    free = RobotJoint(BASE, "floating", WORLD, robot.root)
    links = {WORLD: RobotLink(WORLD), **robot.links}
    return replace(robot, links=links, joints=(free, *robot.joints), root=WORLD)


def _with_coordinate(robot: Robot) -> set[str]:
    """The joints to whose coordinate a motor, spring, damper, rotor or mimic refers."""
    parts = (*ACTING, "mimic", "stops")
    acting = {j.name for j in robot.joints if any(getattr(j, part) for part in parts)}
    followed = {each.joint for joint in robot.joints if joint.mimic for each in joint.mimic.terms}
    return acting | followed | {motor.joint for motor in robot.motors}


@dataclass
class _RigidGroup:
    """Links that are fixed to each other, on the frame of the joint that leads to the first."""

    name: str
    point: Point
    frame: ReferenceFrame
    inertias: list[Inertia] = field(default_factory=list)
    potential: Expr = S.Zero
    body: RigidBody | None = None
    line: list[str] = field(default_factory=list)


@dataclass
class _MovingJoint:
    """A joint of the tree that moves the outer group against the inner one.

    ``place``: of its frame on the inner group.
    """

    joint: RobotJoint
    motion: JointMotion
    inner: _RigidGroup
    outer: _RigidGroup
    place: Place
    turned: bool


class _MechanismBuilder:
    """The parts of the mechanism, joint after joint from the root outwards."""

    def __init__(self, tree: SpanningTree, values: RobotValues) -> None:
        self.tree, self.robot, self.values = tree, tree.robot, values
        self.points: dict[str, Point] = {}
        self.parts: dict[str, tuple[_RigidGroup, Place]] = {}
        self.motions: dict[str, JointMotion] = {}
        self.moving: list[_MovingJoint] = []
        self.loads: list[Load] = []
        self.inputs: dict[Any, None] = {}
        self.limits: dict[str, Limits] = {}
        self.contacts: list[Contact] = []
        self.solids: list[Solid] = []
        self.skipped: list[str] = [*self.robot.skipped]
        for branch in sorted(tree.branches, key=lambda each: each.joint.mimic is not None):
            if branch.joint.kind != "fixed":  # those that mimic may come before what they follow
                motion = motion_of(branch.joint, self.motions, branch.is_turned)
                self.motions[branch.joint.name] = motion
        root = self.robot.root
        self.root = _RigidGroup(root, Point(root), ReferenceFrame(root))
        self._attach(root, self.root, Place())
        for branch in tree.branches:
            self._lead_on(branch)
        self._embody()
        self.joints = [self._joint(moving) for moving in self.moving]
        self.bodies = [moving.outer.body for moving in self.moving]
        for moving in self.moving:
            self._add_rotors(moving)
        self.joints += [self._cut(joint) for joint in tree.cuts]

    # -- links -----------------------------------------------------------------------------

    def _attach(self, name: str, part: _RigidGroup, place: Place) -> None:
        """Add a link at a place on its part: its inertia and its shapes."""
        link = self.robot.links[name]
        self.parts[name] = (part, place)
        self._add_point(name, part, place)
        turned = Inertia(0, (0, 0, 0), self.values.inertia(link))
        central = turned.transform(Place(of_angles(link.centre.rpy))).about
        own = Inertia(self.values.mass(link), self.values.centre(link), central)
        part.inertias.append(own.share(link.share).transform(place))
        for visual in link.visuals:
            shape = _side(f"{visual.label} shape", part, place.then(place_of(visual.pose)))
            mesh: Any = {"path": visual.path, "triangles": visual.triangles}
            given = (visual.kind, visual.label, shape.point, shape.frame, tuple(visual.sizes))
            self.solids.append(Solid(*given, **mesh))

    def _add_point(self, name: str, part: _RigidGroup, place: Place) -> None:
        """Add a named point of a part, to which the part's line leads."""
        at = part.point
        self.points[name] = at if name == at.name else at.locatenew(
            name, vector_along(place.origin, part.frame)
        )  # fmt: skip
        part.line.append(name)

    def _point_name(self, name: str) -> str:
        return unused_name(name, {*self.robot.links, *self.points})

    # -- joints ----------------------------------------------------------------------------

    def _lead_on(self, branch: TreeJoint) -> None:
        joint, (inner, at) = branch.joint, self.parts[branch.inner]
        near, far = self._on_parent(joint), place_of(joint.child_origin)
        if branch.is_turned:
            near, far = far, near
        place, link = at.then(near), far.inverse()
        if joint.kind == "fixed":
            self._attach(branch.outer, inner, place.then(link))
            return
        point = Point(branch.outer if link.is_identity else self._point_name(f"{joint.name} end"))
        outer = _RigidGroup(branch.outer, point, ReferenceFrame(branch.outer))
        motion = self.motions[joint.name]
        motion.place(place, (outer.point, outer.frame), (inner.point, inner.frame))
        if not link.is_identity:
            self._add_point(point.name, outer, Place())
        self._attach(branch.outer, outer, link)
        self.moving.append(_MovingJoint(joint, motion, inner, outer, place, branch.is_turned))
        if joint.row.unit:
            self._act(self.moving[-1])
        else:
            self._act_on_several(self.moving[-1])

    def _on_parent(self, joint: RobotJoint) -> Place:
        return Place(of_angles(self.values.orientation(joint)), self.values.origin(joint))

    def _act(self, moving: _MovingJoint) -> None:
        """Add the motors, the damper and the spring of a joint, and its limits."""
        joint, motion = moving.joint, moving.motion
        unit, effort = joint.row.unit, "N m" if joint.row.unit == "rad" else "N"
        applied = -sympify(self.values.acting("damping", joint, f"{effort} s/{unit}")) * motion.rate
        stiffness = sympify(self.values.acting("stiffness", joint, f"{effort}/{unit}"))
        stretch = motion.position - sympify(joint.rest)
        applied -= stiffness * stretch
        moving.outer.potential += stiffness * stretch**2 / 2
        bounds = (("lower", unit), ("upper", unit), ("velocity", f"{unit}/s"), ("effort", effort))
        bound = {name: self.values.limit(joint, name, of) for name, of in bounds}
        self.limits[joint.name] = Limits(motion.position, **bound)
        applied += self._drive(joint, bound["effort"])
        if applied != 0:
            self._push(moving, applied)
        if joint.stops:
            gaps = (motion.position - bound["lower"], bound["upper"] - motion.position)
            self.contacts += [Contact(gap=gap) for gap in gaps]
        force = self.values.acting("friction", joint, effort)
        if force != 0:
            self.contacts.append(Contact(slip=motion.rate, force=force))

    def _drive(self, joint: RobotJoint, effort: Any) -> Expr:
        """The torque or force of a joint's motors, whose inputs are added."""
        found = S.Zero
        for motor in (each for each in self.robot.motors if each.joint == joint.name):
            control = of_time(motor.name)
            self.inputs[control] = None
            found += within(motor.force, sympify(motor.gear) * within(motor.control, control))
        saturates = joint.saturates and effort and found != 0
        return within((-effort, effort) if saturates else None, found)

    def _act_on_several(self, moving: _MovingJoint) -> None:
        """Add the damper of a ball joint, or one that floats from the ground; name what else is."""
        joint, inner, outer = moving.joint, moving.inner, moving.outer
        found = {"dry friction": joint.friction, "a spring": joint.stiffness}
        from_ground = inner is self.root and not moving.turned
        if joint.kind == "ball" or (joint.kind == "floating" and from_ground):
            damping = sympify(self.values.acting("damping", joint, "N m s/rad"))
            spin = outer.frame.ang_vel_in(inner.frame)
            self.loads += [(outer.frame, -damping * spin), (inner.frame, damping * spin)]
            if joint.kind == "floating":
                rates = [speed.symbol for speed in moving.motion.speeds[:3]]
                velocity = vector_along(apply(moving.place.rotation, rates), inner.frame)
                self.loads.append((outer.point, -damping * velocity))
        else:
            found["damping"] = joint.damping
        if not moving.motion.quaternion:
            found["a rotor"] = joint.armature
        self.skipped += [
            f"{what} of the {joint.kind} joint {joint.name} ({value})"
            for what, value in found.items()
            if value
        ]

    def _push(self, moving: _MovingJoint, size: Expr) -> None:
        """Add a torque about the axis or a force along it, on the child, and its reaction."""
        inner, outer = moving.inner, moving.outer
        along = (-size if moving.turned else size) * vector_along(moving.joint.axis, outer.frame)
        if moving.joint.row.unit == "rad":
            self.loads += [(outer.frame, along), (inner.frame, -along)]
            return
        start = inner.point.locatenew(
            f"{moving.joint.name} start", vector_along(moving.place.origin, inner.frame)
        )
        self.loads += [(outer.point, along), (start, -along)]

    def _joint(self, moving: _MovingJoint) -> Joint:
        joint, motion, outer = moving.joint, moving.motion, moving.outer
        parent = _side(f"{joint.name} start", moving.inner, moving.place)
        child = Side(outer.body, outer.point, outer.frame)
        if moving.turned:
            parent, child = child, parent
        own = (tuple(c.symbol for c in motion.coordinates), tuple(s.symbol for s in motion.speeds))
        return Joint(
            joint.name, parent.body, child.body, parent.point, child.point, parent.frame,
            child.frame, *own, quaternion=motion.quaternion,
        )  # fmt: skip

    def _cut(self, joint: RobotJoint) -> Joint:
        (one, at_one), (other, at_other) = self.parts[joint.parent], self.parts[joint.child]
        if one is other:
            raise MechanismError(
                f"{self.robot.name}: the joint {joint.name!r} closes a loop of links that are "
                "fixed to each other; remove it from the file"
            )
        on_parent = at_one.then(cut_place(joint, self._on_parent(joint)))
        on_child = at_other.then(cut_place(joint, place_of(joint.child_origin)))
        name = self._point_name(f"{joint.name} cut")
        self._add_point(name, one, on_parent)
        if joint.kind == "distance":  # whose points are two
            self._add_point(self._point_name(f"{joint.name} end"), other, on_child)
        else:
            other.line.append(name)
        parent = _side(f"{joint.name} on {joint.parent}", one, on_parent)
        child = _side(f"{joint.name} on {joint.child}", other, on_child)
        return cut_joint(joint, parent, child, self.tree.distance(joint))

    # -- bodies ----------------------------------------------------------------------------

    def _embody(self) -> None:
        """Add a body for every moving part; also for one without mass."""
        self._refuse_massless()
        for part in (moving.outer for moving in self.moving):
            whole = combine(part.inertias)
            centre = part.point.locatenew(
                f"{part.name} centre", vector_along(whole.centre, part.frame)
            )
            central = _dyadic(part.frame, whole.about)
            mass = sympify(whole.mass)
            part.body = RigidBody(part.name, centre, part.frame, mass, (central, centre))
            part.body.potential_energy = part.potential

    def _refuse_massless(self) -> None:
        """Refuse joints that, with those that mimic them, move nothing that has inertia."""
        moves = dict.fromkeys((m.joint.name for m in self.moving if m.joint.mimic is None), False)
        heavy: set[int] = set()  # numbers of groups that have inertia, or carry one that has
        for moving in reversed(self.moving):
            joint, outer = moving.joint, moving.outer
            if id(outer) in heavy or not combine(outer.inertias).vanishes:
                heavy |= {id(outer), id(moving.inner)}
            owns = [joint.name] if joint.mimic is None else [e.joint for e in joint.mimic.terms]
            for own in owns:
                moves[own] = moves[own] or id(outer) in heavy or joint.armature != 0
        massless = ", ".join(repr(name) for name, any_inertia in moves.items() if not any_inertia)
        if massless:
            raise MechanismError(
                f"{self.robot.name}: nothing that these joints move, or joints that mimic them, "
                f"has mass or inertia, so no acceleration is defined: {massless}; write "
                'type="fixed" for them, or give a link that they move an <inertial>'
            )

    def _add_rotors(self, moving: _MovingJoint) -> None:
        """Add bodies on the ground that turn with a joint's coordinates, where that has a rotor.

        That of a ball joint turns as its child does; a floating joint has one such, and one for
        each of its ways.
        """
        joint, motion, root = moving.joint, moving.motion, self.root
        if not (motion.quaternion or joint.row.unit):
            return
        unit = "kg" if joint.row.unit == "m" else "kg m^2"
        size = sympify(self.values.acting("armature", joint, unit))
        if size == 0:
            return
        turns, pairs = [], [(motion.position, motion.rate)]
        if motion.quaternion:
            turns = [(motion.rotation, motion.turning)]
            ways = zip(motion.coordinates, motion.speeds, strict=False)
            pairs = [(q.symbol, u.symbol) for q, u in ways if q.quantity.unit == "m"]
        turns += [(about((1, 0, 0), position), (rate, 0, 0)) for position, rate in pairs]
        for number, (rotation, spin) in enumerate(turns):
            name = f"{joint.name} rotor" + f" {number}" * (len(turns) > 1)
            frame = ReferenceFrame(name)
            orient(frame, root.frame, rotation)
            frame.set_ang_vel(root.frame, vector_along(spin, frame))
            central = (inertia(frame, size, size, size), root.point)
            body = RigidBody(name, root.point, frame, S.Zero, central)
            self.bodies.append(body)
            self.joints.append(Joint(name, None, body, root.point, root.point, root.frame, frame))

    # -- the whole -------------------------------------------------------------------------

    def mechanism(self) -> Mechanism:
        motions, root = self.motions.values(), self.root
        g = Symbol("g")
        down, size = _direction(self.robot.gravity)
        along = "-z" if down == DOWN else "({:.3g}, {:.3g}, {:.3g})".format(*map(float, down))
        weight = Parameter(g, size, Quantity("m/s^2", f"acceleration of free fall, along {along}"))
        return Mechanism(
            name=self.robot.name,
            title=self.robot.name,
            frame=root.frame,
            origin=root.point,
            coordinates=tuple(c for m in motions for c in m.coordinates),
            speeds=tuple(s for m in motions for s in m.speeds),
            kinematics=tuple(k for m in motions for k in m.kinematics),
            parameters=(*self.values.parameters, weight),
            bodies=tuple(body for body in self.bodies if body is not None),
            loads=tuple(load for load in self.loads if load[0] is not root.frame),
            points=tuple(self.points.values()),
            drawing=self._drawing(),
            start=self._start(),
            skipped=tuple(self.skipped),
            inputs=self.inputs,
            gravity=g * vector_along(down, root.frame),
            joints=tuple(self.joints),
            limits=self.limits,
            contacts=tuple(self.contacts),
        )

    def _start(self) -> dict[str, float]:
        """Where coordinates are zero, or at the stop nearest to it; as the file has it, loops are
        closed there."""
        motions = self.motions.values()
        names = [c.symbol.func.__name__ for m in motions for c in m.coordinates]
        zero = dict.fromkeys(names, 0.0) if self.tree.cuts else {}
        for each in () if self.tree.cuts else self.moving:
            if each.joint.stops and each.joint.mimic is None:
                lower, upper = (float(each.joint.limits[end]) for end in ("lower", "upper"))
                if not lower <= 0.0 <= upper:
                    name = each.motion.coordinates[0].symbol.func.__name__
                    zero[name] = lower if lower > 0.0 else upper
        return zero | {name: x for m in motions for name, x in m.start.items()}

    def _drawing(self) -> Drawing:
        """Lines from each part's origin to its points and those of the parts that it carries."""
        lines: dict[str, list[str]] = {}
        for moving in self.moving:
            outer, inner = moving.outer, moving.inner
            lines.setdefault(outer.point.name, outer.line)
            lines.setdefault(inner.point.name, inner.line).append(outer.point.name)
        links = dict[str, tuple[str, ...]]()
        for name, line in lines.items():  # from the first point to each of the others and back
            first, *others = dict.fromkeys(line)
            links[name] = tuple(n for other in others for n in (first, other)) or (first,)
        ends = [line[-1] for _, line in links.items()]
        return Drawing(
            links=tuple((name, line) for name, line in links.items() if len(line) > 1),
            ground=(self.root.point.name,),
            traced=tuple(ends[-1:]),
            view=("x", "z"),
            solids=tuple(self.solids),
        )


def _direction(vector: V3) -> tuple[V3, float]:
    """The direction of a vector, DOWN of a zero one, and its length."""
    length = hypot(*vector)
    if not any(vector[:2]) and vector[2] <= 0:
        return DOWN, length
    x, y, z = (x / length for x in vector)
    return (x, y, z), length


def _dyadic(frame: ReferenceFrame, rows: Sequence[Sequence[Any]]) -> Dyadic:
    """The dyadic of a symmetric matrix, of which the upper half counts; in one step, since a sum
    compares the texts of all terms."""
    axes, half = (frame.x, frame.y, frame.z), enumerate(rows)
    terms = {(i, j): sympify(row[j]) for i, row in half for j in range(i, 3)}
    entries = [(terms[min(i, j), max(i, j)], i, j) for i in range(3) for j in range(3)]
    return Dyadic([(value, axes[i], axes[j]) for value, i, j in entries if value != 0])


def _side(name: str, part: _RigidGroup, place: Place) -> Side:
    """A point and a frame at a place on a part."""
    frame = part.frame
    if place.rotation != IDENTITY:
        frame = ReferenceFrame(name)
        orient(frame, part.frame, place.rotation)
        frame.set_ang_vel(part.frame, Vector(0))
    point = part.point.locatenew(name, vector_along(place.origin, part.frame))
    return Side(part.body, point, frame)
