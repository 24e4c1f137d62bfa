"""Inverse dynamics along a path: closed forms, and the motion that the inputs make again."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline
from sympy import Symbol, cos, sin
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

TIMES = np.linspace(0.0, 1.5, 201)
UPPER, LOWER = 0.5, 0.4
NEAR = {"q1": -1.5, "q2": 1.0}
X, Y = "points[0,0]", "points[0,1]"


@pytest.fixture(scope="module")
def arm():
    """Two links in a plane, a torque at each joint, and its tip."""
    frame, upper, lower = (RigidBody(name) for name in ("frame", "upper", "lower"))
    for body, mass in ((upper, 2.0), (lower, 1.0)):
        body.mass, body.central_inertia = mass, inertia(body.frame, 0, 0, 0.05)
    q1, q2, u1, u2, shoulder, elbow = dynamicsymbols("q1 q2 u1 u2 T1 T2")
    joints = [
        PinJoint("shoulder", frame, upper, q1, u1, child_point=-UPPER / 2 * upper.x,
                 joint_axis=frame.z),
        PinJoint("elbow", upper, lower, q2, u2, parent_point=UPPER / 2 * upper.x,
                 child_point=-LOWER / 2 * lower.x, joint_axis=upper.z),
    ]  # fmt: skip
    loads = [(upper.frame, (shoulder - elbow) * frame.z), (lower.frame, elbow * frame.z)]
    tip = lower.masscenter.locatenew("tip", LOWER / 2 * lower.x)
    described = mechc.from_joints("arm", joints, gravity=-9.81 * frame.y, points=[tip], loads=loads)
    return mechc.compile(described, outputs=("points",))


@pytest.fixture(scope="module")
def drawn(arm):
    """The tip along a curve."""
    path = {X: "0.3 + 0.1*sin(2*t)", Y: "-0.5 + 0.2*t"}
    return arm.inverse_dynamics(path=path, t=TIMES, guess=NEAR)


def test_an_arm_draws_a_curve(arm, drawn):
    x, y = 0.3 + 0.1 * np.sin(2 * TIMES), -0.5 + 0.2 * TIMES
    np.testing.assert_allclose(drawn[X], x, atol=1e-14)
    np.testing.assert_allclose(drawn[Y], y, atol=1e-14)
    bend = np.arccos((x**2 + y**2 - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER))
    lean = np.arctan2(LOWER * np.sin(bend), UPPER + LOWER * np.cos(bend))
    np.testing.assert_allclose(drawn["q2"], bend, atol=1e-13)
    np.testing.assert_allclose(drawn["q1"], np.arctan2(y, x) - lean, atol=1e-13)
    speeds = CubicSpline(TIMES, bend).derivative()(TIMES)
    np.testing.assert_allclose(drawn["u2"], speeds, atol=1e-5)


def test_the_inputs_make_the_path_again(arm, drawn):
    sol = arm.simulate(TIMES, drawn.y[0], inputs=drawn.signals(), rtol=1e-12)
    assert sol.status.ok
    np.testing.assert_allclose(sol.y, drawn.y, atol=1e-9)
    rates = arm.with_inputs(drawn.signals()).rhs(TIMES[1:-1], drawn.y[1:-1])[:, 2:]
    np.testing.assert_allclose(rates, drawn.accelerations[1:-1], atol=1e-11)
    np.testing.assert_allclose(drawn.acceleration("u1"), drawn.accelerations[:, 0])


def test_a_pendulum_needs_the_torque_of_the_textbook(arm):
    """Both links as one: a rod of two masses that turns by a law, with a parameter in it."""
    path = {"q1": "0.7*sin(3*t)", "q2": 0.0}
    found = arm.inverse_dynamics(path=path, t=TIMES)
    angle, second = 0.7 * np.sin(3 * TIMES), -6.3 * np.sin(3 * TIMES)
    arms = UPPER / 2, UPPER + LOWER / 2
    about = 0.1 + 2.0 * arms[0] ** 2 + 1.0 * arms[1] ** 2
    weight = 9.81 * (2.0 * arms[0] + 1.0 * arms[1]) * np.cos(angle)
    np.testing.assert_allclose(found["T1"], about * second + weight, atol=1e-12)


@pytest.mark.parametrize("guess", [NEAR, {"q1": 0.0, "q2": -1.5}])
def test_the_guess_chooses_the_assembly(arm, guess):
    found = arm.inverse_dynamics(path={X: 0.4, Y: -0.4}, t=0.0, guess=guess)
    assert np.sign(found["q2"][0]) == np.sign(guess["q2"])


@pytest.mark.slow
def test_paths_are_texts_samples_splines_functions(arm, drawn):
    knots = np.linspace(0.0, 1.5, 61)
    x = 0.3 + 0.1 * np.sin(2 * knots)
    t = dynamicsymbols._t
    exact = [0.3 + 0.1 * sin(2 * t), (
        lambda t: 0.3 + 0.1 * np.sin(2 * t),
        lambda t: 0.2 * np.cos(2 * t), lambda t: -0.4 * np.sin(2 * t),
    )]  # fmt: skip
    splines = [(knots, x), CubicSpline(knots, x), mechc.Signal(knots, x, "quintic"),
               make_interp_spline(knots, x, k=5), make_interp_spline(knots, x, k=7)]  # fmt: skip
    for near, given in ((1e-12, exact), (0.05, splines)):
        for one in given:
            path = {X: one, Y: "-0.5 + 0.2*t"}
            found = arm.inverse_dynamics(path=path, t=TIMES, guess=NEAR)
            np.testing.assert_allclose(found.inputs, drawn.inputs, atol=near)


def test_a_slider_crank_follows_its_crank_and_its_slider():
    model, lengths = mechc.load("slider_crank"), {"l_0": 0.3, "l_1": 0.9}
    for path, guess in (
        ({"theta": "1 + 4*t"}, {"x": 1.0}),
        ({"x": "0.9 + 0.1*sin(t)"}, {"theta": 1.3, "phi": -0.3}),
    ):
        found = model.inverse_dynamics(
            path=path, t=TIMES, params=lengths, inputs=["T"], guess=guess
        )
        crank = found["theta"]
        slider = 0.3 * np.cos(crank) + np.sqrt(0.9**2 - (0.3 * np.sin(crank)) ** 2)
        np.testing.assert_allclose(found["x"], slider, atol=1e-12)
        for t, y, torque, rates in zip(
            TIMES, found.y, found["T"], found.accelerations, strict=True
        ):
            again = model.rhs(t, y, {**lengths, "T": torque})
            np.testing.assert_allclose(again, [*y[3:], *rates], atol=1e-9)


def test_where_a_path_leaves_the_reach_or_links_are_in_line(arm):
    four_bar = mechc.load("four_bar")
    lengths = np.array([1.0, 2.0, 3.0, 4.5])
    end = np.arccos((lengths[0] ** 2 + lengths[3] ** 2 - 25.0) / (2 * lengths[0] * lengths[3]))
    turns = {"path": {"theta_0": "1 + 4*t"}, "t": TIMES, "inputs": ["g"]}
    with pytest.raises(mechc.MechcError, match="leaves the reach of the mechanism at t = ") as no:
        four_bar.inverse_dynamics(params={"l_3": 4.5}, **turns)
    assert f"t = {(end - 1) / 4:.6f}"[:-1] in str(no.value)
    assert f"theta_0 = {np.degrees(end):.3f}"[:-1] in str(no.value)
    with pytest.raises(mechc.MechcError, match=r"two ways on meet.*theta_0 = 180 deg"):
        four_bar.inverse_dynamics(**turns)
    with pytest.raises(mechc.MechcError, match=r"at t = 0\.6 s, points\[0,0\] = 0\.9 m"):
        arm.inverse_dynamics(path={X: "0.3 + t", Y: 0.0}, t=TIMES, guess=NEAR)
    with pytest.raises(mechc.MechcError, match="singular at t = 0 s"):
        arm.inverse_dynamics(path={X: 0.9, Y: 0.0}, t=0.0, guess={"q1": 0.0, "q2": 0.0})
    with pytest.raises(mechc.AssemblyError, match="no configuration on the path was found at t"):
        arm.inverse_dynamics(path={X: 2.0, Y: 0.0}, t=TIMES, guess=NEAR)


def test_speeds_need_not_be_rates_of_coordinates():
    """q' = u / (2 + cos q): second rates of q have a term at constant u."""
    (q, u), force, m = dynamicsymbols("q u"), dynamicsymbols("F"), Symbol("m")
    frame, origin, at = ReferenceFrame("N"), Point("O"), Point("P")
    origin.set_vel(frame, 0)
    at.set_pos(origin, q * frame.x)
    at.set_vel(frame, u / (2 + cos(q)) * frame.x)
    kane = KanesMethod(frame, [q], [u], kd_eqs=[u - (2 + cos(q)) * q.diff()])
    kane.kanes_equations([Particle("bead", at, m)], [(at, force * frame.x)])
    model = mechc.compile(kane, defaults={"m": 2.0})
    found = model.inverse_dynamics(path={"q": "sin(2*t)"}, t=TIMES)
    np.testing.assert_allclose(found["F"], -8.0 * np.sin(2 * TIMES), atol=1e-12)
    np.testing.assert_allclose(found["u"], (2 + np.cos(found["q"])) * 2 * np.cos(2 * TIMES))


def test_a_body_on_a_ball_is_led_by_its_quaternion_and_a_point():
    frame, top = RigidBody("frame"), RigidBody("top", mass=1.3)
    top.central_inertia = inertia(top.frame, 0.02, 0.03, 0.05)
    x, y, z = dynamicsymbols("Tx Ty Tz")
    ball = mechc.BallJoint("ball", frame, top, child_point=-0.3 * top.z)
    points = [top.masscenter.locatenew(n, 0.4 * axis) for n, axis in (("a", top.z), ("b", top.x))]
    loads = [(top.frame, x * top.x + y * top.y + z * top.z)]
    described = mechc.from_joints(
        "top", [ball], gravity=-9.81 * frame.z, points=points, loads=loads
    )
    model = mechc.compile(described, outputs=("points", "accelerations", "state_jacobian"))
    path = {"q1_ball": "0.3*sin(2*t)", X: "0.2*sin(2*t)", "points[1,1]": "0.1*t"}
    found = model.inverse_dynamics(path=path, t=TIMES)
    np.testing.assert_allclose(found["q1_ball"], 0.3 * np.sin(2 * TIMES), atol=1e-12)
    np.testing.assert_allclose(found["points[1,1]"], 0.1 * TIMES, atol=1e-12)
    sol = model.simulate(TIMES, found.y[0], inputs=found.signals(), rtol=1e-12)
    np.testing.assert_allclose(sol.y, found.y, atol=1e-8)


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ({}, "the path is empty"),
        ({X: "t"}, "prescribes 1 numbers and the mechanism has 2 freedoms"),
        ({"q1": "t", "q2": "u1"}, "the path of q2 depends on t and parameters, not on u1"),
        ({"q1": "t", "energy": 1.0}, "no coordinate or number of a point is called 'energy'"),
        ({"q1": "t", "q2": ([0.0, 1.0], [0.0, 1.0, 2.0])}, "one value for each time"),
        ({"q1": "t", "q2": mechc.Signal([0.0, 1.0], [0.0, 1.0], "linear")}, "whose rate jumps"),
        ({"q1": "t", "q2": ([0.0, 0.2, 0.4, 0.5], [0.0] * 4)}, "sampled from 0 to 0.5 s, but is"),
        ({"q1": "t", "q2": "1/(t - 0.7421)"}, "the path moves too far between two times"),
        ({"q1": "t", "q2": abs}, "the path of q2 is an expression of t as text"),
    ],
)
def test_wrong_paths_are_refused(arm, path, told):
    with pytest.raises(mechc.MechcError) as no:
        arm.inverse_dynamics(path=path, t=TIMES, guess={})
    assert told in str(no.value)


def test_states_or_a_path(arm, drawn):
    states = drawn.y[:2], drawn.accelerations[:2]
    found = arm.inverse_dynamics(*states, t=TIMES[:2])
    np.testing.assert_allclose(found.inputs, drawn.inputs[:2])
    for given in ((), states[:1]):
        with pytest.raises(mechc.ValueOutOfBoundsError, match="give states and accelerations, or"):
            arm.inverse_dynamics(*given)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="not both"):
        arm.inverse_dynamics(*states, path={X: 0.0, Y: 0.0})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="a guess is for a path"):
        arm.inverse_dynamics(*states, guess=NEAR)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="rise from each to the next"):
        arm.inverse_dynamics(path={X: 0.0, Y: 0.0}, t=[0.0, 0.0])


def test_the_picture_has_a_panel_for_each_unit(drawn):
    figure = drawn.plot()
    assert [axes.get_ylabel() for axes in figure.axes] == ["m", "inputs (SI units)"]
    angles = drawn.plot("q1", "q2", "T1")
    assert [len(axes.lines) for axes in angles.axes] == [2, 1]
    np.testing.assert_allclose(angles.axes[0].lines[0].get_ydata(), np.degrees(drawn["q1"]))
    with pytest.raises(mechc.UnknownNameError):
        drawn.plot("T3")
    with pytest.raises(mechc.UnknownNameError, match="no speed is called 'q1'"):
        drawn.acceleration("q1")
    assert repr(drawn) == (
        "<mechc.PrescribedMotion of arm: 201 times on a path of points[0,0], points[0,1]; "
        "inputs T1, T2>"
    )
