"""Linear models: against closed forms, differences and each other."""

import pickle

import numpy as np
import pytest
import scipy.signal
from sympy import Symbol, cos, sin
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from tests.support.differences import extrapolated
from tests.support.pendulums import bob_of_a_moved_pivot, pendulum

t = dynamicsymbols._t
REGULAR = {"l_3": 3.5}
CRANK = ("theta_0", "omega_0")


def along_the_loop(model, y, params):
    """The crank's rates as a function of its own angle and speed, the others following."""
    guess = dict(zip(model.coordinates, y, strict=False))

    def rates(angle, speed):
        guessed = {name: value for name, value in guess.items() if name != "theta_0"}
        start = {"theta_0": angle}, {"omega_0": speed}
        closed = model.assemble(*start, guess=guessed, params=params)
        return model.rhs(0.0, closed, params)[[0, 3]], closed

    return rates


def test_a_linear_model_on_a_trajectory_is_the_derivative_along_the_loop(four_bar):
    y = four_bar.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    found = four_bar.linearize(y, REGULAR, independent=CRANK, outputs=("theta_2", "omega_1"))
    rates, h = along_the_loop(four_bar, y, REGULAR), 1e-3
    columns, states = [], []
    for direction in np.eye(2):
        sides = [rates(*(np.array([1.1, 2.0]) + k * h * direction)) for k in (-2, -1, 1, 2)]
        for kind, kept in ((0, columns), (1, states)):
            a, b, c, d = (side[kind] for side in sides)
            kept.append((a - 8 * b + 8 * c - d) / (12 * h))
    np.testing.assert_allclose(found.A, np.transpose(columns), atol=1e-8)
    np.testing.assert_allclose(found.to_state, np.transpose(states), atol=1e-8)
    np.testing.assert_allclose(found.C, found.to_state[[2, 4]], atol=0)
    assert found.states == CRANK
    assert found.D.shape == (2, 0)


@pytest.mark.slow
def test_eigenvalues_at_an_equilibrium_do_not_depend_on_what_is_independent(four_bar):
    for equilibrium in four_bar.equilibria(REGULAR):
        spectra = []
        for chosen in (CRANK, ("theta_2", "omega_2"), ("theta_1", "omega_0"), None):
            found = four_bar.linearize(equilibrium.y, REGULAR, independent=chosen)
            spectra.append(np.sort_complex(np.linalg.eigvals(found.A)))
            np.testing.assert_allclose(found.rates, 0.0, atol=1e-9)
        np.testing.assert_allclose(spectra, np.broadcast_to(spectra[0], (4, 2)), rtol=1e-9)
        assert bool(abs(spectra[0].real).max() < 1e-6) is equilibrium.stable


@pytest.mark.slow
def test_inputs_and_outputs_act_as_the_simulated_mechanism_does(four_bar, torque):
    """A small torque from the stable equilibrium: the motion, and what is measured of it."""
    y = four_bar.equilibria(REGULAR)[0].y
    chosen = ("theta_0", "alpha", "pull")
    lin = four_bar.linearize(y, REGULAR, inputs=(torque,), outputs=chosen, independent=CRANK)
    small, times = 1e-4, np.linspace(0.0, 2.0, 21)
    pushed = {**REGULAR, torque: small}
    sol = four_bar.simulate((0.0, 2.0), y, pushed, t_eval=times, rtol=1e-12)
    rest = {name: four_bar.output(name, y, REGULAR) for name in chosen[1:]}
    told = [sol["theta_0"] - y[0]]
    told += [four_bar.output(name, sol.y, pushed) - rest[name] for name in chosen[1:]]
    steps = np.full_like(times, small)
    _, expected, _ = scipy.signal.lsim(scipy.signal.StateSpace(*lin), steps, times)
    size = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(np.transpose(told) / size, expected / size, atol=2e-3)
    assert np.abs(lin.D[1:]).min() > 0.0


def test_what_cannot_be_linearized_is_refused(four_bar):
    y = four_bar.assemble({"theta_0": 1.1}, params=REGULAR)
    with pytest.raises(ValueError, match=r"1 of theta_0, theta_1, theta_2 are independent here"):
        four_bar.linearize(y, REGULAR, independent=("theta_0", "theta_1"))
    with pytest.raises(mechc.UnknownNameError, match="no input or parameter is called"):
        four_bar.linearize(y, REGULAR, inputs=("torque",))
    with pytest.raises(mechc.UnknownNameError, match="coordinate, speed or user-defined output"):
        four_bar.linearize(y, REGULAR, outputs=("pul",))
    with pytest.raises(mechc.AssemblyError, match="leaves the loop open"):
        four_bar.linearize(y + 0.1, REGULAR)
    with pytest.raises(mechc.ChangePointError, match="linearize near it"):
        four_bar.linearize(np.array([np.pi, 0, 0, 0, 0, 0]), {"l_3": 4.0})


def knife_edge():
    """A skate on a slope, which moves along its blade alone: nonholonomic."""
    x, y, phi, w, ux, uy = dynamicsymbols("x y phi w ux uy")
    m, k = Symbol("m"), Symbol("k")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    skate = origin.locatenew("S", x * frame.x + y * frame.y)
    skate.set_vel(frame, ux * frame.x + uy * frame.y)
    blade = frame.orientnew("B", "Axis", (phi, frame.z))
    blade.set_ang_vel(frame, w * frame.z)
    tip = skate.locatenew("T", k * blade.x)
    tip.set_vel(frame, ux * frame.x + uy * frame.y + k * w * blade.y)
    method = KanesMethod(
        frame,
        [x, y, phi],
        [ux, w],
        kd_eqs=[x.diff(t) - ux, y.diff(t) - uy, phi.diff(t) - w],
        u_dependent=[uy],
        velocity_constraints=[-ux * sin(phi) + uy * cos(phi)],
    )
    bodies = [Particle("skate", skate, m), Particle("tip", tip, m)]
    method.kanes_equations(bodies, [(skate, 9.81 * m * frame.x / 3)])
    return method


def test_constraints_on_the_speeds_alone_leave_all_coordinates_independent():
    model = mechc.compile(knife_edge(), outputs=("state_jacobian",), defaults={"m": 2, "k": 0.3})
    start = np.array([0.0, 0.0, 0.4, 1.0, 0.5, np.tan(0.4)])
    assert model.speeds == ("ux", "w", "uy")
    lin = model.linearize(start, independent=("x", "y", "phi", "ux", "w"))
    assert lin.states == ("x", "y", "phi", "ux", "w")
    assert lin.A.shape == (5, 5)
    # uy = ux tan(phi): its rate by phi is ux / cos(phi)^2
    assert lin.to_state[5, 2] == pytest.approx(1.0 / np.cos(0.4) ** 2, rel=1e-13)
    h, columns = 1e-3, []
    for direction in np.eye(5):
        sides = []
        for k in (-2, -1, 1, 2):
            moved = start[:5] + k * h * direction
            sides.append(model.rhs(0.0, np.append(moved, moved[3] * np.tan(moved[2])))[:5])
        a, b, c, d = sides
        columns.append((a - 8 * b + 8 * c - d) / (12 * h))
    np.testing.assert_allclose(lin.A, np.transpose(columns), atol=1e-9)


@pytest.mark.slow
def test_a_shipped_mechanism_is_linearized_when_asked_for_its_jacobian(four_bar):
    asked = {"outputs": ["state_jacobian"], "fix": {"g": 9.81}}
    model = mechc.load("four_bar", **asked)
    y = four_bar.equilibria(REGULAR)[0].y
    expected = four_bar.linearize(y, REGULAR, independent=CRANK).A
    np.testing.assert_allclose(
        model.linearize(y, REGULAR, independent=CRANK).A, expected, rtol=1e-9
    )
    assert model.options == asked
    assert "g" not in model.parameters
    assert pickle.loads(pickle.dumps(model)) is model
    with pytest.raises(mechc.MechcError, match="'enery' is not one of energy"):
        mechc.load("four_bar", outputs=["enery"])
    with pytest.raises(TypeError, match="requested by name"):
        mechc.load("four_bar", outputs=[{"own": Symbol("g")}])


def pulled_pendulum():
    """A bob on a rod whose pivot moves as r, pulled by F: the equations hold r''."""
    q, u, r, F = dynamicsymbols("q u r F")
    frame, pivot = ReferenceFrame("N"), Point("O")
    pivot.set_vel(frame, 0)
    rod = frame.orientnew("B", "Axis", (q, frame.z))
    rod.set_ang_vel(frame, u * frame.z)
    bob = pivot.locatenew("P", r * frame.x - rod.y)
    bob.set_vel(frame, r.diff(t) * frame.x + u * rod.x)
    method = KanesMethod(frame, [q], [u], [q.diff(t) - u])
    forces = [(bob, F * frame.x - 9.81 * Symbol("m") * frame.y)]
    method.kanes_equations([Particle("bob", bob, Symbol("m"))], forces)
    return method, {"pull": F * u.diff(t)}


def test_inputs_that_a_run_is_given_are_inputs_of_linear_models():
    method, own = pulled_pendulum()
    model = mechc.compile(method, outputs=("state_jacobian", own), defaults={"m": 2.0})
    driven = model.with_inputs({"F": 0.7, "r": 0.0})
    assert driven.input_values == ("F", "r''")
    lin = driven.linearize([0.4, 0.3], inputs=("F", "r''"), outputs=("q", "pull"))
    # u' = (F/m - r'') cos q - g sin q
    alpha, push = 0.35 * np.cos(0.4) - 9.81 * np.sin(0.4), 0.7
    np.testing.assert_allclose(lin.B, [[0, 0], [np.cos(0.4) / 2, -np.cos(0.4)]], rtol=1e-14)
    slope = -0.35 * np.sin(0.4) - 9.81 * np.cos(0.4)
    np.testing.assert_allclose(lin.A, [[0, 1], [slope, 0]], rtol=1e-14)
    np.testing.assert_allclose(lin.C, [[1, 0], [push * slope, 0]], rtol=1e-14)
    by_push = alpha + push * np.cos(0.4) / 2
    np.testing.assert_allclose(lin.D, [[0, 0], [by_push, -push * np.cos(0.4)]], rtol=1e-14)
    rates = driven.rhs(0.0, [0.4, 0.3])[1:]
    found = driven.inverse_dynamics([0.4, 0.3], rates, inputs=("F",))
    assert found.inputs == pytest.approx(0.7, rel=1e-13)
    with pytest.raises(mechc.UnknownNameError, match="no input or parameter is called 'r'"):
        driven.linearize([0.4, 0.3], inputs=("r",))


# -- inputs and parameters in constraints: against closed motions of the nonlinear mechanism -------


def driven_at(model, given):
    """The model with inputs and rates of theirs that have constant values."""
    rates = {name: [given.get(name + "'" * k, 0.0) for k in range(3)] for name in model.inputs}
    return model.with_inputs({
        name: tuple(lambda t, x=x: x for x in values) for name, values in rates.items()
    })  # fmt: skip


def agrees_with_differences(model, y, params, inputs, outputs=(), *, given=None, independent=None):
    """The linear model, compared with differences of the mechanism whose loops stay closed."""
    given, names = given or {}, (*model.coordinates, *model.speeds)
    usual = dict(zip(model.parameters, model.system.parameter_set.resolve(params), strict=True))
    at, outputs = dict(zip(names, y, strict=True)), (*names, *outputs)
    lin = driven_at(model, given).linearize(
        y, params, inputs=inputs, outputs=outputs, independent=independent
    )

    def told(name, change):
        moved = {n: x + change * (n == name) for n, x in (at | given).items()}
        every = params | ({name: usual[name] + change} if name in usual else {})
        here, kept = driven_at(model, moved), {n: moved[n] for n in lin.states}
        there = here.assemble(
            {n: x for n, x in kept.items() if n in model.coordinates},
            {n: x for n, x in kept.items() if n in model.speeds},
            guess={n: at[n] for n in model.coordinates if n not in kept}, params=every,
        )  # fmt: skip
        rates, known = here.rhs(0.0, there, every), dict(zip(names, there, strict=True))
        return np.array(
            [rates[names.index(n)] for n in lin.states]
            + [known[n] if n in known else here.output(n, there, every) for n in outputs]
        )

    expected = np.transpose([
        extrapolated(lambda change, name=name: told(name, change), 1e-2)
        for name in (*lin.states, *inputs)
    ])  # fmt: skip
    found = np.block([[lin.A, lin.B], [lin.C, lin.D]])
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(lin.by_input, lin.D[: len(y)], atol=0)
    return lin


def test_a_driven_crank_turns_with_the_parameter_that_drives_it():
    """And the other links with the lengths; the state is the crank's angle alone."""
    model = mechc.load(
        "four_bar", crank_speed=True, outputs=("state_jacobian", "parameter_jacobian")
    )
    params = {"l_3": 3.5, "Omega_0": 2.0}
    y = model.assemble({"theta_0": 1.1}, params=params)
    inputs = ("Omega_0", "l_0", "l_3", "m_1", "g")
    lin = agrees_with_differences(model, y, params, inputs, independent=("theta_0",))
    np.testing.assert_allclose(lin.B, [[1, 0, 0, 0, 0]], atol=1e-14)
    np.testing.assert_allclose(lin.D[:, 0], np.append(np.zeros(3), y[3:] / 2.0), atol=1e-14)


def test_a_linear_model_by_every_parameter_of_a_loop(four_bar):
    """Lengths stand in the constraints, and inertias follow lengths and masses."""
    y = four_bar.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    every = four_bar.parameters
    for independent in (CRANK, ("theta_1", "omega_2")):
        lin = agrees_with_differences(
            four_bar, y, REGULAR, every, ("alpha", "pull"), independent=independent
        )
    lin = four_bar.linearize(y, REGULAR, inputs=["l_3"], independent=CRANK)
    (by_length,) = lin.by_input.T
    assert by_length[0] == by_length[3] == 0.0
    assert abs(by_length[1:3]).min() > 0.1


def test_parameters_that_are_given_follow_no_others(four_bar):
    """The inertia of a rod follows its mass, unless it is given."""
    y = four_bar.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    usual = four_bar.system.parameter_set.resolve(REGULAR)
    usual = dict(zip(four_bar.parameters, usual, strict=True))
    follows = agrees_with_differences(four_bar, y, REGULAR, ("m_0",), independent=CRANK)
    given = REGULAR | {"I_0": usual["I_0"]}
    stays = agrees_with_differences(four_bar, y, given, ("m_0", "I_0"), independent=CRANK)
    slope = usual["I_0"] / usual["m_0"]
    expected = stays.B[:, 0] + slope * stays.B[:, 1]
    np.testing.assert_allclose(follows.B[:, 0], expected, rtol=1e-12)
    assert abs(follows.B - stays.B[:, :1]).max() > 1e-3


def test_a_moved_pivot_moves_what_hangs_on_it():
    method, own = bob_of_a_moved_pivot()
    defaults = {"m": 2.0, "l": 1.3}
    model = mechc.compile(method, outputs=("state_jacobian", own), defaults=defaults)
    given = {"r": 0.2, "r'": -0.4, "r''": 0.7}
    driven, guess = driven_at(model, given), {"y": -1.0}
    y = driven.assemble({"x": 0.7}, {"u": 0.5}, guess=guess)
    inputs = (*driven.input_values, "l", "m")
    lin = agrees_with_differences(model, y, {}, inputs, ("lean",), given=given)
    assert lin.inputs[:3] == ("r", "r'", "r''")
    # at rest below the pivot, to which the bob's place is tied: all of it follows the pivot
    below = driven_at(model, {}).assemble({"x": 0.0}, {"u": 0.0}, guess={"y": -1.0})
    still = driven_at(model, {}).linearize(
        below, inputs=("r",), outputs=("lean",), independent=("x", "u")
    )
    A, B, C, D = still
    assert -C @ np.linalg.solve(A, B) + D == pytest.approx(0.0, abs=1e-14)
    assert -np.linalg.solve(A, B)[0] == pytest.approx(1.0, rel=1e-14)


@pytest.mark.slow
def test_speeds_that_move_by_rounding_alone_are_no_redundant_constraint():
    """The length of a rod, in a motion along it: the speeds of the bob do not change with it."""
    defaults = {"m": 2.0, "l": 1.3}
    model = mechc.compile(bob_of_a_moved_pivot()[0], outputs=("sensitivities",), defaults=defaults)
    driven = model.with_inputs({"r": 0.2})
    y = driven.assemble({"x": 0.7}, {"u": 0.5}, guess={"y": -1.0})
    sol = driven.simulate(0.3, y, sensitivities=("l", "r"))
    assert sol.sensitivity.notes == ()
    assert all(np.isfinite(sol.sensitivity[name]).all() for name in ("l", "r"))


@pytest.mark.slow
def test_a_linear_model_by_every_parameter_of_a_slider_crank():
    model = mechc.load("slider_crank", outputs=("state_jacobian", "parameter_jacobian"))
    y = model.assemble({"theta": 0.8}, {"omega": 3.0})
    lin = agrees_with_differences(model, y, {}, model.parameters)
    assert lin.B.any(axis=0).sum() > 4


def test_a_linear_model_by_every_parameter_of_an_open_pendulum():
    model = mechc.compile(pendulum(), outputs=("state_jacobian", "parameter_jacobian"))
    agrees_with_differences(model, np.array([0.3, 1.2]), {"l": 0.8}, ("l", "m"))


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("rows", ["constraints", "velocity_constraints"])
def test_redundant_constraints_that_an_input_keeps_from_holding(rows):
    """A block held, or pulled, at a and at b: there is no linear model by one of them."""
    x, y, u, v = dynamicsymbols("x y u v")
    a, b = Symbol("a"), Symbol("b")
    held = {"constraints": x, "velocity_constraints": u}[rows]
    block = mechc.from_equations(
        [x, y], [u, v], [[1, 0], [0, 2]], [b - x, a - y], name="held twice",
        kinematics=[x.diff(t) - u, y.diff(t) - v], **{rows: [held - a, 2 * held - 2 * b]},
    )  # fmt: skip
    model = mechc.compile(block, outputs=("state_jacobian",), defaults={"a": 1, "b": 1})
    at = model.assemble({"y": 0.0}, guess={"x": 1.0})
    assert model.linearize(at).A.shape[0] >= 2
    with pytest.raises(mechc.MechcError, match="by b, for the constraints are redundant and with"):
        model.linearize(at, inputs=("b",))
    sol = model.simulate(1.0, at, sensitivities=("a",))
    assert np.isnan(sol.sensitivity["a"]).all()
    assert "with another a they do not hold at all" in sol.sensitivity.notes[0]
