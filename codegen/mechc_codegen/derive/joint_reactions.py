"""Joint reactions, by Newton and Euler from the outermost bodies inwards.

Input: a mechanism with joints, and positions and momentum rates by its derivation.
Output: force and torque of every joint, as expressions of state, accelerations and multipliers.
Invariant: each body's sum is formed once, so the work grows with the bodies and not faster.

The subtree beyond a joint is moved only by that joint, by loads and by cut joints:
R = sum of d(m v)/dt - loads - forces of cuts, and the same for moments (Featherstone 2008,
section 5.3).  A cut joint holds g = gap . axis = 0 and a . b = 0 with M u' + J^T lambda = F, so its
force on the child is -lambda axis, and its torque -lambda a x b.  Of a rod, which pulls with the
tension lambda, the axis is gap / length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from sympy import Expr, S
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.derive.equations import Output
from mechc_codegen.derive.load_bodies import LoadBodies
from mechc_codegen.derive.outputs import V3, vectors
from mechc_codegen.description.joints.couplings import CoupledPair
from mechc_codegen.description.joints.tree import Body, Joint, joint_tree, refuse_unreached
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.errors import MechanismError

ZERO: V3 = (S.Zero, S.Zero, S.Zero)


class Kinetics(Protocol):
    """Positions and momentum rates by a derivation, in components along the inertial axes."""

    def total(self, *vectors: V3) -> V3: ...
    def difference(self, a: V3, b: V3) -> V3: ...
    def cross(self, a: V3, b: V3) -> V3: ...
    def scale(self, factor: Expr, a: V3) -> V3: ...

    def along(self, vector: Vector) -> V3: ...
    def position(self, point: Point) -> V3: ...
    def multiplier(self, row: int) -> Expr: ...

    def momentum_rates(self, body: Body) -> tuple[V3, V3]:
        """d(m v)/dt, and dH/dt about the mass centre."""
        ...


@dataclass(frozen=True)
class Wrench:
    """A force, and the moment about the point where it acts."""

    force: V3
    moment: V3
    at: V3


def reaction_outputs(mechanism: Mechanism, kinetics: Kinetics) -> list[Output]:
    """Forces and torques of all joints, parent on child, each of shape (joints, 3).

    Raises
    ------
    MechanismError
        If they are not known; the message says what to add.
    """
    refuse_unknown_reactions(mechanism)
    found = _JointReactions(mechanism, kinetics).of_all()
    names = [joint.name for joint in mechanism.joints]
    acting = "of every joint, by the parent on the child, in the inertial frame"
    return [
        vectors("reaction_forces", f"forces {acting}", names, [w.force for w in found]),
        vectors("reaction_torques", f"torques {acting}", names, [w.moment for w in found]),
    ]


def refuse_unknown_reactions(mechanism: Mechanism) -> None:
    """Refuse mechanisms whose joint reactions cannot be determined.

    Raises
    ------
    MechanismError
        If joints are missing, or it is not known where a force acts.
    """
    name = mechanism.name
    if mechanism.lagrangian is not None:
        raise MechanismError(
            f"{name}: joint reactions need bodies and loads, which a Lagrangian lacks; form a "
            "System by Kane's method, or describe the mechanism by its joints (mechc.from_joints)"
        )
    if not mechanism.joints:
        raise MechanismError(
            f"{name}: joint reactions need joints, and none are known here: a KanesMethod or a "
            "LagrangesMethod has none.  Give a System with joints, or describe the mechanism by "
            "its joints (mechc.from_joints, or Mechanism(..., joints=...)), cut ones as mechc.Cut"
        )
    refuse_unreached(name, joint_tree(mechanism.joints, mechanism.bodies))
    cut = {joint.name for joint in mechanism.joints if joint.is_cut}
    for closure in mechanism.closures:
        if closure.name not in cut:
            raise MechanismError(
                f"{name}: it is not known which bodies the closure {closure.name} connects, so "
                "joint reactions are not; describe it as a joint (mechc.Cut)"
            )
    _refuse_other_constraints(mechanism)


def _refuse_other_constraints(mechanism: Mechanism) -> None:
    """Refuse constraints on the speeds of several joints: where they act is not known."""
    coupled = {joint.name for joint in _couplings(mechanism)}
    every = (*mechanism.configuration_constraints, *mechanism.motion_constraints)
    for constraint in (c for c in every if c.name not in coupled):
        held = _speeds_of(mechanism, constraint.expression)
        within = [j for j in mechanism.joints if held and held <= set(j.speeds)]
        exact = [j for j in within if held == set(j.speeds)]
        if len(within) != 1 and len(exact) != 1:
            raise MechanismError(
                f"{mechanism.name}: the constraint {constraint.name} is an expression, so it is "
                "not known which bodies its force acts on, and joint reactions are not; describe "
                "it as a joint (mechc.Cut)"
            )


def _couplings(mechanism: Mechanism) -> list[CoupledPair]:
    return [joint for joint in mechanism.joints if isinstance(joint, CoupledPair)]


def _speeds_of(mechanism: Mechanism, expression: Expr) -> set[AppliedUndef]:
    """The speeds that the rate of a constraint is linear in."""
    coordinates = expression.atoms(AppliedUndef) & set(mechanism.q)
    rates = dict(zip(mechanism.q, mechanism.kinematics, strict=True))
    held: set[AppliedUndef] = expression.xreplace(mechanism.rates).atoms(AppliedUndef)
    held = held.union(*(rates[q].atoms(AppliedUndef) for q in coordinates))
    return held & set(mechanism.u)


class _JointReactions:
    """Sums over the subtree beyond each joint."""

    def __init__(self, mechanism: Mechanism, kinetics: Kinetics) -> None:
        self.mechanism, self.kinetics = mechanism, kinetics
        self._outside: dict[Body | None, list[Wrench]] = {}
        self._found: dict[str, Wrench] = {}

    def of_all(self) -> list[Wrench]:
        """The wrench of each joint on its child, about the child's point."""
        self._apply_loads()
        self._apply_constraints()
        tree = joint_tree(self.mechanism.joints, self.mechanism.bodies)
        for branch in reversed(tree.branches):
            at = self.kinetics.position(branch.joint.child_point)
            needed = self._needed_wrench(branch.body, at)
            self._add(branch.inner, self._opposite(needed))
            self._found[branch.joint.name] = needed if branch.sign > 0 else self._opposite(needed)
        return [self._found[joint.name] for joint in self.mechanism.joints]

    def _add(self, body: Body | None, wrench: Wrench) -> None:
        self._outside.setdefault(body, []).append(wrench)

    def _opposite(self, wrench: Wrench) -> Wrench:
        acting = (wrench.force, wrench.moment)
        force, moment = (self.kinetics.scale(S.NegativeOne, v) for v in acting)
        return Wrench(force, moment, wrench.at)

    def _needed_wrench(self, body: Body, at: V3) -> Wrench:
        """The wrench for the body's motion minus all other wrenches on it, about a point."""
        k = self.kinetics
        force, moment = k.momentum_rates(body)
        centre = k.position(body.masscenter)
        for other in self._outside.pop(body, []):
            arm = k.difference(other.at, centre)
            turning = k.total(other.moment, k.cross(arm, other.force))
            force, moment = k.difference(force, other.force), k.difference(moment, turning)
        arm = k.difference(centre, at)
        return Wrench(force, k.total(moment, k.cross(arm, force)), at)

    def _apply_loads(self) -> None:
        k, load_bodies = self.kinetics, LoadBodies(self.mechanism)
        for place, vector in self.mechanism.loads:
            value = k.along(vector)
            if isinstance(place, ReferenceFrame):
                self._add(load_bodies.of(place), Wrench(ZERO, value, ZERO))
            else:
                self._add(load_bodies.of(place), Wrench(value, ZERO, k.position(place)))
        if self.mechanism.gravity is not None:
            for body in self.mechanism.bodies:
                weight = k.along(body.mass * self.mechanism.gravity)
                self._add(body, Wrench(weight, ZERO, k.position(body.masscenter)))

    def _apply_constraints(self) -> None:
        """Add the wrenches of cut joints and couplings, and opposite ones to the parents."""
        k, row = self.kinetics, len(self.mechanism.configuration_constraints)
        joints = {joint.name: joint for joint in self.mechanism.joints if joint.is_cut}
        self._found |= dict.fromkeys(joints, Wrench(ZERO, ZERO, ZERO))  # without constraints
        for closure in self.mechanism.closures:
            joint, axes = joints[closure.name], [k.along(axis) for axis in closure.directions]
            turning = [k.cross(k.along(a), k.along(b)) for a, b in closure.perpendicular]
            force = self._weighted_sum(axes, row)
            moment = self._weighted_sum(turning, row + len(axes))
            self._add_pair(joint, Wrench(force, moment, k.position(joint.child_point)))
            row += len(closure.rows)
        names = [c.name for c in self.mechanism.configuration_constraints]
        for coupling in _couplings(self.mechanism):
            weight = k.multiplier(names.index(coupling.name))
            force, torque = (k.scale(weight, k.along(v)) for v in (coupling.force, coupling.torque))
            self._add_pair(coupling, Wrench(force, torque, k.position(coupling.child_point)))

    def _add_pair(self, joint: Joint, wrench: Wrench) -> None:
        """Add a wrench to the child, and the opposite one to the parent."""
        self._found[joint.name] = wrench
        self._add(joint.child, wrench)
        self._add(joint.parent, self._opposite(wrench))

    def _weighted_sum(self, directions: Sequence[V3], row: int) -> V3:
        """The negative sum of multiplier times direction, with multipliers from a given row on."""
        k = self.kinetics
        parts = [
            k.scale(-k.multiplier(row + i), direction) for i, direction in enumerate(directions)
        ]
        return k.total(ZERO, *parts)
