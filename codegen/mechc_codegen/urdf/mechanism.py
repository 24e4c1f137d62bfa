"""A robot in a URDF file -> Mechanism: :func:`from_urdf`.

Links that are fixed to each other are one body.  Each body's frame is oriented against the one
before it in one step, in which the constant rotations are multiplied out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sympy import Expr, Symbol, sympify
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, inertia
from sympy.physics.vector import Vector

from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.mechanism import Limits, Load, Mechanism, Parameter, Quantity
from mechc_codegen.description.solid import Solid
from mechc_codegen.description.terms import vector_along
from mechc_codegen.errors import MechanismError
from mechc_codegen.urdf.geometry import IDENTITY, Inertia, Place, combine, of_angles
from mechc_codegen.urdf.moving import JointMotion, motion_of, of_time, orient
from mechc_codegen.urdf.read import read_robot
from mechc_codegen.urdf.robot import SINGLE, TURNING, Robot, RobotJoint, RobotLink
from mechc_codegen.urdf.tree import as_tree
from mechc_codegen.urdf.values import RobotValues

WORLD, BASE = "world", "base"  # what a floating base is joined to, and its joint


def from_urdf(
    path: str | Path,
    symbolic: Iterable[Any] = (),
    *,
    driven: Iterable[str] | str = (),
    floating: bool = False,
    name: str | None = None,
) -> Mechanism:
    """The robot in a URDF file, as a mechanism to compile.

    Coordinates ``q_JOINT`` and speeds ``u_JOINT`` of revolute, continuous and prismatic joints, in
    rad and m; a floating joint has those of :class:`mechc.FreeJoint`; a planar one ``x_JOINT,
    y_JOINT, q_JOINT`` and their rates ``vx_JOINT, vy_JOINT, u_JOINT``, x and y across its axis.  A
    joint that mimics another has none of its own, its position is an expression of the other's.
    Links are those of the file, fixed to each other where a joint is fixed; the root is the ground.

    Parameters
    ----------
    path
        A URDF file.  It is untrusted: no entity is expanded and no other file is opened.
    symbolic
        What becomes parameters with the file's numbers for defaults; everything else is compiled
        in.  Kinds of values, for all links and joints: ``"mass"`` (``m_LINK``), ``"centre"``
        (``cx_LINK``, ...), ``"inertia"`` (``Ixx_LINK``, ..., about the mass centre), ``"origin"``
        of joints (``ox_JOINT``, ...), ``"orientation"`` (``roll_JOINT``, ``pitch_``, ``yaw_``),
        ``"damping"`` (``d_JOINT``), ``"limits"`` (``lower_JOINT``, ``upper_``, ``velocity_``,
        ``effort_``); or pairs of a name and a kind, ``("forearm", "mass")``.
    driven
        Names of joints, or ``"all"`` with one coordinate: each has an input ``tau_JOINT``, the
        torque (N m) or force (N) of its motor, which is given with a run.
    floating
        The root moves freely: a floating joint ``base`` joins it to the ground.
    name
        Name of the mechanism; by default the robot's.

    Returns
    -------
    Mechanism
        Its ``limits`` have the bounds of the joints, which nothing enforces: see
        :class:`mechc.Stop`.  Weight has the parameter ``g``, along -z of the root.

    Raises
    ------
    MechanismError
        If the file is no URDF or contradicts itself; the message names the link or the joint.
    """
    robot = as_tree(read_robot(Path(path)))
    robot = _with_floating_base(robot) if floating else robot
    if all(joint.kind == "fixed" for joint in robot.joints):
        raise MechanismError(
            f"{robot.name}: no joint of the file moves; floating=True frees the root"
        )
    robot = robot if name is None else replace(robot, name=name)
    values = RobotValues(robot, symbolic)
    return _MechanismBuilder(robot, values, _names_of_driven(robot, driven)).mechanism()


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


def _names_of_driven(robot: Robot, given: Iterable[str] | str) -> set[str]:
    own = {j.name for j in robot.joints if j.kind in SINGLE and j.mimic is None}
    names = own if given == "all" else {given} if isinstance(given, str) else {*given}
    for each in sorted(names - own):
        raise MechanismError(
            f"{robot.name}: driven={each!r} is no joint with a coordinate of its own; these are "
            f"{', '.join(map(repr, sorted(own)))}"
        )
    return names


@dataclass
class _RigidGroup:
    """Links that are fixed to each other, on the frame of the first."""

    point: Point
    frame: ReferenceFrame
    inertias: list[Inertia] = field(default_factory=list)
    body: RigidBody | None = None
    line: list[str] = field(default_factory=list)


class _MechanismBuilder:
    """The parts of the mechanism, joint after joint from the root outwards."""

    def __init__(self, robot: Robot, values: RobotValues, driven: set[str]) -> None:
        self.robot, self.values, self.driven = robot, values, driven
        self.points: dict[str, Point] = {}
        self.parts: dict[str, tuple[_RigidGroup, Place]] = {}
        self.motions: dict[str, JointMotion] = {}
        self.joints: list[tuple[RobotJoint, _RigidGroup, _RigidGroup, Place]] = []
        self.loads: list[Load] = []
        self.inputs: dict[Any, None] = {}
        self.limits: dict[str, Limits] = {}
        self.solids: list[Solid] = []
        for joint in sorted(robot.joints, key=lambda each: each.mimic is not None):
            if joint.kind != "fixed":  # those that mimic follow others, which may come after them
                self.motions[joint.name] = motion_of(joint, self.motions)
        self._begin(robot.root, Point(robot.root), ReferenceFrame(robot.root))
        for joint in robot.joints:
            self._beyond(joint)
        self._embody()

    # -- links -----------------------------------------------------------------------------

    def _begin(self, link: str, point: Point, frame: ReferenceFrame) -> _RigidGroup:
        part = _RigidGroup(point, frame)
        self.points[link] = point
        self._attach(link, part, Place())
        return part

    def _attach(self, name: str, part: _RigidGroup, place: Place) -> None:
        """Add a link at a place on its part: its inertia and its shapes."""
        link = self.robot.links[name]
        self.parts[name] = (part, place)
        part.line.append(self.points[name].name)
        turned = Inertia(0, (0, 0, 0), self.values.inertia(link))
        about = turned.transform(Place(of_angles(link.centre.rpy))).about
        own = Inertia(self.values.mass(link), self.values.centre(link), about)
        part.inertias.append(own.transform(place))
        for visual in link.visuals:
            shape = place.then(Place(of_angles(visual.pose.rpy), visual.pose.xyz))
            frame = _frame_at(f"{visual.label} shape", part, shape)
            arm = vector_along(shape.origin, part.frame)
            at = part.point.locatenew(f"{visual.label} shape", arm)
            on = None if visual.kind == "ball" else frame
            self.solids.append(Solid(visual.kind, visual.label, at, on, tuple(visual.sizes)))

    # -- joints ----------------------------------------------------------------------------

    def _beyond(self, joint: RobotJoint) -> None:
        carrier, at = self.parts[joint.parent]
        rotation = of_angles(self.values.orientation(joint))
        place = at.then(Place(rotation, self.values.origin(joint)))
        point = Point(joint.child)
        if joint.kind == "fixed":
            point.set_pos(carrier.point, vector_along(place.origin, carrier.frame))
            self.points[joint.child] = point
            self._attach(joint.child, carrier, place)
            return
        motion = self.motions[joint.name]
        frame = ReferenceFrame(joint.child)
        motion.place(place, (point, frame), (carrier.point, carrier.frame))
        part = self._begin(joint.child, point, frame)
        self.joints.append((joint, carrier, part, place))
        if joint.kind in SINGLE:
            self._act(joint, motion, (carrier, part), place)

    def _act(
        self,
        joint: RobotJoint,
        motion: JointMotion,
        sides: tuple[_RigidGroup, _RigidGroup],
        place: Place,
    ) -> None:
        """Add the motor and the damper of a joint, and its limits."""
        unit = "rad" if joint.kind in TURNING else "m"
        effort = {"rad": "N m", "m": "N"}[unit]
        applied = -sympify(self.values.damping(joint, f"{effort} s/{unit}")) * motion.rate
        if joint.name in self.driven:
            torque = of_time(f"tau_{joint.name}")
            self.inputs[torque] = None
            applied += torque
        if applied != 0:
            self._push(joint, applied, sides, place)
        bounds = (("lower", unit), ("upper", unit), ("velocity", f"{unit}/s"), ("effort", effort))
        bound = {name: self.values.limit(joint, name, of) for name, of in bounds}
        self.limits[joint.name] = Limits(motion.position, **bound)

    def _push(
        self, joint: RobotJoint, size: Expr, sides: tuple[_RigidGroup, _RigidGroup], place: Place
    ) -> None:
        """Add a torque about the axis or a force along it, on the child, and its reaction."""
        carrier, part = sides
        along = size * vector_along(joint.axis, part.frame)
        if joint.kind in TURNING:
            self.loads += [(part.frame, along), (carrier.frame, -along)]
            return
        start = Point(f"{joint.name} start")
        start.set_pos(carrier.point, vector_along(place.origin, carrier.frame))
        self.loads += [(part.point, along), (start, -along)]

    # -- bodies ----------------------------------------------------------------------------

    def _embody(self) -> None:
        """Add a body for every moving part; also for one without mass."""
        self._refuse_massless()
        for joint, _, part, _ in self.joints:
            whole = combine(part.inertias)
            centre = part.point.locatenew(
                f"{joint.child} centre", vector_along(whole.centre, part.frame)
            )
            (xx, xy, xz), (_, yy, yz), (*_, zz) = whole.about
            about = inertia(part.frame, *map(sympify, (xx, yy, zz, xy, yz, xz)))
            mass = sympify(whole.mass)
            part.body = RigidBody(joint.child, centre, part.frame, mass, (about, centre))

    def _refuse_massless(self) -> None:
        """Refuse joints that, with those that mimic them, move nothing that has inertia."""
        moves = dict.fromkeys((j.name for j, *_ in self.joints if j.mimic is None), False)
        for joint, _, part, _ in self.joints:
            own = joint.name if joint.mimic is None else joint.mimic.joint
            moves[own] = moves[own] or self._has_inertia(part)
        massless = ", ".join(repr(name) for name, any_inertia in moves.items() if not any_inertia)
        if massless:
            raise MechanismError(
                f"{self.robot.name}: nothing that these joints move, or joints that mimic them, "
                f"has mass or inertia, so no acceleration is defined: {massless}; write "
                'type="fixed" for them, or give a link that they move an <inertial>'
            )

    def _has_inertia(self, part: _RigidGroup) -> bool:
        """Whether this part, or any that it carries, has inertia."""
        beyond = (child for _, parent, child, _ in self.joints if parent is part)
        return not combine(part.inertias).vanishes or any(map(self._has_inertia, beyond))

    # -- the whole -------------------------------------------------------------------------

    def mechanism(self) -> Mechanism:
        root, _ = self.parts[self.robot.root]
        motions = self.motions.values()
        g = Symbol("g")
        weight = Parameter(g, 9.81, Quantity("m/s^2", "acceleration of free fall, along -z"))
        return Mechanism(
            name=self.robot.name,
            title=self.robot.name,
            frame=root.frame,
            origin=root.point,
            coordinates=tuple(c for m in motions for c in m.coordinates),
            speeds=tuple(s for m in motions for s in m.speeds),
            kinematics=tuple(k for m in motions for k in m.kinematics),
            parameters=(*self.values.parameters, weight),
            bodies=tuple(part.body for _, _, part, _ in self.joints if part.body is not None),
            loads=tuple(load for load in self.loads if load[0] is not root.frame),
            points=tuple(self.points.values()),
            drawing=self._drawing(root),
            start={name: x for m in motions for name, x in m.start.items()},
            skipped=tuple(
                f"dry friction of the joint {joint.name} ({joint.friction})"
                for joint in self.robot.joints
                if joint.friction
            ),
            inputs=self.inputs,
            gravity=-g * root.frame.z,
            joints=tuple(self._joint(*each) for each in self.joints),
            limits=self.limits,
        )

    def _joint(
        self, joint: RobotJoint, carrier: _RigidGroup, part: _RigidGroup, place: Place
    ) -> Joint:
        at = _frame_at(f"{joint.name} start", carrier, place)
        start = carrier.point.locatenew(
            f"{joint.name} start", vector_along(place.origin, carrier.frame)
        )  # fmt: skip
        motion = self.motions[joint.name]
        own = (tuple(c.symbol for c in motion.coordinates), tuple(s.symbol for s in motion.speeds))
        return Joint(
            joint.name, carrier.body, part.body, start, part.point, at, part.frame, *own,
            quaternion=motion.quaternion,
        )  # fmt: skip

    def _drawing(self, root: _RigidGroup) -> Drawing:
        """Lines from each part's origin to those of its links and of the parts that it carries."""
        lines: dict[str, list[str]] = {}
        for _, carrier, part, _ in self.joints:
            lines.setdefault(part.point.name, part.line)
            lines.setdefault(carrier.point.name, carrier.line).append(part.point.name)
        links = dict[str, tuple[str, ...]]()
        for name, line in lines.items():  # from the first point to each of the others and back
            first, *others = dict.fromkeys(line)
            links[name] = tuple(n for other in others for n in (first, other)) or (first,)
        ends = [line[-1] for _, line in links.items()]
        return Drawing(
            links=tuple((name, line) for name, line in links.items() if len(line) > 1),
            ground=(root.point.name,),
            traced=tuple(ends[-1:]),
            view=("x", "z"),
            solids=tuple(self.solids),
        )


def _frame_at(name: str, part: _RigidGroup, place: Place) -> ReferenceFrame:
    if place.rotation == IDENTITY:
        return part.frame
    frame = ReferenceFrame(name)
    orient(frame, part.frame, place.rotation)
    frame.set_ang_vel(part.frame, Vector(0))
    return frame
