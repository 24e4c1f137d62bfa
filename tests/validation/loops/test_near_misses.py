"""Near misses that a step's ends alone do not show; the ends of the motion were integrated by
Gauss collocation in quadruple precision."""

import numpy as np
import pytest
from mechc_codegen.library.planar.slider_crank import slider_crank

import mechc
from benchmarks.problems.closed_loops import five_bar
from benchmarks.problems.window_row import window_row
from benchmarks.references.closure_curve import Geometry
from benchmarks.stability import crossings, random_starts
from benchmarks.stability.misses import near_misses, window_misses

METHODS = ("dopri5", "dop853", "gauss8")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_two_near_misses_within_one_step_are_seen(method, rtol):
    model = mechc.load("four_bar")
    lengths = {"l_0": 2.796875, "l_1": 3.7499999996978386, "l_2": 2.796875, "l_3": 3.75}
    params = lengths | {"m_0": 0.792, "m_1": 0.296, "m_2": 4.489}
    start = model.assemble(
        {"theta_0": 1.2019444600348876}, speeds={"omega_0": -2.2806280593736563}, params=params,
        guess={"theta_1": -1.521, "theta_2": 0.418},
    )  # fmt: skip
    sol = model.simulate(4.0, start, params, rtol=rtol, method=method)
    assert sol.status.ok
    assert abs(sol["theta_0"][-1] + 1.729) < 1e-3


@pytest.fixture(scope="module")
def windows():
    return mechc.compile(window_row(2))


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_second_weak_row_is_followed_behind_the_first(windows, method, rtol):
    params = {"g_1": 0.9999999999689277, "g_2": 2.0}
    angle = 1.3746
    upright = {"q_1": -angle, "q_2": angle - 3.14, "q_3": 0.0, "q_4": angle - 3.14}
    start = windows.assemble({"q_0": angle}, speeds={"u_0": -0.5656}, params=params, guess=upright)
    sol = windows.simulate(2.5, start, params, rtol=rtol, method=method)
    assert sol.status.ok
    assert abs(sol["q_0"][-1] - 1.6966) < 2e-4


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", "gauss8"])
@pytest.mark.parametrize(
    ("gap", "angle", "speed"),
    [
        (-2.38e-10, 1.3662538804729476, -0.25138442230999125),
        (-1.472e-9, 2.242278299587178, -2.695507476623075),
        (1.94930527e-4, 1.0118410103164521, 1.090834221184939),
        (-1.191175633e-3, 1.9857911252960534, -0.8793652468990896),
    ],
)
def test_a_change_point_beside_a_near_miss_is_not_left_to_rounding(
    windows, method, gap, angle, speed
):
    """The first window misses its change point, the second is a rhombus: its coupler stays level
    and its rods parallel, as far as the run goes."""
    params = {"g_1": round(1 + gap, 12), "g_2": round(2 + gap, 12)}
    upright = {"q_1": -angle, "q_2": angle - np.pi, "q_3": 0.0, "q_4": angle - np.pi}
    start = windows.assemble({"q_0": angle}, speeds={"u_0": speed}, params=params, guess=upright)
    sol = windows.simulate(3.0, start, params, rtol=1e-8, method=method, max_steps=5000)
    angles = np.array([window_misses.absolute(y)[:5] for y in sol.y])
    assert np.abs(np.exp(1j * angles[:, 3]) - 1).max() < 1e-5
    assert np.abs(np.exp(1j * angles[:, 4]) - np.exp(1j * angles[:, 2])).max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "rtol", "grounds", "angles", "speed", "t_end", "exact"),
    [
        # behind a folded window, whose row stays weak, the other passes its near miss
        (
            "dopri5", 1e-6, (0.9999999985458838, 1.9999999985465882),
            (2.1278470774111184, -2.1278470765054243, -1.0137455787974758, -1.0137455787966463,
             1.0137455778905133), 2.505209175546714, 3.9671888338594936, 0.158792813,
        ),
        # both windows pass theirs, and back, between two nodes of one step
        (
            "gauss8", 1e-3, (1.0000000000823341, 2.0000000000785167),
            (-0.17957464238550358, 0.17957464193194728, 2.9620180111968772, 4.7e-10,
             2.962018010743664), -2.034790958547516, 1.8547763359267213, -7.54493e-05,
        ),
    ],
)  # fmt: skip
def test_what_turns_between_two_nodes_is_looked_for(
    windows, method, rtol, grounds, angles, speed, t_end, exact
):
    params = dict(zip(("g_1", "g_2"), grounds, strict=True))
    guess = {f"q_{k}": angles[k] for k in range(1, 5)}
    start = windows.assemble({"q_0": angles[0]}, speeds={"u_0": speed}, params=params, guess=guess)
    sol = windows.simulate(t_end, start, params, rtol=rtol, method=method)
    assert sol.status.ok
    assert abs(sol["q_0"][-1] - exact) < 100 * rtol


@pytest.mark.slow
def test_a_bend_that_a_step_cuts_short_is_seen_by_the_work_done():
    """The step's own estimate misses it: 1 % of the kinetic energy was made within one step."""
    found = window_misses.case(1078, narrowest=15.0, widest=13.0)
    assert found["word"] in ("right", "flagged"), found


@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_every_passage_within_a_step_is_counted(method, rtol):
    """A folded slider-crank turns with a constant acceleration: its steps are as long as half turns
    and more, and it passes a change point in each."""
    model = mechc.compile(slider_crank())
    start = np.array([0.3, 0.3 + np.pi, 0.0, 3.0, 3.0, 0.0])
    sol = model.simulate(4.0, start, {"l_0": 0.75, "l_1": 0.75}, rtol=rtol, method=method)
    passed = np.pi * (np.arange(1, sol["theta"][-1] / np.pi + 0.5) - 0.5)
    found = [sol(point.t)[0] for point in sol.change_points]
    assert len(passed) > 20
    np.testing.assert_allclose(found, passed, rtol=0, atol=1e-6)


@pytest.mark.parametrize("first_step", [0.005406117116493173, 0.00552])
def test_passages_before_the_first_one_that_is_examined_are_counted(first_step):
    """A step of radau5 leads over eight of them, with a good conditioning at all its nodes."""
    model = mechc.compile(slider_crank())
    start = np.array([0.3, 0.3 + np.pi, 0.0, 3.0, 3.0, 0.0])
    lengths = {"l_0": 0.75, "l_1": 0.75}
    sol = model.simulate(4.0, start, lengths, rtol=1e-4, method="radau5", first_step=first_step)
    assert np.diff(sol["theta"]).max() > 8.0 * np.pi
    assert len(sol.change_points) == int(sol["theta"][-1] / np.pi + 0.5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_run_that_ends_at_a_change_point_is_right_or_says_so(method, rtol):
    """Rounding is magnified there, in speeds by the square of the conditioning."""
    curve = Geometry(
        np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[-1.0, 1.0, 1.0]]),
        np.array([[1.0, 2.0, 3.0]]), np.array([False]),
    )  # fmt: skip
    psi, model = np.array([[2.0], [3.0]]), mechc.load("four_bar")
    start = curve.state(psi)[0]
    passed = model.simulate(2.0, start, rtol=1e-12).change_points[0].t
    for off in 10.0 ** -np.arange(4, 13):
        for t_end in (passed - off, passed + off):
            sol = model.simulate(t_end, start, rtol=rtol, method=method, dense=False)
            exact = curve.state(curve.integrate(psi, np.array([t_end]))[-1])[0]
            assert sol.status.code in ("finished", "no step fits")
            if sol.status.ok:
                assert random_starts.error_of(sol.y[-1], exact) < 100 * rtol + 1e-9
    assert model.simulate(passed - 1e-3, start, rtol=rtol, method=method).status.ok


def test_the_last_step_may_be_the_one_that_finds_the_change_point():
    """Its end, 1.4e-11 s before, had speeds that rounding decided; the run said finished."""
    lengths = [2.3924522399902344, 3.3053646087646484, 2.0769386291503906, 3.620878219604492]
    params = dict(zip(("l_0", "l_1", "l_2", "l_3"), lengths, strict=True))
    start = [1.01545001, -0.05488404, -2.04094922, 1.71896495, -0.11570356, 1.8986287]
    model = mechc.load("four_bar")
    y0 = model.assemble(
        {"theta_0": start[0]}, {"omega_0": start[3]},
        {"theta_1": start[1], "theta_2": start[2]}, params,
    )  # fmt: skip
    passed = model.simulate(2.0, y0, params, rtol=1e-12).change_points[0].t
    for off in (0.0, -1.4e-11, 1.4e-11, -1e-9, 1e-9, -1e-6):
        sol = model.simulate(passed + off, y0, params, rtol=1e-4, method="gauss8")
        wanted = model.simulate(passed + 0.1, y0, params, rtol=1e-11)(passed + off)
        assert sol.status.ok
        np.testing.assert_allclose(sol.y[-1], wanted, rtol=0, atol=1e-6)


@pytest.mark.parametrize("method", ["gauss8", "radau5"])
def test_rounding_does_not_grow_over_many_passages(method):
    """The motion turns round 0.01 rad beyond a change point, which it passes 40 times: rounding of
    the closure, magnified there, moves its end by 1e-8 to 6e-8."""
    curve = Geometry(
        np.array([[4.4, 6.7, 0.7, 10.4]]), np.array([[1.0, 1.0, -1.0]]),
        np.array([[1.0, 2.0, 3.0]]), np.array([False]),
    )  # fmt: skip
    psi, model = np.array([[0.14014414], [0.0]]), mechc.load("four_bar")
    params = {f"l_{k}": length for k, length in enumerate(curve.lengths[0].tolist())}
    exact = curve.state(curve.integrate(psi, np.array([100.0]))[-1])[0]
    sol = model.simulate(100.0, curve.state(psi)[0], params, rtol=1e-12, method=method, dense=False)
    assert len(sol.change_points) == 40
    assert random_starts.error_of(sol.y[-1], exact) < 2e-9


@pytest.mark.slow
def test_a_leap_to_the_other_branch_is_seen_though_the_directions_turn_smoothly():
    """By dopri5 at 1e-6, past a gap of 9e-14 m, while other links are fast."""
    assert window_misses.case(2279)["word"] == "right"


@pytest.mark.parametrize("ground", [4.000000000000001, 3.999999999999999, 3.9999999999999996])
def test_gaps_below_rounding_are_no_change_point(ground):
    sol = mechc.load("four_bar").simulate(3.0, near_misses.start(ground), {"l_3": ground})
    assert sol.status.code == "undecided"
    assert f"{abs(ground - 4.0):.1e} m" in sol.status.cause


@pytest.mark.parametrize(
    "lengths",
    [
        (7.6, 3.8, 7.7, 3.7),  # as typed, not as stored
        (0.4, 0.3, 0.2, 0.1 + 0.2),  # computed: 0.30000000000000004
        (1.0 + 2**-20, 2.0, 2.5 - 2**-20, 3.5 - 2**-19),  # as stored: of seventeen digits
    ],
)
def test_lengths_as_given_make_a_change_point(lengths):
    params = dict(zip(("l_0", "l_1", "l_2", "l_3"), lengths, strict=True))
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 5.0}, params=params)
    sol = model.simulate(5.0, start, params)
    assert sol.status.ok, str(sol.status)
    assert sol.change_points


@pytest.mark.parametrize(
    "family",
    [
        crossings.equal_lengths,
        pytest.param(crossings.decimal_lengths, marks=pytest.mark.slow),
    ],
)
def test_neutral_four_bars_pass_their_change_points(family):
    words = {row["case"]: row["word"] for row in family(True)}
    assert set(words.values()) == {"right"}, words


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_a_five_bar_goes_around_its_critical_configurations(method):
    """Random lengths, some neutral; a leap onto another sheet would lose energy."""
    model = mechc.compile(five_bar())
    for seed in range(40):
        rng = np.random.default_rng(seed)
        lengths = np.round(rng.uniform(0.5, 2.0, 4), 2)
        neutral = abs(float(lengths @ rng.choice([-1.0, 1.0], 4)))
        ground = neutral if 0.4 < neutral < 4.0 else 1.5
        params = dict(zip("abcd", lengths.tolist(), strict=True)) | {"g": ground}
        try:
            angles = dict(zip(("q_0", "q_1"), rng.uniform(-3, 3, 2), strict=True))
            start = model.assemble(angles, speeds={"u_0": 1.0, "u_1": -1.0}, params=params)
        except mechc.MechcError:
            continue  # these lengths do not reach
        sol = model.simulate(10.0, start, params, rtol=1e-9, method=method)
        assert sol.status.ok, (seed, str(sol.status))
        assert sol.energy_drift < 1e-6, seed
