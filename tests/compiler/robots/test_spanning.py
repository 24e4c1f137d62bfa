"""A graph of joints has one motion, whichever of its joints are cut, and the choice is known."""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from mechc_codegen.robots.graph import resolve_graph
from mechc_codegen.robots.mechanism import mechanism_of
from mechc_codegen.robots.robot import Pose, Robot, RobotJoint, RobotLink
from mechc_codegen.robots.spanning import spanning_tree

import mechc
from tests.compiler.robots.by_numbers import ByNumbers
from tests.compiler.robots.loops import MACHINES, cut_sets, four_bar, machine


def tree_of(robot, *args):
    return spanning_tree(resolve_graph(robot), *args)


def names(joints):
    return [joint.name for joint in joints]


# -- the choice -----------------------------------------------------------------------------------


def test_a_ball_is_cut_before_pins():
    assert names(tree_of(MACHINES["with_universal"]).cuts) == ["C"]
    assert names(tree_of(MACHINES["puck"]).cuts) == ["table"]


def test_the_tree_is_short():
    """A ring of eleven links is cut in its middle, and no link is further than five joints away."""
    points = [(np.cos(a), 0, np.sin(a)) for a in np.linspace(0, 2 * np.pi, 12)[:-1]]
    ring = ["ground", *(f"l{k}" for k in range(1, 11))]
    joints = [
        (f"j{k}", "continuous", ring[k], ring[(k + 1) % 11], points[k], (0, 1, 0))
        for k in range(11)
    ]
    tree = tree_of(machine("ring", dict.fromkeys(ring[1:], (0, 0, 0)), joints))
    depth = {"ground": 0}
    for branch in tree.branches:
        depth[branch.outer] = depth[branch.inner] + 1
    assert max(depth.values()) == 5
    assert sum(branch.is_turned for branch in tree.branches) == 5


def test_the_cut_is_the_pin_that_holds_its_loop_better():
    """B and C lead to the coupler alike; the longer the crank, the better C holds it as a cut."""
    found = []
    for height in (1.5, 0.1):
        links = {"crank": (0, 0, 0), "coupler": (0, 0, height), "rocker": (2, 0, 0)}
        robot = machine("bars", links, [
            ("A", "continuous", "ground", "crank", (0, 0, 0), (0, 1, 0)),
            ("B", "continuous", "crank", "coupler", (0, 0, height), (0, 1, 0)),
            ("C", "continuous", "rocker", "coupler", (2, 0, 1.6 - height), (0, 1, 0)),
            ("D", "continuous", "ground", "rocker", (2, 0, 0), (0, 1, 0)),
        ])  # fmt: skip
        found += names(tree_of(robot).cuts)
    assert found == ["C", "B"]


def test_joints_that_are_named_are_cut():
    for cut in "ABCD":
        assert names(tree_of(four_bar(), [cut]).cuts) == [cut]
    with pytest.raises(mechc.MechanismError, match="'A' cannot be cut: besides the others in cut="):
        tree_of(four_bar(), ["A", "B"])
    with pytest.raises(mechc.MechanismError, match=r"cut='Z' is no joint .* close loops are 'B'"):
        tree_of(four_bar(), ["Z"])


def test_what_the_file_says_that_it_closes_a_loop_is_cut():
    assert names(tree_of(four_bar(D={"closes": True})).cuts) == ["D"]
    assert names(tree_of(four_bar(D={"closes": True}), ["A"]).cuts) == ["A"]


def test_a_joint_to_which_something_refers_is_not_cut():
    assert names(tree_of(four_bar(), (), {"A", "B", "D"}).cuts) == ["C"]
    assert names(tree_of(four_bar(), (), {"A", "C", "D"}).cuts) == ["B"]


def test_where_something_refers_to_every_joint_a_link_is_cut_in_halves():
    tree = tree_of(four_bar(), (), {"A", "B", "C", "D"})
    (weld,) = tree.cuts
    assert weld.kind == "fixed"
    halves = [tree.robot.links[name] for name in (weld.parent, weld.child)]
    assert [half.share for half in halves] == [0.5, 0.5]
    assert (
        names(branch.joint for branch in tree.branches) == ["A", "C", "D", "B"]
        or len({branch.joint.name for branch in tree.branches}) == 4
    )


def test_what_cannot_be_cut_is_refused_by_name():
    with pytest.raises(mechc.MechanismError, match="'D' closes a loop, where a floating joint"):
        tree_of(four_bar(D={"kind": "floating"}))
    fixed = RobotJoint("twice", "fixed", "ground", "plate")
    robot = four_bar()
    links = {**robot.links, "plate": RobotLink("plate")}
    joints = (*robot.joints, fixed, replace(fixed, name="again"))
    with pytest.raises(mechc.MechanismError, match="'again' closes a loop of links that are fixed"):
        mechanism_of(replace(robot, links=links, joints=joints))


@pytest.mark.slow
def test_names_of_links_and_points_may_be_those_that_mechc_adds():
    robot = four_bar()
    names = {"crank": "C cut", "coupler": "B end", "rocker": "coupler half", "ground": "q'; {"}
    links = {names[name]: replace(each, name=names[name]) for name, each in robot.links.items()}
    joints = [
        replace(j, parent=names[j.parent], child=names[j.child], damping=0.1 * (j.name != "D"))
        for j in robot.joints
    ]
    renamed = Robot("four_bar", links, tuple(joints), names["ground"])
    for cut in "AC":
        described = mechanism_of(renamed, cut=cut)
        points = [point.name for point in described.points]
        assert len({*points}) == len(points) > 5
        check_same_motion(at_start(renamed), at_start(renamed, cut=cut))


def test_long_rings_are_no_recursion():
    links = {name: RobotLink(name) for name in ("ground", *map(str, range(2000)))}
    ring = [*links, "ground"]
    joints = [
        RobotJoint(f"j{k}", "continuous", *ring[k : k + 2], Pose((1, 0, 0))) for k in range(2001)
    ]
    tree = tree_of(Robot("net", links, tuple(joints), "ground"))
    assert (len(tree.branches), len(tree.cuts)) == (2000, 1)


# -- the motion -----------------------------------------------------------------------------------


def at_start(robot, **options):
    return ByNumbers(mechanism_of(robot, **options))


def check_same_motion(one, other):
    """At one moving state the bodies of two mechanisms have the same accelerations."""
    u = one.closed_speeds()
    velocities, accelerations = one.velocities(u), one.accelerations(u)
    v = other.speeds(velocities)
    same, again = other.velocities(v), other.accelerations(v)
    for name, velocity in velocities.items():
        assert same[name] == pytest.approx(velocity, abs=1e-9)
        assert again[name] == pytest.approx(accelerations[name], abs=1e-9)


FAST = ("four_bar", "with_ball", "cylindrical", "gripper")
SLOW = [pytest.param(n, marks=pytest.mark.slow(cases=4)) for n in MACHINES if n not in FAST]


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("name", [*FAST, *SLOW])
def test_every_spanning_tree_gives_the_same_motion(name):
    """The tree that is chosen, and of the others the first two, or of slow ones all up to eight."""
    robot = MACHINES[name]
    chosen = at_start(robot)
    others = [cut for cut in cut_sets(robot) if {*cut} != {*chosen.mechanism.cuts}]
    assert others or name == "distance"
    for cut in others[:: max(1, len(others) // 2)][: 2 if name in FAST else 8]:
        other = at_start(robot, cut=cut)
        assert set(cut) <= {each.removesuffix(" weld") for each in other.mechanism.cuts}
        check_same_motion(chosen, other)


@pytest.mark.slow
def test_halves_of_a_link_move_as_the_link():
    """With a damper at each pin but D, the cut of C is one of its coupler."""
    dampers = {name: {"damping": 0.3} for name in "ABC"}
    plain, halved = at_start(four_bar(**dampers)), at_start(four_bar(**dampers), cut="C")
    assert (plain.mechanism.cuts, halved.mechanism.cuts) == (("D",), ("C weld",))
    check_same_motion(plain, halved)


def test_a_compiled_linkage_starts_closed_and_keeps_its_energy():
    model = mechc.compile(mechanism_of(four_bar()), outputs=("energy",))
    start = model.assemble()
    assert not start.any()  # to the last bit
    sol = model.simulate(0.5, start, rtol=1e-11)
    assert sol.closure.max() < 1e-13
    assert sol.energy == pytest.approx(sol.energy[0], abs=1e-9)
    assert abs(sol["q_A"][-1]) > 0.01


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "options",
    [{"floating": True}, {"symbolic": ["mass", "centre", "inertia", "origin", "damping"]}],
)
def test_cuts_make_no_difference_on_a_free_base_and_with_symbols(options):
    """B and C turned round, C in halves, and their places and masses symbols."""
    robot = four_bar(C={"damping": 0.2})
    one, other = at_start(robot), at_start(robot, cut=["C"], **options)
    if "floating" in options:
        one = at_start(robot, **options)
    check_same_motion(one, other)


def motions(robot, cuts):
    """For each set of cuts the places of the links after the motion of a second, and its seconds,
    the least of many runs in turn."""
    runs, places = [], []
    for cut in cuts:
        model = mechc.compile(mechanism_of(robot, cut=cut), outputs=("points",))
        start = model.assemble()
        last = model.simulate(MOTION, start, rtol=1e-12).y[-1]
        of_links = [model.point_names.index(name) for name in robot.links]
        places.append(model.points(last)[of_links])
        runs.append(lambda model=model, start=start: model.simulate(MOTION, start))
    seconds = np.full(len(runs), np.inf)
    for _ in range(ROUNDS):
        for number, run in enumerate(runs):
            begun = perf_counter()
            run()
            seconds[number] = min(seconds[number], perf_counter() - begun)
    return places, seconds


MOTION, ROUNDS, MOST_TREES = 1.0, 40, 12
SAME_MOTION, SLOWER = 1e-9, 1.5


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("name", MACHINES)
def test_motions_of_all_trees_are_one_and_that_of_the_chosen_one_is_fast(name, capsys):
    """All spanning trees, or of many a dozen; the chosen one takes at most 1.5 times the least."""
    robot = MACHINES[name]
    chosen = mechanism_of(robot).cuts
    others = [cut for cut in cut_sets(robot) if {*cut} != {*chosen}]
    others = others[:: max(1, -(-len(others) // MOST_TREES))]
    places, seconds = motions(robot, [chosen, *others])
    apart = max(abs(each - places[0]).max() for each in places)
    ratio = seconds[0] / seconds.min()
    with capsys.disabled():
        print(
            f"\n{name:14s} {len(seconds):3d} trees, apart {apart:.1e} m, "
            f"chosen {1e3 * seconds[0]:.3f} ms, {ratio:.2f} of the fastest, "
            f"{seconds[0] / seconds.max():.2f} of the slowest"
        )
    assert apart < SAME_MOTION
    assert ratio < SLOWER
