"""Derivatives of event times, and through the resets of events."""

import numpy as np
import pytest
from mpmath import mpf, sqrt, workdps

import mechc
from tests.runtime.sensitivities.test_loops import REGULAR, START, bar
from tests.runtime.sensitivities.test_run import GIVEN, T, swing
from tests.support.differences import apart, extrapolated
from tests.support.impacts import points_on_a_line

__all__ = ["bar", "swing"]  # compiled scenes of other tests
Q, U = 0.7, -0.5
PUSH = mechc.Signal([0.0, 0.25, 1.4, 3.0], [0.3, -0.8, 0.5, 0.5], "previous")
BOUNCE = mechc.Event(lambda t, y: y[0], reset=lambda t, q, u: (q, -0.8 * u))


def bounced(swing, name, events=BOUNCE, **policy):
    """The run as a function of a change of one name."""

    def run(change):
        y0, params = {"q": Q, "u": U}, dict(GIVEN)
        given = y0 if name in y0 else params
        given[name] += change
        return swing.simulate(T, y0, params, inputs={"F": PUSH}, events=events, **policy)

    return run


@pytest.mark.parametrize("name", ["l", "c", "q", "u"])
def test_through_three_resets_and_jumps_of_an_input(swing, name):
    run = bounced(swing, name, rtol=1e-13)
    sol = bounced(swing, name, rtol=1e-11, sensitivities=[name])(0.0)
    assert len(sol.events[0].t) >= 2
    wanted = extrapolated(lambda change: run(change).y[-1], 0.004)
    assert apart(sol.sensitivity[name][-1], wanted) < 1e-8
    times = extrapolated(lambda change: run(change).events[0].t, 0.004)
    assert apart(sol.sensitivity.events[0].t[name], times) < 1e-8
    states = extrapolated(lambda change: run(change).events[0].y.reshape(-1), 0.004)
    assert apart(sol.sensitivity.events[0].y[name].reshape(-1), states) < 1e-8
    backwards = sol.gradient(end=np.array([1.0, -2.0]), by=[name])[name]
    forwards = sol.sensitivity[name][-1] @ [1.0, -2.0]
    assert abs(backwards - forwards) < 1e-9 * np.abs(sol.sensitivity[name][-1]).max()


def action(sol):
    """The integral of the kinetic energy, by quadrature on every step."""
    s, w = np.polynomial.legendre.leggauss(8)
    t = sol.record.states()[0]
    points = t[:-1, None] + np.diff(t)[:, None] * (0.5 + 0.5 * s)
    energy = sol.model.kinetic_energy(sol(points.ravel()), sol.params).reshape(points.shape)
    return np.diff(t) @ energy @ w / 2


@pytest.mark.parametrize("name", ["l", "q"])
def test_an_integral_whose_integrand_jumps_where_the_event_moves(swing, name):
    found = bounced(swing, name, rtol=1e-11)(0.0).gradient(integral="kinetic_energy", by=[name])
    wanted = extrapolated(lambda change: action(bounced(swing, name, rtol=1e-13)(change)), 0.004)
    assert apart(found[name], wanted) < 1e-7


def test_before_and_after_a_reset(swing):
    """Of the two rows at its time the first is before it; between them the columns jump."""
    sol = bounced(swing, "q", sensitivities=["q"])(0.0)
    hit = sol.events[0].t[0]
    before, after = np.flatnonzero(sol.t == hit)
    columns = sol.sensitivity["q"]
    assert np.abs(columns[after] - columns[before]).max() > 0.1
    near = sol.sensitivity(np.array([hit - 1e-9, hit + 1e-9]))["q"]
    np.testing.assert_allclose(near, columns[[before, after]], rtol=1e-6, atol=1e-6)


def test_expressions_are_differentiated_by_parameters(bar):
    """Where the crank's angle passes a value that has a length in it."""
    from sympy import Symbol
    from sympy.physics.mechanics import dynamicsymbols

    passes = mechc.Event(dynamicsymbols("theta_0") - Symbol("l_3") / 2.0)

    def times(change):
        params = {"l_3": REGULAR["l_3"] + change}
        return bar.simulate(1.0, START, params, events=passes, rtol=1e-13).events[0].t

    sol = bar.simulate(1.0, START, REGULAR, events=passes, rtol=1e-11, sensitivities=["l_3"])
    assert len(sol.events[0].t) == 1
    assert apart(sol.sensitivity.events[0].t["l_3"], extrapolated(times, 0.004)) < 1e-8


@pytest.mark.parametrize("name", ["l", "q"])
def test_a_reset_that_is_an_expression_is_differentiated(swing, name):
    hit = mechc.Event("q - l/20", reset={"u": "-(1 - l/5)*u + q*t/10", "q": "q + 0"})
    run = bounced(swing, name, hit, rtol=1e-13)
    sol = bounced(swing, name, hit, rtol=1e-11, sensitivities=[name])(0.0)
    assert len(sol.events[0].t) >= 2
    wanted = extrapolated(lambda change: run(change).y[-1], 0.004)
    assert apart(sol.sensitivity[name][-1], wanted) < 1e-9


def test_through_a_compiled_reset_and_the_impulse_of_constraints(bar):
    hit = mechc.Event("theta_0 - l_3/2", reset={"omega_0": "-l_3/7*omega_0"})

    def end(change):
        params = {"l_3": REGULAR["l_3"] + change}
        return bar.simulate(1.0, START, params, events=hit, rtol=1e-13).y[-1]

    sol = bar.simulate(1.0, START, REGULAR, events=hit, rtol=1e-11, sensitivities=["l_3"])
    assert len(sol.segments) > 1
    assert apart(sol.sensitivity["l_3"][-1], extrapolated(end, 0.004)) < 1e-8


def test_through_the_impact_at_a_stop(bar):
    stop = mechc.Stop("l_3/2 - theta_0", 0.6)

    def run(change, **given):
        params = {"l_3": REGULAR["l_3"] + change}
        return bar.simulate(1.0, START, params, events=stop, rtol=1e-13, **given)

    sol = run(0.0, sensitivities=["l_3"])
    assert len(sol.segments) > 1
    wanted = extrapolated(lambda change: run(change).y[-1], 0.004)
    assert apart(sol.sensitivity["l_3"][-1], wanted) < 1e-8


def falling(height, speed, kept, end):
    """Position and speed of a ball above a floor, and the times of its impacts, in closed form."""
    g, t, q, u, times = mpf("9.81"), mpf(0), height, speed, list[mpf]()
    while True:
        down = (u + sqrt(u**2 + 2 * g * q)) / g
        if t + down > end:
            rest = end - t
            return [q + u * rest - g * rest**2 / 2, u - g * rest, *times]
        t, q, u = t + down, mpf(0), -kept * (u - g * down)
        times.append(t)


def test_a_ball_on_a_stop_against_40_digits():
    """Ends and times of three impacts by start and restitution: differences of the closed form."""
    more = {"outputs": ("sensitivities",), "parameters": ["e"]}
    ball = points_on_a_line("ball", 1, lambda q, u, m: -9.81 * m, **more)
    stop, end = mechc.Stop("q_0", "e"), 2.0
    sol = ball.simulate(
        end, {"q_0": 1.0, "u_0": 0.5}, {"e": 0.8}, events=stop, rtol=1e-12,
        sensitivities=["q_0", "u_0", "e"],
    )  # fmt: skip
    found = np.append(sol.y[-1], sol.events[0].t)
    with workdps(40):
        given = [mpf(1), mpf("0.5"), mpf("0.8")]
        exact = falling(*given, mpf(end))
        assert len(exact) == 5
        np.testing.assert_allclose(found, np.array(exact, float), atol=1e-12)
        for place, name in enumerate(("q_0", "u_0", "e")):
            step = [mpf(10) ** -12 * (k == place) for k in range(3)]
            ahead = falling(*(x + h for x, h in zip(given, step, strict=True)), mpf(end))
            behind = falling(*(x - h for x, h in zip(given, step, strict=True)), mpf(end))
            known = [(a - b) / mpf("2e-12") for a, b in zip(ahead, behind, strict=True)]
            columns = np.append(sol.sensitivity[name][-1], sol.sensitivity.events[0].t[name])
            np.testing.assert_allclose(columns, np.array(known, float), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["c", "q"])
def test_through_a_stop_under_a_given_input(swing, name):
    """The impact is one of compiled code, between the jumps of the signal."""
    stop = mechc.Stop("q + l/4", 0.9)
    run = bounced(swing, name, stop, rtol=1e-13)
    sol = bounced(swing, name, stop, rtol=1e-11, sensitivities=[name])(0.0)
    assert sol.status.ok
    assert len(sol.events[0].t) >= 2
    wanted = extrapolated(lambda change: run(change).y[-1], 0.004)
    assert apart(sol.sensitivity[name][-1], wanted) < 1e-8


def test_resets_at_one_instant_have_no_derivative(swing):
    twice = [BOUNCE, mechc.Event(lambda t, y: y[0], direction=1, reset=lambda t, q, u: (q, -u))]
    sol = bounced(swing, "q", events=twice, sensitivities=["q"])(0.0)
    if any(len(piece.causes) > 1 for piece in sol.record.pieces):
        assert np.isnan(sol.sensitivity["q"][-1]).all()
        assert "one instant" in sol.sensitivity.notes[0]
        with pytest.raises(mechc.MechcError, match="one instant"):
            sol.gradient(end="q", by=["q"])
    else:
        pytest.fail("both events were to reset the state together")


def touched(swing, *names):
    """A motion whose event meets its zero at 1 s with no rate, and resets the state there.

    Without gravity and torque q = Q + U t.  A torque that begins later moves nothing by then.
    """
    hit = mechc.Event("q - 0.7 + 0.5*t - (t - 1)**3", direction=-1, reset={"u": "-u"})
    torque = mechc.Signal([0.0, 1.5, 2.0], [0.0, 0.4, 0.4], "previous")
    params = GIVEN | {"g": 0.0, "c": 0.0}
    return swing.simulate(
        T, {"q": Q, "u": U}, params, inputs={"F": torque}, events=hit, sensitivities=names
    )


def test_at_a_grazing_event_there_is_no_derivative(swing):
    """But by what does not move the event; of its time, of the motion after it, and backwards."""
    sol = touched(swing, "q", "u", "m", "F[1]")
    (hit,) = sol.events[0].t
    assert hit == pytest.approx(1.0, abs=1e-4)
    at = sol.sensitivity.events[0]
    for name in ("q", "u"):
        assert np.isnan(at.t[name]).all()
        assert np.isfinite(sol.sensitivity[name][sol.t < hit]).all()
        assert np.isnan(sol.sensitivity[name][sol.t > hit]).all()
    assert at.t["m"] == at.t["F[1]"] == 0.0
    assert np.abs(sol.sensitivity["F[1]"][-1]).min() > 0.0
    assert np.isfinite(sol.sensitivity["m"]).all()
    for notes in (at.notes, sol.sensitivity.notes):
        assert [note.split(":")[0] for note in notes] == ["by q", "by u"]
        assert all("grazing" in note for note in notes)
    with pytest.raises(mechc.MechcError, match=r"no gradient: none at t = .*grazing"):
        sol.gradient(end="q", by=["q"])
