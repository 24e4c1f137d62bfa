"""Error control of the derivatives' own, where the motion rests and its derivatives swing."""

import pickle

import numpy as np
import pytest

import mechc
from mechc.native._codes import RUNNING
from mechc.simulation.initialise import begin
from tests.runtime.sensitivities.test_run import GIVEN, METHODS, START, swing
from tests.support.differences import apart

__all__ = ["swing"]  # a compiled scene of other tests
HANGING = {"q": -np.pi / 2, "u": 0.0}
FREE = GIVEN | {"c": 0.0}
INERTIA, STIFFNESS = GIVEN["m"] * GIVEN["l"] ** 2, GIVEN["m"] * GIVEN["g"] * GIVEN["l"]
BY = ("q", "u", "F")


def small_swings(t):
    """The derivatives of hanging at rest, in closed form: small oscillations."""
    w = np.sqrt(STIFFNESS / INERTIA)
    c, s = np.cos(w * t), np.sin(w * t)
    parts = {"q": (c, -w * s), "u": (s / w, c), "F": ((1 - c) / STIFFNESS, w * s / STIFFNESS)}
    return {name: np.stack(part, axis=-1) for name, part in parts.items()}


def at_rest(model, **policy):
    policy = {"inputs": {"F": 0.0}, "sensitivities": BY} | policy
    return model.simulate(policy.pop("span", 10.0), HANGING, FREE, **policy)


def off(sol, start=0.0):
    """The largest error of a derivative over its largest value."""
    wanted = small_swings(sol.t - start)
    return max(apart(sol.sensitivity[name], wanted[name]) for name in wanted)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_the_error_follows_the_tolerance_with_it_alone(swing, method, rtol):
    policy = {"method": method, "rtol": rtol}
    assert off(at_rest(swing, sensitivity_error_control=True, **policy)) < rtol
    plain = at_rest(swing, **policy)
    assert off(plain) > 10 * rtol
    assert len(plain.t) < 40
    assert plain.status.warnings == ()


def test_a_tolerance_in_numbers(swing):
    """Of a torque of 1 N m the size of the derivative is that of the angle: some 0.2 rad."""
    policy = {"method": "dop853", "sensitivities": ["F"], "sensitivity_error_control": True}
    steps = {}
    for atol in (1e-4, 1e-8):
        sol = at_rest(swing, rtol=1e-13, atol=atol, **policy)
        assert np.abs(sol.sensitivity["F"] - small_swings(sol.t)["F"]).max() < 10 * atol
        steps[atol] = len(sol.t)
    assert 1.5 * steps[1e-4] < steps[1e-8]


def test_backwards_and_past_a_reset(swing):
    """A reset that changes nothing; derivatives by the state at the end, and times that fall."""
    still = mechc.Event(lambda t, y: t - 3.3, reset=lambda t, q, u: (q, u))
    sol = at_rest(swing, span=(10.0, 0.0), events=still, sensitivity_error_control=True)
    assert len(sol.segments) == 2
    assert off(sol, 10.0) < 1e-9


def test_the_steps_of_a_motion_that_needs_them_anyway_stay(swing):
    """What has no effect on the motion has none on its steps: the mass, of a free pendulum."""
    start = {"q": 0.7, "u": -0.5}
    runs = [
        swing.simulate(
            2.0, start, FREE, inputs={"F": 0.0}, sensitivities=["m"], sensitivity_error_control=on
        )
        for on in (False, True)
    ]
    np.testing.assert_array_equal(runs[0].t, runs[1].t)
    assert runs[1].policy.limits is None


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("span", [(0.0, 2.0), (2.0, 0.0)])
def test_steps_keep_to_limits(swing, method, span):
    """Over parts with different limits the shares of a step add up to one at most."""
    driven = swing.with_inputs({"F": 0.3})
    times, longest = np.array([0.3, 0.35, 0.8, 1.4]), np.array([0.02, np.inf, 0.05])
    limits = {"rtol": 1e-3, "method": method}
    free = driven.simulate(span, START, GIVEN, **limits)
    policy = free.policy._replace(limits=(times, longest))
    run = begin(driven.system, span, free.y[0], free.params, policy)
    while run.status == RUNNING:
        run.advance(1000)
    t = np.sort(run.steps.states()[0])
    inner = np.sort(np.concatenate([t, times]))
    middles = 0.5 * (inner[1:] + inner[:-1])
    place = np.searchsorted(times, middles) - 1
    rates = np.where((place >= 0) & (place < 3), 1.0 / longest[np.clip(place, 0, 2)], 0.0)
    shares = np.interp(t, inner, np.append(0.0, np.cumsum(rates * np.diff(inner))))
    assert np.diff(shares).max() < 1.0 + 1e-9
    assert np.median(np.diff(t)[(t[1:] > 0.85) & (t[1:] < 1.35)]) > 0.045
    assert np.diff(t).max() > 0.06


def test_a_solution_is_pickled(swing):
    sol = at_rest(swing, sensitivity_error_control=True)
    again = pickle.loads(pickle.dumps(sol))
    np.testing.assert_array_equal(sol.t, again.t)
    np.testing.assert_allclose(sol.y, again.y, rtol=0, atol=1e-12)
