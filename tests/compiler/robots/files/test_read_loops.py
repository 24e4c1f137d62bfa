"""Each form in which files close a loop is the same linkage, and what is not read is named."""

import numpy as np
import pytest
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files.read_urdf import read_robot
from mechc_codegen.robots.geometry import place_of
from mechc_codegen.robots.graph import resolve_graph
from mechc_codegen.robots.spanning import spanning_tree

import mechc

MASS = (
    '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    "</inertial>"
)
TREE = f"""<robot name="bars"><link name="g"/>
<link name="a">{MASS}</link><link name="b">{MASS}</link><link name="c">{MASS}</link>
<joint name="A" type="continuous"><parent link="g"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="B" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 1"/>
<axis xyz="0 1 0"/></joint>
<joint name="D" type="continuous"><parent link="g"/><child link="c"/>
<origin xyz="2 0 0" rpy="0 0.5 0"/><axis xyz="0 1 0"/></joint>{{}}</robot>"""
# On the rocker c, whose frame is turned by 0.5, and on the coupler b: the point (2, 0, 1.5).
ON_ROCKER, ON_COUPLER = "-0.7191383079063044 0 1.316373842835558", "2 0 0.5"
LOOPS = {
    "constraint": f'<constraint name="C" type="revolute"><parent link="c"/>'
    f'<parent_origin xyz="{ON_ROCKER}"/><parent_axis xyz="0 2 0"/><child link="b"/>'
    f'<child_origin xyz="{ON_COUPLER}" rpy="0 0 1"/>'
    '<child_axis xyz="0.8414709848078965 0.5403023058681398 0"/></constraint>',
    "loop_joint": f'<loop_joint name="C" type="revolute"><link1 link="c" xyz="{ON_ROCKER}"/>'
    f'<link2 link="b" xyz="{ON_COUPLER}"/><axis xyz="0 1 0"/></loop_joint>',
    "gazebo": '<gazebo><joint name="C" type="revolute"><parent>c</parent><child>b</child>'
    f"<pose>{ON_COUPLER} 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></gazebo>",
    "URDF+": f'<loop name="C" type="revolute"><predecessor link="c"><origin xyz="{ON_ROCKER}"/>'
    f'</predecessor><successor link="b"><origin xyz="{ON_COUPLER}"/></successor>'
    '<axis xyz="0 1 0"/></loop>',
    "drake": '<drake:ball_constraint><drake:ball_constraint_body_A name="c"/>'
    f'<drake:ball_constraint_body_B name="b"/><drake:ball_constraint_p_AP value="{ON_ROCKER}"/>'
    f'<drake:ball_constraint_p_BQ value="{ON_COUPLER}"/></drake:ball_constraint>',
}


def read(folder, loop):
    path = folder / "bars.urdf"
    path.write_text(TREE.format(loop))
    return read_robot(path)


@pytest.mark.parametrize("form", LOOPS)
def test_the_two_sides_of_a_loop_meet_at_the_start(form, tmp_path):
    tree = spanning_tree(resolve_graph(read(tmp_path, LOOPS[form])))
    (cut,) = tree.cuts
    assert (cut.parent, cut.child) == ("c", "b")
    sides = (cut.parent, cut.origin), (cut.child, cut.child_origin)
    for link, pose in sides:
        end = tree.places[link].then(place_of(pose))
        assert end.origin == pytest.approx([2, 0, 1.5])
        if cut.kind != "ball":
            axis = [sum(a * b for a, b in zip(row, cut.axis, strict=True)) for row in end.rotation]
            assert axis == pytest.approx([0, 1, 0], abs=1e-15)


def test_a_universal_joint_has_an_axis_on_each_side(tmp_path):
    loop = LOOPS["constraint"].replace("revolute", "universal").replace("0 2 0", "0 0 3")
    (cut,) = spanning_tree(resolve_graph(read(tmp_path, loop))).cuts
    on_parent, on_child = (place_of(pose).rotation for pose in (cut.origin, cut.child_origin))
    assert [row[0] for row in on_parent] == pytest.approx([0, 0, 1])
    assert [row[1] for row in on_child] == pytest.approx([0, 1, 0])


def test_a_damper_of_gazebo_keeps_its_joint_in_the_tree(tmp_path):
    damped = LOOPS["gazebo"].replace("</axis>", "<dynamics><damping>3</damping></dynamics></axis>")
    robot = read(tmp_path, damped)
    assert robot.joints[-1].damping == 3
    tree = spanning_tree(resolve_graph(robot), with_coordinate=("C",))
    assert [cut.name for cut in tree.cuts] == ["C weld"]


def test_what_is_not_read_is_named(tmp_path):
    other = '<drake:linear_bushing_rpy/><gazebo><joint name="G" type="gearbox"/></gazebo>'
    assert read(tmp_path, LOOPS["drake"] + other).skipped == (
        "<drake:linear_bushing_rpy> in <robot> of bars, which is not read",
        "the joint G of <gazebo> (gearbox)"
    )  # fmt: skip


def test_a_pose_of_gazebo_may_be_relative_to_another_link(tmp_path):
    frame = LOOPS["gazebo"].replace(f"<pose>{ON_COUPLER}", f'<pose relative_to="c">{ON_ROCKER}')
    (cut,) = spanning_tree(resolve_graph(read(tmp_path, frame))).cuts
    assert cut.origin.xyz == pytest.approx([float(x) for x in ON_ROCKER.split()])
    assert cut.child_origin.xyz == pytest.approx([float(x) for x in ON_COUPLER.split()])


WRONG = {
    "type": ("loop_joint", 'type="revolute"', 'type="rod"', "loop_joint 'C' has the type 'rod'"),
    "link": ("loop_joint", '"b"', '"z"', "the child of the joint 'C' is 'z', which is no link"),
    "itself": ("loop_joint", '"b"', '"c"', "'C' joins the link 'c' to itself"),
    "nan": ("loop_joint", "0 1.3", "nan 1.3", "'C' has xyz="),
    "text": ("gazebo", "0 0 0</pose>", "0 0</pose>", "'C' has text='2 0 0.5 0 0' in <pose>, not 6"),
    "name": ("constraint", ' name="C"', "", "a constraint has no name"),
    "repeat": ("constraint", 'name="C"', 'name="A"', "more than one joint is called 'A'"),
    "unknown": ("gazebo", "<parent>c", "<parent>world", "'C' refers to 'world', which is no link"),
    "slide": ("constraint", "revolute", "prismatic", "'C' slides along axes that differ"),
}


@pytest.mark.parametrize("what", WRONG)
def test_errors_name_the_element(what, tmp_path):
    form, old, new, words = WRONG[what]
    assert old in LOOPS[form]
    with pytest.raises(mechc.MechanismError) as caught:
        resolve_graph(read(tmp_path, LOOPS[form].replace(old, new)))
    assert words in str(caught.value)


CHAINS = f"""<robot name="chains"><link name="g"/>
{"".join(f'<link name="{name}">{MASS}</link>' for name in ("a", "b", "c", "d"))}
{
    "".join(
        f'<joint name="{name.upper()}" type="continuous"><parent link="{parent}"/>'
        f'<child link="{name}"/><origin xyz="0 {y} 0.7"/><axis xyz="{axis}"/></joint>'
        for name, parent, y, axis in (
            ("a", "g", 0, "1 0 0"),
            ("b", "a", 0.3, "0 1 0"),
            ("c", "a", -0.4, "1 0 0"),
            ("d", "c", 0.5, "0 0 1"),
        )
    )
}{{}}</robot>"""
COUPLING = (
    '<coupling name="K"><predecessor link="{}"/><successor link="{}"/><ratio value="{}"/>'
    "</coupling>"
)


def chains(folder, added):
    path = folder / "chains.urdf"
    path.write_text(CHAINS.format(added))
    return mechc.from_urdf(path)


def test_a_coupling_of_two_joints_is_a_mimic(tmp_path):
    follower = '<child link="c"/>'
    mimic = CHAINS.replace(follower, f'{follower}<mimic joint="B" multiplier="2.5"/>')
    (tmp_path / "mimic.urdf").write_text(mimic.format(""))
    wanted = mechc.compile(mechc.from_urdf(tmp_path / "mimic.urdf"))
    model = mechc.compile(chains(tmp_path, COUPLING.format("b", "c", 2.5)))
    state = np.linspace(0.3, 1.2, 6)
    assert model.coordinates == wanted.coordinates == ("q_A", "q_B", "q_D")
    np.testing.assert_allclose(model.rhs(0.0, state), wanted.rhs(0.0, state), rtol=1e-12)


def test_a_coupling_holds_sums_along_two_ways(tmp_path):
    """b = (c + d) / 2 without the joint that both ways have: M and F are those of the free chains
    along the directions that it leaves."""
    free = mechc.compile(chains(tmp_path, ""))
    model = mechc.compile(chains(tmp_path, COUPLING.format("b", "d", 2)))
    assert model.coordinates == ("q_A", "q_B", "q_C")
    directions = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 2, -1]], float)
    q, u = np.array([0.4, -0.3, 0.8]), np.array([1.1, 0.7, -0.6])
    state = np.concatenate([directions @ q, directions @ u])
    mass = directions.T @ free.mass_matrix(state) @ directions
    wanted = np.linalg.solve(mass, directions.T @ free.forcing(state))
    found = model.rhs(0.0, np.concatenate([q, u]))[3:]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_the_joint_that_is_not_independent_follows(tmp_path):
    added = COUPLING.format("b", "d", 2)
    text = CHAINS.replace('name="B"', 'name="B" independent="False"').format(added)
    (tmp_path / "chains.urdf").write_text(text)
    mechanism = mechc.from_urdf(tmp_path / "chains.urdf")
    assert mechc.compile(mechanism).coordinates == ("q_A", "q_C", "q_D")


def test_couplings_are_solved_together(tmp_path):
    """2 b = c and b = 3 (c + d) / 2: c and d follow b, or b and c follow d."""
    added = COUPLING.format("b", "c", 2) + COUPLING.format("d", "b", 1.5)
    mechanism = chains(tmp_path, added)
    free, model = mechc.compile(chains(tmp_path, "")), mechc.compile(mechanism)
    assert model.coordinates == ("q_A", "q_B")
    directions = np.array([[1, 0], [0, 1], [0, 2], [0, 2 / 3 - 2]], float)
    q, u = np.array([0.4, -0.3]), np.array([1.1, 0.7])
    mass = free.mass_matrix(np.concatenate([directions @ q, directions @ u]))
    found = model.mass_matrix(np.concatenate([q, u]))
    np.testing.assert_allclose(found, directions.T @ mass @ directions, rtol=1e-12)
    last = CHAINS.format(added).replace('name="D"', 'name="D" independent="true"')
    for name in "BC":
        last = last.replace(f'name="{name}"', f'name="{name}" independent="false"')
    last = last.replace(
        "</robot>", '<transmission name="t"><joint name="B"/></transmission></robot>'
    )
    (tmp_path / "last.urdf").write_text(last)
    assert mechc.compile(mechc.from_urdf(tmp_path / "last.urdf")).coordinates == ("q_A", "q_D")


def test_long_chains_of_couplings_are_read_at_once(tmp_path):
    """Each is of two sums, which all that are before it enter."""
    parts = ['<link name="g"/>']
    for k in range(40):
        for chain in "ab":
            on = f"{chain}{k - 1}" if k else "g"
            parts.append(
                f'<link name="{chain}{k}">{MASS}</link><joint name="{chain.upper()}{k}" '
                f'type="continuous"><parent link="{on}"/><child link="{chain}{k}"/></joint>'
            )
        parts.append(COUPLING.replace('"K"', f'"K{k}"').format(f"a{k}", f"b{k}", 1))
    path = tmp_path / "long.urdf"
    path.write_text(f'<robot name="long">{"".join(parts)}</robot>')
    followers = [joint for joint in resolve_graph(read_robot(path)).joints if joint.mimic]
    assert len(followers) == 40
    assert all(joint.mimic.beside == () for joint in followers)


@pytest.mark.parametrize(
    ("added", "why"),
    [
        (COUPLING.format("a", "nowhere", 1), "which no joint joins"),
        (COUPLING.format("a", "a", 1), "couples no two joints"),
        (COUPLING.format("c", "d", 1), "couples no two joints"),  # c is on the way to d
        (COUPLING.format("g", "a", 1), "couples no two joints"),
        (COUPLING.format("b", "c", 1) + COUPLING.format("c", "b", 1), "that nothing couples yet"),
        (COUPLING.format("b", "d", "x"), "ratio|value"),
        (COUPLING.replace("<ratio", "<rate").format("b", "d", 1), "lacks <ratio>"),
    ],
)
def test_couplings_that_say_nothing_are_refused(tmp_path, added, why):
    with pytest.raises(MechanismError, match=why):
        chains(tmp_path, added)
