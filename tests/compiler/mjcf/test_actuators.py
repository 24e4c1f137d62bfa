"""Actuators of MJCF are inputs with the forces of MuJoCo, or are named."""

import pytest

import mechc
from tests.compiler.mjcf.reference import Reference, differences, write_model

pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # contacts

CLOSE = 1e-9
MODEL = """<mujoco>
  <option>{option}</option>
  <worldbody>
    <body name="arm">
      <joint name="lift" axis="0 1 0" ref="15" stiffness="2" springref="5" damping="0.1"/>
      <geom size="0.1" pos="0.4 0 0"/><site name="tip" pos="0.5 0 0"/>
      <body name="hand" pos="0.5 0 0"><joint name="push" type="slide" ref="0.1"/><geom size="0.05"/>
        <body name="ball"><joint name="wrist" type="ball"/><geom size="0.1" pos="0.2 0 0"/></body>
      </body>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""
TAKEN = """
    <motor name="torque" joint="lift" gear="3"/>
    <position name="servo" joint="lift" kp="7" kv="0.4" gear="2"/>
    <velocity name="speed" joint="push" kv="5" gear="-2"/>
    <general name="law" joint="push" gainprm="1.5" biastype="affine" biasprm="0.7 -2 -0.3"
      gear="0.5"/>
    <motor name="rotor" jointinparent="push" gear="4" armature="0.02" damping="0.05"/>"""
JOINTS = ("lift", "push", "wrist")


def test_motors_and_servos(tmp_path):
    path = write_model(tmp_path, MODEL.format(actuators=TAKEN, option=""))
    model = mechc.compile(mechc.from_mjcf(path, driven="all"))
    inputs = ("ctrl_torque", "ctrl_servo", "ctrl_speed", "ctrl_law", "ctrl_rotor")
    assert model.inputs == inputs
    assert differences(model, Reference(path), JOINTS, inputs=inputs) < CLOSE


def test_controls_that_are_not_driven_are_zero(tmp_path):
    path = write_model(tmp_path, MODEL.format(actuators=TAKEN, option=""))
    model = mechc.compile(mechc.from_mjcf(path, driven="torque"))
    assert model.inputs == ("ctrl_torque",)
    still = model.with_inputs({"ctrl_torque": 0.0})
    assert differences(still, Reference(path), JOINTS) < CLOSE


def test_a_joint_may_be_driven(tmp_path):
    path = write_model(
        tmp_path, MODEL.format(actuators=TAKEN, option='<flag actuation="disable"/>')
    )
    mechanism = mechc.from_mjcf(path, driven=["push"])
    assert "its actuators, which the file disables" in mechanism.skipped
    model = mechc.compile(mechanism)
    assert model.inputs == ("tau_push",)
    with pytest.raises(mechc.MechanismError, match=r"driven='pusch' .*near are 'push'"):
        mechc.from_mjcf(path, driven=["pusch"])


@pytest.mark.parametrize(
    ("actuator", "words"),
    [
        ('<motor name="a" joint="wrist"/>', "the actuator a (the joint wrist has more than one"),
        ('<motor name="a" site="tip"/>', "the actuator a (its trntype is site)"),
        ('<muscle name="a" joint="lift" lengthrange="0 1"/>', "the actuator a (its dyntype is"),
        ('<position name="a" joint="lift" timeconst="0.1"/>', "the actuator a (its dyntype is"),
        ('<damper name="a" joint="lift" kv="1" ctrlrange="0 1"/>', "the actuator a (its gaintype"),
        ('<motor name="a" joint="lift" delay="0.1" nsample="2"/>', "actuator a (its control is"),
        ('<motor name="a" joint="lift" ctrlrange="-2 1"/>', "leaves them): ctrl_a -2.0 to 1"),
        ('<motor name="a" joint="lift" gear="2" forcerange="-2 1"/>', "ctrl_a -4.0 to 2.0"),
        ('<position name="a" joint="lift" forcerange="-2 1"/>', "servo a, -2.0 to 1.0"),
    ],
)  # fmt: skip
def test_what_is_not_taken_is_named(tmp_path, actuator, words):
    path = write_model(tmp_path, MODEL.format(actuators=actuator, option=""))
    skipped = "; ".join(mechc.from_mjcf(path, driven="all").skipped)
    assert words in skipped


BOUNDED = """
    <motor name="control" joint="lift" gear="3" ctrlrange="-0.2 0.3"/>
    <position name="servo" joint="lift" kp="7" kv="0.4" gear="2" ctrlrange="-0.1 0.1"/>
    <motor name="force" joint="push" gear="-5" forcerange="-0.1 0.4"/>
    <motor name="second" joint="push" gear="2"/>"""


def test_bounds_of_controls_and_forces_are_those_of_mujoco(tmp_path):
    """Controls are drawn of the order of one: nearly all are beyond their bounds, and so is the sum
    of both forces that push."""
    text = MODEL.replace('ref="0.1"', 'ref="0.1" actuatorfrcrange="-1 1"')
    path = write_model(tmp_path, text.format(actuators=BOUNDED, option=""))
    mechanism = mechc.from_mjcf(path, driven="all", effort="saturate")
    assert mechanism.skipped == ("contacts",)
    inputs = ("ctrl_control", "ctrl_servo", "ctrl_force", "ctrl_second")
    model = mechc.compile(mechanism)
    assert differences(model, Reference(path), JOINTS, inputs=inputs) < CLOSE


def test_a_servo_is_not_held_to_the_effort_of_its_joint(tmp_path):
    text = MODEL.replace('ref="0.1"', 'ref="0.1" actuatorfrcrange="-1 1"')
    servo = '<position name="a" joint="push" kp="3"/>'
    path = write_model(tmp_path, text.format(actuators=servo, option=""))
    mechanism = mechc.from_mjcf(path, driven="all", effort="saturate")
    assert "the bound of the force of push, where a is a servo" in mechanism.skipped


def test_a_group_that_the_file_disables(tmp_path):
    text = MODEL.format(actuators='<position name="a" joint="lift" group="2"/>', option="")
    path = write_model(tmp_path, text.replace("<option>", '<option actuatorgroupdisable="2">'))
    mechanism = mechc.from_mjcf(path, driven="all")
    assert "the actuator a, whose group 2 is disabled" in mechanism.skipped
    assert differences(mechc.compile(mechanism), Reference(path), JOINTS) < CLOSE
