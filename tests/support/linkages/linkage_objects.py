"""Random linkages as the compiler and SymPy describe them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mechc_codegen.description.mechanism import (
    Closure,
    Constraint,
    Coordinate,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
)
from sympy import Expr, Rational, S, Symbol, cos, zeros
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
    inertia,
)
from sympy.physics.vector import Vector

from tests.support.linkages.random_mechanisms import GROUND, Link, Linkage, Vector3, values

t = dynamicsymbols._t
l, g, k, d, tau = map(Symbol, ("l", "g", "k", "d", "tau"))
ONE = Quantity("1", "number")


def coordinates(linkage: Linkage) -> tuple[Sequence[Expr], Sequence[Expr]]:
    """q and u."""
    size = len(linkage.links)
    return dynamicsymbols(f"q_0:{size}"), dynamicsymbols(f"u_0:{size}")


def vector(entries: Vector3, frame: ReferenceFrame, scale: Expr = S.One) -> Vector:
    x, y, z = (Rational(e.numerator, e.denominator) * scale for e in entries)
    return x * frame.x + y * frame.y + z * frame.z


def _body(number: int, link: Link, centre: Point, frame: ReferenceFrame) -> RigidBody:
    mass = Symbol(f"m_{number}")
    moments = [Rational(i.numerator, i.denominator) * mass * l**2 for i in link.inertia]
    return RigidBody(f"body {number}", centre, frame, mass, (inertia(frame, *moments), centre))


class Description:
    """Frames, points, bodies and loads, from joint to joint; with u or with q' for speeds."""

    def __init__(self, linkage: Linkage, speeds: Sequence[Expr] | None = None) -> None:
        self.linkage = linkage
        self.q, self.u = coordinates(linkage)
        self.rates = self.u if speeds is None else speeds
        self.inertial, self.origin = ReferenceFrame("N"), Point("O")
        self.origin.set_vel(self.inertial, 0)
        self.frames: list[ReferenceFrame] = []
        self.joints: list[Point] = []
        self.bodies: list[RigidBody] = []
        self.loads: list[tuple[Any, Vector]] = []
        for number, link in enumerate(linkage.links):
            self._add(number, link)

    def carrier(self, link: int) -> tuple[ReferenceFrame, Point]:
        ground = link == GROUND
        return (
            self.inertial if ground else self.frames[link],
            self.origin if ground else self.joints[link],
        )

    def at(self, name: str, link: int, arm: Vector3) -> Point:
        """A point of a link."""
        frame, joint = self.carrier(link)
        return joint.locatenew(name, vector(arm, frame, l))

    def _add(self, number: int, link: Link) -> None:
        on, _ = self.carrier(link.parent)
        axis = vector(link.axis, on)
        joint = seat = self.at(f"seat {number}", link.parent, link.place)
        frame = on.orientnew(f"B{number}", "Axis", (self.q[number] if link.turns else 0, axis))
        frame.set_ang_vel(on, self.rates[number] * axis if link.turns else 0)
        if not link.turns:
            joint = seat.locatenew(f"slider {number}", self.q[number] * axis)
        self.frames.append(frame)
        self.joints.append(joint)
        centre = self.at(f"centre {number}", number, link.centre)
        self.bodies.append(_body(number, link, centre, frame))
        force = (tau * cos(t) * link.driven - d * self.rates[number] * link.damper) * axis
        places = (frame, on) if link.turns else (joint, seat)
        self.loads += [(places[0], force), (places[1], -force)] if force != 0 else []

    def springs(self) -> Expr:
        """Their potential energy."""
        pairs = zip(self.q, self.linkage.links, strict=True)
        return sum((k * q**2 / 2 for q, link in pairs if link.spring), S.Zero)

    def spring_loads(self) -> list[tuple[Any, Vector]]:
        loads: list[tuple[Any, Vector]] = []
        for number, link in enumerate(self.linkage.links):
            on, _ = self.carrier(link.parent)
            pull = -k * self.q[number] * vector(link.axis, on)
            seat = self.at(f"anchor {number}", link.parent, link.place)
            places = (self.frames[number], on) if link.turns else (self.joints[number], seat)
            loads += [(places[0], pull), (places[1], -pull)] if link.spring else []
        return loads

    def gravity(self) -> Vector:
        return vector(self.linkage.gravity, self.inertial, g)

    def weight(self) -> Expr:
        """Potential energy of all weights."""
        heights = [
            -b.mass * self.gravity().dot(b.masscenter.pos_from(self.origin)) for b in self.bodies
        ]
        return sum(heights, S.Zero)

    def closures(self) -> tuple[Closure, ...]:
        loop, frame = self.linkage.loop, self.inertial
        if loop is None:
            return ()
        ends = (
            self.at("end", loop.link, loop.point),
            self.at("target", loop.target_link, loop.target),
        )
        axes = [(frame.x, frame.y, frame.z)[axis] for axis in loop.axes]
        return (Closure("loop", *ends, tuple(axes)),)

    def constraints(self) -> list[Expr]:
        return [row.expression for closure in self.closures() for row in closure.constraints()]


def mechanism(linkage: Linkage) -> Mechanism:
    """By bodies and loads, the loop as a cut: what both derivations take."""
    made = Description(linkage)
    if made.springs() != 0:
        made.bodies[0].potential_energy = made.springs()
    return _mechanism(
        made,
        bodies=tuple(made.bodies),
        loads=(*made.loads, *made.spring_loads()),
        gravity=made.gravity(),
        closures=made.closures(),
        points=tuple(body.masscenter for body in made.bodies),
    )


def by_lagrangian(linkage: Linkage) -> Mechanism:
    """The same by its L; the loop written out."""
    made = Description(linkage, [q.diff(t) for q in coordinates(linkage)[0]])
    return _mechanism(
        made,
        bodies=(),
        loads=tuple(made.loads),
        lagrangian=_kinetic(made) - made.weight() - made.springs(),
        configuration_constraints=tuple(
            Constraint(f"row {i}", row, "m") for i, row in enumerate(made.constraints())
        ),
    )


def _kinetic(made: Description) -> Expr:
    for body in made.bodies:
        place = body.masscenter
        place.set_vel(made.inertial, place.pos_from(made.origin).dt(made.inertial))
    return sum((body.kinetic_energy(made.inertial) for body in made.bodies), S.Zero)


def _mechanism(made: Description, **parts: Any) -> Mechanism:
    known = values(made.linkage)
    return Mechanism(
        name="linkage",
        title="Linkage",
        frame=made.inertial,
        origin=made.origin,
        coordinates=tuple(Coordinate(q, ONE) for q in made.q),
        speeds=tuple(Speed(u, ONE) for u in made.u),
        kinematics=tuple(made.u),
        parameters=tuple(Parameter(Symbol(name), value, ONE) for name, value in known.items()),
        **parts,
    )


def system(linkage: Linkage, *, speeds: bool = True) -> System:
    """The same by SymPy's joints; without speeds of its own it is one for Lagrange's method."""
    q, u = coordinates(linkage)
    rates = u if speeds else [x.diff(t) for x in q]
    ground = RigidBody("ground")
    made = System.from_newtonian(ground)
    bodies: list[RigidBody] = []
    for number, link in enumerate(linkage.links):
        parent, arm = ground, link.place
        if link.parent != GROUND:
            parent = bodies[link.parent]
            before = linkage.links[link.parent].centre
            arm = tuple(a - b for a, b in zip(link.place, before, strict=True))
        frame = ReferenceFrame(f"B{number}")
        body = _body(number, link, Point(f"centre {number}"), frame)
        kind = PinJoint if link.turns else PrismaticJoint
        axis = vector(link.axis, parent.frame)
        joint = kind(
            f"joint {number}", parent, body, q[number], rates[number],
            parent_point=vector(arm, parent.frame, l),
            child_point=-vector(link.centre, frame, l),
            joint_axis=axis,
        )  # fmt: skip
        made.add_joints(joint)
        bodies.append(body)
        _load_joint(made, joint, axis, link, (q[number], rates[number]))
    _close(made, linkage, bodies)
    made.apply_uniform_gravity(vector(linkage.gravity, made.frame, g))
    return made


def _load_joint(
    made: System, joint: Any, axis: Vector, link: Link, state: tuple[Expr, Expr]
) -> None:
    q, rate = state
    force = -k * q * link.spring - d * rate * link.damper + tau * cos(t) * link.driven
    if force == 0:
        return
    ends = (joint.child_point, joint.parent_point)
    if link.turns:
        ends = (joint.child.frame, joint.parent.frame)
    made.add_loads((ends[0], force * axis), (ends[1], -force * axis))


def _close(made: System, linkage: Linkage, bodies: Sequence[RigidBody]) -> None:
    loop = linkage.loop
    if loop is None:
        return

    def place(link: int, arm: Vector3) -> Vector:
        if link == GROUND:
            return vector(arm, made.frame, l)
        body, centre = bodies[link], linkage.links[link].centre
        from_centre = tuple(a - b for a, b in zip(arm, centre, strict=True))
        start = body.masscenter.pos_from(made.fixed_point)
        return start + vector(from_centre, body.frame, l)

    gap = place(loop.link, loop.point) - place(loop.target_link, loop.target)
    axes = (made.frame.x, made.frame.y, made.frame.z)
    made.add_holonomic_constraints(*(gap.dot(axes[i]) for i in loop.axes))
    rows, every = len(loop.axes), list(made.q)
    made.q_ind, made.q_dep = every[:-rows], every[-rows:]
    if len(made.u):
        speeds = list(made.u)
        made.u_ind, made.u_dep = speeds[:-rows], speeds[-rows:]


def formed(made: System) -> System:
    """By Kane's method where it has speeds of its own, else by Lagrange's.

    What SymPy makes of the dependent speeds is not read: they need not be solved for.
    """
    if any(u.is_Derivative for u in made.u):
        made.form_eoms(LagrangesMethod)
    else:
        made.form_eoms(KanesMethod, constraint_solver=lambda a, b: zeros(a.cols, b.cols))
    return made
