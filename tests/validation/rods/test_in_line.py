"""Cranks joined by massless rods, each a single distance: where links come in line every row of the
constraints' Jacobian vanishes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.fuzz.scenes import TOPOLOGIES, compiled

pytestmark = pytest.mark.slow  # scenes that take long to compile

METHODS = ("dopri5", "dop853", "gauss8", "radau5")
GRAVITY = 9.81 * 0.8  # in the plane of the cranks, which is inclined


def equal_cranks(topology, pivots, r, masses):
    """Parameters of cranks that stay parallel."""
    params = {"g": 9.81}
    for k, (x, y) in enumerate(pivots):
        values = (x, y, 0.0, 0.0, 0.0, r, 0.0, masses[k])
        params |= dict(zip((f"{kind}_{k}" for kind in "xyzabrhm"), values, strict=True))
    for i, j in TOPOLOGIES[topology].rods:
        params[f"L_{i}{j}"] = float(np.hypot(*np.subtract(pivots[j], pivots[i])))
    return params


def pendulum(r, start, t_end):
    """Angle and speed at the end: all cranks turn as a point at their radius does."""
    run = solve_ivp(
        lambda t, y: [y[1], -GRAVITY / r * np.cos(y[0])], (0, t_end), start,
        method="DOP853", rtol=3e-14, atol=1e-14,
    )  # fmt: skip
    return run.y[:, -1]


def moves_as_a_pendulum(topology, pivots, r, start, t_end, rtol, method):
    count = len(pivots)
    params = equal_cranks(topology, pivots, r, np.linspace(1.0, 2.0, count))
    y0 = np.repeat(start, count)
    sol = compiled(topology).simulate(t_end, y0, params, rtol=rtol, method=method)
    assert sol.status.ok, sol.status
    exact = np.repeat(pendulum(r, start, t_end), count)
    assert np.abs(sol.y[-1] - exact).max() < 300 * rtol * (1 + sol.t[-1]) + 1e-10
    return sol


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("method", METHODS)
def test_a_rod_in_line_with_two_cranks_is_passed(method, rtol):
    """The only row vanishes there, and nothing but its former length tells that it is short."""
    pivots = [(0.0, 0.0), (3.0, 0.0)]
    moves_as_a_pendulum("one loop", pivots, 1.0, [0.5, -3.0], 5.0, rtol, method)


def test_change_points_of_a_rod_are_counted():
    pivots = [(0.0, 0.0), (3.0, 0.0)]
    sol = moves_as_a_pendulum("one loop", pivots, 1.0, [0.5, -3.0], 5.0, 1e-8, "auto")
    assert len(sol.change_points) == 5  # at angles 0, -pi ... -4 pi


@pytest.mark.parametrize("method", METHODS)
def test_three_cranks_pass_where_their_rods_vanish_together(method):
    pivots = [(-0.3, 0.0), (2.4, 0.0), (3.5, 0.0)]
    start = [-0.31796472857518555, 0.46851965]
    moves_as_a_pendulum("two loops, one rod redundant", pivots, 1.2, start, 1.0, 1e-8, method)


@pytest.mark.parametrize("method", METHODS)
def test_three_cranks_pass_where_their_rods_vanish_one_after_the_other(method):
    """Pivots are nearly in line, and near the start other configurations close that cannot move."""
    pivots = [
        (0.45536430090951885, -0.2573852132926189),
        (2.372650501511681, 0.01402597339131906),
        (3.701913527152048, 0.18395007454037116),
    ]
    r, start = 1.8969283630269909, [0.18010205, 0.0]
    moves_as_a_pendulum("two loops, one rod redundant", pivots, r, start, 1.0, 1e-8, method)


def test_a_start_where_the_only_row_vanishes_takes_the_branch_of_its_speeds():
    params = equal_cranks("one loop", [(0.0, 0.0), (3.0, 0.0)], 1.0, [1.0, 2.0])
    model = compiled("one loop")
    along = model.simulate(0.2, [0.0, 0.0, 1.0, 1.0], params, rtol=1e-9)
    assert along.status.ok
    assert np.abs(along.y[-1] - np.repeat(pendulum(1.0, [0.0, 1.0], 0.2), 2)).max() < 1e-8
    between = model.simulate(0.2, [0.0, 0.0, 1.0, 0.5], params, rtol=1e-9)
    assert between.status.code == "at a change point"


def test_a_start_where_rows_vanish_that_are_redundant_elsewhere():
    pivots = [(0.0, 0.0), (3.0, 0.0), (4.5, 0.0)]
    name = "two loops, one rod redundant"
    params = equal_cranks(name, pivots, 1.0, [1.0, 2.0, 1.5])
    sol = compiled(name).simulate(0.2, [0.0] * 3 + [1.0] * 3, params, rtol=1e-9)
    assert sol.status.ok
    assert np.abs(sol.y[-1] - np.repeat(pendulum(1.0, [0.0, 1.0], 0.2), 3)).max() < 1e-8
