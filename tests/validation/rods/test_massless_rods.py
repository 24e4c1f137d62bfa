"""Rods without mass: closed forms, other formulations, and bodies that are all free."""

import numpy as np
import pytest
import sympy as sm
from mechc_codegen.derive import derive_equations as stage
from sympy.physics.mechanics import PinJoint, PlanarJoint, RigidBody, inertia

import mechc
from tests.support.linkages.free_bodies import GROUND, G, Link, Rod, Scene

ASKED = ("reactions", "multipliers", "accelerations")
X, Y, Z = np.eye(3)
NONE = np.zeros(3)


def vector(*components):
    return np.array(components, float)


def assert_moves_like(scene, q, u, tolerance=1e-11, **compiled):
    """Accelerations, reactions and tensions of a scene are those of free bodies."""
    model = mechc.compile(scene.mechanism(), outputs=ASKED, **compiled)
    y = np.concatenate([*map(np.atleast_1d, q), u])
    assert abs(model.constraints(y)).max() < 1e-13
    assert abs(model.velocity_constraints(y)).max() < 1e-13
    wanted, (force, torque) = scene.solved(q, u), model.reactions(y)
    found = (model.rhs(0.0, y)[len(model.coordinates) :], force, torque, model.multipliers(y))
    expected = (wanted.accelerations, wanted.forces, wanted.torques, wanted.tensions)
    for one, other in zip(found, expected, strict=True):
        assert abs(one - other).max() < tolerance * (1 + abs(other).max())
    assert_bodies_balance(model, scene, y, force)
    return model, y


def assert_bodies_balance(model, scene, y, force):
    """m a of every body is its weight and the forces of its joints and rods."""
    moving = model.point_accelerations(y)
    joints = [(link.parent, k) for k, link in enumerate(scene.links)]
    joints += [(rod.parent, rod.child) for rod in scene.rods]
    for k, link in enumerate(scene.links):
        if f"body{k}_masscenter" in model.point_names:
            on = sum(f * ((child == k) - (parent == k))
                     for f, (parent, child) in zip(force, joints, strict=True))  # fmt: skip
            at = moving[model.point_names.index(f"body{k}_masscenter")]
            balance = on - link.mass * (at + G * Z)
            assert abs(balance).max() < 1e-11 * (1 + abs(force).max())


# -- closed forms ---------------------------------------------------------------------------------


def bob_on_a_rod():
    """A body that slides in a plane and turns, its mass centre on a rod to the ground."""
    L, m, g = sm.symbols("L m g")
    ground, bob = RigidBody("ground"), RigidBody("bob", mass=m)
    bob.central_inertia = inertia(bob.frame, 1, 1, 1)
    free = PlanarJoint("free", ground, bob, parent_interframe=ground.z)
    rod = mechc.Cut.rod("rod", ground, bob, L)
    values = {"L": 0.7, "m": 1.3, "g": G}
    return mechc.from_joints("bob", [free, rod], gravity=-g * ground.y, parameters=values)


def test_a_pendulum_pulls_with_its_weight_and_its_turning():
    """m (g cos a + L w^2), tension positive."""
    model = mechc.compile(bob_on_a_rod(), outputs=(*ASKED, {"pull": mechc.multiplier("rod")}))
    assert model.constraint_names == ("rod",)
    y = model.assemble({"q0_free": 0.3}, guess={"q1_free": 0.5, "q2_free": -0.4})
    sol = model.simulate(3.0, y, rtol=1e-12)
    at = sol.output("points")[:, model.point_names.index("bob_masscenter")]
    v = sol.output("point_velocities")[:, model.point_names.index("bob_masscenter")]
    spin = np.linalg.norm(v, axis=-1) / 0.7
    pull = 1.3 * (-G * at[:, 1] / 0.7 + 0.7 * spin**2)
    assert abs(sol.output("pull") - pull).max() < 1e-9
    force = sol.output("reaction_forces")[:, model.joint_names.index("rod")]
    assert abs(force + pull[:, None] * at / 0.7).max() < 1e-9


@pytest.mark.slow
def test_a_mass_hangs_on_three_rods():
    """At rest the tensions balance the weight: three equations for three rods."""
    feet = [vector(0.6, 0.1, 1.0), vector(-0.3, 0.5, 1.1), vector(-0.2, -0.7, 0.9)]
    body = Link("free", GROUND, NONE, NONE, X, 2.0, vector(0.3, 0.4, 0.5))
    scene = Scene([body], [Rod(GROUND, 0, foot, NONE) for foot in feet])
    q, u = [vector(0, 0, 0, 1, 0, 0, 0)], np.zeros(6)
    u = scene.closed(q, u)
    model, y = assert_moves_like(scene, q, u)
    units = np.array([foot / np.linalg.norm(foot) for foot in feet])
    assert model.multipliers(y) == pytest.approx(np.linalg.solve(units.T, [0, 0, 2 * G]), rel=1e-13)
    around = 0.2 + 2 * np.pi / 3 * np.arange(3)
    alike = Scene([body], [Rod(GROUND, 0, vector(0.5 * np.cos(a), 0.5 * np.sin(a), 1), NONE)
                           for a in around])  # fmt: skip
    alike.closed(q, u)
    model, y = assert_moves_like(alike, q, u)
    # m g / (3 cos a) at equal angles a to the vertical
    assert model.multipliers(y) == pytest.approx(2 * G / 3 * np.hypot(0.5, 1), rel=1e-13)


# -- in place of a link ---------------------------------------------------------------------------


def four_bar(coupler):
    """Crank, rocker and between them a rod, or a link of that mass."""
    ground = RigidBody("ground")
    crank, rocker = RigidBody("crank", mass=1.0), RigidBody("rocker", mass=2.0)
    for body, size in ((crank, 0.02), (rocker, 0.1)):
        body.central_inertia = inertia(body.frame, 0, 0, size)
    joints = [
        PinJoint("A", ground, crank, child_point=-0.2 * crank.x, joint_axis=ground.z),
        PinJoint("D", ground, rocker, parent_point=ground.x, child_point=-0.3 * rocker.x,
                 joint_axis=ground.z),
    ]  # fmt: skip
    if coupler is None:
        ends = (0.2 * crank.x, 0.3 * rocker.x)
        joints.append(mechc.Cut.rod("rod", crank, rocker, "900 mm", *ends))
    else:
        link = RigidBody("link", mass=coupler)
        link.central_inertia = inertia(link.frame, 0, 0, coupler * 0.9**2 / 12)
        joints.append(PinJoint("B", crank, link, parent_point=0.2 * crank.x,
                               child_point=-0.45 * link.x, joint_axis=crank.z))  # fmt: skip
        joints.append(mechc.Cut.pin("C", link, rocker, 0.45 * link.x, 0.3 * rocker.x,
                                    joint_axis=link.z))  # fmt: skip
    return mechc.from_joints("four_bar", joints, gravity=-G * ground.y)


@pytest.fixture(scope="module")
def linkage():
    return mechc.compile(four_bar(None), outputs=ASKED)


@pytest.mark.slow
def test_a_four_bar_with_a_rod_is_that_with_a_light_link(linkage):
    light = mechc.compile(four_bar(1e-10), outputs=ASKED)
    start = {"q_A": 0.5}
    y = linkage.assemble(start, {"u_A": 3.0}, guess={"q_D": 1.2})
    z = light.assemble(start, {"u_A": 3.0}, guess={"q_D": 1.2, "q_B": 0.0})
    names = [light.coordinates.index(name) for name in linkage.coordinates]
    assert z[names] == pytest.approx(y[:2], abs=1e-13)
    rates = light.rhs(0.0, z)[[3 + k for k in names]]
    assert rates == pytest.approx(linkage.rhs(0.0, y)[2:], rel=1e-8)
    force = linkage.reactions(y).force
    other = light.reactions(z).force
    for mine, theirs in (("A", "A"), ("D", "D"), ("rod", "C")):
        one = force[linkage.joint_names.index(mine)]
        assert one == pytest.approx(other[light.joint_names.index(theirs)], rel=1e-7, abs=1e-7)
    ends = [linkage.simulate(1.0, y, rtol=1e-11).y[-1, 0], light.simulate(1.0, z, rtol=1e-11).y[-1]]
    assert ends[1][names[0]] == pytest.approx(ends[0], abs=1e-7)


def test_positions_of_a_four_bar_with_a_rod(linkage):
    """Both assemblies by the law of cosines, and one followed through a turn of the crank."""

    def rocker(crank, sign):
        crank = np.asarray(crank)
        to = 0.4 * np.exp(1j * crank) - 1
        d = abs(to)
        return np.angle(to) + sign * np.arccos((0.6**2 + d**2 - 0.9**2) / (2 * 0.6 * d))

    found = np.sort([y[1] % (2 * np.pi) for y in linkage.assemblies({"q_A": 0.5})])
    assert found == pytest.approx(np.sort([rocker(0.5, s) % (2 * np.pi) for s in (1, -1)]))
    values = np.linspace(0.5, 6.5, 50)
    sweep = linkage.sweep_positions("q_A", values, guess={"q_D": 1.2})
    off = sweep.q[:, 1] - rocker(values, -1)
    assert abs(np.exp(1j * off) - 1).max() < 1e-12
    assert linkage.redundant_constraints() == ()


def parallelogram(rods=1):
    """Two equal cranks half a metre long, and level rods between their ends."""
    ground, one, two = RigidBody("ground"), RigidBody("one", mass=1.0), RigidBody("two", mass=1.0)
    for body in (one, two):
        body.central_inertia = inertia(body.frame, 0, 0, 1 / 48)
    pins = [
        PinJoint(body.name, ground, body, parent_point=x * ground.x, child_point=-body.x / 4,
                 joint_axis=ground.z)
        for x, body in ((0, one), (2, two))
    ]  # fmt: skip
    ends = (one.x / 4, two.x / 4)
    rods = [mechc.Cut.rod(f"rod {k}", one, two, 2, *ends) for k in range(rods)]
    load = (one.masscenter, -5 * ground.x)
    made = mechc.from_joints("cranks", [*pins, *rods], gravity=-G * ground.y, loads=[load])
    return mechc.compile(made, outputs=ASKED)


def test_rods_in_line_with_their_cranks_are_passed():
    model = parallelogram()
    sol = model.simulate(3.0, [0.5, 0.5, -4.0, -4.0], rtol=1e-10)
    assert sol.status.ok
    assert len(sol.change_points) >= 2
    assert abs(sol.y[:, 0] - sol.y[:, 1]).max() < 1e-8


def test_one_of_two_equal_rods_is_redundant():
    """They share what one pulls with."""
    single, double = parallelogram(), parallelogram(rods=2)
    (redundant,) = double.redundant_constraints()
    assert redundant.name == "rod 1"
    y = [0.7, 0.7, 1.0, 1.0]
    (tension,) = single.multipliers(y)
    assert abs(tension) > 1
    assert double.multipliers(y) == pytest.approx([tension / 2, tension / 2], rel=1e-12)
    assert double.rhs(0.0, y) == pytest.approx(single.rhs(0.0, y), rel=1e-12)
    with pytest.warns(mechc.UndeterminedReactionWarning, match=r"rod 0: force x"):
        double.reactions(y)


# -- in space, against bodies that are all free ---------------------------------------------------


@pytest.mark.slow
def test_a_multi_link_suspension():
    """A wishbone on a pin, the upright on its ball; two rods above and a tie rod: one freedom."""
    wishbone = Link("pin", GROUND, vector(0, 0.3, 0.2), vector(0, -0.2, 0), X, 3.0,
                    vector(0.05, 0.03, 0.06))  # fmt: skip
    upright = Link("ball", 0, vector(0, 0.2, 0), vector(0, 0, -0.15), X, 12.0,
                   vector(0.3, 0.4, 0.25))  # fmt: skip
    rods = [
        Rod(GROUND, 1, vector(0.15, 0.35, 0.5), vector(0.02, 0.0, 0.16)),
        Rod(GROUND, 1, vector(-0.2, 0.35, 0.52), vector(-0.02, 0.01, 0.16)),
        Rod(GROUND, 1, vector(0.18, 0.3, 0.28), vector(0.14, 0.02, -0.05)),
    ]
    scene = Scene([wishbone, upright], rods)
    turn = vector(0.99, 0.05, -0.08, 0.1)
    q = [0.12, turn / np.linalg.norm(turn)]
    u = scene.closed(q, vector(2.0, 0.5, -0.3, 0.7))
    assert np.linalg.matrix_rank(scene.rows(q)) == 3
    model, y = assert_moves_like(scene, q, u)
    near = dict(zip(model.coordinates[1:], y[1:5], strict=True))
    again = model.assemble({"q_j0": 0.15}, guess=near)
    assert abs(model.constraints(again)).max() < 1e-14


@pytest.mark.slow
def test_a_delta_robot():
    """Three arms, and a platform that is free but for its six rods in three parallelograms."""
    links, rods = [], []
    for k in range(3):
        angle = 2 * np.pi * k / 3
        out, axis = (
            vector(np.cos(angle), np.sin(angle), 0),
            vector(-np.sin(angle), np.cos(angle), 0),
        )
        links.append(Link("pin", GROUND, 0.2 * out, -0.15 * out, axis, 0.6, vector(1, 2, 2) * 1e-3))
        for side in (0.04, -0.04):
            at_arm, at_plate = 0.15 * out + side * axis, 0.05 * out + side * axis
            rods.append(Rod(k, 3, at_arm, at_plate))
    links.append(Link("free", GROUND, NONE, NONE, Z, 0.4, vector(2, 2, 4) * 1e-4))
    scene = Scene(links, rods)
    q = [0.3, 0.4, 0.5, vector(0.02, -0.01, -0.6, 1, 0, 0, 0)]
    u = scene.closed(q, vector(1, -2, 3, 0.1, 0.2, 0.3, 0, 0, 0))
    assert_moves_like(scene, q, u)


@pytest.fixture(scope="module")
def chain():
    """Seven pins in a row, a rod from the last to the ground and one across the middle."""
    links = [Link("pin", k - 1, vector(0.2, 0.05, 0) if k else NONE, vector(-0.2, 0, 0),
                  Y if k % 2 else Z, 1.0 + 0.1 * k, vector(0.01, 0.02, 0.03))
             for k in range(7)]  # fmt: skip
    rods = [Rod(GROUND, 6, vector(0.5, 0.3, -0.2), vector(0.2, 0, 0.1)),
            Rod(1, 4, vector(0, 0.1, 0), vector(0, 0.1, 0.05))]  # fmt: skip
    scene = Scene(links, rods)
    q = list(np.random.default_rng(5).uniform(-0.8, 0.8, 7))
    return scene, q, scene.closed(q, np.random.default_rng(6).uniform(-1, 1, 7))


@pytest.mark.slow
def test_a_chain_with_rods_is_walked_link_by_link(chain):
    scene, q, u = chain
    assert stage.derive_equations(scene.mechanism()).tree is not None
    model, y = assert_moves_like(scene, q, u)
    sol = model.simulate(0.5, y, rtol=1e-10)
    assert sol.status.ok
    assert abs(model.constraints(sol.y)).max() < 1e-13
    assert np.ptp(model.energy(sol.y)) < 1e-8


@pytest.mark.slow
def test_walked_and_written_out_rods_have_the_same_derivatives(chain, monkeypatch):
    scene, q, u = chain
    scene = Scene(scene.links[:3], [Rod(GROUND, 2, *vector([0.5, 0.3, -0.2], [0.2, 0, 0.1]))])
    y = np.concatenate([q[:3], scene.closed(q[:3], u[:3])])
    found = []
    for least in (1, 99):
        monkeypatch.setattr(stage, "LEAST_TREE", least)
        monkeypatch.setattr(stage, "LEAST_WRITTEN", least)
        model = mechc.compile(  # by a name of its own it is derived again
            scene.mechanism(), name=f"least_{least}", outputs=("state_jacobian", "multipliers")
        )
        assert (model.system.data["walked"] > 0) == (least == 1)
        found.append((model.state_jacobian(y), model.rhs(0.0, y), model.multipliers(y)))
    for one, other in zip(*found, strict=True):
        assert abs(one - other).max() < 1e-11 * (1 + abs(other).max())
