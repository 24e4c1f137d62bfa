"""Motions under laws of samples: steps end at the knots of tables, by every method."""

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle

METHODS = ["auto", "dopri5", "dop853", "gauss8", "radau5"]
t = dynamicsymbols._t
q, u = dynamicsymbols("q u")
c, k, w, x0 = sm.symbols("c k w x0")
TIMES = np.array([0.0, 0.7, 0.75, 2.1, 3.0, 3.02, 4.9, 6.0])
VALUES = np.array([0.0, 5.0, -3.0, 2.0, 8.0, -8.0, 1.0, 0.0])


def compiled(force, **options):
    return mechc.compile(particle([q], [u], [force], 1), **options)


@pytest.fixture(scope="module")
def load_curves():
    """Under a load curve as a table of time, and as a signal."""
    F = dynamicsymbols("F")
    table = mechc.Table(TIMES, VALUES, kind="linear")
    return compiled(-9 * q + table(t)), compiled(-9 * q + F)


@pytest.mark.parametrize("method", METHODS)
def test_a_load_curve_moves_as_its_signal_does(load_curves, method):
    by_table, by_signal = load_curves
    inputs = {"F": mechc.Signal(TIMES, VALUES, "linear")}
    exact = by_signal.simulate(6.0, [0.0, 1.0], inputs=inputs, rtol=1e-13).y[-1]
    sol = by_table.simulate(6.0, [0.0, 1.0], method=method, rtol=1e-9)
    assert abs(sol.y[-1] - exact).max() < 2e-9
    assert all(abs(sol.t - knot).min() < 1e-13 for knot in TIMES[1:-1])
    back = by_table.simulate((6.0, 0.0), sol.y[-1], method=method, rtol=1e-9)
    assert abs(back.y[-1] - [0.0, 1.0]).max() < 4e-9


@pytest.fixture(scope="module")
def road():
    """A force over a stretch of the way, its work 3/2 c."""
    stretch = mechc.Table([-1, -0.5, 0.5, 1], [0, 1, 1, 0], kind="linear", outside="hold")
    return compiled(c / w * stretch((q - x0) / w))


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("method", METHODS)
def test_no_bump_is_narrower_than_a_step(road, method):
    rng = np.random.default_rng(1)  # with two knots a part of 1e-5 of a step apart
    params = {"c": rng.uniform(0.02, 0.5, 40), "w": 10 ** rng.uniform(-4, 0, 40),
              "x0": rng.uniform(1, 9, 40)}  # fmt: skip
    batch = road.simulate_batch(12.0, [-1.0, 1.0], params, method=method, rtol=1e-9)
    speeds = np.sqrt(1 + 3 * params["c"])
    assert abs(batch.y[:, 1] - speeds).max() < 1e-7, params
    one = {name: float(values[7]) for name, values in params.items()}
    alone = road.simulate(12.0, [-1.0, 1.0], one, method=method, rtol=1e-9)
    np.testing.assert_array_equal(alone.y[-1], batch.y[7])


@pytest.mark.parametrize("method", METHODS)
def test_a_bump_of_a_spline_is_seen(method):
    x = np.linspace(0.0, 10.0, 501)
    bump = mechc.Table(x, 10 * np.exp(-(((x - 5) / 0.03) ** 2)), outside="hold")
    sol = compiled(bump(q)).simulate(8.0, [0.0, 1.0], method=method, rtol=1e-9)
    fine = np.linspace(4.5, 5.5, 10001)
    work = np.trapezoid(bump(fine), fine)
    assert sol["u"][-1] == pytest.approx(np.sqrt(1 + 2 * work), rel=1e-8)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("method", ["dopri5", "auto"])
def test_an_argument_may_be_no_number_where_the_table_is_not_used(method):
    law = mechc.Table([0.0, 0.3, 0.7, 1.0], [0.0, 1.0, -1.0, 0.0], kind="linear", outside="repeat")
    model = compiled(-q + sm.Piecewise((law(sm.sqrt(q)), q > 0), (0, True)))
    sol = model.simulate(5.0, [0.5, 0.3], method=method, rtol=1e-8)

    def rates(_, y):
        return [y[1], -y[0] + (float(law(np.sqrt(y[0]))) if y[0] > 0 else 0.0)]

    known = solve_ivp(rates, (0.0, 5.0), [0.5, 0.3], rtol=1e-10, atol=1e-12, max_step=0.01)
    assert sol.y[:, 0].min() < -0.1
    np.testing.assert_allclose(sol.y[-1], known.y[:, -1], atol=1e-6)


@pytest.mark.slow
def test_derivatives_follow_over_knots():
    law = mechc.Table([-2, -0.5, 0.1, 0.7, 2], [3, 0.2, -0.3, -0.8, -4], kind="linear")
    model = compiled(c * law(k * q) - law(q).diff(q))
    given = {"c": 2.0, "k": 1.3}

    def end(**changed):
        return model.simulate(4.0, [0.3, 1.0], given | changed, rtol=1e-12).y[-1]

    h = 1e-5
    differences = [
        (end(**{name: value + h}) - end(**{name: value - h})) / (2 * h)
        for name, value in given.items()
    ]
    sol = model.simulate(4.0, [0.3, 1.0], given, sensitivities=["c", "k"], rtol=1e-10)
    found = [sol.sensitivity[name][-1] for name in given]
    np.testing.assert_allclose(found, differences, atol=2e-7)
