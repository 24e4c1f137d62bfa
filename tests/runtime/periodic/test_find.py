"""Cycles from a guess: what is free, held or grows, and the words where there is none."""

import numpy as np
import pytest
from scipy.special import ellipk

import mechc
from tests.support.pendulums import driven_pendulum, pendulum, van_der_pol, walker

HALF_PERIOD = 1.6607240639610833  # s, of the regular four-bar from rest at 85 degrees; see its data
PLAIN = {"gamma": 0.0, "beta": 0.0}  # neither driven nor damped
FROM_REST = {"hold": ["theta_0", "omega_0"], "rtol": 1e-12}


@pytest.mark.slow
def test_every_iterate_closes_the_loops_and_the_period_is_the_known_one(model):
    start = {"theta_0": "85deg"}
    cycle = model.periodic(start, 3.2, {"l_3": 3.5}, **FROM_REST)
    assert cycle.period == pytest.approx(2 * HALF_PERIOD, abs=1e-11)
    assert np.abs(model.constraints(cycle.y0, cycle.params)).max() < 1e-14
    assert cycle.closure < 1e-12
    same = model.periodic(start, 3.2, {"l_3": 3.5}, hold=["energy"], rtol=1e-12)
    assert same.period == pytest.approx(2 * HALF_PERIOD, abs=1e-11)
    assert not same.notes


@pytest.mark.slow
def test_without_what_is_held_the_nearest_of_a_family_is_found_and_told(model):
    cycle = model.periodic({"theta_0": "85deg"}, 3.2, {"l_3": 3.5})
    assert cycle.period == pytest.approx(2 * HALF_PERIOD, abs=1e-4)
    assert "one of a family" in str(cycle)


@pytest.mark.parametrize("speed", [10.0, 30.0])  # rad/s: it swings, and turns over
def test_a_pendulum_has_the_period_of_the_elliptic_integral(speed):
    own, k = 3 * np.pi, speed / (6 * np.pi)
    exact = 4 * ellipk(k**2) / own if k < 1 else 2 * ellipk(1 / k**2) / (k * own)
    cycle = driven_pendulum().periodic(
        {"q": 0.0, "u": speed}, 1.1 * exact, PLAIN, hold=["q", "u"], rtol=1e-12
    )
    assert cycle.period == pytest.approx(exact, rel=1e-12)
    assert cycle.advances == ({"q": pytest.approx(2 * np.pi)} if k > 1 else {})
    assert (cycle.stable, cycle.neutral) == (True, 1)


def test_a_period_that_is_held_chooses_the_amplitude():
    exact = 4 * ellipk(0.25) / (3 * np.pi)  # sin(amplitude / 2) = 1/2
    cycle = driven_pendulum().periodic({"q": 0.9}, exact, PLAIN, hold=["period"], rtol=1e-12)
    highest = np.abs(cycle.samples(20001)[:, 0]).max()
    assert highest == pytest.approx(np.pi / 3, abs=1e-6)


def test_the_period_of_a_driven_motion_is_an_expression_or_a_multiple_of_the_drives():
    pendulum = driven_pendulum()
    one = pendulum.periodic({"q": 0.0}, "2*pi/Omega", {"gamma": 0.2})
    two = pendulum.periodic({"q": 0.0}, "2000 ms", {"gamma": 0.2})
    assert (one.period, two.period) == (pytest.approx(1.0, abs=1e-15), 2.0)
    np.testing.assert_allclose(two.y0, one.y0, atol=1e-7)
    assert two.notes == ("it repeats already after 1 s",)
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"does not repeat after 0\.7 s"):
        pendulum.periodic({"q": 0.0}, 0.7, {"gamma": 0.2})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="parameters alone"):
        pendulum.periodic({"q": 0.0}, "2*pi/Omega + q", {"gamma": 0.2})


def test_where_there_is_no_cycle_the_words_tell_how_near_a_motion_came():
    words = r"misses its start in q by \+\d.*°.*If q need not return.*advance=\{'q': None\}"
    with pytest.raises(mechc.MechcError, match=words):
        driven_pendulum().periodic({"q": 0.0, "u": 30.0}, 0.22, PLAIN, advance={"q": "0deg"})


def test_what_need_not_return_must_change_nothing():
    with pytest.raises(mechc.ValueOutOfBoundsError, match="accelerations depend on q"):
        driven_pendulum().periodic({"q": 0.0, "u": 30.0}, 0.22, PLAIN, advance={"q": None})


def test_a_search_that_ends_at_rest_is_refused():
    with pytest.raises(mechc.MechcError, match="ended at an equilibrium"):
        van_der_pol().periodic({"q": 0.01}, 6.28)


def test_a_guess_that_does_not_last_a_period_is_refused():
    model, strike = walker()
    stop = mechc.Event("theta + 0.1", terminal=True)
    with pytest.raises(mechc.MechcError, match=r"does not last a period of 3\.9 s"):
        model.periodic({"theta": 0.2, "phi": 0.4, "w": -0.2}, 3.9, events=[strike, stop])


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        ({"hold": ["amplitude"]}, mechc.UnknownNameError),
        ({"advance": {"u": 1.0}}, mechc.UnknownNameError),
        ({"period": -1.0}, mechc.ValueOutOfBoundsError),
        ({"period": "one"}, mechc.MechcError),
    ],
)
def test_wrong_arguments_are_refused(wrong, error):
    with pytest.raises(error):
        van_der_pol().periodic({"q": 2.0}, **{"period": 6.6, **wrong})


def test_whole_turns_that_an_event_notices_are_no_cycle():
    once = mechc.Event("q - 5", reset={"u": "30"})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="an event or a contact does"):
        driven_pendulum().periodic({"q": 0.0, "u": 25.0}, 0.3, PLAIN, events=[once])


def test_the_energy_that_is_held_changes_with_the_parameter_that_is_followed():
    swing = mechc.compile(pendulum())
    cycle = swing.periodic({"q": 1.0}, 2.1, hold=["energy"], rtol=1e-12)
    branch = cycle.follow("l", (1.0, 1.5), step=0.02, most=3)
    low, middle, high = (swing.energy(cycle.y0, {"l": l}) for l in (0.999, 1.0, 1.001))
    slope = 0.5 * (high - low) / 0.002 / abs(middle)  # over its size and the ends' distance
    assert branch[0].shot.jacobian[-1, -1] == pytest.approx(slope, rel=1e-5)
    energies = [swing.energy(one.y0, one.params) for one in branch]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-7)
