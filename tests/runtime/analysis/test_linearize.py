"""Linear models: against closed forms, differences and each other."""

import pickle

import numpy as np
import pytest
import scipy.signal
from sympy import Symbol, cos, sin
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

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
