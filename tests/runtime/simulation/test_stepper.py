"""A motion advanced step by step: the same as in one run, and as closed forms."""

import math

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.inputs import sampled
from tests.support.pendulums import pushed_mass

MASS, STIFFNESS, DT = 2.0, 30.0, 1e-3
METHODS = ("gauss8", "dop853", "dopri5", "radau5")


@pytest.fixture(scope="module")
def pushed():
    defaults = {"m": MASS, "k": STIFFNESS}
    return mechc.compile(pushed_mass(), name="cart", defaults=defaults, outputs=("energy",))


def after(q, u, force, dt=DT):
    """The cart after dt under a constant force."""
    w, rest = math.sqrt(STIFFNESS / MASS), force / STIFFNESS
    c, s = math.cos(w * dt), math.sin(w * dt)
    return rest + (q - rest) * c + u / w * s, u * c - (q - rest) * w * s


@pytest.mark.parametrize("method", METHODS)
def test_a_linkage_steps_through_its_change_points_as_in_one_run(model, method):
    y0 = model.assemble({"theta_0": np.radians(85)})
    sol = model.simulate(8.0, y0, method=method)
    stepper = model.stepper(y0, method=method)
    states, met = [], []
    while stepper.t < 4.9:
        states.append(stepper.step(DT))
        met += stepper.change_points
    times = np.add.accumulate(np.full(len(states), DT))
    expected = [p.t for p in sol.change_points if p.t < 4.9]
    assert len(expected) == 4
    # but for the implicit method, the integrator takes the same steps
    atol = 1e-7 if method == "radau5" else 1e-12
    np.testing.assert_allclose(sorted({p.t for p in met}), expected, atol=atol, rtol=0)
    np.testing.assert_allclose(states, sol(times), atol=atol, rtol=0)


@pytest.mark.parametrize("method", METHODS)
def test_a_force_that_changes_every_step_gives_the_closed_form(pushed, method):
    rng = np.random.default_rng(5)
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, method=method, rtol=1e-10)
    state = 0.1, 0.0
    for force in rng.uniform(-40.0, 40.0, 500):
        state = after(*state, force)
        np.testing.assert_allclose(stepper.step(DT, {"F": force}), state, atol=1e-9)
    assert stepper.t == pytest.approx(500 * DT)
    assert stepper.status.ok


def test_an_input_that_is_not_named_keeps_its_value(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 7.0})
    state = after(*after(0.1, 0.0, 7.0), -3.0)
    stepper.step(DT)
    np.testing.assert_allclose(stepper.step(DT, {dynamicsymbols("F"): np.float64(-3)}), state)
    np.testing.assert_allclose(stepper.step(0.5), after(*state, -3.0, 0.5), atol=1e-9)


@pytest.mark.parametrize("kind", ["previous", "linear"])
def test_signals_and_functions_are_those_of_one_run(pushed, kind):
    signal = mechc.Signal([0.0, 0.0113, 0.05, 0.31, 1.0], [1.0, 60.0, -20.0, 5.0, 5.0], kind)
    for given in (signal, lambda t: 30.0 * math.sin(20.0 * t)):
        sol = pushed.simulate(1.0, [0.1, 0.0], inputs={"F": given}, rtol=1e-10)
        stepper = pushed.stepper([0.1, 0.0], inputs={"F": given}, rtol=1e-10)
        for k in range(1, 40):
            state = stepper.step(0.025)
            np.testing.assert_allclose(state, sol(0.025 * k), atol=2e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_moment_comes_back_to_the_last_bit(pushed, model, method):
    force = np.random.default_rng(2).uniform(-9.0, 9.0, 60)
    driven = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, method=method)
    linkage = model.stepper(model.assemble({"theta_0": 1.4835}), method=method)
    while linkage.t < 0.774:  # a change point is at 0.7754 s
        linkage.step(DT)
    for stepper, given in ((driven, [{"F": f} for f in force]), (linkage, [None] * 60)):
        for inputs in given[:30]:
            stepper.step(DT, inputs)
        saved = stepper.save()
        once = [stepper.step(DT, inputs) for inputs in given[30:]]
        stepper.set(stepper.y, t=3.0)
        stepper.step(DT)
        stepper.restore(saved)
        assert (stepper.t, stepper.y.tolist()) == (saved.t, saved.y.tolist())
        again = [stepper.step(DT, inputs) for inputs in given[30:]]
        assert np.array_equal(once, again)


def test_parameters_and_inputs_come_back_too(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 1.0})
    first = stepper.save()
    once = [stepper.step(DT, {"F": 2.0}), stepper.step(DT)]
    saved = stepper.save()
    further = stepper.step(DT)
    stepper.set(params={"k": 0.0})
    np.testing.assert_allclose(stepper.step(DT)[1] - further[1], DT * 2.0 / MASS)
    stepper.restore(saved)
    assert np.array_equal(stepper.step(DT), further)
    stepper.restore(first)
    np.testing.assert_allclose(stepper.step(DT), after(0.1, 0.0, 1.0))
    stepper.restore(first)
    assert np.array_equal([stepper.step(DT, {"F": 2.0}), stepper.step(DT)], once)
    other = pushed.stepper([0.1, 0.0], inputs={"F": 1.0})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="another stepper"):
        other.restore(saved)


def test_outputs_are_those_of_the_present_state_and_inputs(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0})
    q, u = stepper.step(0.1, {"F": 12.0})
    found = stepper.outputs("kinetic_energy", "rates")
    np.testing.assert_allclose(found["rates"], [u, (12.0 - STIFFNESS * q) / MASS])
    np.testing.assert_allclose(found["kinetic_energy"], 0.5 * MASS * u**2)
    with pytest.raises(mechc.UnknownNameError):
        stepper.outputs("nothing")


def test_nothing_is_recorded(pushed, model):
    driven = pushed.stepper([0.1, 0.0], inputs={"F": 0.0})
    linkage = model.stepper(model.assemble({"theta_0": 1.4835}))
    for k in range(300):
        driven.step(0.3, {"F": k})
        linkage.step(0.02)
        assert all(len(of._motion.steps().states()[0]) < 12 for of in (driven, linkage))


def test_a_step_that_ends_early_is_told_with_its_status(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, max_steps=3, max_step=0.01)
    with pytest.raises(mechc.StepError, match="max_steps") as caught:
        stepper.step(1.0)
    assert caught.value.status.code == "too many steps"
    assert caught.value.status.t == stepper.t == stepper.status.t == pytest.approx(0.03)
    np.testing.assert_allclose(stepper.y, after(0.1, 0.0, 0.0, stepper.t), atol=1e-9)
    stepper.set()
    assert stepper.step(0.02)[0] == pytest.approx(after(0.1, 0.0, 0.0, 0.05)[0])


def test_a_failing_function_is_told(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": lambda t: 1.0 / (t < 0.5)})
    stepper.step(0.3)
    with pytest.raises(mechc.InputError, match="ZeroDivisionError"):
        stepper.step(0.3)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.inf, math.nan])
def test_wrong_intervals_are_refused(pushed, dt):
    with pytest.raises(mechc.ValueOutOfBoundsError, match="dt"):
        pushed.stepper([0.1, 0.0], inputs={"F": 0.0}).step(dt)


def test_wrong_inputs_are_refused(pushed):
    with pytest.raises(mechc.MissingInputError, match="F"):
        pushed.stepper([0.1, 0.0])
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0})
    for wrong in (math.nan, "much", lambda t: t):
        with pytest.raises(
            mechc.ValueOutOfBoundsError, match=r"input F(: 'much' is not a| must be a)"
        ):
            stepper.step(DT, {"F": wrong})
    with pytest.raises(mechc.UnknownNameError, match="'G'"):
        stepper.step(DT, {"G": 1.0})
    called = pushed.stepper([0.1, 0.0], inputs={"F": lambda t: t})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="as a function or a signal"):
        called.step(DT, {"F": 1.0})
    with pytest.raises(mechc.AssemblyError):
        mechc.load("four_bar").stepper([0.0, 1.0, 2.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("delay", [0.0, 0.0037])
def test_a_sampled_controller_is_that_of_one_run(pushed, delay, monkeypatch):
    """Beyond the instants that are made room for at once, and whatever the steps are."""
    monkeypatch.setattr(sampled, "AT_ONCE", 64)

    def controller():
        calls = []

        def law(t, q, u):
            calls.append(t)
            return -20.0 * q[0] - 3.0 * u[0]

        return calls, mechc.Sampled(law, 0.01, delay, jitter=0.004, seed=3, initial=1.0)

    called, given = controller()
    sol = pushed.simulate(3.0, [0.1, 0.0], inputs={"F": given}, rtol=1e-10)
    calls, again = controller()
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": again}, rtol=1e-10)
    for k in range(1, 120):
        np.testing.assert_allclose(stepper.step(0.025), sol(0.025 * k), atol=1e-9)
    np.testing.assert_allclose(calls, called[: len(calls)], rtol=0, atol=1e-12)
    with pytest.raises(mechc.MechcError, match="memory"):
        stepper.save()
    stepper.set([0.1, 0.0], t=0.0)
    np.testing.assert_allclose(stepper.step(0.5), sol(0.5), atol=1e-9)


def test_why_an_event_failed_is_told_as_by_simulate():
    pendulum = mechc.load("pendulum")
    wrong = mechc.Event("theta_0 < 0", reset={"m_0": "-m_0"})
    stepper = pendulum.stepper([0.5, 0.0], events=wrong)
    with pytest.raises(mechc.StepError, match="m_0 beyond its bounds"):
        stepper.step(2.0)
    assert 0.4 < stepper.t < 0.6


@pytest.mark.parametrize("kind", ["previous", "linear"])
def test_a_moment_before_kinks_comes_back_to_the_last_bit(pushed, kind):
    """Those that were passed meanwhile are ahead again."""
    times = np.linspace(0.0, 2.0, 40) + 0.0123
    signal = mechc.Signal(times, 20.0 * np.sin(9.0 * times), kind, outside="hold")
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": signal})
    stepper.step(0.03)
    saved = stepper.save()
    once = [stepper.step(0.07) for _ in range(20)]
    stepper.restore(saved)
    assert np.array_equal(once, [stepper.step(0.07) for _ in range(20)])


def test_a_run_that_is_ahead_goes_on_beyond_its_end_after_it_was_restored(model):
    """The run that was saved ends at another time than the one that took its place."""
    stepper = model.stepper(model.assemble({"theta_0": 1.4}))
    start = stepper.save()
    stepper.step(0.5)
    first = stepper.save()
    stepper.restore(first)
    once = [stepper.step(100.0) for _ in range(6)]
    stepper.restore(start)
    stepper.step(0.5)
    stepper.restore(first)
    again = [stepper.step(100.0) for _ in range(6)]
    assert np.array_equal(once, again)


def test_the_least_conditioning_is_that_of_the_motion(model):
    y0 = model.assemble({"theta_0": 1.4})
    stepper = model.stepper(y0)
    for _ in range(30):
        stepper.step(0.02)
    sol = model.simulate(0.6, y0)
    least = stepper.stats["least_singular"]
    assert least <= sol.stats["least_singular"] * (1.0 + 1e-12)  # its run is ahead
    assert least > 0.5 * sol.stats["least_singular"]
    assert stepper.stats["critical_gap"] == np.inf


@pytest.mark.parametrize("dt", [0.1, 0.05, 0.02, 0.01, 1 / 30])
def test_steps_reach_the_last_sample_of_a_signal(pushed, dt):
    """Their sum was a few roundings beyond it, and refused; four of these five lengths stopped."""
    times = np.linspace(0.0, 2.0, 11)
    signal, count = mechc.Signal(times, np.sin(5 * times), "linear"), round(2.0 / dt)
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": signal}, rtol=1e-10)
    for _ in range(count // 2):
        stepper.step(dt)
    saved = stepper.save()
    states = [stepper.step(dt) for _ in range(count - count // 2)]
    assert stepper.t == pytest.approx(2.0, rel=1e-14)
    sol = pushed.simulate(2.0, [0.1, 0.0], inputs={"F": signal}, rtol=1e-10)
    np.testing.assert_allclose(states[-1], sol.y[-1], rtol=1e-7)
    stepper.restore(saved)
    assert np.array_equal([stepper.step(dt) for _ in states], states)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="is sampled from 0 to 2 s"):
        stepper.step(dt)


# -- after a reset that changes a parameter, and what is known of events --------------------------

HARDER = mechc.Event("q < 0", reset={"k": "4*k"})
RATE = math.sqrt(STIFFNESS / MASS)
TURNED = 0.5 * math.pi / RATE  # s: the cart passes 0, and its spring becomes four times as hard


def with_a_harder_spring(t):
    """The cart from 0.1 m at rest, before it passes 0 again."""
    if t < TURNED:
        return 0.1 * math.cos(RATE * t), -0.1 * RATE * math.sin(RATE * t)
    angle = 2.0 * RATE * (t - TURNED)
    return -0.05 * math.sin(angle), -0.1 * RATE * math.cos(angle)


def test_outputs_and_parameters_are_those_that_a_reset_left(pushed):
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, events=HARDER)
    for _ in range(3):
        stepper.step(0.15)
    q, u = with_a_harder_spring(0.45)
    np.testing.assert_allclose(stepper.y, [q, u], atol=1e-9)
    assert dict(zip(pushed.parameters, stepper.params, strict=True)) == {"k": 120.0, "m": 2.0}
    found = stepper.outputs("rates", "energy")
    np.testing.assert_allclose(found["rates"], [u, -60.0 * q], atol=1e-7)
    np.testing.assert_allclose(found["energy"], u**2 + 60.0 * q**2, atol=1e-8)
    stepper.set([0.1, 0.0])  # the parameters stay
    np.testing.assert_allclose(stepper.outputs("rates")["rates"], [0.0, -6.0], atol=1e-12)


@pytest.mark.parametrize("moment", [0.3, 0.45])
def test_a_moment_comes_back_with_its_parameters(pushed, moment):
    """To the last bit, before the reset and after it, also from a motion that began meanwhile."""
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, events=HARDER)
    stepper.step(moment)
    saved = stepper.save()
    once = [(*stepper.step(0.08), *stepper.params) for _ in range(4)]
    np.testing.assert_allclose(once[-1][:2], with_a_harder_spring(moment + 0.32), atol=1e-9)
    for away in (lambda: None, lambda: stepper.set([0.3, 0.0], params={"k": 1.0})):
        away()
        stepper.restore(saved)
        assert np.array_equal(once, [(*stepper.step(0.08), *stepper.params) for _ in range(4)])


def test_a_controller_goes_on_with_the_parameters_that_a_reset_left(pushed, monkeypatch):
    """Beyond the instants that are made room for at once, where another motion takes over."""
    monkeypatch.setattr(sampled, "AT_ONCE", 16)
    given = mechc.Sampled(lambda t: 0.0, 0.01)
    third = mechc.Event("u", terminal=3)
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": given}, events=[HARDER, third])
    for k in range(1, 11):
        np.testing.assert_allclose(stepper.step(0.07), with_a_harder_spring(0.07 * k), atol=1e-9)
    assert stepper.params[pushed.parameters.index("k")] == 120.0
    alone = pushed.simulate(9.0, [0.1, 0.0], inputs={"F": 0.0}, events=[HARDER, third])
    while stepper.t + 0.07 < alone.t[-1]:
        stepper.step(0.07)
    with pytest.raises(mechc.StepError, match="stopped by an event"):
        stepper.step(0.07)
    assert stepper.t == pytest.approx(alone.t[-1], abs=1e-9)


@pytest.mark.parametrize("way", ["plain", "inputs change", "saved", "restored"])
def test_a_terminal_event_counts_each_zero_once(pushed, way):
    """Those ahead of the time reached are found again where the run begins anew."""
    third = mechc.Event("q", terminal=3)
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": 0.0}, events=third)
    k = 0
    while stepper.t + 0.01 < 5.0 * TURNED:
        k += 1
        stepper.step(0.01, {"F": 1e-12 * (k % 2)} if way == "inputs change" else None)
        saved = stepper.save() if way in ("saved", "restored") else None
        if way == "restored" and k % 7 == 3 and stepper.t + 0.3 < 5.0 * TURNED:
            stepper.step(0.3)
            stepper.restore(saved)
    with pytest.raises(mechc.StepError, match="stopped by an event"):
        stepper.step(0.01)
    assert stepper.t == pytest.approx(5.0 * TURNED, abs=1e-9)


def test_a_contact_that_lasts_comes_back(pushed):
    """The cart leans on a stop at 0: reactions of the contact too."""
    stop = mechc.Stop("q", restitution=0.0)
    stepper = pushed.stepper([0.1, 0.0], inputs={"F": -9.0}, events=stop)
    stepper.step(0.5)
    np.testing.assert_allclose(stepper.outputs("rates")["rates"], [0.0, 0.0], atol=1e-14)
    saved = stepper.save()
    np.testing.assert_allclose(stepper.outputs("rates")["rates"], [0.0, 0.0], atol=1e-14)
    once = [stepper.step(0.1), stepper.step(0.1, {"F": 5.0})]
    stepper.restore(saved)
    again = [stepper.step(0.1, {"F": -9.0}), stepper.step(0.1, {"F": 5.0})]
    assert np.array_equal(once, again)
    assert once[1][0] > 0.0
