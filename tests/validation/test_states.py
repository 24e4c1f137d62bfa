"""States with rates of their own: muscles and controllers, against SciPy on SymPy's equations."""

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import solve_ivp
from sympy.physics.biomechanics import (
    FirstOrderActivationDeGroote2016,
    MusculotendonDeGroote2016,
    MusculotendonFormulation,
)
from sympy.physics.mechanics import (
    KanesMethod,
    LinearPathway,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from benchmarks.problems.particle import particle
from mechc import from_joints

t = dynamicsymbols._t
q, u = dynamicsymbols("q u")
G = 9.81


def hinge(loads):
    """A point mass on a rod that turns about a fixed axis; ``loads(frames, points)``."""
    m, l = sm.symbols("m l")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", (q, N.z))
    A.set_ang_vel(N, u * N.z)
    hand = O.locatenew("hand", l * A.x)
    hand.v2pt_theory(O, N, A)
    kane = KanesMethod(N, [q], [u], kd_eqs=[q.diff(t) - u])
    weight = (hand, -m * G * N.y)
    kane.kanes_equations([Particle("hand", hand, m)], [weight, *loads(N, A, O)])
    return kane


# -- a muscle lifts a forearm -------------------------------------------------------------------

ARM = {"m": 2.0, "l": 0.3, "d": 0.05, "h": 0.3, "F_max": 900.0, "l_opt": 0.12, "l_slack": 0.2}


def forearm(formulation):
    """An elbow at the origin, a muscle from the shoulder to a grip on the forearm."""
    d, h, strength, optimal, slack = sm.symbols("d h F_max l_opt l_slack")
    made = []

    def biceps(N, A, O):
        shoulder = O.locatenew("shoulder", h * N.y)
        shoulder.set_vel(N, 0)
        grip = O.locatenew("grip", d * A.x)
        grip.v2pt_theory(O, N, A)
        made.append(
            MusculotendonDeGroote2016.with_defaults(
                "biceps",
                LinearPathway(shoulder, grip),
                FirstOrderActivationDeGroote2016.with_defaults("biceps"),
                musculotendon_dynamics=formulation,
                tendon_slack_length=slack,
                peak_isometric_force=strength,
                optimal_fiber_length=optimal,
            )
        )
        return made[0].to_loads()

    return hinge(biceps), made[0]


def reference(kane, states, excitation, values):
    """SymPy's own equations as a function of (t, y), y = [q, x, u]."""
    named = {sm.Symbol(name): value for name, value in values.items()}
    rates = {q.diff(t): u}
    arguments = [t, q, *states, u, excitation]

    def function(expression):
        written = expression.doit().xreplace(rates).doit().subs(named)
        return sm.lambdify(arguments, written, cse=True)

    mass, forcing = function(kane.mass_matrix), function(kane.forcing)
    own = [function(rate) for rate in states.values()]

    def right_hand_side(time, y, e):
        point = (time, *y, e)
        turning = forcing(*point)[0, 0] / mass(*point)[0, 0]
        return [y[-1], *(f(*point) for f in own), turning]

    return right_hand_side


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "start"),
    [
        (MusculotendonFormulation.RIGID_TENDON, {}),
        (MusculotendonFormulation.FIBER_LENGTH_EXPLICIT, {"l_M_tilde_biceps": 1.05}),
    ],
    ids=["rigid tendon", "elastic tendon"],
)
def test_a_muscle_lifts_a_forearm_as_sympys_equations_say(formulation, start):
    kane, muscle = forearm(formulation)
    model = mechc.compile(kane, states=muscle, defaults={**ARM, "a_biceps": 0.05}, outputs=())
    assert model.states == tuple(x.func.__name__ for x in muscle.x)
    assert model.inputs == ("e_biceps",)
    assert model.coordinates == ("q", *model.states)
    y0 = model.assemble({"q": -0.5, **start})
    assert y0[model.state_index("a_biceps")] == 0.05
    states = dict(zip(muscle.x, muscle.rhs(), strict=True))
    expected = reference(kane, states, muscle.r[0], ARM)
    rng = np.random.default_rng(3)
    for _ in range(5):
        y = y0 + rng.uniform(-0.02, 0.02, len(y0))
        rates = expected(0.0, y, 0.6)
        found = model.rhs(0.0, y, inputs={"e_biceps": 0.6})
        np.testing.assert_allclose(found, rates, rtol=1e-11, atol=1e-11)
    excitation = mechc.Signal([0.0, 0.05, 0.25, 0.4], [0.0, 0.9, 0.2, 0.2], "previous")
    sol = model.simulate(0.4, y0, inputs={"e_biceps": excitation}, rtol=1e-10)
    y = y0
    for low, high, e in ((0.0, 0.05, 0.0), (0.05, 0.25, 0.9), (0.25, 0.4, 0.2)):
        with np.errstate(over="ignore", invalid="ignore"):  # in steps that it then refuses
            y = solve_ivp(
                expected, (low, high), y, method="DOP853", args=(e,), rtol=1e-12, atol=1e-13,
                first_step=1e-7,
            ).y[:, -1]  # fmt: skip
    np.testing.assert_allclose(sol.y[-1], y, rtol=1e-8, atol=1e-9)
    assert sol.stats["method"] == "gauss8"  # its length sqrt(x**2) keeps its sign
    assert sol["q"].max() > 0.3 > y0[0]  # lifted
    assert 0.0 < sol["a_biceps"].min() < sol["a_biceps"].max() < 0.9


def test_a_muscle_on_joints_is_that_of_kanes_method():
    kane, muscle = forearm(MusculotendonFormulation.RIGID_TENDON)
    m, l, d, h = sm.symbols("m l d h")
    ground, arm = RigidBody("ground"), RigidBody("hand", mass=m)
    arm.central_inertia = inertia(arm.frame, 0, 0, 0)
    elbow = PinJoint("elbow", ground, arm, q, u, child_point=-l * arm.x, joint_axis=ground.z)
    shoulder = ground.masscenter.locatenew("shoulder", h * ground.y)
    grip = arm.masscenter.locatenew("grip", (d - l) * arm.x)
    own = MusculotendonDeGroote2016.with_defaults(
        "biceps",
        LinearPathway(shoulder, grip),
        muscle.activation_dynamics,
        **{k: getattr(muscle, k) for k in ("tendon_slack_length", "peak_isometric_force")},
        optimal_fiber_length=muscle.optimal_fiber_length,
    )
    rates = dict(zip(own.x, own.rhs(), strict=True))
    described = [
        from_joints("arm", [elbow], ground=ground, gravity=-G * ground.y, loads=[own], states=given)
        for given in (
            own,
            [own],
            rates,
            [mechc.State(x, r, mechc.Quantity("", "")) for x, r in rates.items()],
        )
    ]
    assert len({tuple((s.symbol, s.rate) for s in each.states) for each in described}) == 1
    jointed = mechc.compile(described[0], defaults=ARM, outputs=())
    model = mechc.compile(kane, states=muscle, defaults=ARM, outputs=())
    assert jointed.inputs == model.inputs == ("e_biceps",)
    for y in ([0.3, 0.4, -0.7], [-0.5, 0.1, 0.2]):
        given = {"inputs": {"e_biceps": 0.6}}
        np.testing.assert_allclose(
            jointed.rhs(0.0, y, **given), model.rhs(0.0, y, **given), rtol=1e-11
        )
    with pytest.raises(TypeError, match="states are given as"):
        from_joints("arm", [elbow], ground=ground, loads=[own], states=3)


def test_a_muscle_told_by_the_force_of_its_tendon_has_sympys_rates():
    kane, muscle = forearm(MusculotendonFormulation.TENDON_FORCE_EXPLICIT)
    model = mechc.compile(kane, states=muscle, defaults=ARM, outputs=())
    states = dict(zip(muscle.x, muscle.rhs(), strict=True))
    expected = reference(kane, states, muscle.r[0], ARM)
    start = model.assemble({"q": -0.5, "F_T_tilde_biceps": 0.03, "a_biceps": 0.05})
    rng = np.random.default_rng(4)
    for _ in range(5):
        y = start + rng.uniform(-0.01, 0.01, len(start))
        found = model.rhs(0.0, y, inputs={"e_biceps": 0.6})
        np.testing.assert_allclose(found, expected(0.0, y, 0.6), rtol=1e-11, atol=1e-11)


# -- a controller -------------------------------------------------------------------------------

GAINS = {"m": 1.0, "l": 1.0, "k_p": 40.0, "k_i": 30.0, "k_d": 9.0}
z, target, torque = dynamicsymbols("z target T")


def controlled(**asked):
    """A pendulum held by a PID controller, whose integral is a state, at a target."""
    k_p, k_i, k_d = sm.symbols("k_p k_i k_d")
    kane = hinge(lambda N, A, O: [(A, torque * N.z)])
    error = target - q
    return mechc.compile(
        kane,
        name="controlled",
        states={z: error},
        inputs={torque: k_p * error + k_i * z - k_d * u},
        defaults={**GAINS, "z": 0.1},
        units={"z": "rad s"},
        **asked,
    )


@pytest.fixture(scope="module")
def pid():
    outputs = ("energy", "state_jacobian", {"torque": torque})
    return controlled(outputs=outputs)


def pid_rates(time, y, goal):
    angle, integral, speed = y
    push = 40.0 * (goal - angle) + 30.0 * integral - 9.0 * speed
    return [speed, goal - angle, push - G * np.cos(angle)]


@pytest.mark.parametrize("method", ["gauss8", "dop853", "dopri5", "radau5", "auto"])
def test_a_pid_controller_holds_a_pendulum(pid, method):
    assert pid.states == ("z",)
    assert pid.inputs == ("target",)
    assert pid.units["z"] == "rad s"
    y0 = pid.assemble({"q": 0.2}, {"u": 0.5})
    np.testing.assert_array_equal(y0, [0.2, 0.1, 0.5])
    sol = pid.simulate(30.0, y0, inputs={"target": 1.0}, method=method, rtol=1e-9)
    early = solve_ivp(
        pid_rates, (0, 2), y0, method="DOP853", args=(1.0,), rtol=1e-12, atol=1e-13
    ).y[:, -1]
    np.testing.assert_allclose(sol(2.0), early, atol=1e-8)
    assert sol["q"][-1] == pytest.approx(1.0, abs=1e-6)  # no error is left
    assert sol["z"][-1] == pytest.approx(G * np.cos(1.0) / 30.0, abs=1e-6)
    assert sol.model.output("torque", sol.y[-1], t=30.0) == pytest.approx(G * np.cos(1.0), abs=1e-5)


def test_the_derivative_by_states_is_that_of_the_rates(pid):
    driven, y = pid.with_inputs({"target": 1.0}), np.array([0.3, 0.2, -0.4])
    exact, step = driven.state_jacobian(y), 1e-6
    for k in range(3):
        moved = [driven.rhs(0.0, y + s * step * np.eye(3)[k]) for s in (1, -1)]
        np.testing.assert_allclose(exact[:, k], (moved[0] - moved[1]) / (2 * step), atol=1e-8)
    linear = driven.linearize(y)
    assert linear.states == ("q", "z", "u")
    np.testing.assert_allclose(linear.A, exact)


def test_what_searches_for_equilibria_says_that_there_are_states(pid):
    with pytest.raises(mechc.MechcError, match=r"additional states \(z\)"):
        pid.equilibria()


def test_members_of_a_batch_are_runs_with_their_states():
    gains = sm.symbols("k_p k_i k_d")
    kane = hinge(lambda N, A, O: [(A, torque * N.z)])
    model = mechc.compile(
        kane,
        states={"z": 1 - q},
        inputs={"T": gains[0] * (1 - q) + gains[1] * z - gains[2] * u},
        defaults={**GAINS, "z": 0.1},
        outputs=(),
    )
    start = mechc.Assembly({"q": np.array([0.0, 0.5, 1.0])})
    for method in ("dop853", "gauss8", "gauss8 in lockstep"):
        alone = None if method.endswith("in lockstep") else False
        batch = model.simulate_batch(3.0, start, rtol=1e-9, method=method, lockstep=alone)
        for k, angle in enumerate((0.0, 0.5, 1.0)):
            one = model.simulate(3.0, model.assemble({"q": angle}), rtol=1e-9, method=method)
            np.testing.assert_array_equal(batch.y[k], one.y[-1])


# -- states beside constraints ------------------------------------------------------------------


def rod():
    """A bob on a rod in x and y, pushed along x by a state that its own speed feeds."""
    x, y, v, w = dynamicsymbols("x y v w")
    kane = particle([x, y], [v, w], [z, -G], 1, closed=[x**2 + y**2 - 1])
    return kane, {z: x.diff(t) ** 2 - z + sm.sin(t)}


@pytest.mark.parametrize("method", ["gauss8", "dop853", "radau5"])
def test_closing_a_loop_moves_no_state(method):
    kane, states = rod()
    model = mechc.compile(kane, states=states, name="rod", outputs=())
    y0 = model.assemble({"x": 0.6, "z": 50.0}, {"v": 0.3}, guess={"y": -0.8})
    off = y0 + np.array([1e-4, 0.0, 0.0, 0.0, 0.0])
    projected = model.system.scene.project(0.0, off, np.zeros(0))[1]
    assert projected[2] == 50.0
    assert abs(model.constraints(projected)[0]) < 1e-15

    def by_angle(time, state):  # x = sin a, y = -cos a
        a, push, rate = state
        speed = rate * np.cos(a)
        return [rate, speed**2 - push + np.sin(time), push * np.cos(a) - G * np.sin(a)]

    start = [np.arcsin(0.6), 50.0, 0.3 / 0.8]
    a, push, rate = solve_ivp(by_angle, (0, 3), start, method="DOP853", rtol=1e-13, atol=1e-13).y[
        :, -1
    ]
    expected = [np.sin(a), -np.cos(a), push, rate * np.cos(a), rate * np.sin(a)]
    sol = model.simulate(3.0, y0, rtol=1e-9, method=method)
    np.testing.assert_allclose(sol.y[-1], expected, atol=5e-8)
    assert sol.closure.max() < 1e-14
    between = sol(np.linspace(0, 3, 40))
    assert np.abs(model.constraints(between)).max() < 1e-14


def test_a_configuration_constraint_may_hold_no_state():
    x, y, v, w = dynamicsymbols("x y v w")
    kane = particle([x, y], [v, w], [0, 0], 1, closed=[y - z])
    with pytest.raises(mechc.MechcError, match="'constraint 1' contains a state"):
        mechc.compile(kane, states={z: -z})


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"states": {"Z": -z}}, "no function of time 'Z' here; known: T"),
        ({"states": {z: "__import__('os').abort()"}}, "text is never evaluated"),
        ({"states": {z: u.diff(t)}}, "rate of z contains the acceleration Derivative"),
        ({"states": {z: -z}, "defaults": {"z": "much"}}, "'much' is not a number"),
        ({"states": {z: -z}, "inputs": {z: 1}}, "inputs: there is no specified function"),
    ],
)
def test_descriptions_of_states_that_cannot_be_are_refused(asked, told):
    kane = hinge(lambda N, A, O: [(A, torque * N.z)])
    with pytest.raises(mechc.MechcError, match=told):
        mechc.compile(kane, **asked)


# -- a steep start ------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["auto", "dopri5", "dop853", "gauss8", "radau5", "taylor"])
def test_a_start_may_be_steeper_than_the_doubles_of_the_span(method):
    """z' = -exp(40 z) falls from z = 1 within 1e-19 s: exp(-40 z) = exp(-40) + 40 t."""
    m, z = sm.Symbol("m"), sm.Function("z")(t)
    model = mechc.compile(
        particle([q], [u], [-q], m), defaults={m: 1.0}, states={z: -sm.exp(40 * z)}
    )
    sol = model.simulate(1.0, model.assemble({z: 1.0, q: 0.1}), method=method)
    assert sol.t[-1] == 1.0
    assert sol["z"][-1] == pytest.approx(-np.log(np.exp(-40) + 40.0) / 40, rel=1e-8)
    assert sol["q"][-1] == pytest.approx(0.1 * np.cos(1.0), rel=1e-7)


def test_squares_of_a_steep_starts_rates_may_overflow():
    """z' = -exp(400 z): the rate is 1e173, and steps begin at 1e-176 s."""
    m, z = sm.Symbol("m"), sm.Function("z")(t)
    model = mechc.compile(
        particle([q], [u], [-q], m), defaults={m: 1.0}, states={z: -sm.exp(400 * z)}
    )
    sol = model.simulate(1.0, model.assemble({z: 1.0, q: 0.1}), method="dop853")
    assert sol.t[-1] == 1.0
    assert sol["z"][-1] == pytest.approx(-np.log(400.0) / 400, rel=1e-7)
