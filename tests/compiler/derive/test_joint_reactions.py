"""Joint reactions against free bodies, closed forms, and each other."""

from __future__ import annotations

import numpy as np
import pytest
from mechc_codegen.derive import derive_equations as stage
from sympy import Symbol
from sympy.physics.mechanics import (
    LinearPathway,
    LinearSpring,
    PinJoint,
    PrismaticJoint,
    RigidBody,
    System,
    TorqueActuator,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.errors import MechcError
from tests.support.linkages.jointed import CHAIN, PINS, chain, four_bar, rod, spatial_four_bar, tree

ASKED = ("reactions", "multipliers")
G = 9.81
DOWN = np.array([0.0, G])  # what carries the weight
TO_PINS = np.array([[1, 0, 0], [-1, 1, 0], [0, -1, 1], [0, 0, 1.0]])


def states_of(model, count=4, seed=1):
    width = len(model.coordinates + model.speeds)
    return np.random.default_rng(seed).uniform(-1, 1, (count, width))


# -- one body -------------------------------------------------------------------------------------


def test_a_pendulum_pulls_its_pin_as_the_closed_form_says():
    model = mechc.compile(chain(1), outputs=ASKED)
    m, l = CHAIN["m"], CHAIN["l"]
    q, u = np.linspace(-3, 3, 7), np.linspace(2, -1, 7)
    force, torque = model.reactions(np.stack([q, u], axis=-1))
    alpha = -1.5 * G / l * np.cos(q)  # a rod about its end
    centre = l / 2 * np.stack([-alpha * np.sin(q) - u**2 * np.cos(q),
                               alpha * np.cos(q) - u**2 * np.sin(q)], axis=-1)  # fmt: skip
    assert force.shape == torque.shape == (7, 1, 3)
    assert np.allclose(force[:, 0, :2], m * (centre + DOWN), rtol=1e-13, atol=1e-13)
    assert np.allclose(force[:, 0, 2], 0, atol=1e-15)
    assert np.allclose(torque, 0, atol=1e-14)
    assert model.joint_names == ("pin_0",)


@pytest.mark.parametrize("cut", [False, True])
def test_a_spatial_pin_holds_the_moments_across_its_axis(cut):
    """A skew plate on a vertical shaft: the moment of its product of inertia, spinning freely."""
    ground, plate = RigidBody("ground"), RigidBody("plate", mass=2)
    plate.central_inertia = inertia(plate.frame, 1.0, 2.0, 2.5, 0.1, 0.4, 0.3)
    g, at = Symbol("g"), -0.2 * plate.x + 0.3 * plate.z
    if cut:
        shaft = mechc.Cut.pin("shaft", ground, plate, 0 * ground.x, at, ground.z, plate.z)
        joints = [mechc.FreeJoint("free", ground, plate), shaft]
    else:
        joints = [PinJoint("shaft", ground, plate, child_point=at, joint_axis=ground.z)]
    made = mechc.from_joints("plate", joints, gravity=-g * ground.z, parameters={"g": G})
    model = mechc.compile(made, outputs=ASKED)
    angle, spin = 0.7, 3.0
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    arm, omega = turn @ [0.2, 0, -0.3], np.array([0, 0, spin])
    half = [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]
    free = [*arm, *half, *np.cross(omega, arm), *omega]
    force, torque = model.reactions(free if cut else [angle, spin])
    needed = 2 * (-(spin**2) * np.array([*arm[:2], 0]) + [0, 0, G])
    about_centre = np.cross(
        omega, turn @ [[1.0, 0.1, 0.3], [0.1, 2.0, 0.4], [0.3, 0.4, 2.5]] @ omega
    )
    k = model.joint_names.index("shaft")
    assert np.allclose(force[k], needed, rtol=1e-13, atol=1e-13)
    assert np.allclose(torque[k], about_centre + np.cross(arm, needed), rtol=1e-13, atol=1e-13)
    assert abs(torque[k, 2]) < 1e-14  # nothing about the free axis


# -- loads are not reactions ----------------------------------------------------------------------


def driven(**more):
    """A sledge with a spring to the ground, and a rod on it that a motor and gravity turn."""
    ground, sledge, arm = RigidBody("ground"), RigidBody("sledge", mass=3), rod("arm")
    x, v, q, u = dynamicsymbols("x v q u")
    slide = PrismaticJoint("slide", ground, sledge, x, v, joint_axis=ground.x)
    pin = PinJoint("pin", sledge, arm, q, u, child_point=-Symbol("l") / 2 * arm.x,
                   joint_axis=sledge.z)  # fmt: skip
    spring = LinearSpring(40, LinearPathway(ground.masscenter, sledge.masscenter), 0.1)
    motor = TorqueActuator(Symbol("T"), sledge.z, arm, sledge)
    return mechc.from_joints(
        "driven", [slide, pin], loads=[spring, motor], gravity=-Symbol("g") * ground.y,
        parameters={**CHAIN, "T": 2.0}, **more,
    )  # fmt: skip


def test_springs_and_motors_are_loads_and_not_in_the_reactions():
    model = mechc.compile(driven(), outputs=ASKED)
    y = np.array([0.3, 0.4, 0.2, -1.1])
    force, torque = model.reactions(y)
    a = model.rhs(0.0, y)[2:]
    m, l, T = CHAIN["m"], CHAIN["l"], 2.0
    q, u = y[1], y[3]
    centre = np.array([a[0], 0]) + l / 2 * np.array(
        [-a[1] * np.sin(q) - u**2 * np.cos(q), a[1] * np.cos(q) - u**2 * np.sin(q)]
    )
    at_pin = m * (centre + DOWN)
    assert np.allclose(force[1, :2], at_pin, rtol=1e-13)
    assert np.allclose(torque[1], 0, atol=1e-13)  # the motor's torque is a load
    # The slide is free along x, where the spring acts; it holds weight and the motor's moment.
    assert np.allclose(force[0], [0, at_pin[1] + 3 * G, 0], rtol=1e-12, atol=1e-12)
    assert np.allclose(torque[0], [0, 0, T], rtol=1e-12, atol=1e-12)


def test_a_drive_by_a_constraint_on_a_joints_own_speeds_acts_in_that_joint():
    made = driven()
    rate = mechc.Constraint("driven", made.u[1] - 2, "rad/s")
    model = mechc.compile(driven(motion_constraints=(rate,)), outputs=ASKED)
    y = np.array([0.3, 0.4, 0.2, 2.0])
    _, torque = model.reactions(y)
    assert abs(torque[1, 2]) > 0.1
    assert np.isclose(torque[1, 2], -model.multipliers(y)[0], rtol=1e-13)


# -- trees ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def both_routes():
    """A tree of ten links, walked and written out."""
    mechanism = tree(3, 3)
    walked = mechc.compile(mechanism, outputs=ASKED)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stage, "LEAST_TREE", 99)
        written = mechc.compile(mechanism, name="written_out", outputs=ASKED)  # not from the cache
    assert (walked.system.data["walked"] > 0, written.system.data["walked"]) == (True, 0)
    return walked, written


@pytest.mark.slow
def test_ten_links_have_the_same_reactions_walked_and_written_out(both_routes):
    walked, written = both_routes
    assert walked.joint_names == written.joint_names
    assert len(walked.joint_names) == 10
    y = states_of(walked)
    for mine, other in zip(walked.reactions(y), written.reactions(y), strict=True):
        assert np.allclose(mine, other, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_along_every_free_axis_of_a_tree_nothing_is_left(both_routes):
    walked, _ = both_routes
    y = states_of(walked)
    force, torque = walked.reactions(y)
    assert np.allclose(force[:, 0, 0], 0, atol=1e-9)  # the hub slides along x
    weights = sum(np.array([0, CHAIN["m"] * G, 0]) for _ in range(10))
    assert np.abs(force[:, 0] - weights).max() > 1  # it carries more than the weight
    power = 0.0
    for k, name in enumerate(walked.joint_names):
        if name.startswith("pin"):
            power = max(power, abs(torque[:, k]).max())
    assert power > 0.1  # spatial pins hold moments


# -- loops ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cut_anywhere():
    return [mechc.compile(four_bar(cut), outputs=ASKED) for cut in range(4)]


def absolute_state(theta_0=1.4835, omega_0=0.4, **params):
    shipped = mechc.load("four_bar")
    y = shipped.assemble({"theta_0": theta_0}, speeds={"omega_0": omega_0}, params=params)
    return y[:3], y[3:], shipped.rhs(0.0, y, params)[3:]


def relative(theta, omega, cut):
    kept = TO_PINS[[k for k in range(4) if k != cut]]
    return np.concatenate([kept @ theta, kept @ omega])


def free_bodies(theta, omega, alpha, lengths, masses):
    """Pin forces (4, 2) by Newton and Euler, rod by rod: nine equations, eight forces."""
    e = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    n = np.stack([-np.sin(theta), np.cos(theta)], axis=-1)
    along = lengths[:3, None] * (alpha[:, None] * n - omega[:, None] ** 2 * e)  # far end, near end
    starts = np.vstack([np.zeros(2), np.cumsum(along, axis=0)[:2]])
    needed = masses[:, None] * (starts + along / 2 + DOWN)
    spin = masses * lengths[:3] ** 2 / 12 * alpha
    matrix, right = np.zeros((9, 8)), np.zeros(9)
    for k in range(3):
        # Pin k pushes rod k at its near end; at its far end pin k + 1 pushes back, or J_3 pushes.
        far, sign = 2 * (k + 1), 1 if k == 2 else -1
        matrix[3 * k : 3 * k + 2, 2 * k : 2 * k + 2] = np.eye(2)
        matrix[3 * k : 3 * k + 2, far : far + 2] = sign * np.eye(2)
        arm = lengths[k] / 2 * e[k]
        matrix[3 * k + 2, 2 * k : 2 * k + 2] = [arm[1], -arm[0]]
        matrix[3 * k + 2, far : far + 2] = sign * np.array([-arm[1], arm[0]])
        right[3 * k : 3 * k + 3] = [*needed[k], spin[k]]
    forces, *_ = np.linalg.lstsq(matrix, right)
    assert np.allclose(matrix @ forces, right, atol=1e-9 * max(1, np.abs(forces).max()))
    return forces.reshape(4, 2)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("cut", range(4))
@pytest.mark.parametrize("l_3", [3.5, 4.0])
def test_four_bar_pins_are_what_free_bodies_ask_for_whichever_is_cut(cut_anywhere, cut, l_3):
    model, rng = cut_anywhere[cut], np.random.default_rng(4)
    assert model.joint_names == PINS
    lengths = np.array([1.0, 2.0, 3.0, l_3])
    for _ in range(3):
        theta, omega, alpha = absolute_state(rng.uniform(0.5, 2), rng.uniform(-3, 3), l_3=l_3)
        force, torque = model.reactions(relative(theta, omega, cut), {"l_3": l_3})
        wanted = free_bodies(theta, omega, alpha, lengths, np.array([1.0, 2.0, 3.0]))
        assert np.allclose(force[:, :2], wanted, rtol=1e-9, atol=1e-9)
        assert np.allclose(force[:, 2], 0, atol=1e-12)
        assert np.allclose(torque, 0, atol=1e-11)


@pytest.mark.slow
def test_near_a_change_point_all_cuts_still_agree_on_the_forces(cut_anywhere):
    """One degree before the links are in line forces are ill-conditioned, and large."""
    theta, omega, alpha = absolute_state(np.pi - np.radians(1), 2.0)
    lengths, masses = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0])
    wanted = free_bodies(theta, omega, alpha, lengths, masses)
    for cut, model in enumerate(cut_anywhere):
        force, _ = model.reactions(relative(theta, omega, cut))
        assert np.allclose(force[:, :2], wanted, rtol=1e-7, atol=1e-7)


def test_the_shipped_four_bar_has_reactions_on_request():
    model = mechc.load("four_bar", outputs=("energy", "reactions"))
    plain = mechc.load("four_bar")
    theta, omega, alpha = absolute_state()
    y = np.concatenate([theta, omega])
    force, torque = model.reactions(y)
    lengths, masses = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0])
    assert model.joint_names == ("O", "p_1", "p_2", "p_3")
    wanted = free_bodies(theta, omega, alpha, lengths, masses)
    assert np.allclose(force[:, :2], wanted, rtol=1e-10)
    assert np.allclose(torque, 0, atol=1e-12)
    assert plain.joint_names == model.joint_names


@pytest.mark.slow
def test_in_a_loop_in_space_nothing_is_left_along_the_free_directions_of_any_joint():
    """A wrench of the cut pin that was wrong in any part would be found in these."""
    model = mechc.compile(spatial_four_bar(), outputs=ASKED)
    assert len(model.constraint_names) == 5
    for seed in range(3):
        y = closed(model, seed)
        force, torque = model.reactions(y)
        size = np.abs(force).max()
        first, ball_1, ball_2, second = torque
        assert abs(first[2]) < 1e-10 * size
        assert np.abs([ball_1, ball_2]).max() < 1e-10 * size
        axis = np.array([1, 0, 1]) / np.sqrt(2)  # the interframe's x, which the pin turns about
        assert abs(second @ axis) < 1e-10 * size
        assert np.abs(second).max() > 1e-2 * size  # it does hold moments


def closed(model, seed):
    """A closed state with speeds that keep it, by Newton's method."""
    size, rng = len(model.coordinates), np.random.default_rng(seed)
    for _ in range(50):
        y = rng.uniform(-1.5, 1.5, 2 * size)
        for _ in range(40):
            step = np.linalg.lstsq(model.constraint_jacobian(y), model.constraints(y), rcond=1e-9)
            y[:size] -= step[0]
        if np.abs(model.constraints(y)).max() < 1e-13:
            rows = model.constraint_jacobian(y)
            y[size:] -= np.linalg.lstsq(rows, model.velocity_constraints(y), rcond=1e-9)[0]
            return y
    raise AssertionError("no closed state was found")


# -- objects of SymPy's ---------------------------------------------------------------------------


def loop_system():
    """A chain of two rods as a System whose tip is held by expressions."""
    ground, a, b = RigidBody("ground"), rod("a"), rod("b")
    l = Symbol("l")
    q, u = dynamicsymbols("q_0:2"), dynamicsymbols("u_0:2")
    joints = [
        PinJoint("first", ground, a, q[0], u[0], child_point=-l / 2 * a.x, joint_axis=ground.z),
        PinJoint("second", a, b, q[1], u[1], l / 2 * a.x, -l / 2 * b.x, joint_axis=a.z),
    ]
    system = System.from_newtonian(ground)
    system.add_joints(*joints)
    system.apply_uniform_gravity(-Symbol("g") * ground.y)
    return system, ground, b


def test_a_system_has_the_reactions_of_the_mechanism_of_its_joints():
    system, ground, _ = loop_system()
    model = mechc.compile(system, defaults=CHAIN, outputs=("reactions",))
    gravity = -Symbol("g") * ground.y
    made = mechc.from_joints("same", system.joints, gravity=gravity, parameters=CHAIN)
    other = mechc.compile(made, outputs=ASKED)
    assert model.joint_names == other.joint_names == ("first", "second")
    y = states_of(model)
    for mine, theirs in zip(model.reactions(y), other.reactions(y), strict=True):
        assert np.allclose(mine, theirs, rtol=1e-13, atol=1e-13)


def test_what_reactions_need_and_was_not_said_is_asked_for():
    system, ground, b = loop_system()
    held = b.masscenter.pos_from(ground.masscenter).dot(ground.x) - Symbol("d")
    system.add_holonomic_constraints(held)
    system.q_ind, system.q_dep = [system.q[0]], [system.q[1]]
    system.u_ind, system.u_dep = [system.u[0]], [system.u[1]]
    with pytest.raises(MechcError, match=r"constraint 1 is an expression.*mechc.Cut"):
        mechc.compile(system, outputs=("reactions",))

    system = loop_system()[0]
    system.form_eoms()
    kane = system.eom_method
    with pytest.raises(MechcError, match="joint reactions need joints"):
        mechc.compile(kane, outputs=("reactions",))


def test_a_load_of_which_it_is_not_known_what_it_acts_on_is_named():
    l = Symbol("l")
    system, ground, _ = loop_system()
    first = system.joints[0]
    between = ground.masscenter.locatenew("between", dynamicsymbols("q_0") * ground.x)
    pushed = mechc.from_joints("pushed", [first], loads=[(between, l * ground.y)], ground=ground)
    with pytest.raises(MechcError, match="the force on between acts on, and no body carries it"):
        mechc.compile(pushed, outputs=("reactions",))


# -- peaks ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_peak_of_a_joint_force_is_a_reduction_of_a_batch():
    model = mechc.load("four_bar", outputs=("energy", "reactions"))
    y = model.assemble({"theta_0": 1.4835}, params={"l_3": 3.5})
    peak = "max(abs(reaction_forces[1,0]))"
    batch = model.simulate_batch(2.0, y[None], {"l_3": 3.5}, reduce=[peak])
    sol = model.simulate(2.0, y, {"l_3": 3.5})
    seen = np.abs(model.reactions(sol(np.linspace(0, 2, 4001)), {"l_3": 3.5}).force[:, 1, 0]).max()
    assert np.isclose(batch[peak][0], seen, rtol=1e-3)
