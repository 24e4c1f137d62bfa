"""Objects of SymPy's, compiled: what is asked for, what is refused, what is kept."""

from inspect import signature

import numpy as np
import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.read import read
from sympy import Symbol, sin, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Lagrangian,
    Particle,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
)

import mechc
from mechc.compilation import build, cache
from mechc.errors import MissingParameterError, UnavailableOutputError
from tests.support.sympy_objects import four_bar_kane, four_bar_system, slider

t = dynamicsymbols._t


VALUES = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5, "rho": 1.5, "g": 9.81}


@pytest.fixture(scope="module")
def four_bar():
    """By Kane's method, with everything that can be asked for."""
    power = -sum(Symbol("rho") * l for l in map(Symbol, ("l_0", "l_1"))) * dynamicsymbols("u_0")
    outputs = ("energy", "points", "momenta", "multipliers", {"power": power, "wave": sin(t)})
    return mechc.compile(four_bar_kane(), outputs=outputs, name="four-bar")


def test_parameters_without_a_value_are_asked_for_by_name(four_bar):
    assert four_bar.defaults == {}
    with pytest.raises(MissingParameterError, match=r"need a value: g, l_0, l_1, l_2, l_3, rho\."):
        four_bar.rhs(0.0, np.zeros(6))
    given = {k: v for k, v in VALUES.items() if k not in ("rho", "g")}
    with pytest.raises(MissingParameterError, match=r"need a value: g, rho\. Give them"):
        four_bar.simulate(1.0, np.zeros(6), given)


def test_closing_the_loops_needs_the_lengths_only(four_bar):
    lengths = {k: v for k, v in VALUES.items() if k not in ("rho", "g")}
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=lengths)
    np.testing.assert_allclose(
        y, four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES), atol=1e-13
    )
    assert four_bar.limits("q_0", lengths) == four_bar.limits("q_0", VALUES)
    del lengths["l_3"]
    with pytest.raises(MissingParameterError, match=r"need a value: l_3\. Give"):
        four_bar.assemble({"q_0": 1.0}, params=lengths)


def test_what_a_needed_default_follows_is_needed_too():
    k = Symbol("k")
    model = mechc.compile(four_bar_kane(), defaults={"l_3": 7 * k, "rho": k})
    assert set(model.system.data["closing"]) == {"l_0", "l_1", "l_2", "l_3", "k"}
    lengths = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0}
    with pytest.raises(MissingParameterError, match=r"need a value: k, l_3\. Give"):
        model.assemble({"q_0": 1.0}, params=lengths)
    y = model.assemble({"q_0": 1.0}, params=lengths | {"k": 0.5})
    assert np.abs(model.constraints(y, lengths | {"k": 0.5, "rho": 1.0, "g": 9.81})).max() < 1e-14


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


@pytest.mark.slow
def test_fixed_parameters_fall_away_and_take_operations_with_them(four_bar):
    fixed = mechc.compile(four_bar_kane(), fix={"g": 0, "l_3": 3.5}, outputs=())
    assert fixed.parameters == ("l_0", "l_1", "l_2", "rho")
    y = four_bar.assemble({"q_0": 1.0}, {"u_0": 2.0}, params=VALUES)
    left = {name: VALUES[name] for name in fixed.parameters}
    expected = four_bar.rhs(0.0, y, VALUES | {"g": 0.0})
    np.testing.assert_allclose(fixed.rhs(0.0, y, left), expected, rtol=1e-13)
    operations = [m.system.data["operations"]["outputs"]["forcing"][1] for m in (fixed, four_bar)]
    assert operations[0] < operations[1]
    report = fixed.report()
    assert "fixed: g = 0, l_3 = 3.5" in report
    assert "not in this scene: energy, momenta, points, multipliers" in report
    with pytest.raises(mechc.UnknownNameError):
        fixed.rhs(0.0, y, VALUES)


def test_what_is_not_known_says_so():
    whirl = mechc.compile(slider(lambda q, u, N: -Symbol("k") * q[0] * N.y), defaults={"k": 2.0})
    assert whirl.defaults == {"k": 2.0}
    y = [0.1, 0.2, 0.3, 0.4]
    with pytest.raises(UnavailableOutputError, match=r"load on P has a potential cannot be seen"):
        whirl.energy(y, {"m": 1.0})
    with pytest.raises(UnavailableOutputError, match="joint reactions need joints"):
        whirl.reactions(y, {"m": 1.0})
    assert whirl.kinetic_energy(y, {"m": 2.0}) == pytest.approx(0.25)


def test_a_run_without_a_known_energy_is_told_and_shown(monkeypatch, tmp_path):
    monkeypatch.undo()
    whirl = mechc.compile(slider(lambda q, u, N: -Symbol("k") * q[0] * N.y), defaults={"k": 2.0})
    sol = whirl.simulate(1.0, [1.0, 0.0, 0.0, 1.0], {"m": 0.5}, rtol=1e-10)
    np.testing.assert_allclose(sol.y[-1], [1.0, -1.0, 0.0, -3.0], atol=1e-8)
    assert np.isnan(sol.energy).all()
    assert np.isnan(sol.energy_drift)
    assert "energy is not known" in sol._repr_html_()
    sol.plot()
    assert sol.save(tmp_path / "run.csv").exists()


def test_what_was_compiled_once_is_found_without_deriving(monkeypatch, tmp_path):
    monkeypatch.undo()
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(build, "_compiled", {})
    asked = {"defaults": {"m": 2.0}, "fix": {"c": 0.5}}

    def damped():
        return slider(lambda q, u, N: -Symbol("c") * u[0] * N.x)

    first = mechc.compile(damped(), **asked)
    assert first.capsule
    assert len(cache.scenes()) == 1
    monkeypatch.setattr(build, "_compiled", {})
    monkeypatch.setattr(build, "_built", lambda *_: pytest.fail("derived again"))
    again = mechc.compile(damped(), **asked)
    assert again is not first
    y = [0.0, 0.0, 3.0, 0.0]
    assert again.rhs(0.0, y)[2] == first.rhs(0.0, y)[2] == pytest.approx(-0.75)
    assert set(again.build["seconds"]) == {"read", "load"}


# -- equations that are not formed ------------------------------------------------------------


def spring_system(speed):
    """A mass on a spring, by its potential energy, and a damper."""
    q, (m, k, b) = dynamicsymbols("q"), symbols("m k b")
    wall, bob = RigidBody("wall"), Particle("bob", mass=m)
    system = System.from_newtonian(wall)
    bob.potential_energy = k * q**2 / 2
    system.add_joints(PrismaticJoint("slide", wall, bob, q, speed(q)))
    system.add_loads((bob.masscenter, -b * speed(q) * system.x))
    return system


def own_speed(q):
    return dynamicsymbols("u")


def rates(thing, form=None):
    defaults = {"m": 2.0, "k": 5.0, "b": 0.5}
    model = mechc.compile(thing, form=form, defaults=defaults)
    return model.rhs(0.0, [0.4, 0.7]).tolist()


@pytest.mark.filterwarnings("ignore::mechc.UnusedValueWarning")
def test_a_system_that_is_not_formed_is_taken_by_the_method_asked_for():
    system = spring_system(lambda q: q.diff(t))
    assert rates(system, "lagrange") == pytest.approx([0.7, -(5 * 0.4 + 0.5 * 0.7) / 2], rel=1e-14)
    assert rates(system, "kane") == pytest.approx([0.7, -0.5 * 0.7 / 2], rel=1e-14)
    assert system.eom_method is None
    system.form_eoms(LagrangesMethod)
    assert rates(system) == rates(system, "lagrange")
    assert rates(spring_system(own_speed), "kane") == rates(system, "kane")


@pytest.mark.filterwarnings("ignore::mechc.UnusedValueWarning")
def test_methods_whose_equations_are_not_formed_are_taken_when_asked():
    formed = spring_system(own_speed)
    expected = rates(formed, "kane")
    formed.form_eoms()
    made = formed.eom_method
    kane = KanesMethod(
        formed.frame, made.q, made.u, list(formed.kdes), bodies=made.bodies, forcelist=made.loads
    )
    assert rates(kane, "kane") == expected
    system = spring_system(lambda q: q.diff(t))
    bodies, loads = system.bodies, system.loads
    lagrangian = Lagrangian(system.frame, *bodies)
    lagrange = LagrangesMethod(lagrangian, system.q, loads, bodies, system.frame)
    assert rates(lagrange, "lagrange") == rates(system, "lagrange")


@pytest.mark.parametrize(
    ("thing", "form", "words"),
    [
        (lambda: spring_system(own_speed), None, r"form='kane' or form='lagrange'"),
        (lambda: spring_system(own_speed), "lagrange", "has u: make its joints"),
        (lambda: spring_system(own_speed), "newton", "form is 'kane' or 'lagrange'"),
        (lambda: LagrangesMethod(1, [dynamicsymbols("q")]), None, "form='lagrange'"),
        (lambda: LagrangesMethod(1, [dynamicsymbols("q")]), "kane", "not for a LagrangesMethod"),
    ],
)
def test_the_method_that_is_missing_or_does_not_fit_is_named(thing, form, words):
    with pytest.raises(mechc.MechanismError, match=words):
        mechc.compile(thing(), form=form)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"inputs": [1]}, "inputs are given by name"),
        ({"inputs": 3}, "inputs are given by name"),
        ({"units": ["m"]}, "units are given by name"),
        ({"fix": [("m", 1)]}, "parameters to fix are given by name"),
        ({"states": 3}, r"states are given as .*not as 3"),
        ({"inputs": {"F": lambda t: 0.0}}, r"give it with each run: .*inputs=\{'F': f\}"),
    ],
)
def test_options_of_a_wrong_kind_are_named(asked, words):
    with pytest.raises((TypeError, mechc.MechanismError), match=words):
        mechc.compile(slider(), **asked)


def test_a_single_constraint_needs_no_list():
    x, y = dynamicsymbols("x y")
    model = mechc.compile(slider(), configuration_constraints=x - y)
    assert len(model.constraint_names) == 1


def test_a_gravity_without_a_direction_is_refused():
    wall, bob = RigidBody("wall"), RigidBody("bob")
    joint = PrismaticJoint("slide", wall, bob, *dynamicsymbols("q u"))
    with pytest.raises(mechc.MechanismError, match=r"gravity is a vector, such as .*not 9\.81"):
        mechc.from_joints("slider", [joint], gravity=9.81)


# -- SymPy 1.15, of which names of attributes and one argument are new ----------------------------


def test_names_that_sympy_deprecates_are_not_read(monkeypatch):
    """``forcelist`` and ``bodylist`` of its methods warn; ``loads`` and ``bodies`` are as old."""
    x = dynamicsymbols("x")
    frame = four_bar_kane()._inertial
    lagrange = LagrangesMethod(x.diff(t) ** 2 - x**2, [x], forcelist=[], frame=frame)
    lagrange.form_lagranges_equations()
    kane, methods = four_bar_kane(), (KanesMethod, LagrangesMethod)

    def deprecated(method):
        raise AssertionError("a name that warns")

    for kind in methods:
        for name in ("forcelist", "bodylist"):
            monkeypatch.setattr(kind, name, property(deprecated), raising=False)
    assert len(read(kane).loads) == len(kane.loads)
    assert read(lagrange).loads == ()


@pytest.mark.skipif(
    "nonholonomic_constraints" not in signature(KanesMethod).parameters, reason="SymPy before 1.15"
)
def test_nonholonomic_constraints_are_the_velocity_constraints_besides_rates():
    x, y, z, p, v, w, s, r = dynamicsymbols("x y z p v w s r")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    rates = {x: v, y: w, z: s, p: r}
    circle, row = x**2 + y**2 - 1, s - p * v

    def made(**constraints):
        P = O.locatenew("P", x * N.x + y * N.y + z * N.z)
        P.set_vel(N, v * N.x + w * N.y + s * N.z)
        kane = KanesMethod(
            N, [x, z, p], [v, r], [a.diff(t) - b for a, b in rates.items()],
            q_dependent=[y], u_dependent=[w, s], configuration_constraints=[circle], **constraints
        )  # fmt: skip
        kane.kanes_equations([Particle("pearl", P, Symbol("m"))], [(P, -N.z)])
        return convert(read(kane), ConversionSettings())

    one = made(nonholonomic_constraints=[row])
    other = made(velocity_constraints=[2 * x * v + 2 * y * w, row])
    for each in ("configuration_constraints", "motion_constraints"):
        assert [c.expression for c in getattr(one, each)] == [
            c.expression for c in getattr(other, each)
        ]
    assert (len(one.configuration_constraints), len(one.motion_constraints)) == (1, 1)
