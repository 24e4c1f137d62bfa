"""``mechc synthesize``: targets in a CSV file, designs and a picture out."""

import json

import numpy as np
import pytest

from mechc.cli.commands import main
from tests.support.command_line import complaint
from tests.support.linkages.synthesis import bounds, coupler_points

pytestmark = pytest.mark.usefixtures("here")
KNOWN = {
    "l_0": 0.5, "l_1": 1.2, "l_2": 1.1, "l_3": 1.4, "x_C": 0.7, "y_C": 0.6, "x_O": -0.2,
    "y_O": 0.1, "alpha": 0.3,
}  # fmt: skip
SCENE = ("--with", "coupler_point", "--with", "placed", "--with", "crank_speed")
FREE = [
    part for name, (low, high) in bounds(2.0).items() for part in ("--free", f"{name}={low}:{high}")
]


@pytest.fixture
def points(here):
    """Points of a known linkage in mm at crank angles in degrees, one of them half missing."""
    crank = np.linspace(0.0, 5.6, 10)
    rows = ["theta_0 [deg],C.x [mm],C.y [mm]"]
    for angle, (x, y) in zip(crank, coupler_points(KNOWN, crank)[0], strict=True):
        rows.append(f"{np.degrees(angle)!r},{1e3 * x!r},{'' if angle == 0 else repr(1e3 * y)}")
    (here / "points.csv").write_text("\n".join(rows).replace("np.float64(", "").replace(")", ""))
    return "points.csv"


@pytest.mark.slow
def test_a_linkage_from_a_table(points, here, capsys):
    options = ("--samples", "256", "--refined", "6", "--turns")
    assert main(["synthesize", "four_bar", points, *SCENE, *FREE, *options]) == 0
    assert "l_3 = 1.4 m" in capsys.readouterr().out
    folder = here / "mechc_synthesis_four_bar"
    assert {path.name for path in folder.iterdir()} == {"design.png", "design.svg", "designs.json"}
    best = json.loads((folder / "designs.json").read_text())["designs"][0]
    assert best["values"] == pytest.approx(KNOWN, abs=1e-9)
    assert best["errors"]["C"] < 1e-10


@pytest.mark.slow
def test_json_writes_nothing_and_a_condition_that_is_missed_is_an_exit_code(points, here, capsys):
    options = ("--samples", "32", "--refined", "2", "--transmission", "p_1,p_2,p_3,89deg")
    assert main(["synthesize", "four_bar", points, *SCENE, *FREE, *options, "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["tried"] == 32
    assert any("transmission angle" in each for each in told["designs"][0]["warnings"])
    assert [path.name for path in here.iterdir()] == [points]


@pytest.mark.parametrize(
    ("header", "more", "message"),
    [
        ("C.q", ("--free", "l_0=1:2"), "no target, a column of wrong.csv"),
        ("C.x [kg]", ("--free", "l_0=1:2"), "'kg' is not one of its units"),
        ("C.x", (), "say what is to be found"),
        ("C.x", ("--free", "l_0=1:2", "--driven", "C"), "no coordinate is called 'C'"),
    ],
)
def test_what_is_wrong_is_one_line(here, capsys, header, more, message):
    (here / "wrong.csv").write_text(f"{header}\n1\n2\n")
    assert message in complaint(capsys, "synthesize", "four_bar", "wrong.csv", *SCENE, *more)
