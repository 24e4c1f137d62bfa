"""Outputs along a motion in which contacts last, against statics, closed forms and differences."""

import numpy as np
import pytest
from sympy import Symbol, symbols
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia

import mechc
from benchmarks.problems.particle import on_a_line, particle
from mechc.errors import MechcError
from tests.support.impacts import G

L, M = 0.7, 1.3  # m, kg: the arm
MU, SLOPE = 0.3, 0.5
REST = mechc.Stop("q_hinge", 0.0)
TIMES = np.array([1.0, 1.5, 2.0])
t = dynamicsymbols._t


@pytest.fixture(scope="module", name="arm")
def a_uniform_arm():
    """An arm on a hinge, horizontal at 0, that falls on a stop."""
    m, l, g = symbols("m l g")
    ground, arm = RigidBody("ground"), RigidBody("arm", mass=m)
    arm.central_inertia = inertia(arm.frame, 0, 0, m * l**2 / 12)
    hinge = PinJoint("hinge", ground, arm, child_point=-l / 2 * arm.x, joint_axis=ground.z)
    described = mechc.from_joints(
        "arm", [hinge], gravity=-g * ground.y, parameters={"m": M, "l": L, "g": G}
    )
    tip = l * dynamicsymbols("u_hinge").diff(t)
    return mechc.compile(described, outputs=("reactions", "state_jacobian", {"tip": tip}))


def test_an_arm_at_rest_on_its_stop(arm):
    sol = arm.simulate(2.0, [0.3, 0.0], events=REST)
    assert sol.segments[-1].contacts == ("held",)
    fall = sol.segments[0]
    np.testing.assert_allclose(arm.rhs(TIMES, sol(TIMES))[:, 1], -1.5 * G / L)  # it would fall
    np.testing.assert_allclose(sol.output("rates", TIMES), 0.0, atol=1e-11)
    np.testing.assert_allclose(sol.output("tip", 1.5), 0.0, atol=1e-11)
    forces = sol.output("reaction_forces", TIMES)
    np.testing.assert_allclose(forces[:, 0], np.tile([0.0, M * G, 0.0], (3, 1)), atol=1e-11)
    torques = sol.output("reaction_torques", TIMES)  # of the stop, which acts at the hinge's angle
    np.testing.assert_allclose(torques[:, 0, 2], M * G * L / 2, rtol=1e-12)
    early = np.linspace(0.0, 0.9 * fall.t1, 5)  # before: those of a state alone
    np.testing.assert_array_equal(sol.output("tip", early), arm.output("tip", sol(early)))
    np.testing.assert_array_equal(sol.output("tip")[-1], sol.output("tip", sol.t[-1]))
    with pytest.raises(MechcError, match="derivatives of a motion in which contacts last"):
        sol.output("state_jacobian")


def test_reductions_and_outputs_of_a_batch(arm):
    starts = np.array([[0.3, 0.0], [0.2, 0.0], [0.3, -1.0]])
    names = ("tip", "rates", "reaction_forces")
    reduce = ["final(tip)", "final(reaction_forces[0,1])", "max(tip)", "max(rates[1])"]
    batch = arm.simulate_batch(
        2.0, starts, events=REST, t_eval=np.linspace(0.0, 2.0, 9), outputs=names, reduce=reduce
    )
    np.testing.assert_allclose(batch["final(tip)"], 0.0, atol=1e-11)
    np.testing.assert_allclose(batch["final(reaction_forces[0,1])"], M * G, rtol=1e-12)
    np.testing.assert_allclose(batch["max(tip)"], 0.0, atol=1e-11)
    np.testing.assert_allclose(batch["max(rates[1])"], 0.0, atol=1e-11)
    for k, start in enumerate(starts):
        sol = arm.simulate(2.0, start, events=REST, t_eval=batch.t_eval)
        for name in names:
            np.testing.assert_allclose(batch[name][k], sol.output(name), rtol=1e-12, atol=1e-11)
    hit = arm.simulate_batch(2.0, starts, events=REST, reduce=["first(tip > -1)"])
    np.testing.assert_allclose(hit["first(tip > -1)"], batch.event_latest[:, 0], rtol=1e-12)
    with pytest.raises(MechcError, match="derivatives of a motion in which contacts last"):
        arm.simulate_batch(2.0, starts, events=REST, reduce=["max(state_jacobian[1,0])"])


def test_outputs_of_a_stepper(arm):
    stepper = arm.stepper([0.3, 0.0], events=REST)
    stepper.step(0.01)
    free = stepper.outputs("tip")["tip"]
    np.testing.assert_allclose(free, arm.output("tip", stepper.y), rtol=1e-12)
    for _ in range(10):
        stepper.step(0.1)
    found = stepper.outputs("tip", "rates", "reaction_forces")
    np.testing.assert_allclose(found["tip"], 0.0, atol=1e-11)
    np.testing.assert_allclose(found["rates"], 0.0, atol=1e-11)
    np.testing.assert_allclose(found["reaction_forces"][0], [0.0, M * G, 0.0], atol=1e-11)


def test_a_saved_motion_does_not_know_the_forces_of_its_contacts(arm, tmp_path):
    sol = arm.simulate(2.0, [0.3, 0.0], events=REST)
    opened = mechc.open(sol.save(tmp_path / "arm.nc"), model=arm)
    assert np.isnan(opened.output("tip", TIMES)).all()
    early = np.linspace(0.0, 0.1, 3)
    np.testing.assert_allclose(opened.output("tip", early), sol.output("tip", early), rtol=1e-6)


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_a_block_slides_on_a_slope(speed):
    x, y, v_x, v_y = dynamicsymbols("x y v_x v_y")
    m, g = symbols("m g")
    pull = [-m * g * np.sin(SLOPE), -m * g * np.cos(SLOPE)]
    own = {"a": v_x.diff(t), "lift": v_y.diff(t)}
    model = mechc.compile(
        particle([x, y], [v_x, v_y], pull), outputs=(own,), defaults={"m": 2.0, "g": G}
    )
    stop = mechc.Stop("y", 0.0, friction=MU, slip="v_x")
    sol = model.simulate(0.2, [0.0, 0.0, speed, 0.0], events=stop)
    assert sol.segments[0].contacts == (f"slides {'+' if speed > 0 else '-'}",)
    expected = -G * (np.sin(SLOPE) + np.sign(speed) * MU * np.cos(SLOPE))
    np.testing.assert_allclose(sol.output("a"), expected, rtol=1e-12)
    np.testing.assert_allclose(sol.output("lift"), 0.0, atol=1e-12)


def differences(sol, times, apart=1e-4):
    """The rates of the states by central differences of the dense output."""
    steps = apart * np.array([-2.0, -1.0, 1.0, 2.0])
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * apart)
    return np.einsum("k,tkj->tj", weights, sol(times[:, None] + steps))


def within(sol, margin=2e-3):
    """Times within the smooth parts of a motion."""
    times = np.linspace(*sol.span, 301)[1:-1]
    ends = np.array([part.t1 for part in sol.segments])
    return times[np.abs(times[:, None] - ends).min(axis=1) > margin]


def test_a_mass_on_a_belt_sticks_and_slips():
    q, u = dynamicsymbols("q u")
    k = Symbol("k")
    model = mechc.compile(
        on_a_line([q], [u], [-k * q], [1.0]), outputs=({"a": u.diff(t)},), defaults={"k": 10.0}
    )
    belt = mechc.DryFriction("u - 0.5", mu=1.0, normal="2", static=1.5)
    sol = model.simulate(6.0, [0.0, 0.5], events=belt)
    assert {"sticks", "slides -"} <= {part.contacts[0] for part in sol.segments}
    times = within(sol)
    np.testing.assert_allclose(sol.output("a", times), differences(sol, times)[:, 1], atol=1e-6)


@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_multipliers_of_loops_beside_friction(speed):
    torque = 0.05
    model = mechc.load("four_bar", outputs=["multipliers", "accelerations"])
    y = model.assemble({"theta_0": 1.1}, speeds={"omega_0": speed})
    friction = mechc.DryFriction("omega_0", mu=torque, normal="1")
    sol = model.simulate(0.2, y, events=friction)
    times = within(sol)
    states, rates = sol(times), sol.output("rates", times)
    np.testing.assert_allclose(rates, differences(sol, times), rtol=1e-6, atol=1e-6)
    acting = model.forcing(states)
    acting[:, 0] -= np.sign(speed) * torque
    inertial = np.einsum("tij,tj->ti", model.mass_matrix(states), rates[:, 3:])
    loops = np.einsum(
        "tij,ti->tj", model.constraint_jacobian(states), sol.output("multipliers", times)
    )
    size = np.abs(loops).max()
    np.testing.assert_allclose(inertial + loops, acting, atol=1e-12 * size)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    ("name", "count"),
    [("planar_chain", {"links": 8}), ("windows", {"count": 3})],
    ids=["tree", "loops"],
)
def test_links_with_friction_in_a_joint(name, count):
    model = mechc.load(name, **count, outputs=["accelerations"])
    friction = mechc.DryFriction(model.speeds[0], mu=2.0, normal="1")
    sol = model.simulate(0.3, model.assemble(), events=friction)
    times = within(sol)
    rates = sol.output("rates", times)
    np.testing.assert_allclose(rates, differences(sol, times), rtol=1e-5, atol=1e-4)
    assert np.abs(rates - model.rhs(times, sol(times))).max() > 0.1  # than without friction
