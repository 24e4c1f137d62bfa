"""Equations derived by hand against the same systems by Kane's method, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from mechc_codegen.frontend.from_equations import from_equations
from sympy import Function, Matrix, Symbol, cos, diag, eye, sin, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.errors import MechcError
from tests.support.sympy_objects import four_bar_kane, four_bar_system

t = dynamicsymbols._t
q, u, F = dynamicsymbols("q u F")
m, l, g, k = symbols("m l g k")
WEIGHT = {"mass_matrix": [[m * l**2]], "forcing": [-m * g * l * cos(q)]}
VALUES = {"m": 1.3, "l": 0.7, "g": 9.81}
LENGTHS = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5, "rho": 1.5, "g": 9.81}


def pendulum(coordinates=(q,), speeds=(u,), **given):
    given = {**WEIGHT, "defaults": VALUES} | given
    return mechc.compile(from_equations(coordinates, speeds, **given))


def states(model, count=5, seed=3):
    width = len(model.coordinates + model.speeds)
    return np.random.default_rng(seed).uniform(-1, 1, (count, width))


def assert_same_rates(found, expected, y, params=None):
    np.testing.assert_allclose(
        found.rhs(0.3, y, params), expected.rhs(0.3, y, params), rtol=1e-11, atol=1e-11
    )


# -- explicit, implicit, kinematics ---------------------------------------------------------------


def test_implicit_explicit_and_without_speeds_are_the_same_motion():
    implicit = pendulum()
    explicit = pendulum(mass_matrix=None, forcing=[-g / l * cos(q)], defaults={"l": 0.7, "g": 9.81})
    rates = pendulum(speeds=None)
    wheel = pendulum(kinematics={"q": 2 * u}, mass_matrix=[[4 * m * l**2]],
                     forcing=[-2 * m * g * l * cos(q)])  # fmt: skip
    y = np.array([0.4, -0.3])
    expected = -9.81 / 0.7 * np.cos(0.4)
    for model in (implicit, explicit, rates):
        np.testing.assert_allclose(model.rhs(0.0, y), [-0.3, expected], rtol=1e-14)
    np.testing.assert_allclose(wheel.rhs(0.0, y), [-0.6, expected / 2], rtol=1e-14)
    assert rates.speeds == ("q_dot",)
    ends = [model.simulate(2.0, {"q": 0.4}).y[-1] for model in (implicit, explicit, rates)]
    np.testing.assert_allclose(ends, [ends[0]] * 3, rtol=1e-9)


def chain():
    """Three hanging rods, by Kane's method."""
    system = four_bar_system()
    method = KanesMethod(system.frame, list(system.q), list(system.u), list(system.kdes))
    method.kanes_equations(list(system.bodies), [(x.point, x.force) for x in system.loads])
    return method


def test_an_open_chain_is_that_of_kanes_method():
    """M and F as SymPy forms them."""
    kane = chain()
    expected = mechc.compile(kane)
    model = mechc.compile(from_equations(kane.q, kane.u, kane.mass_matrix, kane.forcing))
    assert model.parameters == expected.parameters
    values = {name: LENGTHS[name] for name in model.parameters}
    assert_same_rates(model, expected, states(model), values)


@pytest.mark.slow
def test_a_loop_is_closed_with_the_multipliers_of_kanes_method():
    kane, rows = chain(), list(four_bar_system().holonomic_constraints)
    terms, outputs = (kane.q, kane.u, kane.mass_matrix, kane.forcing), ("multipliers",)
    expected = mechc.compile(four_bar_kane(), outputs=outputs)
    model = mechc.compile(from_equations(*terms, constraints=rows), outputs=outputs)
    y = expected.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=LENGTHS)
    assert_same_rates(model, expected, y, LENGTHS)
    found, wanted = (each.multipliers(y, LENGTHS) for each in (model, expected))
    np.testing.assert_allclose(found, wanted, rtol=1e-10)
    ends = [each.simulate(1.0, y, LENGTHS).y[-1] for each in (model, expected)]
    np.testing.assert_allclose(*ends, rtol=1e-8)
    redundant = from_equations(*terms, constraints=[*rows, rows[0] + 2 * rows[1]])
    assert_same_rates(mechc.compile(redundant), expected, y, LENGTHS)


def sleigh():
    """Chaplygin's sleigh, whose blade a behind the mass centre does not slip, by Kane's method."""
    x, y, turn, v, w, spin = dynamicsymbols("x y phi v w omega")
    a, about = symbols("a I")
    frame, body, origin = ReferenceFrame("N"), ReferenceFrame("B"), Point("O")
    origin.set_vel(frame, 0)
    body.orient_axis(frame, turn, frame.z)
    body.set_ang_vel(frame, spin * frame.z)
    centre = origin.locatenew("C", x * frame.x + y * frame.y)
    centre.set_vel(frame, v * frame.x + w * frame.y)
    row = -v * sin(turn) + w * cos(turn) - a * spin
    rates = [x.diff(t) - v, y.diff(t) - w, turn.diff(t) - spin]
    method = KanesMethod(
        frame, [x, y, turn], [v, spin], rates, u_dependent=[w], velocity_constraints=[row]
    )
    push = F * body.x
    method.kanes_equations(
        [RigidBody("sleigh", centre, body, m, (inertia(body, 0, 0, about), centre))],
        [(centre, push)],
    )
    mass, force = diag(m, about, m), [F * cos(turn), 0, F * sin(turn)]
    return method, ([x, y, turn], [v, spin, w], mass, force, rates, row)


def test_nonholonomic_constraints_and_inputs_are_those_of_kanes_method():
    method, (coordinates, speeds, mass, force, rates, row) = sleigh()
    given = from_equations(
        coordinates, speeds, mass, force, kinematics=rates, velocity_constraints=[row],
        defaults={"m": 2.0, "I": 0.5, "a": 0.3},
    )  # fmt: skip
    model = mechc.compile(given)
    expected = mechc.compile(method, defaults={"m": 2.0, "I": 0.5, "a": 0.3})
    assert model.inputs == expected.inputs == ("F",)
    assert model.speeds == expected.speeds
    push = {"F": lambda t: np.sin(3 * t)}
    y = model.assemble({"x": 0.1, "y": 0.2, "phi": 0.7}, {"v": 0.4, "omega": 0.3})
    assert_same_rates(model.with_inputs(push), expected.with_inputs(push), y)
    ends = [each.simulate(2.0, y, inputs=push).y[-1] for each in (model, expected)]
    np.testing.assert_allclose(*ends, rtol=1e-8)


# -- outputs --------------------------------------------------------------------------------------


def test_energies_are_outputs_and_kept():
    model = pendulum(kinetic_energy=m * l**2 * u**2 / 2, potential_energy=m * g * l * sin(q))
    sol = model.simulate(2.0, {"q": 0.4})
    assert model.knows_energy
    assert sol.energy_drift < 1e-9
    assert model.energy([0.4, 0.3]) == pytest.approx(
        1.3 * 0.7 * (0.7 * 0.3**2 / 2 + 9.81 * np.sin(0.4)), rel=1e-14
    )


def test_without_energies_the_message_says_how_to_give_them():
    model = pendulum()
    assert not model.knows_energy
    with pytest.raises(mechc.UnavailableOutputError, match="kinetic_energy=, potential_energy="):
        model.energy([0.4, 0.3])
    with pytest.raises(MechcError, match="outputs: momenta need bodies"):
        model.momenta([0.4, 0.3])


def test_derivatives_outputs_and_fixed_parameters():
    made = from_equations(q, u, **WEIGHT, defaults=VALUES)
    model = mechc.compile(made, fix={"g": 9.81}, outputs=({"height": l * sin(q)},))
    assert model.parameters == ("l", "m")
    assert model.output("height", [0.4, 0.0]) == pytest.approx(0.7 * np.sin(0.4), rel=1e-15)
    slopes = model.state_jacobian([0.4, 0.0])
    np.testing.assert_allclose(slopes, [[0, 1], [9.81 / 0.7 * np.sin(0.4), 0]], rtol=1e-14)


def test_a_state_and_a_curve_stand_in_the_forcing():
    """An activation, and a spring whose force is known by samples."""
    x, h = dynamicsymbols("x"), Function("h")
    places = np.linspace(-2.0, 2.0, 9)
    table = mechc.Table(places, places**3)
    made = from_equations(
        q, u, [[m]], [x - h(q)], inputs={h(q): table(q)}, states={x: (F - x) / 0.1},
        defaults={"m": 2.0},
    )  # fmt: skip
    model = mechc.compile(made)
    assert model.coordinates == ("q", "x")
    rates = model.rhs(0.0, [0.5, 0.2, 0.1], inputs={"F": 1.0})
    np.testing.assert_allclose(rates, [0.1, 8.0, (0.2 - 0.5**3) / 2], rtol=1e-13)


# -- refused --------------------------------------------------------------------------------------

TWO = {"coordinates": dynamicsymbols("a b"), "speeds": dynamicsymbols("c d"),
       "mass_matrix": eye(2), "forcing": [0, 0]}  # fmt: skip
WRONG = {
    r"shape \(1, 2\); 2 speeds need": TWO | {"mass_matrix": [[1, 2]]},
    r"mass_matrix\[1, 0\] = 0 differs from mass_matrix\[0, 1\] = m": TWO
    | {"mass_matrix": [[1, m], [0, 1]]},
    "forcing has 1 entries for 2 speeds: give one for each of c, d": TWO | {"forcing": [0]},
    "forcing.* contains the acceleration": {"forcing": [u.diff(t)]},
    "mass_matrix.* contains the speed u": {"mass_matrix": [[1 + u**2]]},
    "explicit equations have none": {"mass_matrix": None, "constraints": [sin(q)]},
    "potential_energy is missing": {"kinetic_energy": u**2},
    "take no kinematics": {"speeds": None, "kinematics": {q: u}},
    "functions of time": {"coordinates": [Symbol("q")]},
    "2 coordinates need as many kinematic": TWO
    | {"speeds": [u], "mass_matrix": [[1]], "forcing": [0]},
    "no coordinate 'z' here": {"kinematics": {"z": u}},
    "text is never evaluated": {"forcing": ["q"]},
    "not linear in the speeds": TWO | {"velocity_constraints": [dynamicsymbols("c") ** 2]},
    r"rates of configuration constraints.*constraints=\[\.\.\.\]": TWO
    | {"velocity_constraints": [dynamicsymbols("c") - dynamicsymbols("d")]},
}


@pytest.mark.parametrize("words", WRONG)
def test_what_does_not_fit_is_refused(words):
    with pytest.raises(MechcError, match=words):
        pendulum(**{"defaults": {}} | WRONG[words])


def test_velocity_constraints_alone_can_be_declared():
    given = TWO | {"velocity_constraints": [dynamicsymbols("c") - dynamicsymbols("d")]}
    model = mechc.compile(from_equations(**given, constraints=[]))
    assert model.constraint_names == ("velocity constraint 1",)


@pytest.mark.parametrize("given", [(eye(2), Matrix([0, 1])), eye(2), [q, u], {"q": u}])
def test_a_tuple_or_a_matrix_is_refused_with_the_way_to_do_it(given):
    with pytest.raises(TypeError, match=r"mechc\.from_equations\(coordinates, speeds, mass_matrix"):
        mechc.compile(given)


def test_the_same_equations_have_the_same_key():
    """Their text is complete: they are found in the cache without being derived."""
    made = [from_equations(q, u, **WEIGHT, defaults=VALUES) for _ in range(2)]
    models = [mechc.compile(each) for each in made]
    assert models[0].build["key"] == models[1].build["key"]
    other = mechc.compile(from_equations(q, u, WEIGHT["mass_matrix"], [k * q]))
    assert other.build["key"] != models[0].build["key"]
