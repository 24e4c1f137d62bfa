"""Trees in MJCF have the accelerations of MuJoCo."""

import numpy as np
import pytest
from mechc_codegen.robots import meshes

import mechc
from tests.compiler.mjcf.reference import Reference, differences, write_model

pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # contacts

CLOSE = 1e-9
EVERY_JOINT = """<mujoco model="tree">
  <compiler angle="degree"/>
  <option gravity="0.3 -0.2 -9.7"/>
  <default><geom density="300"/></default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="post" pos="0.1 0.2 0.3" euler="10 20 30"><geom size="0.1"/>
      <body name="arm" pos="0.2 0 0.1" euler="0 40 -30">
        <joint name="slew" axis="0 0 1" pos="0.03 0.01 -0.02" ref="20"/>
        <joint name="reach" type="slide" axis="1 2 2" ref="0.1"/>
        <joint name="tilt" axis="1 0 1" pos="-0.1 0.05 0" range="-30 40"/>
        <geom type="capsule" size="0.04 0.2" pos="0.1 0 0.05" euler="30 0 0"/>
        <body pos="0.4 0 0.1"><geom type="box" size="0.05 0.1 0.02"/></body>
        <body name="bob" pos="0.3 0.1 0" quat="0.9 0.1 -0.3 0.2">
          <joint name="socket" type="ball" pos="0.05 0.1 -0.02"/>
          <inertial pos="0.02 0.1 -0.04" mass="0.8"
            fullinertia="0.02 0.03 0.04 0.002 -0.003 0.001"/>
          <body name="tip" pos="0 0.2 0"><joint axis="0 1 0"/>
            <geom size="0.05 0.1" type="cylinder"/>
          </body>
        </body>
      </body>
    </body>
    <body name="drone" pos="1 2 3" euler="30 0 50"><freejoint/>
      <geom type="ellipsoid" size="0.1 0.2 0.05"/>
      <body name="blade" pos="0.1 0.1 0"><joint axis="0 0 -1"/>
        <geom size="0.02 0.3 0.01" type="box"/></body>
    </body>
  </worldbody>
</mujoco>"""
JOINTS = ("slew", "reach", "tilt", "socket", "tip", "drone", "blade")
FORCES = """<mujoco>
  <option gravity="0 0 -5"/>
  <worldbody>
    <body name="arm"><joint name="lift" axis="0 1 0" stiffness="30" springref="20" ref="10"
        damping="0.7" armature="0.3"/>
      <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/>
      <body name="hand" pos="0.5 0 0">
        <joint name="push" type="slide" axis="0 1 1" stiffness="12" damping="3" armature="0.9"
          ref="0.02" springref="0.1" range="-0.3 0.4" actuatorfrcrange="-5 5"/>
        <geom size="0.1"/>
        <body name="ball" pos="0 0 0.3">
          <joint name="wrist" type="ball" damping="0.4" armature="0.2"/>
          <geom type="box" size="0.1 0.2 0.3" pos="0.1 0.1 0.1"/></body>
      </body>
    </body>
    <body name="float" pos="0 0 2">
      <joint name="float" type="free" damping="0.6" armature="0.5"/>
      <geom type="box" size="0.3 0.2 0.1" pos="0.2 0 0"/>
    </body>
  </worldbody>
</mujoco>"""


def test_every_kind_of_joint(tmp_path):
    path = write_model(tmp_path, EVERY_JOINT)
    model = mechc.compile(mechc.from_mjcf(path))
    assert differences(model, Reference(path), JOINTS) < CLOSE


def test_springs_dampers_and_rotors(tmp_path):
    path = write_model(tmp_path, FORCES)
    model = mechc.compile(mechc.from_mjcf(path))
    assert differences(model, Reference(path), ("lift", "push", "wrist", "float")) < CLOSE
    assert not any("spring" in part for part in model.system.data["skipped"])


def test_what_the_file_disables_is_absent(tmp_path):
    flags = '<flag spring="disable" damper="disable" gravity="disable"/></option>'
    path = write_model(tmp_path, FORCES.replace('-5"/>', f'-5">{flags}', 1))
    model = mechc.compile(mechc.from_mjcf(path))
    assert model.defaults["g"] == 0.0
    assert differences(model, Reference(path), ("lift", "push", "wrist", "float")) < CLOSE


def test_places_start_and_limits(tmp_path):
    path = write_model(tmp_path, EVERY_JOINT)
    mechanism = mechc.from_mjcf(path)
    reference = Reference(path)
    model = mechc.compile(mechanism, outputs=("points",))
    q, v = reference.state(np.random.default_rng(3))
    coordinates, speeds = reference.names(JOINTS)
    y = np.concatenate(
        [q[[coordinates.index(x) for x in model.coordinates]],
         v[[speeds.index(x) for x in model.speeds]]]
    )  # fmt: skip
    reference.accelerations(q, v)
    places = dict(zip(model.point_names, model.points(y), strict=True))
    for name in ("post", "arm", "body3", "bob", "tip", "drone", "blade"):
        wanted = reference.data.body(reference.mujoco.mj_name2id(reference.model, 1, name)
                                     if name != "body3" else 3).xpos  # fmt: skip
        np.testing.assert_allclose(places[name], wanted, atol=1e-12)
    assert [mechanism.start[x] for x in coordinates] == pytest.approx(reference.model.qpos0)
    tilt = mechanism.limits["tilt"]
    assert (tilt.lower, tilt.upper) == pytest.approx(np.deg2rad([-30, 40]))
    assert mechanism.limits["slew"].lower is None
    assert mechanism.name == "tree"


def test_symbols(tmp_path):
    path = write_model(tmp_path, FORCES)
    symbolic = ["mass", ("lift", "damping"), ("push", "stiffness"), ("push", "armature")]
    model = mechc.compile(mechc.from_mjcf(path, symbolic))
    changed = {"m_arm": 2.5, "d_lift": 0.2, "k_push": 4.0, "a_push": 0.1, "g": 3.0}
    assert {*changed} <= {*model.parameters}
    reference = Reference(path)
    m = reference.model
    m.body("arm").mass[:] = 2.5
    m.joint("lift").damping[:] = 0.2
    m.jnt_stiffness[1], m.dof_armature[1], m.opt.gravity[2] = 4.0, 0.1, -3.0
    joints = ("lift", "push", "wrist", "float")
    assert differences(model, reference, joints, params=changed) < CLOSE


def test_meshes_are_where_mujoco_has_them(tmp_path, monkeypatch):
    """MuJoCo moves the corners of a mesh to its middle, and the geom the other way."""
    monkeypatch.setattr(meshes, "PACKAGES", ())
    corners = np.array([[5, 6, 7], [6, 6, 7], [5, 8, 7], [5, 6, 10]])
    vertices = " ".join(map(str, corners.ravel()))
    text = f"""<mujoco><asset><mesh name="t" vertex="{vertices}"/></asset>
      <worldbody><body name="b"><joint/><geom type="mesh" mesh="t" pos="0.1 0.2 0.3"/>
      <geom type="mesh" mesh="t" group="3"/></body></worldbody></mujoco>"""
    path = write_model(tmp_path, text)
    mechanism = mechc.from_mjcf(path)
    (solid,) = mechanism.drawing.solids
    at = [solid.at.pos_from(mechanism.points[-1]).dot(axis) for axis in mechanism.bodies[0].frame]
    rotation = np.array(mechanism.bodies[0].frame.dcm(solid.frame), float)
    drawn = np.frombuffer(solid.triangles, "<f4").reshape(-1, 3) @ rotation.T + np.array(at, float)
    assert len(drawn) == 12
    expected = corners + np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(
        np.unique(drawn.round(4), axis=0), np.unique(expected, axis=0), atol=1e-4
    )
    assert mechc.from_mjcf(path, meshes="ignore").drawing.solids == ()
