"""Pinocchio: forward dynamics in compiled code, integrated by SciPy.

It has no integrator of error control; its documentation has one write one's own around ``aba``
(open trees) or ``constraintDynamics`` (loops, held by proximal iterations), which is what SciPy's
``solve_ivp`` does here.  Its models are the bodies of formulations/rigid_scenes.py, a tree of
joints.  A loop is held by a point constraint; the torques of motors and springs, from the virtual
work of their length, are computed in Python and handed over.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..formulations.rigid_bodies import GROUND, ORIGIN, Anchor, Bodies, Body, Vector
from ..formulations.rigid_scenes import rigid_bodies
from ..problems.problem import Array, Formulation, NotExpressibleError, Problem
from . import Built
from .scipy_ivp import IMPLICIT, Rates, cases

TOOLS = ("Pinocchio",)
# Proximal iterations end at rounding; planar loops hold one direction twice, which needs mu > 0.
ACCURACY, MU, ITERATIONS = 1e-14, 1e-8, 20
ROLLING = "its constraints hold points and frames together; wheels that roll are neither"
# Stiffness (1/s^2) and damping (1/s) of gaps, critical, as in its example of closed loops; without
# them errors are two or three times as large.
STABILISED = (10.0, 2 * 10.0**0.5)
TOP = "XZY"  # its axis about x and z, and the spin about the axis


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """RK45 and DOP853; on stiff problems SciPy's implicit methods.

    Raises
    ------
    ImportError
        Without Pinocchio.
    NotExpressibleError
        For rolling wheels and constraints that depend on time.
    """
    problem.values  # noqa: B018 - compiled by mechc, which is not Pinocchio's time
    start = time.perf_counter()
    tree = tree_of(problem)
    rates = closed(tree) if tree.loops else opened(tree)
    seconds = time.perf_counter() - start
    observe = lambda x: problem.observe(tree.back(x))  # noqa: E731
    own = Formulation(problem.mechanism, tree.into(problem.start), observe)
    methods = IMPLICIT if problem.stiff else ("RK45", "DOP853")
    found = cases(TOOLS[0], rates, replace(problem, formulation=own), tolerances, methods)
    return Built(found, {TOOLS[0]: {"derive": 0.0, "compile": seconds}})


def opened(tree: Tree) -> Rates:
    """[q', v'] by the articulated-body algorithm."""
    import pinocchio

    model, data, n = tree.model, tree.model.createData(), tree.model.nv

    def rates(time: float, x: Array) -> Array:
        q, v = x[:n], x[n:]
        return np.concatenate([v, pinocchio.aba(model, data, q, v, tree.torque(q, v))])

    return rates


def closed(tree: Tree) -> Rates:
    """[q', v'] with the loops' constraints at the level of accelerations."""
    import pinocchio

    model, data, n = tree.model, tree.model.createData(), tree.model.nv
    loops = pinocchio.StdVec_RigidConstraintModel()
    of_loops = pinocchio.StdVec_RigidConstraintData()
    for loop in tree.loops:
        loops.append(loop)
        of_loops.append(loop.createData())
    pinocchio.initConstraintDynamics(model, data, loops, of_loops)
    settings: Any = pinocchio.ProximalSettings(ACCURACY, MU, ITERATIONS)

    def rates(time: float, x: Array) -> Array:
        q, v = x[:n], x[n:]
        a = pinocchio.constraintDynamics(
            model, data, q, v, tree.torque(q, v), loops, of_loops, settings
        )
        return np.concatenate([v, a])

    return rates


# -- models ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Tree:
    """A model, what closes its loops, and how its state is that of mechc.

    Attributes
    ----------
    model, loops
        ``pinocchio.Model`` and ``RigidConstraintModel`` of every loop.
    torque
        The joint torques of loads that are no gravity, of q and v.
    into, back
        From mechc's state [q, u] to [q, v] of the model, and back.
    """

    model: Any
    into: Callable[[Array], Array]
    back: Callable[[Array], Array]
    torque: Callable[[Array, Array], Array]
    loops: tuple[Any, ...] = ()


def tree_of(problem: Problem) -> Tree:
    """The model of a problem.

    Raises
    ------
    NotExpressibleError
        For wheels that roll, and for mechanisms that are not described as rigid bodies.
    """
    if problem.name == "bicycle":
        raise NotExpressibleError(ROLLING)
    bodies = rigid_bodies(problem)
    return _top(bodies) if bodies.bodies[0].joint == "ball" else _tree(bodies)


def _tree(bodies: Bodies) -> Tree:
    import pinocchio

    model = _empty(pinocchio, bodies)
    for body in bodies.bodies:
        joint = _add_joint(pinocchio, model, body.on + 1, _kind(body), body.place)
        _add_body(pinocchio, model, joint, body)
    # Axes that point backwards turn the other way.
    signs = np.array([np.sign(sum(body.axis)) for body in bodies.bodies])

    def into(y: Array) -> Array:
        return np.concatenate([signs * x for x in bodies.joints(y)])

    def back(x: Array) -> Array:
        q, v = np.split(x, 2)
        return bodies.state(signs * q, signs * v)

    loops = [_loop(pinocchio, model, *ends) for ends in bodies.loops]
    return Tree(model, into, back, _torque(pinocchio, model, bodies), tuple(loops))


def _empty(pinocchio: Any, bodies: Bodies) -> Any:
    model = pinocchio.Model()
    model.gravity.linear = np.array(bodies.gravity)
    return model


def _kind(body: Body) -> str:
    """Such as "RZ", for a hinge about z."""
    axis = "XYZ"[int(np.argmax(np.abs(body.axis)))]
    return ("P" if body.joint == "slide" else "R") + axis


def _add_joint(pinocchio: Any, model: Any, on: int, kind: str, place: Vector = ORIGIN) -> int:
    joint = getattr(pinocchio, f"JointModel{kind}")()
    return int(model.addJoint(on, joint, _placed(pinocchio, place), f"joint_{model.njoints}"))


def _add_body(pinocchio: Any, model: Any, joint: int, body: Body) -> None:
    inertia = pinocchio.Inertia(body.mass, np.array(body.centre), np.diag(body.inertia))
    model.appendBodyToJoint(joint, inertia, pinocchio.SE3.Identity())


def _placed(pinocchio: Any, at: Vector) -> Any:
    return pinocchio.SE3(np.eye(3), np.array(at, float))


def _loop(pinocchio: Any, model: Any, one: Anchor, other: Anchor) -> Any:
    """Two points of two bodies stay together; what drifts apart is drawn back."""
    loop = pinocchio.RigidConstraintModel(
        pinocchio.ContactType.CONTACT_3D, model,
        one[0] + 1, _placed(pinocchio, one[1]), other[0] + 1, _placed(pinocchio, other[1]),
        pinocchio.ReferenceFrame.LOCAL,
    )  # fmt: skip
    loop.setBaumgarteCorrectorParameters(pinocchio.BaumgarteCorrectorParameters(*STABILISED))
    return loop


def _torque(pinocchio: Any, model: Any, bodies: Bodies) -> Callable[[Array, Array], Array]:
    """The motor's on the first joint, and those of springs."""
    constant = np.zeros(model.nv)
    constant[0] = bodies.torque
    if not bodies.springs:
        return lambda q, v: constant
    data, world = model.createData(), pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    ends = [[(k + 1, np.array(at)) for k, at in spring.ends] for spring in bodies.springs]

    def point(joint: int, at: Array) -> tuple[Array, Any]:
        """Where it is, and what the joints' rates make of it."""
        place = data.oMi[joint].act(at)
        if joint == GROUND + 1:
            return place, 0.0
        J = pinocchio.getJointJacobian(model, data, joint, world)
        return place, J[:3] - np.cross(place - data.oMi[joint].translation, J[3:], axisb=0, axisc=0)

    def torque(q: Array, v: Array) -> Array:
        pinocchio.computeJointJacobians(model, data, q)
        tau = constant.copy()
        for spring, (one, other) in zip(bodies.springs, ends, strict=True):
            (start, by_one), (end, by_other) = point(*one), point(*other)
            along = end - start
            length = np.sqrt(along @ along)
            slope = along @ (by_other - by_one) / length
            tau -= slope * (
                spring.stiffness * (length - spring.length) + spring.damping * (slope @ v)
            )
        return tau

    return torque


def _top(top: Bodies) -> Tree:
    """Three joints in one point, whose angles are smooth.

    The axis passes the vertical and stays away from x.
    """
    import pinocchio

    model, joint = _empty(pinocchio, top), 0
    for axis in TOP:
        joint = _add_joint(pinocchio, model, joint, f"R{axis}")
    _add_body(pinocchio, model, joint, top.bodies[0])
    none = np.zeros(3)

    def into(y: Array) -> Array:
        quaternion, spin = top.joints(y)
        angles = Rotation.from_quat(quaternion, scalar_first=True).as_euler(TOP)
        return np.concatenate([angles, np.linalg.solve(_spin_by_rates(angles), spin)])

    def back(x: Array) -> Array:
        angles, rates = np.split(x, 2)
        quaternion = Rotation.from_euler(TOP, angles).as_quat(scalar_first=True)
        return top.state(quaternion, _spin_by_rates(angles) @ rates)

    return Tree(model, into, back, lambda q, v: none)


def _spin_by_rates(angles: Array) -> Array:
    """(3, 3), from the rates of the angles to the angular velocity in the body's axes."""
    columns = []
    for k, axis in enumerate(TOP):
        after = Rotation.from_euler(TOP[k:], angles[k:])  # a turn about the axis keeps the axis
        columns.append(after.inv().apply(np.eye(3)["XYZ".index(axis)]))
    return np.column_stack(columns)
