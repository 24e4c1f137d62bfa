"""Position analysis of the four-bar against the law of cosines, and of its derivative."""

import numpy as np
import pytest

import mechc
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError
from tests.support.differences import extrapolated

REGULAR = (1.0, 2.0, 3.0, 3.5)
TURN = np.linspace(0.0, 2 * np.pi, 361)


def named(lengths):
    return {f"l_{k}": float(length) for k, length in enumerate(lengths)}


def by_cosines(crank, lengths, elbow):
    """theta_1 and theta_2 (n, 2) by the law of cosines; elbow: 1 up, -1 down, or one each."""
    l_0, l_1, l_2, l_3 = lengths
    gap = l_3 - l_0 * np.exp(1j * crank)
    d, slope = np.abs(gap), np.angle(gap)
    first = np.arccos(np.clip((l_1**2 + d**2 - l_2**2) / (2 * l_1 * d), -1, 1))
    second = np.arccos(np.clip((l_2**2 + d**2 - l_1**2) / (2 * l_2 * d), -1, 1))
    return np.stack([slope + elbow * first, slope - elbow * second], axis=-1)


def ratios(q, lengths):
    """theta_1 and theta_2 by theta_0, from l_0 z_0 + l_1 r_1 z_1 + l_2 r_2 z_2 = 0."""
    bend = np.sin(q[:, 1] - q[:, 2])
    first = lengths[0] * np.sin(q[:, 2] - q[:, 0]) / (lengths[1] * bend)
    second = lengths[0] * np.sin(q[:, 0] - q[:, 1]) / (lengths[2] * bend)
    return np.stack([first, second], axis=-1)


def apart(a, b):
    return np.abs(np.angle(np.exp(1j * (a - b)))).max()


@pytest.mark.parametrize("values", [TURN, TURN[::-1], TURN[:3], np.array([0.0, 3.0, 6.0])])
@pytest.mark.parametrize("elbow", [1, -1])
def test_a_crank_rocker_turns_as_the_law_of_cosines_says(model, values, elbow):
    start = by_cosines(values[0], REGULAR, elbow)
    guess = {"theta_1": float(start[0]), "theta_2": float(start[1])}
    sweep = model.sweep_positions("theta_0", values, guess=guess, params=named(REGULAR))
    assert apart(sweep.q[:, 1:], by_cosines(values, REGULAR, elbow)) < 1e-13
    if len(values) > 5:
        assert np.abs(np.diff(sweep.q, axis=0)).max() < 0.2  # angles go on, with no turn between
    np.testing.assert_array_equal(sweep["theta_0"], values)
    np.testing.assert_allclose(sweep.ratios[:, 0], 1.0)
    np.testing.assert_allclose(sweep.ratios[:, 1:], ratios(sweep.q, REGULAR), atol=1e-12)
    assert np.isnan(sweep.end)
    assert sweep.change_points.shape == (0,)


def test_points_are_those_of_the_states(model):
    sweep = model.sweep_positions("theta_0", TURN, params=named(REGULAR))
    y = model.assemble({"theta_0": TURN[70]}, params=named(REGULAR))
    np.testing.assert_allclose(sweep.points[70], model.points(y, named(REGULAR)), atol=1e-13)
    assert sweep.points.shape == (361, *sweep.points[70].shape)
    assert "theta_0, 361 values" in repr(sweep)


@pytest.mark.parametrize("instruction_set", [None, "baseline"])  # whose rounding differs
@pytest.mark.parametrize(
    "degrees",
    [np.arange(85.0, 275.0), np.arange(80.0, 275.0, 5.0), np.arange(84.5, 275.0), [60.0, 290.0]],
)
def test_through_a_change_point_it_goes_straight_on(degrees, instruction_set):
    """With lengths 1, 2, 3, 4 the elbow is up before 180 degrees and down behind them."""
    model, values = mechc.load("four_bar", instruction_set=instruction_set), np.radians(degrees)
    sweep = model.sweep_positions("theta_0", values)
    elbow = np.where(values < np.pi, 1.0, -1.0)
    exact = by_cosines(values, (1, 2, 3, 4), elbow)
    beside = np.abs(values - np.pi) > 1e-6
    assert apart(sweep.q[beside, 1:], exact[beside]) < 1e-10
    np.testing.assert_allclose(sweep.change_points, [np.pi], atol=2e-6)
    if not beside.all():
        (at,) = np.flatnonzero(~beside)
        assert np.abs(sweep.q[at, 1:]).max() < 1e-11
        ways = -3 + np.sqrt(6) * np.array([-1, 1])  # theta_1 / theta_2, to second order
        assert np.abs(sweep.ratios[at, 1] / sweep.ratios[at, 2] - ways).min() < 1e-8
        assert sweep.ratios[at] @ [-1, 2, 3] == pytest.approx(0, abs=1e-10)
    assert np.isnan(sweep.end)


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("step", [0.5, 1.0, 7.0])
def test_beside_a_change_point_it_stays_on_its_own_curve(model, gap, step):
    """A shorter ground link: the crank turns fully and the elbow stays where it was; a longer one:
    the crank stops short of 180 degrees."""
    values = np.radians(np.arange(85.0, 275.0, step))
    shorter = (1.0, 2.0, 3.0, 4.0 - gap)
    sweep = model.sweep_positions("theta_0", values, params=named(shorter))
    assert np.isnan(sweep.end)
    beside = np.abs(values - np.pi) > 1e-3
    exact = by_cosines(values, shorter, 1.0)
    assert apart(sweep.q[beside, 1:], exact[beside]) < 1e-10
    assert not len(sweep.change_points)
    longer = (1.0, 2.0, 3.0, 4.0 + gap)
    sweep = model.sweep_positions("theta_0", values, params=named(longer))
    limit = np.arccos((1.0 + longer[3] ** 2 - 25.0) / (2.0 * longer[3]))  # stretched: 5 m
    assert sweep.end == pytest.approx(limit, abs=1e-13 / np.sin(limit))
    assert np.isnan(sweep.q[values > limit]).all()
    assert np.isfinite(sweep.q[values < limit - 1e-6]).all()


def test_it_ends_where_the_crank_can_turn_no_further(model):
    lengths = (2.0, 1.0, 2.5, 2.4)
    low, high = (np.arccos((2.0**2 + 2.4**2 - d**2) / (2 * 2.0 * 2.4)) for d in (1.5, 3.5))
    middle = 0.5 * (low + high)
    for values, end in ((np.linspace(middle, 3.0, 50), high), (np.linspace(middle, 0.0, 9), low)):
        sweep = model.sweep_positions("theta_0", values, params=named(lengths))
        assert sweep.end == pytest.approx(end, abs=1e-12)
        inside = np.abs(values - middle) < abs(end - middle)
        assert np.isfinite(sweep.q[inside]).all()
        assert np.isnan(sweep.q[~inside]).all()


def test_parameters_may_be_many(model):
    params = {"l_3": np.array([[3.5, 4.0, 3.8], [4.01, 9.0, 3.6]]), "l_1": 2.0}
    sweep = model.sweep_positions("theta_0", TURN + 1.0, params=params)
    assert sweep.q.shape == (2, 3, 361, 3)
    assert sweep.points.shape[:3] == (2, 3, 361)
    assert np.isnan(sweep.q[1, 1]).all()  # does not close
    assert sweep.change_points.shape[:2] == (2, 3)
    for index, length in np.ndenumerate(params["l_3"]):
        if length < 5:
            one = model.sweep_positions("theta_0", TURN + 1.0, params={"l_3": length})
            np.testing.assert_array_equal(sweep.q[index], one.q)
            np.testing.assert_array_equal(sweep.end[index], one.end)


def test_any_coordinate_may_drive(model):
    crank = model.sweep_positions("theta_0", TURN[80:210], params=named(REGULAR))
    rocker = model.sweep_positions(
        "theta_2", crank["theta_2"], guess={"theta_0": TURN[80]}, params=named(REGULAR)
    )
    assert apart(rocker.q, crank.q) < 1e-12
    np.testing.assert_allclose(rocker.ratio("theta_0") * crank.ratio("theta_2"), 1.0, rtol=1e-9)


def test_what_cannot_be_done_is_said(model):
    with pytest.raises(AssemblyError, match=r"was found .* at theta_0 = .* least gap met is"):
        model.sweep_positions("theta_0", [0.5, 0.6], params={"l_0": 30.0})
    with pytest.raises(AssemblyError, match="theta_0 = 180 deg is a change point"):
        model.sweep_positions("theta_0", [np.pi, 4.0])
    with pytest.raises(ValueOutOfBoundsError, match="must rise or fall"):
        model.sweep_positions("theta_0", [1.0, 2.0, 1.5])
    with pytest.raises(ValueOutOfBoundsError, match="finite numbers"):
        model.sweep_positions("theta_0", [1.0, np.nan])
    with pytest.raises(UnknownNameError, match="theta_0"):
        model.sweep_positions("theta", [1.0, 2.0])


def test_the_transmission_angle_is_that_of_the_law_of_cosines(model):
    lengths = {"l_3": np.array([3.3, 3.5])}
    sweep = model.sweep_positions("theta_0", TURN, params=lengths)
    squared = 1.0 + lengths["l_3"][:, None] ** 2 - 2 * lengths["l_3"][:, None] * np.cos(TURN)
    wanted = np.abs((4.0 + 9.0 - squared) / 12.0)
    found = sweep.transmission_angle("p_1", "p_2", "p_3")
    np.testing.assert_allclose(np.cos(found), wanted, atol=1e-12)
    with pytest.raises(UnknownNameError, match="p_9"):
        sweep.transmission_angle("p_1", "p_9", "p_3")


@pytest.mark.slow
def test_derivatives_by_lengths():
    """Against differences of sweeps; where branches meet there is none."""
    model = mechc.load("four_bar", outputs=("energy", "points", "sensitivities"))
    values = TURN[::30]
    sets = {"l_3": np.array([3.3, 3.5])}
    sweep = model.sweep_positions("theta_0", values, params=sets)
    for name, given in (("l_0", 1.0), ("l_2", 3.0), ("l_3", sets["l_3"])):

        def moved(change, name=name, given=given):
            return model.sweep_positions("theta_0", values, params=sets | {name: given + change})

        wanted = extrapolated(lambda h: moved(h).q, 0.01)
        assert np.abs(sweep.sensitivity(name) - wanted).max() < 1e-9
        wanted = extrapolated(lambda h: moved(h).points, 0.01)
        assert np.abs(sweep.point_sensitivity(name) - wanted).max() < 1e-9
    through = model.sweep_positions("theta_0", np.radians([170.0, 180.0, 190.0]))
    by_length = through.sensitivity("l_3")
    assert np.isfinite(by_length[[0, 2]]).all()
    assert np.isnan(by_length[1, 1:]).all()
    assert (sweep.sensitivity("m_0") == 0).all()
