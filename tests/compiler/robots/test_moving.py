"""Springs, rotors and motors at joints, by the closed forms of one body on one joint."""

import numpy as np
import pytest
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.robot import Pose, Robot, RobotJoint, RobotLink, RobotMotor
from sympy import Symbol

import mechc
from tests.compiler.robots.by_numbers import ByNumbers

MASS, INERTIA = 2.0, 0.7
INPUT = 0.3  # that ByNumbers gives


def one_joint(kind, turned=False, **more):
    """A body on a joint along the horizontal x; turned: the file has the ground as the child."""
    links = {"ground": RobotLink("ground"), "body": RobotLink("body", MASS, Pose(), (INERTIA, 0, 0,
             INERTIA, 0, INERTIA))}  # fmt: skip
    sides = ("body", "ground") if turned else ("ground", "body")
    joint = RobotJoint("j", kind, *sides, axis=(1, 0, 0), **more)
    motors = (RobotMotor("drive", "j", gear=5.0),)
    return Robot("one", links, (joint,), "ground", motors if joint.row.unit else ())


def acceleration(robot, u=0.0):
    start = ByNumbers(mechanism_of(robot))
    found = start.accelerations(np.full(start.size, u))["body"]
    return found[3] if robot.joints[0].kind != "prismatic" else found[0]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("kind", "inertia"), [("continuous", INERTIA), ("prismatic", MASS)])
def test_what_acts_at_a_joint(kind, inertia, turned):
    """Motor, spring and damper push the child against the parent, over the body's and the rotor's
    inertia; where the body is the parent it goes the other way."""
    sign = -1 if turned else 1
    robot = one_joint(kind, turned, stiffness=4.0, rest=0.5, damping=0.2, armature=0.9)
    force = 5.0 * INPUT - 4.0 * (0.0 - 0.5) - 0.2 * 0.8
    assert acceleration(robot, 0.8) == pytest.approx(sign * force / (inertia + 0.9), rel=1e-9)


def test_the_spring_has_its_potential():
    described = mechanism_of(one_joint("continuous", stiffness=4.0, rest=0.5))
    (body,) = described.bodies
    (q,) = described.q
    assert body.potential_energy.subs(q, 2.5) == pytest.approx(4.0 * 2.0**2 / 2)


def test_the_rotor_is_a_parameter_where_that_is_wanted():
    described = mechanism_of(one_joint("continuous", armature=0.9), symbolic=["armature"])
    assert Symbol("a_j") in [p.symbol for p in described.parameters]
    assert [body.name for body in described.bodies] == ["body", "j rotor"]


def test_a_ball_is_damped_by_a_torque_against_its_turning():
    assert acceleration(one_joint("ball", damping=0.2), 0.8) == pytest.approx(-0.2 * 0.8 / INERTIA)


def test_what_a_joint_of_several_coordinates_lacks_is_named():
    with pytest.warns(mechc.SkippedPartWarning, match="dry friction of the planar joint j"):
        described = mechanism_of(one_joint("planar", armature=0.9, friction=0.1))
    assert described.skipped == ("dry friction of the planar joint j (0.1)",
                                 "a rotor of the planar joint j (0.9)")  # fmt: skip


@pytest.mark.parametrize("kind", ["ball", "universal", "cylindrical", "planar", "floating"])
def test_a_turned_joint_moves_the_parent_as_it_moves_the_child(kind):
    """The body as the child of a joint, and as the parent of one whose ground is the child: what
    the first does at speeds u, the second does the other way at its own."""
    child = ByNumbers(mechanism_of(one_joint(kind)))
    parent = ByNumbers(mechanism_of(one_joint(kind, True)))
    u = np.linspace(0.3, 0.9, child.size)
    there, back = child.velocities(u)["body"], parent.velocities(-u)["body"]
    assert back == pytest.approx(there, abs=1e-12)
