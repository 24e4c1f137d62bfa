"""The four-bar along the tangent of its closure."""

import numpy as np
from scipy.integrate import solve_ivp

import mechc
from benchmarks.problems.data import four_bar_state
from benchmarks.references import tangent


def test_the_motion_along_the_tangent_is_the_exact_one():
    """Written without a constraint; the reference states have 16 digits."""
    y0 = mechc.load("four_bar").assemble({"theta_0": np.radians(85)}, params={"l_3": 3.5})
    bar = tangent.TangentBar((1.0, 2.0, 3.0, 3.5), (1.0, 2.0, 3.0))
    exact = four_bar_state("regular", 5.0)
    run = solve_ivp(lambda t, y: bar.rates(y.tolist()), (0.0, 5.0), [*y0[:3], 0.0],
                    method="DOP853", rtol=1e-12, atol=1e-12)  # fmt: skip
    end = bar.state(run.y[:, -1].tolist())
    np.testing.assert_allclose(end, exact, rtol=0, atol=1e-9)
