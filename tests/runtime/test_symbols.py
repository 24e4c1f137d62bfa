"""Numbers are kept by symbol: symbols and functions of time are taken wherever names are."""

from __future__ import annotations

import copy
import pickle
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, interp1d, make_interp_spline
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

t = dynamicsymbols._t
q, u, T, F = dynamicsymbols("q u T F")
m, l, g, I, Ixx, Iyy, unused = sm.symbols("m l g I Ixx Iyy unused")
CONSTANTS = {m: 2.0, l: 0.5, g: 9.81, I: 0.1, Ixx: 0.2, Iyy: 0.3}
NAMES = {str(key): value for key, value in CONSTANTS.items() if key not in (Ixx, Iyy)}
START = {q: 0.4, u: -0.2}
N, O = ReferenceFrame("N"), Point("O")


def pendulum():
    """A body with three moments of inertia, of which one counts, and two torques."""
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", (q, N.z))
    A.set_ang_vel(N, u * N.z)
    G = O.locatenew("G", -l * A.y)
    G.v2pt_theory(O, N, A)
    kane = KanesMethod(N, [q], [u], [q.diff(t) - u])
    body = RigidBody("body", G, A, m, (inertia(A, Ixx, Iyy, I), G))
    kane.kanes_equations([body], [(G, -m * g * N.y), (A, (T + 2 * F) * N.z)])
    return kane, G, A


def rate(y, torque=0.0, c=NAMES):
    """u' of the pendulum."""
    return (torque - c["m"] * c["g"] * c["l"] * np.sin(y[0])) / (c["I"] + c["m"] * c["l"] ** 2)


@pytest.fixture(scope="module")
def model():
    kane, G, A = pendulum()
    tip = {"tip": G.pos_from(O), "both": [q, u], "turn": A.dcm(N), sm.Symbol("power"): T * u}
    tip["sensors"] = {"rate": u, "axis": A.z}
    outputs = ("energy", "state_jacobian", tip)
    return mechc.compile(kane, defaults=CONSTANTS, inputs={F: sm.S.Zero}, outputs=outputs)


def test_all_constants_of_a_derivation_are_taken_and_what_fell_out_is_no_parameter(model) -> None:
    assert dict(model.defaults) == NAMES
    driven = model.with_inputs({T: 0.3})
    expected = rate([0.4], 0.3, NAMES | {"m": 3.0})
    for params in ({m: 3.0}, {"m": 3.0}, {m: sm.Integer(3)}, {m: np.array(3)}):
        assert abs(driven.rhs(0.0, [0.4, 0.0], params)[1] - expected) < 1e-14
    with pytest.warns(mechc.UnusedValueWarning, match="Ixx, Iyy are not in the equations"):
        driven.rhs(0.0, [0.4, 0.0], CONSTANTS)


def test_a_symbol_that_the_object_never_held_is_named_once_and_a_text_is_refused() -> None:
    kane, _, _ = pendulum()
    inputs = {F: sm.S.Zero, T: sm.S.Zero}
    with pytest.warns(mechc.UnusedValueWarning, match="defaults: unused is not in the equations"):
        mechc.compile(kane, defaults={**CONSTANTS, unused: 1.0}, inputs=inputs)
    with pytest.raises(mechc.UnknownNameError, match="no parameter is called 'mm'; did you mean"):
        mechc.compile(kane, defaults={**NAMES, "mm": 1.0}, inputs=inputs)


def test_values_of_defaults_and_their_order_compile_nothing_anew() -> None:
    kane, _, _ = pendulum()
    inputs = {F: sm.S.Zero}
    first = mechc.compile(kane, defaults=CONSTANTS, inputs=inputs, name="order")
    others = dict(reversed(CONSTANTS.items())) | {m: 5.0}
    again = mechc.compile(kane, defaults=others, inputs=inputs, name="order")
    assert again.build["key"] == first.build["key"]
    assert (first.defaults["m"], again.defaults["m"]) == (2.0, 5.0)
    found = again.with_inputs({T: 0.0}).rhs(0.0, [0.4, 0.0])[1]
    assert abs(found - rate([0.4], 0.0, NAMES | {"m": 5.0})) < 1e-14


def test_defaults_that_follow_others_follow_the_values_given() -> None:
    kane, _, _ = pendulum()
    defaults = {m: 2.0, l: 0.5, g: 9.81, I: m * l**2 / 3}
    model = mechc.compile(kane, defaults=defaults, inputs={F: sm.S.Zero}).with_inputs({T: 0.0})
    for params, mass in (({}, 2.0), ({m: 3.0}, 3.0)):
        expected = rate([0.4], 0.0, NAMES | {"m": mass, "I": mass * 0.25 / 3})
        assert abs(model.rhs(0.0, [0.4, 0.0], params)[1] - expected) < 1e-14


def test_starts_by_symbol_in_one_mapping_or_two(model) -> None:
    by_name = model.assemble({"q": 0.4}, {"u": -0.2})
    assert (by_name == model.assemble({q: 0.4}, {u: -0.2})).all()
    sol = model.simulate(0.5, START, inputs={T: 0.3})
    assert (sol.y[0] == by_name).all()
    assert (sol[q] == sol["q"]).all()
    assert (sol[u] == sol.y[:, 1]).all()
    for wrong in (0.4, [0.4], "q"):
        with pytest.raises(TypeError, match=r"coordinates are given by name, such as \{'q': 0.5\}"):
            model.assemble(wrong)
    with pytest.raises(mechc.UnknownNameError, match="no coordinate or speed is called 'v'"):
        model.simulate(0.5, {q: 0.4, sm.Symbol("v"): 1.0}, inputs={T: 0.0})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="two keys are called 'q'"):
        model.assemble({q: 0.4, "q": 0.5})


def test_rates_of_lagranges_coordinates_are_speeds() -> None:
    L = m * l**2 * q.diff(t) ** 2 / 2 + m * g * l * sm.cos(q)
    lagrange = LagrangesMethod(L, [q])
    lagrange.form_lagranges_equations()
    model = mechc.compile(lagrange, defaults={k: CONSTANTS[k] for k in (m, l, g)})
    sol = model.simulate(0.2, {q: 0.4, q.diff(t): -0.2})
    assert sol.y[0].tolist() == [0.4, -0.2]
    assert (sol[q.diff(t)] == sol["q_dot"]).all()


def test_outputs_keep_the_shape_of_vectors_lists_and_matrices(model) -> None:
    driven = model.with_inputs({T: 0.3})
    y = np.array([[0.4, -0.2], [1.0, 0.5]])
    tip = driven.output("tip", y)
    expected = np.column_stack([0.5 * np.sin(y[:, 0]), -0.5 * np.cos(y[:, 0]), [0, 0]])
    assert np.abs(tip - expected).max() < 1e-15
    assert (driven.output("both", y) == y).all()
    turn = driven.output("turn", y[0])
    assert turn.shape == (3, 3)
    assert abs(turn[0, 1] - np.sin(0.4)) < 1e-15
    assert np.abs(driven.output(sm.Symbol("power"), y) - 0.3 * y[:, 1]).max() < 1e-16
    assert (driven.output("tip[1]", y) == tip[:, 1]).all()
    assert (driven.output("sensors.rate", y) == y[:, 1]).all()
    assert driven.output("sensors.axis", y[0]).tolist() == [0.0, 0.0, 1.0]


def test_linear_models_and_events_by_symbol(model) -> None:
    driven = model.with_inputs({T: 0.0})
    linear = driven.linearize([0.0, 0.0], inputs=[T], outputs=[q])
    assert (linear.inputs, linear.outputs) == (("T",), ("q",))
    event = mechc.Event(q - m / 10, direction=-1)
    sol = driven.simulate(2.0, START, events=[event, u])
    assert np.abs(sol.events[0].y[:, 0] - 0.2).max() < 1e-11
    assert len(sol.events[0].t)
    assert len(sol.events[1].t)
    directed = driven.simulate(2.0, START, events=[u > 0, mechc.Event(u <= 0)])
    both = np.sort(np.concatenate([record.t for record in directed.events]))
    assert np.array_equal(both, sol.events[1].t)
    assert len(directed.events[0].t) > 0
    assert len(directed.events[1].t) > 0
    with pytest.raises(mechc.UnknownNameError, match="'height'"):
        driven.simulate(2.0, START, events=sm.Symbol("height") - q)


# -- inputs ---------------------------------------------------------------------------------------

TIMES = np.linspace(0.0, 1.0, 21)
SAMPLES = np.sin(3 * TIMES)


def scipys(torque):
    """The state at 1 s."""
    run = solve_ivp(
        lambda t, y: [y[1], rate(y, torque(t, y))], (0, 1), list(START.values()), "DOP853",
        rtol=1e-12, atol=1e-12, max_step=0.005,
    )  # fmt: skip
    return run.y[:, -1]


def test_samples_are_lines_and_interpolants_are_themselves(model) -> None:
    lines = scipys(lambda t, y: np.interp(t, TIMES, SAMPLES))
    for given in ((TIMES, SAMPLES), [TIMES.tolist(), SAMPLES.tolist()], interp1d(TIMES, SAMPLES)):
        sol = model.simulate(1.0, START, inputs={T: given})
        assert np.abs(sol.y[-1] - lines).max() < 1e-8
        assert not sol.status.warnings  # nothing was called back
    for curve in (CubicSpline(TIMES, SAMPLES), make_interp_spline(TIMES, SAMPLES, 3)):
        sol = model.simulate(1.0, START, inputs={"T": curve}, rtol=1e-11)
        assert np.abs(sol.y[-1] - scipys(lambda t, y, c=curve: c(t))).max() < 1e-9
        assert not sol.status.warnings


def test_an_interpolants_derivatives_are_as_smooth_as_it_is() -> None:
    curve = CubicSpline(TIMES, SAMPLES)
    signal = mechc.Signal.of_interpolant(curve)
    inner = np.linspace(0.01, 0.99, 40)
    for order in range(3):
        assert np.abs(signal(inner, order) - curve(inner, order)).max() < 1e-12
    assert signal.smoothness == 2
    assert mechc.Signal.of_interpolant(interp1d(TIMES, SAMPLES)).smoothness == 0
    steps = mechc.Signal.of_interpolant(interp1d(TIMES, SAMPLES, "previous"))
    assert (steps.smoothness, float(steps(1.0))) == (-1, SAMPLES[-1])
    assert mechc.Signal.of_interpolant(np.sin) is None


def test_functions_of_state_and_time_in_either_order(model) -> None:
    expected = scipys(lambda t, y: -0.4 * y[1] + np.cos(t))
    for law in (lambda x, t: -0.4 * x[1] + np.cos(t), lambda t, x: -0.4 * x[1] + np.cos(t)):
        sol = model.simulate(1.0, START, inputs={T: law})
        assert np.abs(sol.y[-1] - expected).max() < 1e-7
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"lambda t, q, u: f\(numpy.hstack"):
        model.simulate(1.0, START, inputs={T: lambda a, b: 0.0})


def test_one_function_gives_several_inputs() -> None:
    kane, _, _ = pendulum()
    model = mechc.compile(kane, defaults=CONSTANTS)
    calls = []

    def law(x, t):
        calls.append((t, *x))
        return np.array([-0.4 * x[1], 0.1])

    sol = model.simulate(1.0, START, inputs={(T, F): law})
    assert np.abs(sol.y[-1] - scipys(lambda t, y: -0.4 * y[1] + 0.2)).max() < 1e-8
    assert all(one != other for one, other in pairwise(calls))  # once for both inputs
    sol = model.simulate(1.0, START, inputs={(T, F): [0.3, 0.0]})
    assert np.abs(sol.y[-1] - scipys(lambda t, y: 0.3)).max() < 1e-8
    with pytest.raises(mechc.InputError, match="need 2 numbers, not 3"):
        model.simulate(1.0, START, inputs={(T, F): lambda t: [1.0, 2.0, 3.0]})
    each = {T: CubicSpline(TIMES, SAMPLES), F: CubicSpline(TIMES, 2 * SAMPLES)}
    both = np.column_stack([SAMPLES, 2 * SAMPLES])
    expected = model.simulate(1.0, START, inputs=each).y[-1]
    for curves in (CubicSpline(TIMES, both), make_interp_spline(TIMES, both, 3)):
        sol = model.simulate(1.0, START, inputs={(T, F): curves})
        assert not sol.status.warnings  # signals, no Python functions
        np.testing.assert_allclose(sol.y[-1], expected, rtol=0, atol=1e-12)
    lines = model.simulate(1.0, START, inputs={T: (TIMES, SAMPLES), F: (TIMES, 2 * SAMPLES)})
    sol = model.simulate(1.0, START, inputs={(T, F): (TIMES, both)})
    assert np.array_equal(sol.y[-1], lines.y[-1])


def test_a_system_of_pydy_is_compiled_with_all_that_it_holds() -> None:
    kane, _, _ = pendulum()
    system = SimpleNamespace(
        eom_method=kane,
        constants=CONSTANTS,
        initial_conditions=START,
        specifieds={(T, F): lambda x, t: np.array([-0.4 * x[1], 0.1])},
        times=np.linspace(0.0, 1.0, 11),
    )
    model = mechc.compile(system)
    assert model.start == {"q": 0.4, "u": -0.2}
    sol = model.simulate(system.times, system.initial_conditions)
    assert (sol.t == system.times).all()
    assert np.abs(sol.y[-1] - scipys(lambda t, y: -0.4 * y[1] + 0.2)).max() < 1e-8
    assert (model.assemble() == sol.y[0]).all()


# -- elsewhere ------------------------------------------------------------------------------------


def test_batches_by_symbol() -> None:
    kane, _, _ = pendulum()
    inputs = {T: sm.S.Zero, F: sm.S.Zero}
    model = mechc.compile(kane, defaults=CONSTANTS, inputs=inputs)
    masses = np.array([1.0, 2.0, 3.0])
    start = {q: np.array([0.1, 0.2, 0.3]), u: 0.0}
    batch = model.simulate_batch(1.0, start, {m: masses}, reduce=("max", q))
    same = model.simulate_batch(
        1.0, mechc.Assembly({"q": start[q]}, {"u": 0.0}), {"m": masses}, reduce="max(q)"
    )
    assert (batch["max(q)"] == same["max(q)"]).all()
    assert (batch.y == same.y).all()


def test_a_model_is_pickled_with_its_defaults_and_inputs_and_copies_are_itself(model) -> None:
    driven = model.with_inputs({T: mechc.Signal(TIMES, SAMPLES)})
    again = pickle.loads(pickle.dumps(driven))
    assert again.defaults == driven.defaults
    y = np.array([0.4, -0.2])
    assert (again.rhs(0.5, y) == driven.rhs(0.5, y)).all()
    assert copy.deepcopy(model) is model
    assert copy.copy(model) is model


def test_solutions_and_batches_are_pickled_and_copied(model) -> None:
    driven = model.with_inputs({T: mechc.Signal(TIMES, SAMPLES)})
    sol = driven.simulate(1.0, START, {m: 3.0}, events=q)
    for other in (pickle.loads(pickle.dumps(sol)), copy.deepcopy(sol), copy.copy(sol)):
        assert (other.y == sol.y).all()
        assert np.abs(other(0.37) - sol(0.37)).max() < 1e-14
        assert (str(other.status), dict(other.stats)) == (str(sol.status), dict(sol.stats))
        assert (other.events[0].t == sol.events[0].t).all()
    other = copy.deepcopy(sol)
    other.y[:] = 0.0
    assert sol.y[0, 0] == 0.4


def test_a_batch_is_pickled() -> None:
    kane, _, _ = pendulum()
    model = mechc.compile(kane, defaults=CONSTANTS, inputs={T: sm.S.Zero, F: sm.S.Zero})
    batch = model.simulate_batch(1.0, START, {m: [1.0, 2.0]}, reduce="max(q)")
    for other in (pickle.loads(pickle.dumps(batch)), copy.deepcopy(batch)):
        assert (other["max(q)"] == batch["max(q)"]).all()
        assert other.model.defaults == model.defaults
        assert other.counts == batch.counts
