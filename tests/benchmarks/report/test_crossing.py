"""The picture of the README: mechc is on the exact motion, solve_ivp is not, and says nothing."""

import numpy as np
import pytest

from benchmarks.problems.data import four_bar_state
from benchmarks.report import crossing


@pytest.mark.slow
def test_mechc_follows_the_exact_motion_and_solve_ivp_takes_other_branches(monkeypatch, tmp_path):
    found = crossing.motions()
    exact = found[crossing.EXACT]
    for k in range(0, len(exact), 50):
        known = np.degrees(four_bar_state("change_point", crossing.TIMES[k])[0])
        assert abs(exact[k] - known) < 1e-6
    assert abs(found[crossing.MECHC] - exact).max() < 1e-6
    for method in crossing.SCIPY:
        assert len(found[method]) == len(exact)  # to the end, with success
        assert abs(found[method] - exact).max() > 90
    monkeypatch.setattr(crossing, "motions", lambda: found)
    assert crossing.main(["--out", str(tmp_path / "picture.svg")]) == 0
    drawn = (tmp_path / "picture.svg").read_text("utf-8")
    assert drawn.count("<path") > 5
