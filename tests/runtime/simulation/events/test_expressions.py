"""Events and resets as texts and expressions of SymPy: what they mean, and what is refused."""

import numpy as np
import pytest
from sympy import Max, Symbol, asinh
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc.compilation.event_tapes import COMPILER
from mechc.errors import EventError, MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.simulation.events.run_events import Compiler, run_events
from tests.support.impacts import points_on_a_line


def read(model, *events):
    p = model.system.parameter_set.resolve({"m": 2.0} if "m" in model.parameters else None)
    return run_events(list(events), model.system, p, Compiler(*COMPILER))


def test_texts_and_expressions_mean_the_same(ball):
    q, u, m, t = *dynamicsymbols("q_0 u_0"), Symbol("m"), dynamicsymbols._t
    state = np.array([0.3, -1.5])
    for given, value, direction in (
        ("q_0 - m/2", -0.7, 0.0),
        (q - m / 2, -0.7, 0.0),
        ("q_0 > m/2", -0.7, 1.0),
        (q < m / 2, -0.7, -1.0),
        ("u_0 + t <= 0", -1.1, -1.0),
        ("max(q_0, u_0, 0) + sign(u_0)", -0.7, 0.0),
        (u + t, -1.1, 0.0),
        (Max(q, u), 0.3, 0.0),
        (q * m, 0.6, 0.0),
    ):
        (event,) = read(ball, given)
        assert event.function(0.4, state) == pytest.approx(value)
        assert event.direction == direction


@pytest.mark.parametrize(
    "text",
    [
        "x > 300deg",
        "x*v > 3mm",
        "x + v > 3mm",
        "l_0*sin(theta) > 2kg",
        "x**2 > 4 m",
        "x > 2 t",
        "theta*l_0 > 1 deg",
    ],
)
def test_units_are_those_of_what_is_compared(text):
    with pytest.raises(MechcError, match=r"not one of its units|different units"):
        read(mechc.load("slider_crank"), text)


@pytest.mark.parametrize(
    ("text", "level"),
    [("l_0*sin(theta) > 30 mm", 0.03), ("x**2 > 4 cm^2", 4e-4), ("v/omega < 2 mm", 2e-3),
     ("omega*l_0 > 3 km/h", 3 / 3.6),
     ("abs(x - l_0) > 3 cm", 0.03), ("max(x, l_0) < 3 cm", 0.03),
     ("theta - 1 > 3 deg", np.radians(3)),
     ("sin(theta) > 0.5", 0.5)],
)  # fmt: skip
def test_units_of_expressions_follow_from_those_of_their_parts(text, level):
    model = mechc.load("slider_crank")
    state = np.arange(1.0, 7.0) / 10
    (event,) = read(model, text)
    (bare,) = read(model, text.partition("<" if "<" in text else ">")[0])
    assert bare.function(0.0, state) - event.function(0.0, state) == pytest.approx(level)


def test_a_level_of_unknown_unit_has_any_but_no_name_of_the_model(ball):
    (event,) = read(ball, "q_0*u_0 > 3mm")
    assert event.function(0.0, np.zeros(2)) == -0.003
    with pytest.raises(MechcError, match="q_0: m in '2 m' is a unit and a name of the model"):
        read(ball, "q_0 > 2 m")


@pytest.mark.parametrize(
    ("text", "value", "direction"),
    [
        ("v > 200mm/s", 0.05, 1.0),
        ("2*v <= 20 cm/s + 0", None, 0.0),
        ("0.2m/s > v", -0.05, 1.0),
        ("v < 3.6km/h", -0.75, -1.0),
        ("t > 500ms", -0.1, 1.0),
        ("t >= 0.01 min", -0.2, 1.0),
        ("500 ms < t", 0.1, -1.0),
        ("x > 100mm", 0.2, 1.0),
    ],
)
def test_units_of_speeds_and_times_are_those_of_other_values(text, value, direction):
    model = mechc.load("slider_crank")
    state = np.zeros(6)
    state[model.coordinates.index("x")], state[3 + model.speeds.index("v")] = 0.3, 0.25
    if value is None:
        with pytest.raises(ValueOutOfBoundsError, match=r"use m/s or mm/s or km/h"):
            read(model, text)
        return
    (event,) = read(model, text)
    assert event.function(0.4, state) == pytest.approx(value)
    assert event.direction == direction


def test_resets_have_signs_and_bounds(ball):
    """Texts had no sign, max and min; derivatives are those beside the jumps."""
    texts = {"q_0": "Max(q_0, -1/2) + Min(0, 1)", "u_0": "-sign(u_0)*min(abs(u_0), 2)"}
    (event,) = read(ball, mechc.Event("q_0", reset=texts))
    q, u = event.reset(0.0, np.array([-0.7]), np.array([-3.0]))
    assert (q[0], u[0]) == (-0.5, 2.0)
    _, by_state, _ = event.reset.slopes(0.0, np.array([-0.2, -1.5]))
    np.testing.assert_array_equal(by_state, [[1.0, 0.0], [0.0, -1.0]])
    sol = ball.simulate(2.0, [1.0, 0.0], events=mechc.Event("q_0", -1.0, reset=texts))
    assert np.abs(sol.segments[1].y0) == pytest.approx([0.0, 2.0])


def test_a_reset_that_changes_nothing(ball):
    """An empty one ended in ``unhashable type: 'dict'``."""
    sol = ball.simulate(0.5, [1.0, 0.0], events=mechc.Event("q_0 - 1/2", reset={}))
    assert len(sol.segments) == 2
    np.testing.assert_array_equal(sol.segments[0].y1, sol.segments[1].y0)


def test_slopes_are_the_derivatives(ball):
    (event,) = read(ball, mechc.Event("q_0*m + u_0**2*t", reset={"u_0": "-u_0/m + q_0*t"}))
    t, y = 0.4, np.array([0.3, -1.5])
    by_time, by_state, by_parameters = event.function.slopes(t, y)
    assert by_time == pytest.approx(2.25)
    np.testing.assert_allclose(by_state, [2.0, -1.2])
    np.testing.assert_allclose(by_parameters, [0.0, 0.0, 0.3])
    by_time, by_state, by_parameters = event.reset.slopes(t, y)
    np.testing.assert_allclose(by_time, [0.0, 0.3])
    np.testing.assert_allclose(by_state, [[1.0, 0.0], [0.4, -0.5]])
    np.testing.assert_allclose(by_parameters, [[0, 0, 0.0], [0, 0, -1.5 / 4]])
    q, u = event.reset(t, y[:1], y[1:])
    assert (q[0], u[0]) == (0.3, pytest.approx(0.75 + 0.12))


def test_what_has_no_form_in_c_runs_in_python(ball):
    q = dynamicsymbols("q_0")
    plain = mechc.Event(asinh(q) - 0.5, reset={"u_0": "-u_0"})
    assert read(ball, plain).bound.calls_python
    sol = ball.simulate(0.5, [1.0, 0.0], events=plain)
    assert len(sol.segments) == 2
    mixed = read(ball, mechc.Event("q_0", reset={"u_0": 0}), lambda t, y: y[1])
    assert mixed.bound.calls_python
    assert not read(ball, mechc.Event("q_0", reset={"u_0": 0})).bound.calls_python


# -- a parameter that a reset changes: a state whose rate is zero -------------------------------


def softening():
    """A mass on a spring whose stiffness is a state, and outputs with it."""
    q, u, k = dynamicsymbols("q u k")
    kane = particle([q], [u], [-k * q], potential=k * q**2 / 2)
    return mechc.compile(
        kane, name="softening", states={k: 0}, defaults={"m": 1.0},
        outputs=("energy", "sensitivities", {"force": -k * q}),
    )  # fmt: skip


def softened(k, times):
    """Position, stiffness, speed in closed form: a quarter of the stiffness after each turn at the
    far side; the frequency is halved at pi/w and at 5 pi/w."""
    w = np.sqrt(k)
    turns = np.array([np.pi / w, 5 * np.pi / w])
    part = np.searchsorted(turns, times, side="right")
    since = times - np.array([0.0, *turns])[part]
    own, sign = w * 0.5**part, np.array([1.0, -1.0, -1.0])[part]
    return np.stack([sign * np.cos(own * since), own**2, -sign * own * np.sin(own * since)], -1)


@pytest.mark.slow
def test_a_parameter_is_reset_as_a_state(tmp_path):
    model = softening()
    times, start = np.linspace(0.0, 9.0, 37), {"q": 1.0, "k": 4.0}
    compiled = mechc.Event("u", direction=1, reset={"k": "k/4"})
    by_python = mechc.Event(
        lambda t, y: y[2], direction=1, reset=lambda t, q, u: ([q[0], q[1] / 4], u)
    )
    exact = softened(4.0, times)
    runs = [model.simulate(9.0, start, events=event, rtol=1e-12) for event in (compiled, by_python)]
    for sol in (*runs, mechc.open(runs[0].save(tmp_path / "run.nc"), model=model)):
        np.testing.assert_allclose(sol(times), exact, atol=1e-10)
        assert [part.y0[1] for part in sol.segments] == [4.0, 1.0, 0.25]
        force = sol.model.output("force", sol(times))
        np.testing.assert_allclose(force, -exact[:, 0] * exact[:, 1], atol=1e-10)
        np.testing.assert_allclose(sol.energy[[0, -1]], [2.0, 0.125], atol=1e-11)
    batch = model.simulate_batch(
        9.0, [[1.0, 4.0, 0.0], [1.0, 9.0, 0.0]], events=compiled, rtol=1e-12, progress=False,
        lockstep=False,
    )  # fmt: skip
    np.testing.assert_array_equal(batch.y[0], runs[0].y[-1])
    assert batch.event_counts[:, 0].tolist() == [2, 2]
    by = model.simulate(9.0, start, events=compiled, rtol=1e-12, sensitivities=["k"])
    slope = np.sin(9.0 / 2 - 5 * np.pi / 4) * 9.0 / (8 * 2)
    np.testing.assert_allclose(by.sensitivity["k"][-1][:2], [slope, 1 / 16], atol=1e-10)


@pytest.mark.slow
def test_a_parameter_is_reset(tmp_path):
    """The same motion as above, where the stiffness is a true parameter."""
    k = Symbol("k")
    spring = points_on_a_line("spring", 1, lambda q, u, m: -k * q, parameters={"k": 4.0})
    times, start = np.linspace(0.0, 9.0, 37), [1.0, 0.0]
    event, left = mechc.Event("u_0", direction=1, reset={"k": "k/4"}), [1.0, 0.25]
    by_python = mechc.Event(
        lambda t, y: y[1], direction=1, reset=lambda t, q, u: {"k": left.pop(0)}
    )
    exact = softened(4.0, times)
    runs = [spring.simulate(9.0, start, events=each, rtol=1e-12) for each in (event, by_python)]
    early = spring.simulate(6.0, start, events=event, rtol=1e-12)
    opened = mechc.open(runs[0].save(tmp_path / "run.nc"), model=spring)
    for sol in (*runs, opened, early.continue_to(9.0)):
        np.testing.assert_allclose(sol(times), exact[:, [0, 2]], atol=1e-10)
        np.testing.assert_array_equal(sol.params_at(times)[:, 0], exact[:, 1])
        assert [part.params[0] for part in sol.segments] == [4.0, 1.0, 0.25]
        assert sol.params[0] == 4.0
        np.testing.assert_allclose(sol.energy[[0, -1]], [2.0, 0.125], atol=1e-11)
        assert sol.energy_drift < 1e-10
    batch = spring.simulate_batch(
        9.0, [start, start], {"k": [4.0, 9.0]}, events=event, rtol=1e-12, t_eval=times,
        outputs=["potential_energy"], reduce=["min(q_0)", "mean(potential_energy)"],
    )  # fmt: skip
    assert batch["min(q_0)"][0] == pytest.approx(-1.0, abs=1e-11)
    fine = np.linspace(0.0, 9.0, 90_001)
    known = softened(4.0, fine)
    mean = np.trapezoid(0.5 * known[:, 1] * known[:, 0] ** 2, fine) / 9.0
    assert batch["mean(potential_energy)"][0] == pytest.approx(mean, rel=1e-4)
    same = spring.simulate(9.0, start, events=event, rtol=1e-12, method=batch.method)
    np.testing.assert_array_equal(batch.y[0], same.y[-1])
    assert batch.event_counts[:, 0].tolist() == [2, 2]
    potential = 0.5 * exact[:, 1] * exact[:, 0] ** 2
    np.testing.assert_allclose(batch["potential_energy"][0], potential, atol=1e-10)
    with pytest.raises(MechcError, match="resets change parameters"):
        runs[0].gradient(end="q_0", by=["k"])
    wrong = mechc.Event("theta_0 < 0", reset={"m_0": "-m_0"})
    with pytest.raises(EventError, match="m_0"):
        mechc.load("pendulum").simulate(2.0, [0.5, 0.0], events=wrong)


def test_what_is_wrong_is_told(ball):
    for given, error, words in (
        (mechc.Event("q_0", reset={"v": "2"}), UnknownNameError, "v"),
        (mechc.Event("q_0", reset={"u_0": "v"}), MechcError, "'v' is not known"),
        (mechc.Event("q_0", reset={"u_0": Symbol("v")}), UnknownNameError, "v"),
        (mechc.Event("q_0", reset={"u_0": [1, 2]}), ValueOutOfBoundsError, "events are made of"),
        (mechc.Event("q_0", reset="-u_0"), ValueOutOfBoundsError, "mapping"),
        ("q_0 +", MechcError, "too early"),
        ("__import__('os')", MechcError, "cannot read"),
    ):
        with pytest.raises(error, match=words):
            ball.simulate(1.0, [1.0, 0.0], events=given)


def test_events_are_called_as_they_were_written(ball, tmp_path):
    """In results, in files, and on the time line of the page in space."""
    from mechc.results.player.motion import marks
    from mechc.results.sampling import sample

    def low(t, y):
        return y[0] - 0.5

    q, u = dynamicsymbols("q_0 u_0")
    events = ["q_0 < m/2", q + 2 * u, mechc.Event("u_0 + 1", direction=-1), low, lambda t, y: y[1]]
    sol = ball.simulate(0.5, {"q_0": 1.0, "u_0": 0.5}, {"m": 1.0}, events=events)
    titles = ("q_0 < m/2", "q_0 + 2*u_0", "u_0 + 1", "low", "event 4")
    assert sol.event_titles == titles
    told = [mark["label"] for mark in marks(sample(sol, 10))]
    assert set(told) <= set(titles)
    assert {"q_0 < m/2", "u_0 + 1"} <= set(told)
    again = mechc.open(sol.save(tmp_path / "ball.nc"), ball)
    assert again.event_titles == titles
