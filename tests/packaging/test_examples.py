"""The example programs run, end at what they say, and draw it."""

import re
import runpy

import pytest

from tests.support import ROOT

pytestmark = pytest.mark.slow(cases=5)  # each is a program
SHOWN = {
    "balancing_controller": r"in a batch the first of 20 ends 0\.0e\+00 apart(?s:.)*"
    r"finished after 600 instants; the stepper ends \d\.\de-1\d apart",
    "bouncing_ball": r"100 bounces, at most \d\.\de-1[3-6] s from(?s:.)*2000 balls",
    "coupler_curve": r"largest distance of a point from the curve: [0-4]\.\d\d mm",
    "four_bar_clearance": r"finished: 11 impacts, 80 smooth parts\n.* at most 0\.0002\d rad off",
    "geneva_drive": r"turn the wheel by -4\.000 quarters\n.*: \de-1[2-5] rad from the closed form"
    r"\n.*: \de-1[4-9] J, rates \de-1[3-6] rad/s off\nthe wheel is still for 38\.\d% of",
    "identified_parameters": r"converged(?s:.)*m_1 = 1\.4 lies within\nm_2 = 2\.5 lies within\n"
    r"c_0 = 0\.8 lies within",
    "latch": r"finished(?s:.)*rates \de-1[3-6] from(?s:.)*mm, (0e\+00|\de-1[5-9]) m from"
    r"(?s:.)*at 1\.236102 s, (0e\+00|\de-1[2-6]) s from",
    "newtons_cradle": r"apart: .*leave with \[0\.01 0\.01 0\.01 0\.01 0\.96\]"
    r"(?s:.)*touching: .*leave with \[-0\.58  0\.4   0\.4   0\.4   0\.4 \]",
    "slider_clearance": r"finished: \d+ impacts of corners, 9\.9\d ms on a wall\n"
    r"energy grows by at most \de-1\d J\n.* are 0\.01\d\d and 0\.003\d rad off"
    r"\n.* are 0\.00\d, 0\.04\d and 0\.04\d rad off",
    "stick_and_slip": r"mu = 0\.5: the block sticks, \de-1[1-9] m off\n"
    r"mu = 0\.2: the block slides -, \de-1[1-9] m off\n8 slips on the belt, \de-1[1-9] s off\n"
    r"the clutch holds at 1\.299019 s, \de-1[1-9] s off",
    "watch_escapement": r"171\.9476 deg, 0\.40000074\d s, \de-1[1-4] from the closed form"
    r"(?s:.)*2000 drops turned the wheel by 2000\.000(?s:.)*rates within \de-0[7-9] s a day",
    "woodpecker": r"8 pecks, \d+ smooth parts: finished\nperiod 0\.14\d\d s(?s:.)*v_y = -0\.34"
    r"(?s:.)*period 0\.145976\d* s, stable(?s:.)*grows by -0\.01944(?s:.)*multiplier +-0\.839"
    r"(?s:.)*by the motion itself: period 0\.146\d* s, factor -0\.83",
}


@pytest.mark.parametrize("name", SHOWN)
def test_it_ends_at_what_it_says(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(ROOT / "examples" / f"{name}.py"), run_name="__main__")
    assert re.search(SHOWN[name], capsys.readouterr().out)
    assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_every_example_is_tested():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == set(SHOWN)
