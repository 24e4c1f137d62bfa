"""SymPy's own models, compiled: rates and constraint forces as SymPy itself evaluates them."""

import sys
from pathlib import Path

import numpy as np
import pytest
import sympy_models
from sympy import Rational, Symbol, sin
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols
from sympy.physics.mechanics.models import multi_mass_spring_damper, n_link_pendulum_on_cart

import mechc
from mechc import cache, jit
from mechc.errors import MissingParameterError, UnavailableOutputError

sys.path.insert(0, str(Path(__file__).parents[1] / "codegen"))
from sympy_objects import four_bar_kane, four_bar_system, slider

t = dynamicsymbols._t


class NeverBehind:
    """In place of the thread that compiles the integrators, which few of these tests need."""

    def __init__(self, make, at_once):
        self.result = make


@pytest.fixture(autouse=True)
def rates_and_outputs_alone(monkeypatch):
    monkeypatch.setattr(jit, "Pending", NeverBehind)


def formed(method):
    method.kanes_equations(method.bodies, method.loads)
    return method


def in_sympys_tests(module, test):
    """What makes the method that one of SymPy's own tests forms first."""
    return lambda: sympy_models.caught(module, test)[0]


MODELS = {
    "springs and dampers": lambda: formed(multi_mass_spring_damper(2, True, True)),
    "pendulums on a cart": lambda: formed(n_link_pendulum_on_cart(2, True, True)),
    "pendulum of two coordinates": in_sympys_tests(
        "test_linearize", "test_linearize_pendulum_kane_nonminimal"
    ),
    "pendulum of two coordinates, by Lagrange": in_sympys_tests(
        "test_lagrange", "test_nonminimal_pendulum"
    ),
    "rolling disc": in_sympys_tests("test_kane", "test_rolling_disc"),
    "rolling disc, dependent and auxiliary speeds": in_sympys_tests("test_kane2", "test_aux_dep"),
    "rolling disc, speeds without mass": in_sympys_tests("test_kane5", "test_kane_rolling_disc_lu"),
    "disc on an incline, by Lagrange": in_sympys_tests(
        "test_lagrange", "test_disc_on_an_incline_plane"
    ),
    "four-bar by joints": in_sympys_tests(
        "test_jointsmethod", "test_four_bar_linkage_with_manual_constraints"
    ),
}


@pytest.mark.filterwarnings("ignore::sympy.utilities.exceptions.SymPyDeprecationWarning")
@pytest.mark.parametrize("name", MODELS)
def test_rates_and_constraint_forces_are_sympys_own(name):
    method = MODELS[name]()
    _, _, specified = sympy_models.states_and_inputs(method)
    inputs = {f: Rational(k + 1, 7) + sin((k + 2) * t) for k, f in enumerate(specified)}
    model = mechc.compile(method, inputs=inputs, outputs=("multipliers",))
    reference = sympy_models.Reference(method, inputs)
    rng = np.random.default_rng(7)
    for _ in range(3):
        time, y, values = sympy_models.random_state(model, reference, rng)
        mine = {p: values[p] for p in model.parameters}
        rates, multipliers = reference.rates(time, y, values)
        scale = max(1.0, np.abs(rates).max())
        np.testing.assert_allclose(model.rhs(time, y, mine), rates, atol=1e-12 * scale, rtol=0)
        found = model.multipliers(y, mine, time)
        if isinstance(method, LagrangesMethod):  # which solves for -lambda
            expected = -multipliers
        else:
            forces = reference.constraint_forces(time, y, values, rates)
            jacobian = model.constraint_jacobian(y, mine, time)
            found, expected = jacobian.T @ found, forces
        scale = max(1.0, np.abs(expected).max(initial=0.0))
        np.testing.assert_allclose(found, expected, atol=1e-12 * scale, rtol=0)


VALUES = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5, "rho": 1.5, "g": 9.81}


@pytest.fixture(scope="module")
def four_bar():
    """By Kane's method, with everything that can be asked for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jit, "Pending", NeverBehind)
        power = -sum(Symbol("rho") * l for l in map(Symbol, ("l_0", "l_1"))) * dynamicsymbols("u_0")
        outputs = ("energy", "points", "momenta", "multipliers", {"power": power, "wave": sin(t)})
        return mechc.compile(four_bar_kane(), outputs=outputs, name="four-bar")


def test_parameters_without_a_value_are_asked_for_by_name(four_bar):
    assert four_bar.defaults == {}
    with pytest.raises(MissingParameterError, match=r"need a value: g, l_0, l_1, l_2, l_3, rho\."):
        four_bar.rhs(0.0, np.zeros(6))
    given = {k: v for k, v in VALUES.items() if k not in ("rho", "g")}
    with pytest.raises(MissingParameterError, match=r"need a value: g, rho\. Give them"):
        four_bar.assemble({"q_0": 1.0}, params=given)


def test_energy_power_and_momenta_balance(four_bar):
    """T + V from a KanesMethod holds: its rate along the motion vanishes."""
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES)
    rates, h = four_bar.rhs(0.0, y, VALUES), 1e-5
    energies = [four_bar.energy(y + s * h * rates, VALUES) for s in (-2, -1, 1, 2)]
    slope = (energies[0] - 8 * energies[1] + 8 * energies[2] - energies[3]) / (12 * h)
    assert abs(slope) < 1e-8 * four_bar.kinetic_energy(y, VALUES)
    momenta = four_bar.momenta(y, VALUES)
    assert momenta.linear.shape == (3, 3)
    velocities = four_bar.point_velocities(y, VALUES)
    masses = VALUES["rho"] * np.array([VALUES[f"l_{k}"] for k in range(3)])
    np.testing.assert_allclose(momenta.linear, masses[:, None] * velocities, rtol=1e-13)


def test_outputs_of_ones_own_are_evaluated_by_name(four_bar):
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES)
    power = four_bar.output("power", np.array([y, y]), VALUES)
    np.testing.assert_allclose(power, -1.5 * 3.0 * 2.0, rtol=1e-14)
    assert four_bar.output("wave", y, VALUES, t=0.5) == pytest.approx(np.sin(0.5), rel=1e-15)


def test_a_system_with_a_constraint_too_many_moves_as_it_does_without(four_bar):
    """KanesMethod cannot express it; a System that is not formed can."""
    model = mechc.compile(four_bar_system(redundant=True), outputs=("multipliers",))
    assert len(model.constraint_names) == 3
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES)
    expected = four_bar.rhs(0.0, y, VALUES)
    np.testing.assert_allclose(model.rhs(0.0, y, VALUES), expected, rtol=1e-12)
    forces = model.constraint_jacobian(y, VALUES).T @ model.multipliers(y, VALUES)
    jacobian = four_bar.constraint_jacobian(y, VALUES)
    np.testing.assert_allclose(forces, jacobian.T @ four_bar.multipliers(y, VALUES), rtol=1e-11)


def test_fixed_parameters_fall_away_and_take_operations_with_them(four_bar):
    fixed = mechc.compile(four_bar_kane(), fix={"g": 0, "l_3": 3.5}, outputs=())
    assert fixed.parameters == ("l_0", "l_1", "l_2", "rho")
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES)
    left = {name: VALUES[name] for name in fixed.parameters}
    expected = four_bar.rhs(0.0, y, VALUES | {"g": 0.0})
    np.testing.assert_allclose(fixed.rhs(0.0, y, left), expected, rtol=1e-13)
    operations = [m._data["operations"]["outputs"]["forcing"][1] for m in (fixed, four_bar)]
    assert operations[0] < operations[1]
    report = fixed.report()
    assert "fixed: g = 0, l_3 = 3.5" in report
    assert "not in this scene: energy, momenta, points, multipliers" in report
    with pytest.raises(mechc.UnknownNameError):
        fixed.rhs(0.0, y, VALUES)


def test_what_was_not_asked_for_or_is_not_known_says_so():
    spring = mechc.compile(slider(lambda q, u, N: -Symbol("k") * q[0] * N.x), defaults={"k": 2.0})
    assert spring.defaults == {"k": 2.0}
    y = [0.1, 0.2, 0.3, 0.4]
    with pytest.raises(UnavailableOutputError, match=r"load on P has a potential cannot be seen"):
        spring.energy(y, {"m": 1.0})
    with pytest.raises(UnavailableOutputError, match=r"compile with outputs=\(..., 'points'\)"):
        spring.points(y, {"m": 1.0})
    assert spring.kinetic_energy(y, {"m": 2.0}) == pytest.approx(0.25)


def test_a_run_without_a_known_energy_is_told_and_shown(monkeypatch, tmp_path):
    monkeypatch.undo()
    spring = mechc.compile(slider(lambda q, u, N: -Symbol("k") * q[0] * N.x), defaults={"k": 2.0})
    sol = spring.simulate(np.pi, [1.0, 0.0, 0.0, 1.0], {"m": 0.5}, rtol=1e-10)
    np.testing.assert_allclose(sol.y[-1], [1.0, np.pi, 0.0, 1.0], atol=1e-8)
    assert np.isnan(sol.energy).all()
    assert np.isnan(sol.energy_drift)
    assert "energy is not known" in sol._repr_html_()
    sol.plot()
    assert sol.save(tmp_path / "run.csv").exists()


def test_what_was_compiled_once_is_found_without_deriving(monkeypatch, tmp_path):
    monkeypatch.undo()
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(jit, "_compiled", {})
    asked = {"defaults": {"m": 2.0}, "fix": {"c": 0.5}}

    def damped():
        return slider(lambda q, u, N: -Symbol("c") * u[0] * N.x)

    first = mechc.compile(damped(), **asked)
    assert first.capsule
    assert len(cache.entries()) == 1
    monkeypatch.setattr(jit, "_compiled", {})
    monkeypatch.setattr(jit, "_built", lambda *_: pytest.fail("derived again"))
    again = mechc.compile(damped(), **asked)
    assert again is not first
    y = [0.0, 0.0, 3.0, 0.0]
    assert again.rhs(0.0, y)[2] == first.rhs(0.0, y)[2] == pytest.approx(-0.75)
    assert set(again.build["seconds"]) == {"load"}
