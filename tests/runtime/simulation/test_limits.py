"""A run that creeps is bounded, and its status names what limits the steps."""

import numpy as np
import pytest
from sympy import Abs, Heaviside, Max, Symbol, exp, sign, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support import scenes

q, u = dynamicsymbols("q u")
METHODS = ("auto", "dopri5", "dop853", "radau5", "gauss8")


@pytest.mark.parametrize("method", METHODS)
def test_memory_has_a_limit(model, regular, method):
    params, start = regular
    limit = 50_000
    whole = model.simulate(20, start, params, method=method, rtol=1e-11)
    cut = model.simulate(20, start, params, method=method, rtol=1e-11, max_bytes=limit)
    assert cut.status.code == "memory limit"
    assert "accuracy limits the steps" in cut.status.cause
    assert "max_bytes" in cut.status.advice
    assert cut.status.t == cut.t[-1] < 20
    kept = len(cut) * 8 * (1 + 6 * (1 + 9))  # at most nine rows of dense output
    assert 0.5 * limit < kept < 1.5 * limit
    np.testing.assert_array_equal(cut.y, whole.y[: len(cut)])
    middle = 0.5 * (cut.t[0] + cut.t[-1])
    np.testing.assert_array_equal(cut(middle), whole(middle))


def test_states_alone_need_less(model, regular):
    params, start = regular
    limit = {"method": "dopri5", "max_bytes": 30_000}
    cut = model.simulate(20, start, params, **limit)
    states = model.simulate(20, start, params, dense=False, **limit)
    assert len(states) == 30_000 // 56 > 3 * len(cut)
    assert states.status.code == "memory limit"


def test_a_limit_that_suffices_changes_nothing(model, regular):
    params, start = regular
    runs = [model.simulate(5, start, params, max_bytes=limit) for limit in (2**30, 1e6, np.inf)]
    assert all(run.status.ok for run in runs)
    for run in runs:
        np.testing.assert_array_equal(run.y, runs[0].y)


@pytest.mark.parametrize("limit", [0, -1, np.nan, "many"])
def test_a_wrong_limit_is_refused(model, regular, limit):
    with pytest.raises(mechc.ValueOutOfBoundsError, match="max_bytes"):
        model.simulate(1.0, regular[1], regular[0], max_bytes=limit)


# -- what limits the steps ------------------------------------------------------------------------


def ended(load, t_end, start=(1.0, 0.0), **policy):
    """The end of a bead's run under this force."""
    model = mechc.compile(scenes.bead_with(load), outputs=())
    start = dict(zip(("q", "u"), start, strict=True))
    return model.simulate(t_end, start, **policy)


@pytest.mark.parametrize("way", [1, -1])
def test_dry_friction_that_sticks_is_named(way):
    """From -0.2 m the spring's 0.8 N do not overcome the friction of 1 N; backwards too."""
    sol = ended(-way * sign(u) - 4 * q, way * 3.0, (0.7, 0.0), rtol=1e-12, max_steps=300)
    assert sol.status.t == pytest.approx(way * np.pi / 2, abs=1e-6)
    assert "the equations jump here: the rate of u is" in sol.status.cause
    assert "0.2" in sol.status.cause
    assert "1.8" in sol.status.cause
    assert "tanh" in sol.status.advice
    assert "mechc.DryFriction" in sol.status.advice


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_dry_friction_that_sticks_ends_every_method(method):
    """At loose tolerances the bead may tremble within them instead."""
    model = mechc.compile(scenes.bead_with(-sign(u) - 4 * q), outputs=())
    start = {"q": 3.3, "u": 0.0}
    sol = model.simulate(15.0, start, rtol=1e-12, method=method, max_steps=10**5)
    assert sol.status.t == pytest.approx(7 * np.pi / 2, abs=1e-3)
    assert "the equations jump here" in sol.status.cause
    assert sol.status.code in ("chatters", "discontinuity")
    assert sol.stats["steps"] < 20_000


@pytest.mark.slow
@pytest.mark.usefixtures("flags_of_users")  # rounding decides about steps across the jump
@pytest.mark.parametrize("start", [2.8, 3.0, 3.2, 3.3, 5.3])
@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4])
def test_a_jacobian_across_a_jump_moves_no_bead_that_sticks(start, rtol):
    """It lost 0.25 m at each end of a swing and rests at less than that, by every exact motion."""
    model = mechc.compile(scenes.bead_with(-sign(u) - 4 * q), outputs=())
    sol = model.simulate(20.0, {"q": start, "u": 0.0}, rtol=rtol, method="radau5")
    swings = np.ceil((start - 0.25) / 0.5)
    rest = (-1) ** swings * (start - 0.5 * swings)
    assert sol.t[-1] > 0.99 * swings * np.pi / 2
    resting = sol.y[sol.t > swings * np.pi / 2]
    assert np.abs(resting - [rest, 0.0]).max(initial=0.0) < 0.05


@pytest.fixture(scope="module")
def at_rest_or_sliding():
    """A bead on a spring with dry friction, moved by a force that it follows now and then."""
    law = 0.5 * sin(dynamicsymbols._t) - 0.4 * sign(u) - q
    return mechc.compile(scenes.bead_with(law), outputs=())


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_steps_that_chatter_about_a_jump_end_the_run(at_rest_or_sliding, start, method, rtol):
    """With 3.3 million states and 1.3 GB it went on."""
    sol = at_rest_or_sliding.simulate(20.0, start, rtol=rtol, method=method)
    assert sol.status.code in ("chatters", "discontinuity")
    assert sol.stats["steps"] < 5000
    assert "mechc.DryFriction" in sol.status.advice


def test_members_chatter_as_alone(at_rest_or_sliding):
    starts = [(0.0, 0.0), (0.0, 1.0), (0.1, 0.0)] * 3
    batch = at_rest_or_sliding.simulate_batch(20.0, starts, method="dop853")
    assert batch.counts["chatters"] >= 3
    for k, start in enumerate(starts[:3]):
        sol = at_rest_or_sliding.simulate(20.0, start, method="dop853")
        np.testing.assert_array_equal(batch.y[k], sol.y[-1])


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "law",
    [
        sign(sin(50 * dynamicsymbols._t)) - q,  # jumps that are crossed
        -Abs(sin(50 * dynamicsymbols._t)) - q,  # corners, seen at one phase by equal steps
        -sign(q),  # the motion leads through
        -sign(u) * q**2 - 4 * q,  # friction that vanishes
    ],
    ids=["sign of a sine", "corner", "through", "vanishing"],
)
def test_jumps_that_are_crossed_many_times_end_nothing(law, method):
    most = {"max_step": np.pi / 25} if law.has(Abs) else {}
    sol = ended(law, 600.0, (0.3, 0.1), rtol=1e-5, method=method, **most)
    assert sol.status.ok, sol.status


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "law",
    [-5 * u - Abs(u) * u / 2 - q, -50 * u - Abs(q) * q - q, -50 * u - 3 * Max(q, 0) - q],
    ids=["drag", "spring", "one-sided"],
)
def test_a_motion_that_comes_to_rest_chatters_about_no_corner(law, method):
    """There both sides lead back too, at a rate that goes to zero with the distance."""
    sol = ended(law, 3000.0, (0.3, 0.1), rtol=1e-6, method=method)
    assert sol.status.ok, sol.status
    assert np.abs(sol.y[-1]).max() < 1e-5


def test_jumps_that_are_passed_are_no_matter():
    """A step of the force is stepped over: status finished, right to the tolerance."""
    sol = ended(-10 * Heaviside(q, 1) * q, 1.0, (0.1, -0.5), rtol=1e-8)
    assert sol.status.ok
    sol = ended(-Abs(q) * q, 3.0, rtol=1e-8)
    assert sol.status.ok


def test_stability():
    """A spring whose vibration dies within 1e-4 s, followed by an explicit method."""
    sol = ended(-1e4 * u - 1e4 * q, 1e3, rtol=1e-6, method="dop853", max_steps=400)
    assert sol.status.code == "too many steps"
    assert "stability limits the steps" in sol.status.cause
    assert "radau5" in sol.status.advice


def test_a_motion_that_grows_without_bound():
    """u' = u^2 from u = 1 is infinite at t = 1."""
    sol = ended(u**2, 2.0, (0.0, 1.0), rtol=1e-9, max_steps=1000)
    assert not sol.status.ok
    assert sol.status.t == pytest.approx(1.0, abs=1e-6)
    assert "grows without bound" in sol.status.cause


def test_accuracy():
    sol = ended(-(100**2) * q, 1e3, rtol=1e-9, method="dop853", max_steps=100)
    assert "accuracy limits the steps" in sol.status.cause


def test_a_short_run_of_a_motion_without_fast_parts_is_not_told_as_rounding():
    """Its tail was as far from a polynomial of low degree in a quarter of it as in the whole."""
    model = mechc.load("pendulum")
    batch = model.simulate_batch(20.0, [[1.0, 0.0]], max_steps=60, progress=False)
    told = str(batch.member(0).status)
    assert "accuracy limits the steps" in told
    assert "rounding" not in told


@pytest.fixture(scope="module")
def pushed():
    """A unit mass at rest, under a force that grows from what is rounding."""
    x, v = dynamicsymbols("x v")
    t, left = dynamicsymbols._t, Symbol("left")
    force = left + 1e5 * sin(3 * t) * exp(-2 * t)
    return mechc.compile(mechc.from_equations([x], [v], [[1]], [force]))


@pytest.mark.parametrize("method", ["auto", "dopri5"])
@pytest.mark.parametrize("left", [1e-25, 1e-15, 4e-13])
def test_a_force_that_grows_from_rounding_sets_no_scale(pushed, left, method):
    sol = pushed.simulate(2.0, [0.0, 0.0], {"left": left}, rtol=1e-9, method=method)
    assert sol.status.ok
    fading = np.exp(-4.0) * (3.0 * np.cos(6.0) + 2.0 * np.sin(6.0))
    assert sol.y[-1, 1] == pytest.approx(1e5 * (3.0 - fading) / 13.0, rel=1e-8)
    assert sol.stats["rejected"] <= 2
