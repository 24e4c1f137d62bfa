"""Rows of four-bar windows, problem A02: one degree of freedom, N + 1 where all lie flat.

In relative angles and turned, so that nothing stays zero by luck; against the closed form.
"""

import numpy as np
import pytest

import mechc
from benchmarks.problems.windows_motion import first_upright, upright_start

pytestmark = pytest.mark.slow  # scenes that take long to compile

TILT = {"tilt": 0.3}
FIRST_HALF = 6.0  # seconds: six times through the flat position
# Where all rows lose rank together, rounding is magnified into the motion; see docs/growth.md.
FLOOR = 1e-6


@pytest.fixture(scope="module", params=[2, 5])
def row(request):
    return request.param, mechc.load("windows", count=request.param)


def error_of(count, model, sol):
    """How far the first upright's end is off (m), at the times reported."""
    places = model.points(sol.y, sol.params)[:, model.point_names.index("B_0"), :2]
    c, s = np.cos(TILT["tilt"]), np.sin(TILT["tilt"])
    return np.abs(places @ np.array([[c, -s], [s, c]]) - first_upright(count, sol.t)).max()


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12])
def test_a_row_of_windows_follows_the_closed_form_at_every_tolerance(row, rtol):
    count, model = row
    sol = model.simulate(20.0, upright_start(count), TILT, rtol=rtol, t_eval=np.arange(0, 20, 0.05))
    assert sol.status.ok, str(sol.status)
    assert error_of(count, model, sol) < max(1e3 * rtol, FLOOR)
    assert len(sol.change_points) == 20


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.2])
def test_however_the_row_is_turned_no_run_ends_well_and_wrong(row, angle):
    count, model = row
    for rtol in (1e-6, 1e-9):
        sol = model.simulate(FIRST_HALF, upright_start(count), {"tilt": angle}, rtol=rtol,
                             t_eval=np.arange(0, FIRST_HALF, 0.05))  # fmt: skip
        q = sol.q[:, 0]
        place = np.stack([np.cos(q), np.sin(q)], axis=1)
        error = np.abs(place - first_upright(count, sol.t)).max()
        assert error < max(1e3 * rtol, FLOOR)
