"""Sheets of configurations on which rows depend on each other throughout.

The collapsed tongs are an open pendulum, whose equations are written down apart; the multipliers
are the least ones by a pseudo-inverse.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from benchmarks.problems.closed_loops import locomotive
from tests.support.linkages.lazy_tongs import Tongs

TONGS, T_END = Tongs(3), 5.0
SEEDS = (1, 4, 7)  # of starts from which the dependent row is long for a rounding, now and then
TIMES = np.linspace(0.0, T_END, 1000)


@pytest.fixture(scope="module")
def model():
    return TONGS.compiled(outputs=("multipliers",))


def random_start(seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, TONGS.pairs), rng.normal(size=TONGS.pairs)


@pytest.fixture(scope="module", params=SEEDS)
def run(model, request):
    return model.simulate(T_END, TONGS.collapsed(*random_start(request.param)), rtol=1e-9)


def absolute(y):
    """Angles and speeds (n, pairs) of the first chain's bars."""
    n = TONGS.pairs
    return np.cumsum(y[:, :n], axis=1), np.cumsum(y[:, 2 * n : 3 * n], axis=1)


def least_multipliers(model, y, rates):
    """Those of least norm by which J^T lambda = F - M u'."""
    rows = model.constraint_jacobian(y)
    inertia = np.einsum("...ij,...j", model.mass_matrix(y), rates[:, len(model.coordinates) :])
    columns = np.linalg.pinv(np.swapaxes(rows, -1, -2), rcond=1e-9)
    return np.einsum("...ij,...j", columns, model.forcing(y) - inertia)


@pytest.mark.slow(cases=99)
def test_a_run_is_the_pendulum(run):
    angles, speeds = (np.asarray(values[0]) for values in absolute(run.y[:1]))
    n = TONGS.pairs
    known = solve_ivp(
        lambda t, x: np.append(x[n:], TONGS.pendulum_rates(x[:n], x[n:])), (0, T_END),
        np.append(angles, speeds), method="DOP853", rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    end = np.concatenate(absolute(run.y[-1:]), axis=1)[0]
    np.testing.assert_allclose(end, known.y[:, -1], rtol=0, atol=1e-6)


def test_states_of_a_run_have_its_rank(model, run):
    """Also evaluated by themselves, where the dependent row is short by their rounding."""
    y, n = run(TIMES), TONGS.pairs
    known = np.array([TONGS.pendulum_rates(*state) for state in zip(*absolute(y), strict=True)])
    relative = np.diff(known, axis=1, prepend=0.0)
    scale = np.abs(known).max()
    multipliers = least_multipliers(model, y, model.rhs(TIMES, y))
    for rates in (
        model.rhs(TIMES, y),
        [model.rhs(0, one) for one in y],
        run.output("rates", TIMES),
    ):
        found = np.array(rates)[:, 2 * n :].reshape(-1, 2, n)
        np.testing.assert_allclose(found[:, 0], relative, rtol=0, atol=1e-9 * scale)
        np.testing.assert_allclose(found[:, 1], relative, rtol=0, atol=1e-9 * scale)
    for found in (model.multipliers(y), run.output("multipliers", TIMES)):
        np.testing.assert_allclose(
            found, multipliers, rtol=0, atol=1e-9 * np.abs(multipliers).max()
        )


def test_beside_the_regular_sheet_no_row_is_lost(model):
    """Its two angles nearly meet where the sheets cross; rounding counts by the square of that."""
    for apart in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5):
        angles, speeds = np.array([-0.4, -0.4 + apart]), np.array([0.7, 0.7 - 0.3 * apart])
        y = TONGS.regular(angles, speeds)
        found = model.rhs(0, y)[2 * TONGS.pairs :].reshape(2, -1)[:, 0]
        known = TONGS.regular_rates(angles, speeds)
        np.testing.assert_allclose(found, known, rtol=0, atol=1e-12 + 1e-13 / apart**2)


def test_reductions_of_a_batch_do_as_the_run_does(model):
    starts = np.array([TONGS.collapsed(*random_start(seed)) for seed in SEEDS])
    batch = model.simulate_batch(
        T_END, starts, reduce="max(norm(multipliers))", rtol=1e-9, progress=False
    )
    for start, most in zip(starts, batch["max(norm(multipliers))"], strict=True):
        y = model.simulate(T_END, start, rtol=1e-9)(np.linspace(0.0, T_END, 2000))
        sizes = np.linalg.norm(least_multipliers(model, y, model.rhs(0, y)), axis=1)
        assert most == pytest.approx(sizes.max(), rel=0.02)


@pytest.mark.slow
def test_rows_that_closed_loops_alone_make_dependent_are_told_as_well():
    """Wheels joined by two rods: all turn alike, with redundant rows."""
    model = mechc.compile(locomotive(3))
    y = model.assemble(
        {"q_wheel_0": 0.3}, {"u_wheel_0": 3.0}, guess=dict.fromkeys(model.coordinates[1:], 0.3)
    )
    run = model.simulate(T_END, y, rtol=1e-9)
    found = model.rhs(TIMES, run(TIMES))[:, len(model.coordinates) :]
    # discs of inertia 1/2, and two rods of 1 kg in translation on pins at radius 1
    turned = run(TIMES)[:, model.coordinates.index("q_wheel_0")]
    known = -9.81 * (np.cos(turned) - np.sin(turned)) / (3 * 0.5 + 2 * 1.0)
    for name, column in zip(model.speeds, found.T, strict=True):
        expected = known if "wheel" in name else -known  # a rod's angle is to its wheel
        np.testing.assert_allclose(column, expected, rtol=0, atol=1e-9)
