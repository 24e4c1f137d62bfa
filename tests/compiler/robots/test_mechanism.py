"""Energies of a robot in URDF are those of its links, placed by matrices of numbers.

The reference knows neither SymPy nor mechc: it multiplies homogeneous matrices and differentiates
them by complex steps.
"""

from xml.etree import ElementTree

import numpy as np
import pytest
from sympy import Symbol

import mechc

STEP = 1e-30
ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")

ROBOT = """<robot name="crane">
  <link name="base"><visual><geometry><box size="0.4 0.4 0.1"/></geometry></visual></link>
  <link name="boom">
    <inertial><origin xyz="0.3 0.02 -0.05" rpy="0.4 -0.2 1.1"/><mass value="2.5"/>
      <inertia ixx="0.03" ixy="0.002" ixz="-0.004" iyy="0.05" iyz="0.006" izz="0.06"/></inertial>
    <visual><origin xyz="0.3 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.05" length="0.6"/></geometry></visual>
  </link>
  <link name="cap">
    <inertial><origin xyz="0.01 0 0.1" rpy="0 0.3 0"/><mass value="0.7"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.015"/></inertial>
    <visual><geometry><sphere radius="0.08"/></geometry></visual>
  </link>
  <link name="slider">
    <inertial><mass value="1.2"/>
      <inertia ixx="0.02" ixy="0" ixz="0.001" iyy="0.01" iyz="0" izz="0.02"/></inertial>
  </link>
  <link name="finger">
    <inertial><origin xyz="0 0.1 0"/><mass value="0.3"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.002"/></inertial>
  </link>
  <joint name="slew" type="continuous"><parent link="base"/><child link="boom"/>
    <origin xyz="0.1 -0.2 0.5" rpy="0.3 0.2 -0.6"/><axis xyz="0 0 1"/>
    <dynamics damping="0.25" friction="0.1"/></joint>
  <joint name="weld" type="fixed"><parent link="boom"/><child link="cap"/>
    <origin xyz="0.6 0.1 0" rpy="0.5 0 0.9"/></joint>
  <joint name="reach" type="prismatic"><parent link="cap"/><child link="slider"/>
    <origin xyz="0 0.2 0.1" rpy="0 -0.7 0.2"/><axis xyz="1 2 -2"/>
    <limit lower="-0.2" upper="0.9" velocity="0.5" effort="40"/></joint>
  <joint name="grip" type="revolute"><parent link="slider"/><child link="finger"/>
    <origin xyz="0.3 0 0" rpy="1 0 0"/><axis xyz="0 -1 0"/>
    <limit lower="-1" upper="1" effort="3" velocity="2"/>
    <mimic joint="reach" multiplier="-1.5" offset="0.2"/></joint>
</robot>"""
OPEN = """<robot name="sled"><link name="floor"/>
  <link name="sled"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
    <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.3" iyz="0.01" izz="0.4"/></inertial></link>
  <joint name="glide" type="{kind}"><parent link="floor"/><child link="sled"/>
    <origin xyz="1 2 3" rpy="0.4 0.1 0.2"/><axis xyz="0 3 4"/></joint></robot>"""


pytestmark = pytest.mark.filterwarnings("ignore::mechc.SkippedPartWarning")  # its bounds


def robot(folder, text=ROBOT, **options):
    path = folder / "robot.urdf"
    path.write_text(text)
    return mechc.from_urdf(path, **options)


# -- the reference --------------------------------------------------------------------------------


def _numbers(element, tag, attribute, default):
    found = element.find(tag) if element is not None else None
    text = found.get(attribute) if found is not None else None
    return np.array([float(x) for x in (text or default).split()])


def _skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _turn(axis, angle):
    k = _skew(axis / np.linalg.norm(axis))
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def _pose(element):
    roll, pitch, yaw = _numbers(element, "origin", "rpy", "0 0 0")
    x, y, z = np.eye(3)
    place = np.eye(4, dtype=complex)
    place[:3, :3] = _turn(z, yaw) @ _turn(y, pitch) @ _turn(x, roll)
    place[:3, 3] = _numbers(element, "origin", "xyz", "0 0 0")
    return place


def _placed(text, values):
    """The matrices of all links at these positions of the joints."""
    root = ElementTree.fromstring(text)
    places = {"base": np.eye(4, dtype=complex)}
    for joint in root.iter("joint"):
        axis = _numbers(joint, "axis", "xyz", "1 0 0")
        axis = axis / np.linalg.norm(axis)
        moved = np.eye(4, dtype=complex)
        value = values.get(joint.get("name"), 0.0)
        if joint.get("type") == "prismatic":
            moved[:3, 3] = axis * value
        else:
            moved[:3, :3] = _turn(axis, value)
        parent = places[joint.find("parent").get("link")]
        places[joint.find("child").get("link")] = parent @ _pose(joint) @ moved
    return root, places


def _energies(text, values, rates):
    """Kinetic energy, and m z summed over the links."""
    moved = {name: value + 1j * STEP * rates[name] for name, value in values.items()}
    root, places = _placed(text, moved)
    kinetic = height = 0.0
    for link in root.iter("link"):
        given = link.find("inertial")
        if given is None:
            continue
        place = places[link.get("name")] @ _pose(given)
        rotation, rate = place[:3, :3].real, place[:3, :3].imag / STEP
        turning = rate @ rotation.T
        spin = rotation.T @ [turning[2, 1], turning[0, 2], turning[1, 0]]
        about = given.find("inertia").get
        xx, xy, xz, yy, yz, zz = (float(about(f"i{e}")) for e in ENTRIES)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        mass = float(given.find("mass").get("value"))
        velocity = place[:3, 3].imag / STEP
        kinetic += mass * velocity @ velocity / 2 + spin @ inertia @ spin / 2
        height += mass * place[2, 3].real
    return kinetic, height


def _expected(text, slew, reach, slew_rate, reach_rate):
    values = {"slew": slew, "reach": reach, "grip": -1.5 * reach + 0.2}
    rates = {"slew": slew_rate, "reach": reach_rate, "grip": -1.5 * reach_rate}
    return _energies(text, values, rates)


THUMB = """<link name="thumb"/><link name="nail"/>
  <joint name="press" type="revolute"><parent link="cap"/><child link="thumb"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="bend" type="revolute"><parent link="finger"/><child link="nail"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
    <mimic joint="grip" multiplier="2" offset="-0.1"/></joint></robot>"""
STATES = np.random.default_rng(3).normal(size=(6, 4))


# -- what is promised -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def crane(tmp_path_factory):
    described = robot(tmp_path_factory.mktemp("crane"))
    return described, mechc.compile(described, outputs=("energy", "points"))


def test_names_follow_the_joints(crane):
    described, model = crane
    assert model.coordinates == ("q_slew", "q_reach")
    assert model.speeds == ("u_slew", "u_reach")
    assert set(model.parameters) == {"g"}
    assert [body.name for body in described.bodies] == ["boom", "slider", "finger"]
    assert described.skipped == (
        "position limits (limits='stop' takes them, limits='ignore' leaves them): "
        "reach -0.2 to 0.9, grip -1 to 1",
        "dry friction (friction='dry' takes it, friction='ignore' leaves it): slew 0.1",
    )


def test_a_reader_warns_its_caller_of_what_it_does_not_take(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(ROBOT)
    with pytest.warns(mechc.SkippedPartWarning, match="dry friction .*: slew 0.1") as told:
        mechc.from_urdf(path)
    assert [each.filename for each in told] == [__file__]


def test_energies_are_those_of_the_links(crane):
    _, model = crane
    for y in STATES:
        kinetic, height = _expected(ROBOT, *y)
        found = model.energy(y)
        assert found == pytest.approx(kinetic + 9.81 * height, rel=1e-13)


def test_the_mass_matrix_is_that_of_the_kinetic_energy(crane):
    """M, and with it the motion: T = u.M.u/2; what is lost is lost by the dampers."""
    _, model = crane
    for y in STATES:
        mass = model.mass_matrix(y)
        for u in ([1, 0], [0, 1], [1, 1]):
            kinetic, _ = _expected(ROBOT, *y[:2], *u)
            assert u @ mass @ u / 2 == pytest.approx(kinetic, rel=1e-13)
        rates = model.rhs(0.0, y)
        step = 1e-6
        change = (model.energy(y + step * rates) - model.energy(y - step * rates)) / (2 * step)
        assert change == pytest.approx(-0.25 * y[2] ** 2, rel=1e-6, abs=1e-7)


def test_links_are_where_the_file_says(crane):
    _, model = crane
    names = model.system.point_names
    y = STATES[0]
    _, places = _placed(ROBOT, {"slew": y[0], "reach": y[1], "grip": 0.2 - 1.5 * y[1]})
    found = dict(zip(names, model.points(y), strict=True))
    for name, place in places.items():
        assert found[name] == pytest.approx(place[:3, 3].real, abs=1e-14)


@pytest.mark.slow
def test_symbols_have_the_numbers_of_the_file(crane, tmp_path):
    """Every value a symbol: at the file's numbers the same energies, at others those of another
    file."""
    kinds = ["mass", "centre", "inertia", "origin", "orientation", "damping", "limits"]
    described = robot(tmp_path, symbolic=kinds)
    model = mechc.compile(described, outputs=("energy",))
    changed = {"m_cap": 1.9, "Ixy_boom": 0.01, "oz_reach": 0.4, "pitch_reach": -0.1}
    other = (
        ROBOT.replace('value="0.7"', 'value="1.9"')
        .replace('ixy="0.002"', 'ixy="0.01"')
        .replace('xyz="0 0.2 0.1" rpy="0 -0.7', 'xyz="0 0.2 0.4" rpy="0 -0.1')
    )
    for y in STATES:
        for params, text in (({}, ROBOT), (changed, other)):
            kinetic, height = _expected(text, *y)
            found = model.energy(y, params)
            assert found == pytest.approx(kinetic + 9.81 * height, rel=1e-12)
    assert model.defaults["d_slew"] == 0.25


def test_one_value_of_one_link_may_be_a_symbol(tmp_path):
    described = robot(tmp_path, symbolic=[("cap", "mass"), ("reach", "limits")])
    names = [p.symbol.name for p in described.parameters]
    assert names == ["m_cap", "lower_reach", "upper_reach", "velocity_reach", "effort_reach", "g"]
    assert described.limits["reach"].upper == Symbol("upper_reach")
    assert described.limits["grip"].position == -1.5 * described.q[1] + 0.2
    assert described.limits["slew"].lower is None


def _has(load, symbol):
    return any(matrix.has(symbol) for matrix, _ in load.args)


def test_a_driven_joint_has_an_input(tmp_path):
    described = robot(tmp_path, driven=["reach"])
    assert [str(f.func) for f in described.inputs] == ["tau_reach"]
    (torque,) = described.inputs
    pushed = [at.name for at, load in described.loads if _has(load, torque)]
    assert pushed == ["slider", "reach start"]
    assert {str(each.func) for each in robot(tmp_path, driven="all").inputs} == {
        "tau_slew", "tau_reach"
    }  # fmt: skip
    with pytest.raises(mechc.MechanismError, match="'grip' is no joint with a coordinate of its"):
        robot(tmp_path, driven=["grip"])


def test_shapes_are_drawn(crane):
    described, _ = crane
    kinds = [(s.kind, s.label, s.sizes) for s in described.drawing.solids]
    assert kinds == [
        ("box", "base", (0.4, 0.4, 0.1)),
        ("cylinder", "boom", (0.05, 0.6)),
        ("ball", "cap", (0.08,)),
    ]


@pytest.mark.parametrize("kind", ["planar", "floating"])
def test_joints_of_several_freedoms(kind, tmp_path):
    """A free body keeps its momentum relative to the weight: each height's energy is right."""
    described = robot(tmp_path, OPEN.format(kind=kind))
    model = mechc.compile(described, outputs=("energy", "points"), fix={"g": 0})
    y = np.random.default_rng(4).normal(size=len(model.coordinates) + len(model.speeds))
    rates = model.rhs(0.0, y)
    step = 1e-6
    change = (model.energy(y + step * rates) - model.energy(y - step * rates)) / (2 * step)
    assert abs(change) < 1e-7 * model.energy(y)
    at = dict(zip((*model.coordinates, *model.speeds), y, strict=True))
    place = model.points(y)[1]
    frame = _pose(ElementTree.fromstring(OPEN.format(kind=kind)).find("joint")).real
    moved = frame[:3, :3].T @ (place - frame[:3, 3])
    if kind == "planar":  # across the axis
        assert moved @ [0, 0.6, 0.8] == pytest.approx(0.0, abs=1e-14)
        assert moved @ moved == pytest.approx(at["x_glide"] ** 2 + at["y_glide"] ** 2)
    else:
        assert moved == pytest.approx([at[f"{axis}_glide"] for axis in "xyz"])


def test_a_mimic_may_come_before_the_joint_that_it_follows(tmp_path):
    """The grip, moved to the root: the joint that it follows is read after it."""
    first = ROBOT.replace('<parent link="slider"/>', '<parent link="base"/>')
    begin, end = first.index('<joint name="grip"'), first.index("</robot>")
    slew = first.index('<joint name="slew"')
    first = first[:slew] + first[begin:end] + first[slew:begin] + first[end:]
    described, later = robot(tmp_path, first), robot(tmp_path)
    names = [[str(q.func) for q in each.q] for each in (described, later)]
    assert names == [["q_slew", "q_reach"]] * 2
    grip = next(joint for joint in described.joints if joint.name == "grip")
    assert grip.coordinates == ()
    model = mechc.compile(described, outputs=("points",), fix={"g": 0})
    found, reach = model.points(model.assemble({"q_slew": 0.3, "q_reach": 0.4})), 0.4
    assert np.isfinite(found).all()
    assert described.limits["grip"].position.subs(described.q[1], reach) == -1.5 * reach + 0.2


def test_links_without_mass_and_mimics_of_mimics(tmp_path):
    """The thumb has no mass, and moves the finger by a joint that mimics it; the nail, which mimics
    the grip, has none either.  The equations are regular, and those of the file."""
    text = ROBOT.replace('mimic joint="reach"', 'mimic joint="press"').replace("</robot>", THUMB)
    described = robot(tmp_path, text)
    model = mechc.compile(described, outputs=("energy",))
    assert model.coordinates == ("q_slew", "q_reach", "q_press")
    bend = described.limits["bend"].position
    assert bend.subs(described.q[2], 1.0) == pytest.approx(2 * (-1.5 + 0.2) - 0.1)
    y = np.random.default_rng(6).normal(size=6)
    named = dict(zip(("slew", "reach", "press"), zip(y[:3], y[3:], strict=True), strict=True))
    values, rates = ({name: pair[k] for name, pair in named.items()} for k in (0, 1))
    values["grip"], rates["grip"] = -1.5 * y[2] + 0.2, -1.5 * y[5]
    kinetic, _ = _energies(text, values, rates)
    assert model.kinetic_energy(y) == pytest.approx(kinetic, rel=1e-13)
    assert np.linalg.eigvalsh(model.mass_matrix(y)).min() > 1e-4
    assert np.isfinite(model.rhs(0.0, y)).all()


def test_a_floating_base(tmp_path):
    described = robot(tmp_path, floating=True)
    assert [str(q.func) for q in described.q][:7] == [
        *(f"{x}_base" for x in "xyz"), *(f"q{k}_base" for k in range(4))
    ]  # fmt: skip
    with pytest.raises(mechc.MechanismError, match="'world' and the joint 'base'"):
        robot(tmp_path, ROBOT.replace('name="slew"', 'name="base"'), floating=True)
