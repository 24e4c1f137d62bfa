"""Motors at the joints of a mechanism that exists, as of a robot's file."""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.errors import MechanismError
from sympy import Symbol, cos
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, dynamicsymbols, inertia

import mechc

t = dynamicsymbols._t
ARM = """<robot name="arm"><link name="base"/>{links}
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit effort="1" velocity="1" lower="-2" upper="2"/></joint>
<joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
<origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/></joint></robot>"""
LINK = """<link name="{}"><inertial><origin xyz="0 0 -0.2"/><mass value="1.5"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(links="".join(map(LINK.format, ("upper", "fore")))), "utf-8")
    return mechc.from_urdf(path, limits="ignore", effort="ignore")


def test_a_robot_is_driven_by_a_law_of_time(arm):
    """The torque at the shoulder moves both links, as Newton and Euler have it: at rest, held
    outstretched, it carries their weight."""
    held = mechc.compile(
        mechc.with_motors(
            arm,
            [mechc.Motor("shoulder", angle=-Symbol("up")), mechc.Motor("elbow", angle=cos(t) - 1)],
            parameters={"up": "90 deg"},
        )
    )
    start = held.simulate(0.01, {}).y[0]
    weight = 1.5 * 9.81 * (0.2 + 0.6)
    accelerating = held.rhs(0.0, start)[len(held.coordinates) + 1]
    assert accelerating == pytest.approx(-1)  # of cos t
    arms = 0.02 + 1.5 * 0.2**2 + 1.5 * 0.4 * 0.2  # of the elbow's motion about the shoulder
    torque = held.output("shoulder_torque", start)
    assert abs(torque) == pytest.approx(weight + arms * np.sign(torque) * -1, rel=1e-9)


def test_it_is_what_from_joints_makes_with_these_motors():
    base, crank, slide = (RigidBody(name, mass=1) for name in ("base", "crank", "slide"))
    for body in (crank, slide):
        body.central_inertia = inertia(body.frame, 0, 0, 0.1)
    joints = [
        PinJoint("main", base, crank, child_point=crank.x, joint_axis=base.z),
        PrismaticJoint("rail", crank, slide, joint_axis=crank.x),
    ]
    motors = [
        mechc.Motor("main", torque=dynamicsymbols("M"), gear=Symbol("n"), effort=Symbol("e")),
        mechc.Motor("rail", position=Symbol("r") + dynamicsymbols("path"), name="lift"),
    ]
    given = {"parameters": {"n": 3, "r": "20 mm"}, "inputs": {"path": cos(t) / 10}}
    at_once = mechc.from_joints("both", joints, motors=motors, **given)
    later = mechc.with_motors(mechc.from_joints("both", joints), motors, **given)
    models = [mechc.compile(each) for each in (at_once, later)]
    assert {*models[0].parameters} == {*models[1].parameters} == {"n", "e", "r"}
    assert models[0].inputs == models[1].inputs
    assert models[0].units["e"] == models[1].units["e"] == "N m"
    ends = [
        model.simulate(0.5, {"q_main": 0.3}, {"e": 0.5}, inputs={"M": "sin(9*t)"}).y[-1]
        for model in models
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)


def test_motors_that_do_not_fit_are_refused(arm):
    with pytest.raises(MechanismError, match=r"drives wrist, which is no joint.*shoulder, elbow"):
        mechc.with_motors(arm, [mechc.Motor("wrist", torque=1)])
    driven = mechc.with_motors(arm, [mechc.Motor("elbow", angle=0)])
    with pytest.raises(MechanismError, match="a motor is called elbow"):
        mechc.with_motors(driven, [mechc.Motor("elbow", angle=0)])
    with pytest.raises(MechanismError, match="arm has no joints for motors"):
        mechc.with_motors(replace(arm, joints=()), [mechc.Motor("elbow", torque=1)])
