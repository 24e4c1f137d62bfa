"""What the families are judged by: closed forms, energies, and runs that must differ."""

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from benchmarks.problems.closed_loops import five_bar
from benchmarks.problems.data import reference
from benchmarks.problems.window_row import exact_row
from benchmarks.references.linkage_curve import PlanarLinkage
from benchmarks.stability import batches, crossings, long_runs, stiff, values
from benchmarks.stability.misses import near_misses, on_curve
from benchmarks.stability.silent import cases, redundant_loops
from tests.support.marks import slow_among


def test_the_pendulum_swings_as_its_equation_says():
    """The closed form's second derivative is -g sin(angle), and a quarter period is down."""
    with mp.workdps(30):
        for t in (0.3, 1.7, 1e5):
            before, at, after = (
                long_runs.swing(mp.mpf(1), mp.mpf(t) + d) for d in (-1e-4, 0.0, 1e-4)
            )
            assert (after[0] - before[0]) / 2e-4 == pytest.approx(at[1], abs=1e-6)
            assert (after[1] - before[1]) / 2e-4 == pytest.approx(-9.81 * np.sin(at[0]), abs=1e-6)


def test_the_modes_of_two_masses_satisfy_their_equation():
    modes = stiff.modes
    y0 = np.array([0.3, 0.31, 0.0, 0.0])
    y, k, c = modes(50.0, 2.0, y0, 0.7), 50.0, 2.0
    slope = (modes(50.0, 2.0, y0, 0.7 + 1e-5) - modes(50.0, 2.0, y0, 0.7 - 1e-5)) / 2e-5
    between = k * (y[1] - y[0]) + c * (y[3] - y[2])
    expected = [y[2], y[3], -10.0 * y[0] + between, -between / 2]
    np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-6)


def test_the_energy_of_a_run_that_gains_some_is_wrong(regular):
    """Twice the free fall is another motion: its energy is not kept."""
    given = dict(zip(regular.model.parameters, regular.params.tolist(), strict=True))
    assert values.judged("", regular, "four_bar", given)["word"] == "right"
    assert values.judged("", regular, "four_bar", given | {"g": 2 * 9.81})["word"] == "WRONG"


@pytest.mark.parametrize(
    "name", slow_among(["four_bar", "pendulum", "slider_crank", "flyball_governor"],
                       ["slider_crank", "flyball_governor"])
)  # fmt: skip
def test_kinetic_energies_are_those_of_the_mass_matrix(name):
    """SymPy's of the bodies and the compiled matrix, at random states."""
    model = values.model_of(name)
    given = dict(
        zip(model.parameters, model.system.parameter_set.resolve(None).tolist(), strict=True)
    )
    size = len(model.coordinates)
    states = np.random.default_rng(1).normal(size=(5, 2 * size))
    u, M = states[:, size:], model.mass_matrix(states)
    kinetic, _ = values.energy(name, states, given)
    np.testing.assert_allclose(kinetic, np.einsum("ni,nij,nj->n", u, M, u) / 2, rtol=1e-12)


def test_a_near_miss_is_bent_back_and_not_passed():
    """Right against 40 digits; held against the change point's own motion it would be wrong."""
    (row,) = near_misses.judged(4.0 - 1e-6, ["auto"], [1e-9])
    assert row["word"] == "right"
    straight_on, _ = near_misses.truth(4.0)
    bent_back, _ = near_misses.truth(4.0 - 1e-6)
    assert np.abs(straight_on - bent_back).max() > 1.0


def test_the_curves_of_the_silent_cases_end_where_collocation_in_quadruple_precision_does():
    """A four-bar's two near misses, and a double window that opens both."""
    lengths, masses = [2.796875, 3.7499999996978386, 2.796875], [0.792, 0.296, 4.489]
    bar = PlanarLinkage([-1, 0, 1], lengths, masses, [2], [(3.75, 0.0)])
    start = mechc.load("four_bar").assemble(
        {"theta_0": 1.2019444600348876}, {"omega_0": -2.2806280593736563},
        params={f"l_{k}": l for k, l in enumerate([*lengths, 3.75])},
        guess={"theta_1": -1.521, "theta_2": 0.418},
    )  # fmt: skip
    assert bar.integrate(start, np.array([4.0]))[0, 0] == pytest.approx(-1.729, abs=1e-3)
    row = exact_row([0.9999999999689277, 2.0])
    angles = [1.3746, 0.0, 1.3746 - np.pi, 0.0, 1.3746 - np.pi]
    start = np.array([*angles, -0.5656, 0.0, -0.5656, 0.0, -0.5656])
    assert row.integrate(start, np.array([2.5]))[0, 0] == pytest.approx(1.6966, abs=1e-4)


def test_a_run_on_the_other_branch_is_wrong():
    """Elbow down where the motion goes elbow up."""
    model, params = mechc.load("four_bar"), {"l_3": 3.5}
    start = model.assemble({"theta_0": 1.0}, {"omega_0": 1.0}, params=params)
    sol = model.simulate(1.0, start, params)
    given = "", sol, PlanarLinkage([-1, 0, 1], [1, 2, 3], [1, 2, 3], [2], [(3.5, 0.0)]), start
    assert on_curve.judged(*given, lambda y: y, 1.0, 1e-6)["word"] == "right"
    reach = 3.5 - np.exp(1j * sol.y[-1, 0])
    down = 2 * np.angle(reach) - sol.y[-1, 1:3]
    mirrored = lambda y: y if y is start else np.concatenate([y[:1], down, y[3:]])  # noqa: E731
    assert on_curve.judged(*given, mirrored, 1.0, 1e-6)["word"] == "WRONG"


def test_what_is_not_found_is_wrong():
    exact = np.arange(5.0)
    assert cases.alike("", exact, exact, 1e-9)["word"] == "right"
    assert cases.alike("", exact[:-1], exact, 1e-9)["word"] == "WRONG"
    assert cases.alike("", exact + 1e-6, exact, 1e-9)["word"] == "WRONG"


@pytest.mark.parametrize(("end", "speed"), [(redundant_loops.swinging, 0.0),
                                            (redundant_loops.turning, 9.0)])  # fmt: skip
def test_pendulums_by_jacobis_functions_are_those_of_their_equation(end, speed):
    run = solve_ivp(lambda t, y: [y[1], -12.0 * np.sin(y[0])], (0.0, 10.0), [2.0, speed],
                    method="DOP853", rtol=1e-12, atol=1e-12)  # fmt: skip
    angle, rate = end(12.0, 2.0, speed)
    assert np.exp(1j * angle) == pytest.approx(np.exp(1j * run.y[0, -1]), abs=1e-9)
    assert rate == pytest.approx(run.y[1, -1], abs=1e-9)


def test_a_member_that_differs_from_its_own_run_is_wrong(regular):
    assert batches.same("", regular, "finished", regular.y[-1])["word"] == "right"
    other = np.nextafter(regular.y[-1], np.inf)
    assert batches.same("", regular, "finished", other)["word"] == "WRONG"
    assert batches.same("", regular, "undecided", regular.y[-1])["word"] == "WRONG"


@pytest.mark.thorough
def test_a_folding_slider_crank_keeps_to_its_branch():
    row = next(crossings._slider_crank([1e-8]))
    assert row["word"] == "right"


def test_a_stiff_spring_moves_as_its_modes_do():
    rows = list(stiff._linear([1e6], [1e-6]))
    assert {row["word"] for row in rows} <= {"right", "flagged"}
    assert sum(row["word"] == "right" for row in rows) >= 4


@pytest.mark.parametrize("miss", [1e-3, -1e-8, 1e-13])
def test_the_curve_of_a_linkage_is_that_of_38_digits(miss):
    ground = 4.0 + miss
    known = reference("four_bar_near_misses")[repr(ground)]
    exact = np.array(known["3.0"], float)
    linkage = PlanarLinkage([-1, 0, 1], [1, 2, 3], [1, 2, 3], [2], [(ground, 0.0)])
    found = linkage.integrate(near_misses.start(ground), np.array([3.0]))[0]
    apart = max(np.abs(np.exp(1j * found[:3]) - np.exp(1j * exact[:3])).max(),
                np.abs(found[3:] - exact[3:]).max())  # fmt: skip
    assert apart < 1e-10
    moved = linkage.moved(0, 2.0**-51).integrate(near_misses.start(ground), np.array([3.0]))[0]
    rounded = np.abs(np.array(known["rounded"], float)).max()  # over twice as much
    assert np.abs(moved - found).max() == pytest.approx(rounded / 2, rel=0.2)


def test_the_judge_of_near_misses_leaps_to_no_other_branch():
    """Two gaps of 1e-14 m are passed in 1e-8 s; a step over both at once looks smooth."""
    linkage = exact_row([0.9999999999999737, 2.000000000000008])
    angles = [1.4687954935852696, 0.0, -1.6727971600045501, 0.0, -1.6727971600045157]
    rates = [2.673775096567639, 0.0, 2.673775096567639, 0.0, 2.673775096567638]
    start = np.array(angles + rates)
    ends = [
        linkage.integrate(start, np.linspace(0.0, 1.0, count + 1)[1:], tolerance)[-1]
        for count in (1, 10)
        for tolerance in (1e-13, 1e-14, 1e-15)
    ]
    np.testing.assert_allclose(ends, [ends[0]] * len(ends), rtol=0, atol=1e-6)


@pytest.mark.thorough
def test_the_judge_of_five_bars_keeps_its_loop_and_its_energy():
    """Its equations of motion know none, and do not project."""
    model = mechc.compile(five_bar())
    params = dict.fromkeys("abcd", 1.0) | {"g": 2.0}
    guess = {"q_2": -1.4, "q_3": 0.7}
    first = model.assemble({"q_0": 1.2, "q_1": -0.9}, {"u_0": 0.5}, guess, params)
    end = crossings.five_bar_end(first, params, 1e-12, 1.5)
    assert np.abs(model.constraints(end, params)).max() < 1e-10
    assert energy_of(params, end) == pytest.approx(energy_of(params, first), abs=1e-9)
    assert abs(end - first).max() > 0.5


def energy_of(params, state):
    """Of the rods' centres, and of their turning about these."""
    lengths = np.array([params[name] for name in "abcd"])
    angles, u = np.cumsum(state.reshape(2, 4), axis=1)
    vectors = lengths * np.exp(1j * angles)
    centres = np.cumsum(vectors) - vectors / 2
    speeds = np.cumsum(1j * vectors * u) - 1j * vectors * u / 2
    turning = (lengths * u) ** 2 / 12
    return float((abs(speeds) ** 2 + turning).sum() / 2 + 9.81 * centres.imag.sum())
