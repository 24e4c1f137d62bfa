"""Loops and couplings of MJCF, against MuJoCo's matrices with constraints that do not yield."""

import numpy as np
import pytest

import mechc
from tests.compiler.mjcf.reference import Reference, differences, write_model
from tests.support.marks import slow_among

pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # contacts

CLOSE = 1e-8
FOUR_BAR = """<mujoco>
  <default><geom type="capsule" size="0.02"/>
    <joint axis="0 1 0" damping="0.2" armature="0.05"/></default>
  <worldbody>
    <body name="crank"><joint name="crank" stiffness="4" springref="30"/>
      <geom fromto="0 0 0 0 0 0.3"/>
      <body name="coupler" pos="0 0 0.3"><joint name="knee"/><geom fromto="0 0 0 0.9 0 0.2"/></body>
    </body>
    <body name="rocker" pos="1 0 0"><joint name="rocker"/><geom fromto="0 0 0 -0.1 0 0.5"/></body>
  </worldbody>
  <equality>{closing}</equality>
</mujoco>"""
BODIES = '<connect name="pin" body1="coupler" body2="rocker" anchor="0.9 0 0.2"/>'
SPACE = """<mujoco>
  <default><geom type="box" size="0.1 0.2 0.05"/></default>
  <worldbody>
    <site name="hook" pos="0.3 0.2 1" euler="10 20 30"/>
    <body name="arm" pos="0 0 0.5"><joint name="yaw" axis="0 0 1"/>
      <joint name="pitch" axis="0 1 0"/>
      <geom pos="0.2 0 0"/>
      <body name="fore" pos="0.5 0 0"><joint name="bend" axis="0 1 0"/><geom pos="0.2 0 0"/></body>
    </body>
    <body name="load" pos="0.9 0.1 0.5"><freejoint name="load"/><geom/>
      <site name="eye" pos="0.1 0 0.2"/>
    </body>
  </worldbody>
  <equality>{closing}</equality>
</mujoco>"""
JOINTS = ("yaw", "pitch", "bend", "load")
COUPLED = """<mujoco>
  <worldbody>
    <body name="driver"><joint name="driver" axis="0 1 0" ref="10"/><geom size="0.1" pos="0.3 0 0"/>
      <body name="finger" pos="0.4 0 0">
        <joint name="finger" axis="0 1 0" ref="-20" damping="0.3" armature="0.4" stiffness="3"/>
        <geom type="box" size="0.2 0.1 0.05" pos="0.2 0 0"/></body>
    </body>
    <body name="slide" pos="0 1 0"><joint name="slide" type="slide" armature="2"/>
      <geom size="0.1"/></body>
  </worldbody>
  <equality>{couplings}</equality>
</mujoco>"""


@pytest.mark.parametrize(
    "closing",
    [BODIES, '<connect name="pin" body1="rocker" body2="coupler" anchor="-0.1 0 0.5"/>'],
)
def test_a_four_bar_closed_by_connect(tmp_path, closing):
    path = write_model(tmp_path, FOUR_BAR.format(closing=closing))
    mechanism = mechc.from_mjcf(path)
    assert [each.name for each in mechanism.closures] == ["pin"]
    assert len(mechanism.rows) == 2  # in its plane
    model = mechc.compile(mechanism)
    assert differences(model, Reference(path), ("crank", "knee", "rocker"), spread=0.1) < CLOSE


CLOSINGS = (
    '<connect body1="fore" body2="load" anchor="0.3 0.1 0.2"/>',
    '<connect site1="hook" site2="eye"/>',
    '<weld body1="fore" body2="load" anchor="0.1 0 0" relpose="0.4 0.1 0 1 2 0 1"/>',
    '<weld body1="fore" body2="load" torquescale="0.4"/>',
    '<weld body1="fore" body2="load" torquescale="0"/>',
    '<weld site1="eye" site2="hook"/>',
    '<weld body1="load"/>',
)


@pytest.mark.parametrize("closing", slow_among(CLOSINGS, (CLOSINGS[0], *CLOSINGS[2:5])))
def test_closed_in_space(tmp_path, closing):
    path = write_model(tmp_path, SPACE.format(closing=closing))
    model = mechc.compile(mechc.from_mjcf(path))
    assert differences(model, Reference(path), JOINTS, spread=0.3) < CLOSE


def test_couplings(tmp_path):
    couplings = """<joint joint1="finger" joint2="driver" polycoef="0.1 -0.7 0 0 0"/>
        <joint joint1="slide" joint2="finger" polycoef="0.05 0.2 0.3 -0.4 0.1"/>"""
    path = write_model(tmp_path, COUPLED.format(couplings=couplings))
    model = mechc.compile(mechc.from_mjcf(path))
    assert model.coordinates == ("q_driver",)
    assert differences(model, Reference(path), ("driver", "finger", "slide"), spread=0.3) < CLOSE


def test_a_locked_joint(tmp_path):
    path = write_model(
        tmp_path, COUPLED.format(couplings='<joint joint1="finger" polycoef="0.3"/>')
    )
    model = mechc.compile(mechc.from_mjcf(path))
    assert model.coordinates == ("q_driver", "q_slide")
    assert differences(model, Reference(path), ("driver", "finger", "slide"), spread=0.3) < CLOSE


def test_equalities_that_are_not_active(tmp_path):
    inactive = '<connect name="pin" body1="slide" body2="finger" anchor="0 0 0" active="false"/>'
    path = write_model(tmp_path, COUPLED.format(couplings=inactive))
    mechanism = mechc.from_mjcf(path)
    assert not mechanism.rows
    assert "the equality pin, which is not active" in mechanism.skipped
    model = mechc.compile(mechanism)
    assert differences(model, Reference(path), ("driver", "finger", "slide"), spread=0.3) < CLOSE


def test_a_cut_of_ones_own(tmp_path):
    """A joint that is cut in place of the pin keeps its coordinate, damper and rotor."""
    path = write_model(tmp_path, FOUR_BAR.format(closing=BODIES))
    mechanism = mechc.from_mjcf(path, cut="rocker")
    assert "pin" not in [each.name for each in mechanism.closures]
    model, reference = mechc.compile(mechanism), Reference(path)
    q, v = reference.state(np.random.default_rng(5), 0.1)
    turn, spin = (rocker - crank - knee for crank, knee, rocker in (q, v))
    names = ("crank", "knee", "rocker")
    values = dict.fromkeys(("q1_pin", "q3_pin", "wx_pin", "wz_pin"), 0.0)
    values |= {f"q_{name}": x for name, x in zip(names, q, strict=True)}
    values |= {f"u_{name}": x for name, x in zip(names, v, strict=True)}
    values |= {"q0_pin": np.cos(turn / 2), "q2_pin": np.sin(turn / 2), "wy_pin": spin}
    y = np.array([values[name] for name in (*model.coordinates, *model.speeds)])
    rates = dict(zip(model.speeds, model.rhs(0.0, y)[len(model.coordinates) :], strict=True))
    found = [rates[f"u_{name}"] for name in names]
    wanted = reference.accelerations(q, v)
    assert found == pytest.approx(wanted, abs=CLOSE * abs(wanted).max())


def test_two_equalities_of_one_joint_are_refused(tmp_path):
    twice = (
        '<joint joint1="finger" joint2="driver"/><joint name="b" joint1="finger" joint2="slide"/>'
    )
    path = write_model(tmp_path, COUPLED.format(couplings=twice))
    with pytest.raises(mechc.MechanismError, match=r"'b' is the second that the joint 'finger'"):
        mechc.from_mjcf(path)
