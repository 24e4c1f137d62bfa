"""The verdict against closed forms, and against numbers read from the XML by NumPy alone."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from benchmarks.suite.robots import robots_folder

GROUND, CRANK, COUPLER, ROCKER = 4.0, 1.0, 3.5, 2.5  # shortest and longest below the others' sum


def link(name, inertia="0.1 0 0 0.1 0 0.1", mass=1.0):
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    told = " ".join(f'{n}="{x}"' for n, x in zip(names, inertia.split(), strict=True))
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {told}/></inertial></link>'
    )


def pin(name, parent, child, at, more="", kind="continuous"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at[0]} 0 {at[1]}"/><axis xyz="0 -1 0"/>{more}</joint>'
    )


def four_bar(lengths=(GROUND, CRANK, COUPLER, ROCKER), angle=1.0, crank="", gap=0.0):
    """A four-bar drawn with its crank at an angle, and its text; the rocker's angle there."""
    ground, one, two, three = lengths
    end = np.array([one * math.cos(angle), one * math.sin(angle)])
    pivot = np.array([ground, 0.0])
    away = pivot - end
    far = math.hypot(*away)
    along = (two**2 + far**2 - three**2) / (2 * far)
    height = math.sqrt(two**2 - along**2)
    joint = end + (along * away + height * np.array([-away[1], away[0]])) / far
    kind = "revolute" if crank else "continuous"
    rocker = joint - pivot
    text = "".join([
        '<robot name="bars"><link name="floor"/>', *map(link, ("crank", "coupler", "rocker")),
        pin("A", "floor", "crank", (0, 0), crank, kind), pin("B", "crank", "coupler", end),
        pin("D", "floor", "rocker", pivot),
        '<constraint name="C" type="revolute"><parent link="rocker"/>',
        f'<parent_origin xyz="{rocker[0] + gap} 0 {rocker[1]}"/><parent_axis xyz="0 -1 0"/>',
        f'<child link="coupler"/><child_origin xyz="{joint[0] - end[0]} 0 {joint[1] - end[1]}"/>',
        "</constraint></robot>",
    ])  # fmt: skip
    return text, math.atan2(rocker[1], rocker[0])


def judged(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_text(text, "utf-8")
    return mechc.from_urdf(path, limits="ignore").judge()


def ranges(verdict):
    return {each.name: each.range for each in verdict.ranges}


def turned(far):
    """The rocker's angle where its joint is so far from the crank's pivot, by the cosine law."""
    at_pivot = math.acos((GROUND**2 + ROCKER**2 - far**2) / (2 * GROUND * ROCKER))
    return math.pi - at_pivot


def test_a_crank_rocker_has_one_freedom_and_the_range_of_the_law_of_cosines(tmp_path):
    """Gruebler in the plane: 3 (4 - 1) - 2 * 4 = 1; of the six conditions of its loop of pins in
    space three follow.  The rocker turns between the poses with crank and coupler in line."""
    text, rocker = four_bar()
    verdict = judged(tmp_path, text)
    assert verdict.freedoms == 1
    assert len(verdict.redundant) == 3
    (loop,) = verdict.loops
    assert (loop.cut, set(loop.joints)) == ("C", {"A", "B", "D"})
    assert loop.why == "the file says that it closes a loop"
    assert not verdict.is_open
    (group,) = verdict.groups
    assert (group.assemblies, group.change_points, group.stops) == (2, (), ())
    found = ranges(verdict)
    assert found["A"] == (-math.inf, math.inf)
    ends = sorted(turned(far) - rocker for far in (COUPLER - CRANK, COUPLER + CRANK))
    assert found["D"] == pytest.approx(ends, abs=1e-9)


@pytest.mark.parametrize("lower", [-0.2, 0.0])
def test_a_limit_of_the_crank_bounds_the_rocker_too(tmp_path, lower):
    """The pose may be at a limit itself."""
    limit = f'<limit lower="{lower}" upper="0.3" effort="1" velocity="1"/>'
    verdict = judged(tmp_path, four_bar(crank=limit)[0])
    drawn = four_bar()[1]
    ends = sorted(four_bar(angle=1.0 + turn)[1] - drawn for turn in (lower, 0.3))
    assert ranges(verdict)["A"] == pytest.approx((lower, 0.3), abs=1e-12)
    assert ranges(verdict)["D"] == pytest.approx(ends, abs=1e-9)
    assert verdict.groups[0].stops == ("q_A",)


def test_a_double_rocker_is_followed_through_its_dead_points(tmp_path):
    """Where no joint turns round (Grashof's sum is too large) the crank's range is that of the
    triangle of ground, crank, and coupler with rocker in line."""
    ground, crank, coupler, rocker = lengths = (4.0, 3.0, 2.0, 2.5)
    verdict = judged(tmp_path, four_bar(lengths, angle=0.5)[0])
    stretched = coupler + rocker
    most = math.acos((ground**2 + crank**2 - stretched**2) / (2 * ground * crank))
    assert ranges(verdict)["A"] == pytest.approx((-most - 0.5, most - 0.5), abs=1e-9)
    assert verdict.groups[0].stops == ()
    assert min(lengths) + max(lengths) > sum(lengths) / 2


def test_a_change_point_is_where_shortest_and_longest_are_as_long_as_the_others(tmp_path):
    verdict = judged(tmp_path, four_bar((4.0, 1.0, 3.5, 1.5))[0])
    assert 1.0 + 4.0 == 3.5 + 1.5
    (point,) = verdict.groups[0].change_points
    assert point["q_A"] == pytest.approx(math.pi - 1.0, abs=1e-6)


def test_two_loops_in_line_at_once_are_a_change_point(tmp_path):
    """Parallelograms of which the second mirrors the first: in line twice a turn, along x."""
    text = '<robot name="gripper"><link name="palm"/>'
    for side, s in (("l", 1), ("r", -1)):
        text += "".join(link(f"{side}_{part}") for part in ("crank", "bar", "finger"))
        mimic = '<mimic joint="l_1" multiplier="-1"/>' if side == "r" else ""
        text += pin(f"{side}_1", "palm", f"{side}_crank", (0.1 * s, 0), mimic)
        text += pin(f"{side}_2", "palm", f"{side}_bar", (0.2 * s, 0))
        text += pin(f"{side}_3", f"{side}_crank", f"{side}_finger", (0.2 * s, 0.4))
        text += (
            f'<constraint name="{side}_4" type="revolute"><parent link="{side}_bar"/>'
            f'<parent_origin xyz="{0.2 * s} 0 0.4"/><parent_axis xyz="0 -1 0"/>'
            f'<child link="{side}_finger"/><child_origin xyz="{0.1 * s} 0 0"/></constraint>'
        )
    (group,) = judged(tmp_path, text + "</robot>").groups
    angle = math.atan2(0.4, 0.2)
    found = sorted(point["q_l_1"] for point in group.change_points)
    assert found == pytest.approx([-angle, math.pi - angle], abs=1e-6)


def test_a_pose_outside_the_limits_is_named(tmp_path):
    limit = '<limit lower="0.5" upper="1" effort="1" velocity="1"/>'
    text = '<robot name="tree"><link name="base"/>' + link("one")
    text += pin("a", "base", "one", (0, 0), limit, "revolute") + "</robot>"
    assert "joints outside their limits: a (0, not 0.5 to 1 rad)" in str(judged(tmp_path, text))


def test_parameters_without_values_leave_a_sentence():
    """The loops of a linkage need its lengths; its inertias may still be known."""
    x, length = dynamicsymbols("x"), mechc.Quantity("m", "length")
    u, frame, point = dynamicsymbols("u"), ReferenceFrame("N"), Point("O")
    slide = point.locatenew("P", x * frame.x)
    slide.set_vel(frame, u * frame.x)
    l = Symbol("l")
    described = mechc.Mechanism(
        name="slide", title="slide", frame=frame, origin=point,
        coordinates=(mechc.Coordinate(x, length),),
        speeds=(mechc.Speed(u, mechc.Quantity("m/s", "speed")),), kinematics=(u,),
        parameters=(mechc.Parameter(l, None, length),), bodies=(Particle("bob", slide, 1),),
        configuration_constraints=(mechc.Constraint("end", x**2 - l**2, "m^2"),),
    )  # fmt: skip
    verdict = described.judge()
    assert verdict.freedoms is None
    assert "l" in verdict.not_known[0]
    assert described.judge({"l": 2.0}).freedoms == 0


def test_a_loop_that_the_file_leaves_open_is_said_to_be_open_and_by_how_much(tmp_path):
    verdict = judged(tmp_path, four_bar(gap=0.03)[0])
    assert verdict.is_open
    assert max(abs(gap) for gap, unit in verdict.gaps.values() if unit == "m") == pytest.approx(
        0.03
    )
    assert 0.0 < verdict.moved < 0.1
    assert "loops: open" in str(verdict)


def test_a_tree_is_judged_without_compiling_anything(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "mechc.verdict.verdict.compile_mechanism", lambda *_: pytest.fail("compiled")
    )
    mimic = '<mimic joint="a" multiplier="-2" offset="0.1"/>'
    text = '<robot name="tree"><link name="base"/>' + link("one") + link("two")
    limit = '<limit lower="-1" upper="2" effort="1" velocity="1"/>'
    text += pin("a", "base", "one", (0, 0), limit, "revolute")
    text += pin("b", "one", "two", (1, 0), mimic) + "</robot>"
    verdict = judged(tmp_path, text)
    assert (verdict.freedoms, verdict.loops, verdict.groups) == (1, (), ())
    assert ranges(verdict) == {"a": (-1.0, 2.0), "b": (-3.9, 2.1)}
    assert [(x.coordinate, x.follows) for x in verdict.ranges] == [
        ("q_a", False),
        ("q_a", True),
    ]


def test_limits_of_a_mimic_bound_what_it_follows(tmp_path):
    mimic = '<mimic joint="a" multiplier="-2" offset="0.1"/>'
    text = '<robot name="tree"><link name="base"/>' + link("one") + link("two")
    for name, parent, child, more in (("a", "base", "one", ""), ("b", "one", "two", mimic)):
        limit = '<limit lower="-1" upper="2" effort="1" velocity="1"/>' + more
        text += pin(name, parent, child, (0, 0), limit, "revolute")
    found = ranges(judged(tmp_path, text + "</robot>"))
    assert found["a"] == pytest.approx((-0.95, 0.55))
    assert found["b"] == pytest.approx((-1.0, 2.0))


@pytest.mark.parametrize(
    ("inertia", "excess"),
    [("1 0 0 1 0 2", None), ("1 0 0 1 0 2.5", 0.5), ("1 2 0 1 0 2", 2.0), ("0 0 0 0 0 0", None)],
)
def test_an_inertia_that_no_body_has_is_named_with_its_excess(tmp_path, inertia, excess):
    """A plate is the limit, as the triangle inequality says; the third has -1, 2, 3.

    The link is fixed to another, with which it would pass."""
    text = (
        '<robot name="tree"><link name="base"/>' + link("one", "9 0 0 9 0 9") + link("odd", inertia)
    )
    text += pin("a", "base", "one", (0, 0)) + pin("b", "one", "odd", (1, 0), "", "fixed")
    found = judged(tmp_path, text + "</robot>").impossible
    assert {name: pytest.approx(c - a - b) for name, (_, a, b, c) in found.items()} == (
        {} if excess is None else {"odd": excess}
    )


@pytest.mark.slow(cases=3)
@pytest.mark.parametrize("name", ["tiago", "romeo_small", "panda"])
def test_the_impossible_inertias_of_public_robots_are_those_of_their_xml(name):
    pytest.importorskip("pinocchio", reason="pip install 'mechc[robots]'")
    path = next(robots_folder().rglob(f"{name}.urdf"))
    expected = set()
    for each in ElementTree.parse(path).getroot().iter("link"):
        inertia = each.find("inertial/inertia")
        if inertia is not None:
            xx, xy, xz, yy, yz, zz = (float(inertia.get(f"i{n}")) for n in
                                      ("xx", "xy", "xz", "yy", "yz", "zz"))  # fmt: skip
            a, b, c = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            if a < -1e-9 * c or c > (a + b) * (1 + 1e-8):
                expected.add(each.get("name"))
    with pytest.warns(mechc.SkippedPartWarning):
        robot = mechc.from_urdf(path, meshes="ignore")
    assert robot.judge().impossible.keys() == expected
    assert bool(expected) == (name != "panda")


def test_objects_of_sympy_and_models_are_judged_too():
    """A pendulum by x, y and its length: one freedom, and its coordinates end at the length."""
    x, y, u, v = dynamicsymbols("x y u v")
    frame, point = ReferenceFrame("N"), Point("O")
    point.set_vel(frame, 0)
    bob = point.locatenew("P", x * frame.x + y * frame.y)
    bob.set_vel(frame, u * frame.x + v * frame.y)
    t = dynamicsymbols._t
    kane = KanesMethod(
        frame, [x], [u], q_dependent=[y], u_dependent=[v], kd_eqs=[u - x.diff(t), v - y.diff(t)],
        configuration_constraints=[x**2 + y**2 - 4], velocity_constraints=[2 * x * u + 2 * y * v],
    )  # fmt: skip
    kane.kanes_equations([Particle("bob", bob, 1)], [(bob, -9.81 * frame.y)])
    model = mechc.compile(kane)
    verdict = mechc.judge(model)
    assert verdict.freedoms == 1
    assert verdict.is_open is None
    assert [each.why for each in verdict.loops] == [
        "a constraint of the description, which names no joint"
    ]
    assert mechc.judge(kane).rows == verdict.rows


def test_the_four_bar_of_the_library_is_judged():
    model = mechc.load("four_bar")
    verdict = mechc.judge(model, {"l_3": 3.5})
    assert verdict.freedoms == 1
    assert "theta_0" in ranges(verdict)
    assert verdict._repr_html_().count("<table>") >= 4
