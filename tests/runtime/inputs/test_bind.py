"""Inputs that are given with a run, against closed forms and against the same as expressions."""

import gc
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from sympy import Rational, Symbol, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from tests.support.pendulums import pushed_mass

t = dynamicsymbols._t
TIMES = np.array([0.0, 0.4, 0.5, 1.3, 2.0, 3.1])
VALUES = np.array([1.0, -2.0, 0.5, 0.5, 3.0, -1.0])
MASS, END = 2.0, 3.1


def closed_form(signal, end=END):
    """Position and speed of the free mass from rest: Gauss-Legendre on each piece, exact there."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    q = u = 0.0
    for low, high in pairwise(TIMES):
        s = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        force = 0.5 * (high - low) * weights * signal(s) / MASS
        u, q = u + force.sum(), q + (force * (end - s)).sum()
    return np.array([q, u])


@pytest.mark.parametrize(
    "force",
    [
        lambda t: 3.0 * np.cos(2.0 * t),
        lambda t, q, u: -2.0 * u[0] + q[0],
        mechc.Signal([0.0, 1.0, 1.1, 1.2, 6.0], [0.0, 0.0, 40.0, 0.0, 0.0], "linear"),
        mechc.Signal([0.0, 1.0, 2.0, 6.0], [0.0, 7.0, -2.0, 0.0], "previous"),
    ],
    ids=["of time", "of the state", "a pulse", "steps"],
)
def test_the_energy_is_a_balance_with_the_work_of_inputs(pushed, force):
    sol = pushed.simulate(5.0, [1.0, 0.5], {"k": 3.0}, inputs={"F": force})
    assert np.ptp(sol.energy) > 0.1 * sol.energy.max()
    assert sol.energy_drift < 1e-8


@pytest.mark.compiles
@pytest.mark.parametrize(
    "force",
    [7.0, mechc.Signal(TIMES, VALUES, "linear"), lambda t: np.cos(t)],
    ids=["a number", "samples", "a function"],
)
def test_the_plain_right_hand_side_has_the_values_of_inputs(pushed, force):
    """Rates one by one, many written into an array, and of SciPy's right-hand side are the same."""
    model = pushed.with_inputs({"F": force})
    y = np.random.default_rng(5).normal(size=(9, 2))
    many, out, ode = model.rhs(0.7, y), np.empty_like(y), model.ode()
    value = force if isinstance(force, float) else force(0.7)
    np.testing.assert_allclose(many - pushed.with_inputs({"F": 0.0}).rhs(0.7, y),
                               [[0.0, value / MASS]] * 9, rtol=0, atol=1e-14)  # fmt: skip
    assert model.rhs(0.7, y, out=out) is out
    np.testing.assert_array_equal(out, many)
    np.testing.assert_array_equal([ode(0.7, state) for state in y], many)
    if isinstance(force, mechc.Signal):
        with pytest.raises(mechc.ValueOutOfBoundsError, match=r"sampled from 0 to 3\.1"):
            ode(5.0, y[0])


@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
@pytest.mark.parametrize("method", ["gauss8", "dop853", "dopri5", "radau5"])
def test_a_mass_pushed_by_samples_follows_the_closed_form(pushed, kind, method):
    signal = mechc.Signal(TIMES, VALUES, kind)
    sol = pushed.simulate(END, [0.0, 0.0], inputs={"F": signal}, method=method, rtol=1e-8)
    np.testing.assert_allclose(sol.y[-1], closed_form(signal), atol=3e-8)
    assert sol.status.code == "finished"
    assert set(signal.breaks(1e-8)) <= set(sol.t)
    assert len(signal.breaks(1e-8)) >= 2
    assert sol.stats["steps"] < (40 if method in ("gauss8", "dop853") else 800)


@pytest.mark.parametrize("kind", ["previous", "linear", "cubic", "quintic"])
def test_the_error_follows_the_tolerance_over_kinks_and_jumps(pushed, kind):
    signal, stiffness = mechc.Signal(TIMES, VALUES, kind), {"k": 60.0}

    def end(rtol, **policy):
        return pushed.simulate(
            END, [0.1, 0.0], stiffness, inputs={"F": signal}, rtol=rtol, **policy
        ).y[-1]

    exact = end(1e-14, method="gauss8")
    for method in ("gauss8", "dop853"):
        errors = [np.abs(end(rtol, method=method) - exact).max() for rtol in (1e-5, 1e-8, 1e-11)]
        assert errors[0] < 2e-5
        assert errors[1] < 2e-8
        assert errors[2] < 2e-11


def test_a_pulse_after_a_long_rest_is_not_stepped_over(pushed):
    times, values = np.linspace(0, 100, 10001), np.zeros(10001)
    values[5000:5003] = 1.0  # 0.03 s in 100
    for kind, impulse in (("previous", 0.03), ("linear", 0.03), ("cubic", 0.03)):
        signal = mechc.Signal(times, values, kind)
        for method in ("gauss8", "dop853"):
            sol = pushed.simulate(100, [0.0, 0.0], inputs={"F": signal}, method=method, rtol=1e-6)
            assert sol["u"][-1] == pytest.approx(impulse / MASS, rel=1e-6)
            assert sol.stats["steps"] < 200


def test_samples_of_a_smooth_function_cost_no_steps(pushed):
    times = np.linspace(0, 10, 5001)
    signal = mechc.Signal(times, np.cos(times))
    sol = pushed.simulate(10, [0.0, 0.0], inputs={"F": signal}, rtol=1e-9)
    assert sol.stats["steps"] < 60
    assert sol["q"][-1] == pytest.approx((1 - np.cos(10)) / MASS, abs=1e-9)


@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
def test_runs_backwards_and_in_two_parts_are_the_same_motion(pushed, kind):
    driven = pushed.with_inputs({"F": mechc.Signal(TIMES, VALUES, kind)})
    whole = driven.simulate(END, [0.2, 0.1], rtol=1e-10)
    back = driven.simulate((END, 0.0), whole.y[-1], rtol=1e-10)
    np.testing.assert_allclose(back.y[-1], [0.2, 0.1], atol=1e-9)
    first = driven.simulate(0.5, [0.2, 0.1], rtol=1e-10)  # ends at a knot
    rest = first.continue_to(END)
    np.testing.assert_allclose(rest.y[-1], whole.y[-1], atol=1e-9)
    between = np.linspace(0.0, END, 57)
    np.testing.assert_allclose(rest(between), whole(between), atol=1e-8)


def test_a_jump_has_the_value_of_its_own_side(pushed):
    """Accelerations of a forward run and of one backwards, both beside the jump at 0.5 s."""
    driven = pushed.with_inputs({"F": mechc.Signal([0.0, 0.5, 1.0], [2.0, 6.0, 0.0], "previous")})
    forwards = driven.simulate((0.0, 1.0), [0.0, 0.0], rtol=1e-10)
    backwards = driven.simulate((1.0, 0.0), forwards.y[-1], rtol=1e-10)
    for sol in (forwards, backwards):
        for side, force in ((-1e-3, 2.0), (1e-3, 6.0)):
            slope = (sol(0.5 + side)[1] - sol(0.5)[1]) / side
            assert slope == pytest.approx(force / MASS, rel=1e-9)
    assert driven.rhs(0.5, [0.0, 0.0])[1] == 3.0  # by itself, what follows the jump


def test_numbers_and_functions_are_inputs_too(pushed):
    y = [0.3, 0.2]
    assert pushed.rhs(0.0, y, inputs={"F": 3.0})[1] == 1.5
    assert pushed.rhs(0.5, y, inputs={"F": np.sin})[1] == pytest.approx(np.sin(0.5) / 2)
    spring = pushed.with_inputs({"F": lambda t, q, u: t - 8.0 * q[0] + u[0]})
    assert spring.rhs(1.0, y)[1] == pytest.approx((1.0 - 2.4 + 0.2) / 2)
    many = spring.rhs(np.array([0.0, 1.0, 2.0]), np.array([y] * 3))
    np.testing.assert_allclose(many[:, 1], (np.arange(3) - 2.2) / 2)
    assert pushed.kinetic_energy(y) == pytest.approx(0.04)  # holds no input


def test_a_spring_called_back_is_the_spring_compiled(pushed):
    sol = pushed.simulate(5.0, [1.0, 0.0], inputs={"F": lambda t, q, u: -8.0 * q[0]}, rtol=1e-10)
    compiled = pushed.simulate(5.0, [1.0, 0.0], {"k": 8.0}, inputs={"F": 0.0}, rtol=1e-10)
    np.testing.assert_allclose(sol.y[-1], compiled.y[-1], atol=1e-9)
    assert sol.y[-1, 0] == pytest.approx(np.cos(10.0), abs=1e-8)
    assert not compiled.status.warnings
    assert "The input F is a Python function" in str(sol.status)


def test_the_error_follows_the_tolerance_over_the_kinks_of_a_function(pushed):
    """A spring with a stop: between its kinks the motion is in closed form, piece by piece."""

    def stopped(time, q, u):
        return min(max(-8.0 * q[0], -4.0), 4.0)

    driven = pushed.with_inputs({"F": stopped})
    sol = driven.simulate(3.0, [2.0, 0.0], rtol=1e-9)
    assert sol.stats["method"] == "dop853"
    fall = np.sqrt(1.5)  # from 2 m to 0.5 m at -2 m/s2
    rate, phase = 2.0, 3.0 - fall
    turn = np.arctan(0.5 * rate / (2.0 * fall)) * 2 / rate  # from 0.5 m to -0.5 m
    assert turn < phase
    speed, left = 2.0 * fall, phase - turn
    q = -0.5 - speed * left + left**2
    assert sol["q"][-1] == pytest.approx(q, abs=3e-8)
    (told,) = sol.status.warnings  # one call an evaluation, whatever the width of the lanes
    attempts = sol.stats["steps"] + sol.stats["rejected"]
    assert int(told.split(":")[1].split()[0]) < 20 * attempts


def test_several_signals_break_a_run_at_the_knots_of_each():
    q, u, f, g = dynamicsymbols("q u f g")
    kane = particle([q], [u], [f * g], 1)
    model = mechc.compile(kane, name="product")
    assert model.inputs == ("f", "g")
    steps = mechc.Signal([0.0, 0.7, 2.0], [1.0, 3.0, 0.0], "previous", outside="hold")
    line = mechc.Signal([0.0, 1.1, 2.0], [0.0, 1.1, 1.1], "linear")
    sol = model.simulate(2.0, [0.0, 0.0], inputs={"f": steps, "g": line}, rtol=1e-10)
    assert {0.7, 1.1} <= set(sol.t)
    speed = 0.5 * 0.7**2 + 3.0 * (0.5 * (1.1**2 - 0.7**2) + 1.1 * 0.9)
    assert sol["u"][-1] == pytest.approx(speed, abs=1e-10)
    with pytest.raises(mechc.MissingInputError, match=r"no value: g\. Give each"):
        model.simulate(2.0, [0.0, 0.0], inputs={"f": steps})


def test_outputs_histories_and_files_know_the_inputs(pushed, tmp_path):
    signal = mechc.Signal(TIMES, VALUES, "linear")
    sol = pushed.simulate(END, [0.0, 0.5], inputs={"F": signal}, rtol=1e-10)
    power = sol.model.output("power", sol.y, t=sol.t)
    np.testing.assert_allclose(power, signal(sol.t) * sol["u"], rtol=1e-13)
    saved = sol.save(tmp_path / "run.nc")
    again = mechc.open(saved)
    np.testing.assert_array_equal(again.y, sol.y)
    np.testing.assert_array_equal(again.model.output("power", sol.y, t=sol.t), power)
    called = pushed.simulate(END, [0.0, 0.5], inputs={"F": lambda t: 0.1}, rtol=1e-10)
    saved = called.save(tmp_path / "called.nc")
    with pytest.raises(
        mechc.MissingInputError, match=r"called.nc does not hold the inputs .*with_inputs"
    ):
        mechc.open(saved)
    again = mechc.open(saved, pushed.with_inputs({"F": 0.1}))
    np.testing.assert_allclose(again.y, called.y, atol=1e-9)
    assert sol.save(tmp_path / "run.csv").exists()
    assert sol.to_xarray()["q"].shape == sol.t.shape
    assert "finished" in sol._repr_html_()
    assert "given with a run (inputs): F" in pushed.report()


def test_events_are_found_across_kinks(pushed):
    signal = mechc.Signal([0.0, 1.0, 2.0, 3.0], [2.0, -6.0, 2.0, 2.0], "previous")
    event = mechc.Event(lambda t, y: y[1] + 1.0, direction=-1, terminal=True)
    sol = pushed.simulate(3.0, [0.0, 0.0], inputs={"F": signal}, events=[event], rtol=1e-10)
    assert sol.status.code == "stopped by an event"
    assert sol.events[0].t[0] == pytest.approx(1.0 + 2.0 / 3.0, abs=1e-11)


# -- motion that is prescribed ------------------------------------------------------------------

DEFAULTS = {"m": 2.0, "g": 9.81, "l": 1.0}


def crane():
    """A bob on a rod whose pivot is moved by the input r: holonomic, it needs r' and r''."""
    x, y, u, v, r = dynamicsymbols("x y u_x u_y r")
    m, g, l = (Symbol(name) for name in DEFAULTS)
    closed = (x - r) ** 2 + y**2 - l**2
    return particle([x, y], [u, v], [0, -m * g], closed=[closed])


MOVED = (
    lambda t: 0.3 * np.sin(2 * t),
    lambda t: 0.6 * np.cos(2 * t),
    lambda t: -1.2 * np.sin(2 * t),
)


@pytest.fixture(scope="module")
def driven():
    return mechc.compile(crane(), name="crane", defaults=DEFAULTS)


@pytest.fixture(scope="module")
def expected():
    """The same motion with r as an expression."""
    wave = Rational(3, 10) * sin(2 * t)
    model = mechc.compile(crane(), name="moved", defaults=DEFAULTS, inputs={"r": wave})
    return model.simulate(4.0, start(model), rtol=1e-10)


def start(model):
    return model.assemble({"x": 0.5}, {"u_x": 0.0}, guess={"y": -0.8})


def test_prescribed_motion_by_functions_is_that_of_the_expression(driven, expected):
    model = driven.with_inputs({"r": MOVED})
    y0 = start(model)
    np.testing.assert_allclose(y0, expected.y[0], atol=1e-14)
    sol = model.simulate(4.0, y0, rtol=1e-10)
    np.testing.assert_allclose(sol.y[-1], expected.y[-1], atol=1e-12)
    assert sol.closure.max() < 1e-14
    assert sol.velocity_closure.max() < 1e-13


@pytest.mark.slow
def test_prescribed_motion_by_splines_converges_to_it(driven, expected):
    times = np.linspace(-0.5, 4.5, 501)
    for kind, error in (("cubic", 1e-7), ("quintic", 1e-10)):
        model = driven.with_inputs({"r": mechc.Signal(times, MOVED[0](times), kind)})
        sol = model.simulate(4.0, start(model), rtol=1e-10)
        np.testing.assert_allclose(sol.y[-1], expected.y[-1], atol=error)
        assert sol.closure.max() < 1e-14
        between = np.linspace(0.0, 4.0, 101)
        assert np.abs(model.constraints(sol(between), t=between)).max() < 1e-14


def test_an_input_whose_rates_are_needed_must_give_them(driven):
    times = np.linspace(0.0, 5.0, 51)
    for given, told in (
        (MOVED[0], r"up to order 2.*give 3 functions"),
        (mechc.Signal(times, np.sin(times), "linear"), r"'cubic' or 'quintic'"),
        (mechc.Signal(times, np.sin(times), outside="hold"), r"without outside='hold'"),
        ((lambda t, q, u: q[0],) * 3, r"function of time only"),
    ):
        with pytest.raises(mechc.ValueOutOfBoundsError, match=told):
            driven.with_inputs({"r": given})


# -- what goes wrong ----------------------------------------------------------------------------


def test_an_output_of_the_state_alone_needs_no_input():
    """One of the user's own that contains an acceleration does."""
    mass = pushed_mass()
    q, u = mass.q[0], mass.u[0]
    model = mechc.compile(mass, outputs=["energy", {"square": q**2, "rate": u.diff(t)}])
    assert model.output("square", [0.5, 0.0], {"k": 1.0, "m": MASS}) == 0.25
    with pytest.raises(mechc.MissingInputError, match="no value: F"):
        model.output("rate", [0.5, 0.0], {"k": 1.0, "m": MASS})


def test_inputs_without_a_value_are_asked_for_by_name(pushed):
    for ask in (
        lambda: pushed.rhs(0.0, [0.0, 0.0]),
        lambda: pushed.simulate(1.0, [0.0, 0.0]),
        lambda: pushed.output("power", [0.0, 0.0]),
    ):
        with pytest.raises(mechc.MissingInputError, match=r"no value: F\. Give each as a number"):
            ask()
    with pytest.raises(mechc.UnknownNameError, match="no input is called 'f'; known are F"):
        pushed.simulate(1.0, [0.0, 0.0], inputs={"f": 1.0})
    with pytest.raises(mechc.UnknownNameError, match="no input is called 'torque'"):
        mechc.load("four_bar").simulate(1.0, np.zeros(6), inputs={"torque": 1.0})


@pytest.mark.parametrize("value", [b"three", np.nan, None, Symbol("x"), [1.0, 2.0], {}])
def test_what_is_no_input_is_refused(pushed, value):
    with pytest.raises(
        mechc.ValueOutOfBoundsError, match=r"the input F(: .* is not| must be) a (finite )?number"
    ):
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": value})


def test_rates_of_a_driven_model_go_into_an_array(pushed):
    """By the compiled table of rows as by any other way: m u' = F - k q."""
    y, out = np.array([[0.3, 0.7], [0.1, -0.2]]), np.empty((2, 2))
    driven = pushed.with_inputs({"F": lambda t: 5.0 + t})
    assert driven.rhs(1.0, y, out=out) is out
    np.testing.assert_allclose(out, np.column_stack([y[:, 1], [6.0 / MASS] * 2]), rtol=1e-14)
    np.testing.assert_array_equal(driven.rhs(1.0, y), out)


def test_compiled_code_without_inputs_gives_no_number(pushed):
    """Whatever calls it below the model: NaN, never what happens to lie in memory."""
    scene = pushed.system.scene._scene
    y, p = np.zeros((3, 2)), np.array([[MASS, 0.0]])
    rates = scene.evaluate("rates", np.zeros(1), y, p)
    assert np.isnan(rates[:, 1]).all()
    np.testing.assert_array_equal(rates[:, 0], 0.0)


def test_a_function_of_other_arguments_is_refused(pushed):
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"of t, or of t, q and u; it takes \(a"):
        pushed.with_inputs({"F": lambda a, b, c, d: 0.0})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="which of them is the time"):
        pushed.with_inputs({"F": lambda a, b: 0.0})


def test_a_run_beyond_the_samples_is_refused_unless_they_are_held(pushed):
    signal = mechc.Signal([0.0, 1.0, 2.0], [1.0, 1.0, 3.0], "linear")
    for span in (2.5, (-0.5, 1.0)):
        with pytest.raises(mechc.ValueOutOfBoundsError, match="F is sampled from 0 to 2 s, but"):
            pushed.simulate(span, [0.0, 0.0], inputs={"F": signal})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="needed at 3 s"):
        pushed.rhs(3.0, [0.0, 0.0], inputs={"F": signal})
    held = mechc.Signal([0.0, 1.0, 2.0], [1.0, 1.0, 3.0], "linear", outside="hold")
    sol = pushed.simulate((-1.0, 4.0), [0.0, 0.0], inputs={"F": held}, rtol=1e-10)
    assert sol["u"][-1] == pytest.approx((1.0 + 1.0 + 2.0 + 6.0) / MASS, abs=1e-10)
    assert held(-5.0) == 1.0
    assert held(7.0) == 3.0


def test_a_function_that_fails_ends_the_run_and_is_told(pushed):
    def broken(time):
        return 1.0 / (time < 0.6)

    with pytest.raises(mechc.InputError, match=r"F failed at t = .*ZeroDivisionError") as caught:
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": broken}, max_step=0.05)
    sol = caught.value.solution
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert sol.status.code == "input failed"
    assert 0.5 < sol.t[-1] <= 0.6
    np.testing.assert_allclose(sol["u"][-1], sol.t[-1] / MASS, rtol=1e-9)
    with pytest.raises(mechc.InputError, match="returned no finite number"):
        pushed.rhs(0.0, [0.0, 0.0], inputs={"F": lambda t: np.inf})
    with pytest.raises(mechc.InputError, match="TypeError"):
        pushed.rhs(0.0, [0.0, 0.0], inputs={"F": lambda t: "much"})
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)


def test_a_function_that_gives_other_values_for_the_same_time_is_refused(pushed):
    noise = np.random.default_rng(0)
    with pytest.raises(mechc.errors.InputError, match=r"returned 0.12573 and then -0.132105"):
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": lambda t: noise.normal()})


def test_collocation_may_miss_jumps_of_a_function_and_says_so(pushed):
    jump = {"F": lambda t: 5.0 if t < 1.234 else -5.0}
    notes = [pushed.simulate(5.0, [0.0, 0.0], inputs=jump, method=method).status.warnings
             for method in ("auto", "gauss8")]  # fmt: skip
    assert not any("may miss a jump" in note for note in notes[0])
    assert any("may miss a jump" in note for note in notes[1])
    batch = pushed.simulate_batch(
        5.0, np.zeros((2, 2)), inputs=jump, method="gauss8", progress=False
    )
    assert any("may miss a jump" in note for note in batch.warnings)


def test_ctrl_c_in_a_function_keeps_what_was_computed(pushed):
    def interrupted(time):
        if time > 0.5:
            raise KeyboardInterrupt
        return 1.0

    with pytest.raises(KeyboardInterrupt) as interrupt:
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": interrupted}, max_step=0.05)
    sol = interrupt.value.solution
    assert sol.status.code == "interrupted"
    assert 0.4 < sol.t[-1] <= 0.5


# -- C functions ----------------------------------------------------------------------------


def called(function, time, y):
    out = np.full(function.width, 7.0)
    function.ctypes(time, y.ctypes.data, out.ctypes.data, function.data)
    return out


@pytest.mark.compiles
@pytest.mark.parametrize(
    "force",
    [
        2.5,
        mechc.Signal(TIMES, VALUES, "previous"),
        mechc.Signal(TIMES, VALUES, "cubic", outside="hold"),
        lambda t: 3.0 * np.cos(2.0 * t),
        lambda t, q, u: -2.0 * u[0] + q[0] - t,
    ],
    ids=["a number", "steps", "held", "of time", "of the state"],
)
def test_c_functions_keep_the_inputs_they_were_made_with(pushed, force):
    driven = pushed.with_inputs({"F": force})
    y, times = np.array([0.3, -0.2]), [0.0, 0.5, 0.77, END]
    expected = [driven.rhs(t, y, {"k": 3.0}) for t in times]
    function = driven.c_function("rates", {"k": 3.0})
    work = driven.integrand("power", "t", y)
    del driven
    gc.collect()
    for at, rates in zip(times, expected, strict=True):
        np.testing.assert_array_equal(called(function, at, y), rates)
    exact = quad(lambda t: -0.2 * MASS * pushed.rhs(t, y, inputs={"F": force})[1], 0.0, 0.4)[0]
    assert quad(work, 0.0, 0.4)[0] == pytest.approx(exact, rel=1e-12)
    assert function.failure is None


@pytest.mark.compiles
def test_a_c_function_is_nan_beyond_the_samples_and_after_a_failure(pushed):
    y, steps = np.array([0.3, -0.2]), mechc.Signal(TIMES, VALUES, "previous")
    for kind in ("previous", "linear", "quintic"):
        signal = mechc.Signal(TIMES, VALUES, kind)
        function = pushed.with_inputs({"F": signal}).c_function()
        for at, known in ((-1e-9, False), (0.0, True), (END, True), (END + 1e-9, False)):
            assert np.isfinite(called(function, at, y)).all() == known
    number = pushed.with_inputs({"F": 1.0})
    both = number.c_function(), pushed.with_inputs({"F": steps}).c_function("kinetic_energy")
    assert called(both[1], 99.0, y) == pytest.approx(0.04, rel=1e-14)  # it contains no input
    failing = pushed.with_inputs({"F": lambda t: 1.0 / (t < 0.6)})
    function = failing.c_function()
    assert called(function, 0.1, y)[1] == 0.5
    assert np.isnan(called(function, 0.7, y)[1])
    assert np.isnan(called(function, 0.1, y)[1])
    name, at, error = function.failure
    assert (name, at, type(error)) == ("F", 0.7, ZeroDivisionError)
    assert failing.rhs(0.1, y)[1] == 0.5, "others are not concerned"
    with pytest.raises(mechc.MissingInputError, match="no value: F"):
        pushed.c_function("rates")


def test_accelerations_of_points_are_those_that_inputs_make():
    """Their expression has the acceleration in place of the input: m x'' = F - k x."""
    model = mechc.compile(
        pushed_mass(), defaults={"m": 2.0, "k": 1.0}, outputs=("accelerations",)
    ).with_inputs({"F": lambda t: 2.0 * t})
    found = model.output("point_accelerations", [0.3, 0.1], t=0.5)
    np.testing.assert_allclose(found, [[(1.0 - 0.3) / 2.0, 0.0, 0.0]], rtol=1e-14)
