"""SDFormat: frames as its specification has them, the world, and files that are refused by name."""

import os

import numpy as np
import pytest
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files import read_urdf
from mechc_codegen.robots.files.read_sdf import read_sdf
from mechc_codegen.robots.geometry import place_of
from mechc_codegen.robots.graph import resolve_graph
from scipy.spatial.transform import Rotation

import mechc

MASS = "<inertial><mass>2</mass></inertial>"
ARM = f"""<sdf version="1.11"><model name="arm">
<link name="a"/><link name="b"><pose>0 0 1 0 0 0</pose>{MASS}
<visual name="v"><geometry><mesh><uri>package://arm/b.stl</uri><scale>1 1 -2</scale></mesh>
</geometry></visual></link>
<joint name="g" type="fixed"><parent>world</parent><child>a</child></joint>
<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 2 0</xyz>
<limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit>
<dynamics><damping>0.1</damping><friction>0.2</friction><spring_stiffness>3</spring_stiffness>
<spring_reference>0.4</spring_reference></dynamics></axis></joint></model></sdf>"""
FRAMES = """<sdf version="1.9"><world name="w"><gravity>1 0 -2</gravity>
<frame name="corner"><pose degrees="1">1 2 3 0 0 90</pose></frame>
<model name="m"><pose relative_to="corner">0.1 0.2 0.3 0.4 0.5 0.6</pose>
  <link name="a"><pose relative_to="f">0.3 0 0 0 0.2 0</pose></link>
  <frame name="f" attached_to="inner"><pose>0 0.7 0 0.1 0 0</pose></frame>
  <model name="inner"><pose relative_to="__model__">0 0 2 -0.3 0 0</pose>
    <link name="a"><pose rotation_format="quat_xyzw">1 0 0 0.2 0.4 0.4 1.6</pose></link></model>
  <joint name="j" type="revolute"><parent>a</parent><child>inner::a</child>
    <pose relative_to="a">0.1 0 0 0 0 0.8</pose>
    <axis><xyz expressed_in="__model__">0 0.6 0.8</xyz></axis></joint>
</model></world></sdf>"""


def read(folder, text, **options):
    path = folder / "model.sdf"
    path.write_text(text)
    return read_sdf(path, **options)


def place(x, y, z, *rpy):
    """The homogeneous matrix of a pose (SciPy's rotation about fixed axes)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), (x, y, z)
    return matrix


def matrix_of(pose):
    found, at = np.eye(4), place_of(pose)
    found[:3, :3], found[:3, 3] = at.rotation, at.origin
    return found


def test_poses_are_relative_to_frames(tmp_path):
    robot = resolve_graph(read(tmp_path, FRAMES))
    model = place(1, 2, 3, 0, 0, np.pi / 2) @ place(0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    inner = model @ place(0, 0, 2, -0.3, 0, 0)
    a = inner @ place(0, 0.7, 0, 0.1, 0, 0) @ place(0.3, 0, 0, 0, 0.2, 0)
    turn = Rotation.from_quat([0.2, 0.4, 0.4, 1.6]).as_matrix()
    inner_a = inner @ np.block([[turn, np.array([[1, 0, 0]]).T], [0, 0, 0, 1]])
    joint, free = robot.joints
    assert (joint.name, joint.parent, joint.child) == ("m::j", "m::a", "m::inner::a")
    assert (free.name, free.kind, free.parent, free.child) == (
        "m::a", "floating", "world", "m::a"
    )  # fmt: skip
    at = a @ place(0.1, 0, 0, 0, 0, 0.8)
    np.testing.assert_allclose(matrix_of(free.origin), a, atol=1e-14)
    np.testing.assert_allclose(a @ matrix_of(joint.origin), at, atol=1e-14)
    np.testing.assert_allclose(inner_a @ matrix_of(joint.child_origin), at, atol=1e-14)
    axis = at[:3, :3] @ joint.axis
    np.testing.assert_allclose(axis, model[:3, :3] @ [0, 0.6, 0.8], atol=1e-14)
    assert robot.gravity == (1, 0, -2)


@pytest.mark.parametrize("older", ["version", "element"])
def test_axes_of_older_files_are_those_of_the_model(tmp_path, older):
    text = FRAMES.replace(' expressed_in="__model__"', "")
    if older == "version":
        text = text.replace('"1.9"', '"1.4"')
    else:
        text = text.replace("</xyz>", "</xyz><use_parent_model_frame>1</use_parent_model_frame>")
    joint, new = (read(tmp_path, each).joints[0] for each in (text, FRAMES))
    assert joint.axis == pytest.approx(new.axis, abs=1e-15)


def test_values_and_those_that_the_format_has_where_a_file_has_none(tmp_path):
    robot = read(tmp_path, ARM)
    a, b, (g, j) = robot.links["a"], robot.links["b"], robot.joints
    assert (a.mass, a.inertia, b.mass) == (1, (1, 0, 0, 1, 0, 1), 2)
    (mesh,) = b.visuals
    assert (mesh.kind, mesh.path, mesh.sizes) == ("mesh", "package://arm/b.stl", (1, 1, -2))
    assert (g.kind, j.kind, j.axis, j.damping, j.friction) == (
        "fixed", "revolute", (0, 1, 0), 0.1, 0.2
    )  # fmt: skip
    assert (j.stiffness, j.rest, robot.gravity) == (3, 0.4, (0, 0, -9.8))
    assert j.limits == {"lower": -1, "upper": 2, "effort": 5}
    free = read(tmp_path, ARM.replace("<upper>2<", "<upper>inf<"))
    assert free.joints[1].kind == "continuous"
    assert free.skipped == ("the limits of the joint j, of which one is infinite",)
    mimic = '<mimic joint="k"><multiplier>2</multiplier><offset>1</offset><reference>3</reference>'
    followed = '<joint name="k" type="continuous"><parent>a</parent><child>c</child></joint>'
    text = ARM.replace("<axis>", f"<axis>{mimic}</mimic>")
    text = text.replace("</model>", f'<link name="c"/>{followed}</model>')
    assert read(tmp_path, text).joints[1].mimic.coefficients == (-5, 2)


def test_what_the_world_holds(tmp_path):
    """Static models, one link of each group that it does not hold, or that fixed to it."""
    text = f"""<sdf version="1.7"><world name="w"><include><uri>model://sun</uri></include>
      <model name="table"><static>true</static><link name="t"/></model>
      {ARM[ARM.index("<model") : ARM.index("</sdf>")]}
      <model name="pair"><link name="x"/><link name="y"/><plugin name="p"/>
      <joint name="z" type="prismatic"><parent>x</parent><child>y</child></joint>
      <joint name="g" type="gearbox"><parent>x</parent><child>y</child></joint></model></world>
      </sdf>"""
    robot = resolve_graph(read(tmp_path, text))
    held = {joint.child: joint.kind for joint in robot.joints if joint.parent == "world"}
    assert held == {"table::t": "fixed", "arm::a": "fixed", "pair::x": "floating"}
    assert robot.skipped == (
        "the model of another file, model://sun", "the element <plugin> p", "the gearbox pair::g"
    )  # fmt: skip
    still = {j.child: j.kind for j in read(tmp_path, text, floating=False).joints}
    assert still["pair::x"] == "fixed"


@pytest.mark.parametrize("kind", ["universal", "revolute2"])
def test_a_universal_joint_has_two_axes(tmp_path, kind):
    second = "</axis><axis2><xyz>0.6 0 0.8</xyz></axis2>"
    robot = read(tmp_path, ARM.replace("revolute", kind).replace("</axis>", second))
    joint = robot.joints[1]
    assert joint.kind == "universal"
    rotation = np.array(place_of(joint.child_origin).rotation)
    np.testing.assert_allclose(rotation[:, :2].T, [[0, 1, 0], [0.6, 0, 0.8]], atol=1e-15)
    assert "damping of the universal joint j" in robot.skipped
    skew = ARM.replace("revolute", kind).replace("</axis>", second.replace(">0.6 0", ">0.6 1"))
    with pytest.raises(mechc.MechanismError, match="'j' has axes that are not perpendicular"):
        read(tmp_path, skew)


WRONG = {
    "root": ("sdf", "robot", "the outermost element is <robot>"),
    "empty": ('<model name="arm">', "</sdf>", "is not XML"),
    "kind": ('"revolute"', '"screw"', "the joint 'j' has the type 'screw'; known are"),
    "link": ("<child>b", "<child>c", "the joint 'j' refers to 'c', which is no link or frame"),
    "parent": ("<parent>a", "<parent>c", "the joint 'j' refers to 'c', which is no link"),
    "itself": ("<parent>a", "<parent>b", "the joint 'j' joins the link 'b' to itself"),
    "frame": ("<pose>", '<pose relative_to="c">', "'b' refers to 'c', which is no"),
    "ring": ("<pose>", '<pose relative_to="j">', "refers to the frame 'b', which leads back"),
    "axis": ("<xyz>", '<xyz expressed_in="c">', "'j' refers to 'c', which is no"),
    "zero": ("0 2 0", "0 0 0", "'j' has an axis without direction"),
    "nan": ("<mass>2", "<mass>nan", "the link 'b' has text='nan'"),
    "infinite": ("<mass>2", "<mass>1e999", "the link 'b' has a number without bounds"),
    "negative": ("<mass>2", "<mass>-2", "the link 'b' has the mass -2"),
    "auto": ("<inertial>", '<inertial auto="true">', "the link 'b' has the inertia of its shapes"),
    "count": ("0 0 1 0 0 0", "0 0 1", "'b' has text='0 0 1' in <pose>, not 6 numbers"),
    "repeat": ('link name="a"', 'link name="b"', "'b' has the name of another link"),
    "limits": ("<upper>2", "<upper>-2", "'j' has the lower limit -1 above"),
    "name": ('<link name="a"/>', "<link/>", "a link has no name"),
    "long": ('link name="a"', f'link name="{1001 * "a"}"', "a link has a name of 1001 letters"),
    "reserved": ('link name="a"', 'link name="world"', "'world' has a name that SDFormat reserves"),
    "twin": ("<link ", '<model name="b"/><link ', "'b' has the name of another link, joint, frame"),
    "version": ('"1.11"', '"1.4.0"', "the version of SDFormat is '1.4.0'"),
    "truth": ("<link ", "<static>yes</static><link ", "the model 'arm' has static='yes', neither"),
    "rotation": ("<pose>", '<pose rotation_format="wxyz">', "'b' has the rotation_format 'wxyz'"),
    "inertial": ("<mass>", '<pose relative_to="a"/><mass>', "'b' has a <pose> in <inertial> that"),
    "size": ("<mesh>", "<box><size>1 1 -1</size></box><mesh>", "'b' has a <box> of negative size"),
    "entity": ("<sdf ", '<!DOCTYPE x [<!ENTITY e "e">]><sdf ', "declares a document type"),
    "two": ("</model>", '</model><model name="n"/>', "with 2 worlds or models"),
    "deep": ("<link ", '<model name="m">' * 50 + "</model>" * 50 + "<link ", "within more than 40"),
    "placement": ('name="arm"', 'name="arm" placement_frame="b"', "has a placement_frame"),
    "canonical": ('name="arm"', 'name="arm" canonical_link="c"', "refers to 'c'"),
    "mimicked": ("<axis>", '<axis><mimic joint="g" axis="axis2"/>', "mimics the 'axis2' of 'g'"),
    "damper": ("<damping>", "<damping>-", "'j' has damping, friction or stiffness that is"),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_refused_by_name(tmp_path, what):
    old, new, words = WRONG[what]
    assert old in ARM
    text = ARM.replace(old, new, -1 if what == "root" else 1)
    if what == "canonical":
        text = text.replace("<parent>world", "<parent>__model__")
    with pytest.raises(mechc.MechanismError) as caught:
        resolve_graph(read(tmp_path, text))
    assert words in str(caught.value)


@pytest.mark.parametrize(("version", "z"), [("1.5", -1.62), ("1.6", -9.8)])
def test_weight_is_in_physics_before_1_6(tmp_path, version, z):
    physics = f'<sdf version="{version}"><world name="w"><physics type="ode">'
    text = (
        physics + '<gravity>0 0 -1.62</gravity></physics><model name="m"><link name="a"/></model>'
    )
    assert read(tmp_path, text + "</world></sdf>").gravity == (0, 0, z)


def test_truth_is_told_in_letters_of_either_case(tmp_path):
    static = ARM.replace("<link ", "<static> True </static><link ", 1)
    assert {joint.kind for joint in read(tmp_path, static).joints} == {"fixed"}
    turned = ARM.replace("<pose>0 0 1 0 0 0", '<pose degrees="TRUE">0 0 1 0 0 90')
    at = matrix_of(read(tmp_path, turned).joints[1].origin)
    np.testing.assert_allclose(at, place(0, 0, 1, 0, 0, np.pi / 2), atol=1e-15)


def test_frames_of_joints_that_do_not_move_are_known(tmp_path):
    """A link may be placed by the joint of a static model, or by a gearbox."""
    text = """<sdf version="1.9"><world name="w"><model name="still"><static>1</static>
      <link name="x"/><link name="y"><pose relative_to="z">0 0 2 0 0 0</pose></link>
      <joint name="z" type="revolute"><parent>y</parent><child>x</child><pose>0 1 0 0 0 0</pose>
      </joint></model><model name="m"><link name="a"/><link name="b"><pose relative_to="g"/></link>
      <joint name="g" type="gearbox"><parent>b</parent><child>a</child><pose>3 0 0 0 0 0</pose>
      </joint></model></world></sdf>"""
    at = {joint.child: joint.origin.xyz for joint in read(tmp_path, text).joints}
    assert at["still::y"] == (0, 1, 2)
    assert at["m::b"] == (3, 0, 0)
    empty = ARM.replace("<pose>0 0 1 0 0 0", '<pose rotation_format="quat_xyzw">')
    assert read(tmp_path, empty).joints[1].origin.xyz == (0, 0, 0)


UNTAKEN = {
    "velocity_decay of the link a": ("<link name='a'><velocity_decay><linear>1</linear>"
                                     "<angular>0</angular></velocity_decay></link>"),
    "fluid_added_mass of the link a": ("<link name='a'><inertial><fluid_added_mass><xx>1</xx>"
                                       "</fluid_added_mass></inertial></link>"),
    "that the link a is kinematic": "<link name='a'><kinematic>TRUE</kinematic></link>",
    "that the link a has no weight": "<link name='a'><gravity>False</gravity></link>",
    "mimic of the ball joint k": ("<link name='a'/><joint name='k' type='ball'><parent>a</parent>"
                                  "<child>b</child><axis><mimic joint='j'/></axis></joint>"),
    "max_force of the joint k": ("<link name='a'/><joint name='k' type='revolute'><parent>a"
                                 "</parent><child>b</child><physics><ode><max_force>1</max_force>"
                                 "</ode></physics></joint>"),
    "the element <model_state> s": "<link name='a'/><model_state name='s'/>",
    "the drawing of shapes (<capsule>): a": ("<link name='a'><visual><geometry><capsule/>"
                                             "</geometry></visual></link>"),
    "that of a mesh one part is drawn (<submesh>): a": (
        "<link name='a'><visual><geometry><mesh><submesh/></mesh></geometry></visual></link>"),
}  # fmt: skip


@pytest.mark.parametrize("words", UNTAKEN)
def test_what_is_not_taken_is_named(tmp_path, words):
    text = ARM.replace('<link name="a"/>', UNTAKEN[words])
    assert read(tmp_path, text).skipped == (words,)


def test_newer_versions_and_the_state_of_a_world_are_named(tmp_path):
    text = """<sdf version="1.13"><world name="w"><model name="m"><link name="a"/></model>
      <state world_name="w"/><population name="p"/><include><uri>u</uri></include></world></sdf>"""
    assert read(tmp_path, text).skipped == (
        "what is new since SDFormat 1.12: the file is 1.13", "the element <state>",
        "the element <population> p", "the model of another file, u",
    )  # fmt: skip
    joint = "</model><joint name='j' type='fixed'><parent>u::x</parent><child>m::a</child></joint>"
    with pytest.raises(mechc.MechanismError, match=r"'u::x'.*models of other files are not read"):
        read(tmp_path, text.replace("</model>", joint))


def test_a_joint_without_bounds_has_none_to_name(tmp_path):
    bounds = "<limit><lower>-1e16</lower><upper>1e16</upper></limit>"
    ball = f"<joint name='k' type='ball'><parent>a</parent><child>b</child><axis>{bounds}</axis>"
    text = ARM.replace("<joint", ball + "</joint><joint", 1)
    assert read(tmp_path, text).skipped == ()


@pytest.mark.parametrize(("floating", "words"), [(True, "the world$"), (False, "floating=True")])
def test_a_file_in_which_nothing_moves_is_refused(tmp_path, floating, words):
    path = tmp_path / "still.sdf"
    path.write_text(
        '<sdf version="1.9"><model name="m"><static>1</static><link name="a"/></model></sdf>'
    )
    with pytest.raises(mechc.MechanismError, match=f"nothing moves, all links are .*{words}"):
        mechc.from_sdf(path, floating=floating)


def test_pipes_and_more_parts_than_memory_has_room_for_are_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.sdf")
    with pytest.raises(mechc.MechanismError, match=r"'pipe\.sdf' is a pipe or a device"):
        read_sdf(tmp_path / "pipe.sdf")
    monkeypatch.setattr(read_urdf, "MOST_PARTS", 30)
    with pytest.raises(mechc.MechanismError, match=r"'model\.sdf' has more than 30 elements"):
        read(tmp_path, ARM)


def test_long_chains_of_frames_are_followed(tmp_path):
    frames = "".join(
        f'<frame name="f{k}" attached_to="f{k + 1}"><pose>0.5 0 0 0 0 0</pose></frame>'
        for k in range(5000)
    )
    frames += '<frame name="f5000" attached_to="b"/>'
    text = ARM.replace("<joint", frames + "<joint", 1).replace("<child>b", "<child>f0")
    joint = read(tmp_path, text).joints[1]
    assert (joint.child, joint.child_origin.xyz) == ("b", (2500, 0, 0))


def test_elements_that_no_version_has_are_named(tmp_path):
    text = ARM.replace("<mass>2</mass>", "<masss>2</masss>").replace("damping>", "dampening>")
    text = text.replace("</model>", "<jiont name='k'/><g:own xmlns:g='http://g'/></model>")
    assert read(tmp_path, text).skipped == (
        "<dampening> in <dynamics> of j, which is not read",
        "<g:own> in <model> of arm, which is not read",
        "<jiont> in <model> of arm, which is not read",
        "<masss> in <inertial> of b, which is not read",
    )


def test_weight_where_a_later_version_has_none_is_named(tmp_path):
    world = '<sdf version="1.6"><world name="w"><physics type="ode"><gravity>0 0 0</gravity>'
    text = f'{world}</physics><model name="m"><link name="a"/></model></world></sdf>'
    assert read(tmp_path, text).skipped == (
        "<gravity> in <physics>, where it is until SDFormat 1.5",
    )


@pytest.mark.parametrize(
    ("moments", "is_read"),
    [("1 0 0 1 0 -0.1", False), ("1 2 2 1 2 1", False), ("1 0.8 0.8 1 -0.8 1", False),
     ("1 1 0 1 0 2", True), ("0 0 0 0 0 0", True), ("0.01 0 0 0.3 0.3 0.299999", True)],
)  # fmt: skip
def test_an_inertia_with_a_negative_moment_is_refused(tmp_path, moments, is_read):
    tags = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = "".join(f"<{t}>{x}</{t}>" for t, x in zip(tags, moments.split(), strict=True))
    text = ARM.replace("</mass>", f"</mass><inertia>{entries}</inertia>")
    if is_read:
        assert read(tmp_path, text).links["b"].inertia == tuple(map(float, moments.split()))
    else:
        with pytest.raises(MechanismError, match="an inertia that no body has"):
            read(tmp_path, text)
