"""Open trees in Exudyn in the coordinates of their joints, and a body on a fixed point."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadForceVector,
    MarkerBodyPosition,
    MarkerKinematicTreeRigid,
    NodeGenericODE2,
    NodeRigidBodyRotVecLG,
    ObjectKinematicTree,
    ObjectRigidBody,
)
from exudyn.rigidBodyUtilities import RigidBodyInertia
from scipy.spatial.transform import Rotation

from ...formulations.rigid_bodies import GROUND, Anchor, Bodies, Body
from ...problems.problem import Array, Problem
from .parts import Assembled, add_springs, empty, hold


def tree(bodies: Bodies, problem: Problem) -> Assembled:
    """One kinematic tree; springs may join its links, loops may not close."""
    container, mbs = empty()
    data, (q, u) = mbs.systemData, bodies.joints(problem.start)
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * len(q), initialCoordinates=q, initialCoordinates_t=u,
            numberOfODE2Coordinates=len(q),
        )
    )  # fmt: skip
    turns = [_turn(body) for body in bodies.bodies]
    links = mbs.AddObject(_links(bodies, turns, node))

    def marker(anchor: Anchor) -> Any:
        k, point = anchor
        local = turns[k] @ point
        return mbs.AddMarker(
            MarkerKinematicTreeRigid(objectNumber=links, linkNumber=k, localPosition=local)
        )

    add_springs(mbs, bodies, marker)
    mbs.Assemble()
    return Assembled(
        container,
        mbs,
        lambda: bodies.state(data.GetODE2Coordinates(), data.GetODE2Coordinates_t()),
    )


def _links(bodies: Bodies, turns: list[Array], node: Any) -> Any:
    """The links, each in a frame whose joint axis points forwards."""
    transformations, inertias = exu.Matrix3DList(), exu.Matrix3DList()
    offsets, centres = exu.Vector3DList(), exu.Vector3DList()
    for body, turn in zip(bodies.bodies, turns, strict=True):
        carrier = np.eye(3) if body.on == GROUND else turns[body.on]
        transformations.Append(carrier @ turn)
        offsets.Append(carrier @ body.place)
        centres.Append(turn @ body.centre)
        inertias.Append(np.diag(body.inertia))
    return ObjectKinematicTree(
        nodeNumber=node, gravity=bodies.gravity,
        jointTypes=[_joint_type(body) for body in bodies.bodies],
        linkParents=[body.on for body in bodies.bodies],
        jointTransformations=transformations, jointOffsets=offsets, linkInertiasCOM=inertias,
        linkCOMs=centres, linkMasses=[body.mass for body in bodies.bodies],
        jointForceVector=[bodies.torque] + [0.0] * (len(bodies.bodies) - 1),
    )  # fmt: skip


def _turn(body: Body) -> Array:
    """Half a turn where the joint's axis points backwards, since Exudyn's point forwards."""
    k = int(np.argmax(np.abs(body.axis)))
    signs = np.ones(3)
    if body.axis[k] < 0:
        signs[[k, k - 1]] = -1.0
    return np.diag(signs)


def _joint_type(body: Body) -> Any:
    kind = "Prismatic" if body.joint == "slide" else "Revolute"
    return getattr(exu.JointType, kind + "XYZ"[int(np.argmax(np.abs(body.axis)))])


def body_on_a_point(top: Bodies, problem: Problem) -> Assembled:
    """A rigid body on a Lie group node, the rotation vector, which sits at the fixed point.

    The node's place is held, which explicit methods do by leaving the coordinates out; that is
    right only where inertia does not couple them with the rotation.  So the inertia is that about
    the fixed point with the mass centre there, and the weight acts where the mass centre is.
    """
    container, mbs = empty()
    body, (quaternion, velocity) = top.bodies[0], top.joints(problem.start)
    turn = Rotation.from_quat(quaternion, scalar_first=True).as_rotvec()
    node = mbs.AddNode(
        NodeRigidBodyRotVecLG(
            referenceCoordinates=[0.0, 0.0, 0.0, *turn], initialVelocities=[0.0] * 3 + [*velocity]
        )
    )
    hold(mbs, node, range(3))
    about = RigidBodyInertia(body.mass, np.diag(body.inertia)).Translated(body.centre)
    number = mbs.AddObject(
        ObjectRigidBody(mass=body.mass, inertia=about.GetInertia6D(), nodeNumber=node)
    )
    centre = mbs.AddMarker(MarkerBodyPosition(bodyNumber=number, localPosition=body.centre))
    weight = body.mass * np.array(top.gravity)
    mbs.AddLoad(LoadForceVector(markerNumber=centre, loadVector=weight))
    mbs.Assemble()
    return Assembled(container, mbs, lambda: _orientation(top, mbs, node))


def _orientation(top: Bodies, mbs: Any, node: Any) -> Array:
    turned = mbs.GetNodeOutput(node, exu.OutputVariableType.RotationMatrix).reshape(3, 3)
    velocity = mbs.GetNodeOutput(node, exu.OutputVariableType.AngularVelocityLocal)
    return top.state(Rotation.from_matrix(turned).as_quat(scalar_first=True), velocity)
