"""Configurations of sheets on which a mechanism is folded onto itself, told from all others.

The cell is that of Peaucellier: with C and D in one point, B and P move on circles about it.
"""

import numpy as np
import pytest

import mechc
from benchmarks.problems.closed_loops import locomotive
from tests.support.linkages.peaucellier import RODS, cell

CRANKS = np.linspace(-0.5, 0.5, 4)  # y_B, m
FOLDED = {"x_B": 1.9, "x_C": 2.9, "y_C": 0.6, "x_D": 2.9, "y_D": 0.6, "x_P": 3.7, "y_P": 0.9}


@pytest.fixture(scope="module")
def model():
    return cell()


def places(model, y):
    """The points of the cell, by name."""
    known = dict(zip(model.coordinates, y, strict=False))
    points = {name: np.array([known[f"x_{name}"], known[f"y_{name}"]]) for name in "BCDP"}
    return {"O": np.zeros(2), "Q": np.array([1.0, 0.0]), **points}


def is_folded(model, y):
    at = places(model, y)
    return np.linalg.norm(at["C"] - at["D"]) < 1e-6


@pytest.mark.parametrize("crank", CRANKS)
@pytest.mark.parametrize("guess", [{}, {"x_B": 1.9}, {"x_B": 1.9, "x_C": 2.7, "y_C": 1.0}])
def test_assemble_takes_what_is_not_folded(model, crank, guess):
    y = model.assemble({"y_B": crank}, guess=guess)
    at = places(model, y)
    assert not is_folded(model, y)
    for (a, b), length in RODS.items():
        assert np.linalg.norm(at[a] - at[b]) == pytest.approx(length, abs=1e-12)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("crank", CRANKS)
def test_assemblies_leaves_the_sheet_out_and_says_so(model, crank):
    """C above D or below, and P beyond them on Peaucellier's line, or on B."""
    with pytest.warns(mechc.CollapsedSheetWarning, match="they are left out"):
        found = model.assemblies({"y_B": crank})
    x, y = places(model, found[0])["B"]
    line = (3.0**2 - 1.25**2) / 2  # |OB| |OP| = 9 - 1.25^2, and |OB|^2 = 2 x_B
    beyond = line / x * np.array([x, y])
    assert len(found) == 4
    for state in found:
        at = places(model, state)
        assert not is_folded(model, state)
        ways = [np.linalg.norm(at["P"] - place) for place in (beyond, at["B"])]
        assert min(ways) == pytest.approx(0.0, abs=1e-9)


def test_a_folded_one_is_had_by_guessing_all_of_it(model):
    y = model.assemble({"y_B": 0.4}, guess=FOLDED)
    assert is_folded(model, y)
    assert np.linalg.matrix_rank(model.constraint_jacobian(y), tol=1e-9) == len(RODS) - 1


def test_where_all_are_folded_assemble_says_so(model):
    """C and D are held in one point."""
    x, y = 3.0 * np.cos(0.3), 3.0 * np.sin(0.3)
    held = {"x_C": x, "y_C": y, "x_D": x, "y_D": y}
    with pytest.warns(mechc.CollapsedSheetWarning, match="no other was found"):
        folded = model.assemble(held, guess={"y_B": 0.4})
    assert is_folded(model, folded)


def test_rows_that_are_redundant_everywhere_are_no_sheet():
    model = mechc.compile(locomotive(2))
    y = model.assemble({"q_wheel_0": 0.3}, guess={"q_wheel_1": 0.3})
    assert y[: len(model.coordinates)] == pytest.approx([0.3, 0.3, -0.3, -0.3], abs=1e-9)
