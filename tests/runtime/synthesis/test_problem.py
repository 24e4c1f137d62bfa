"""Derivatives of residuals through closed loops, against differences of the residuals."""

import numpy as np
import pytest

from mechc.synthesis import search as searches
from tests.support.linkages.synthesis import bounds, four_bar

STEP = 1e-6
CRANK = np.linspace(0.0, 2.0, 5)
POINTS = np.column_stack([np.cos(CRANK), 0.4 * np.sin(CRANK)])
FREE = {**bounds(1.5, shortest=1.0), "l_0": (0.2, 0.5)}
CONDITIONS = {
    "transmission_angle": ("p_1", "p_2", "p_3", "60deg"),
    "box": ((-1.0, 2.0), (-1.0, 2.0)),
}


def descents(monkeypatch, targets, free, **options):
    """Descents and unknowns that a search begins with, of every linkage that it would refine."""
    found = []

    def begin(problem, z, q, tol):
        found.append((searches._Descent(problem, z, q, 10.0), z))
        return searches.Candidate(z, q, *searches.judge(problem, z, q))

    monkeypatch.setattr(searches, "refine", begin)
    four_bar().synthesize(targets, free, samples=64, refined=3, **options)
    return found


@pytest.mark.parametrize(
    ("more", "zeros", "options"),
    [
        ({}, (), {}),
        ({"theta_0": CRANK}, ("theta_0",), {}),
        ({"theta_0": CRANK, "theta_2": CRANK / 5}, ("theta_0", "theta_2"),
         {"turns": True, **CONDITIONS}),
        ({"theta_2": CRANK / 5}, ("theta_2",), CONDITIONS),
    ],
    ids=["found crank angles", "given crank angles", "conditions over a turn", "conditions"],
)  # fmt: skip
def test_the_jacobian_is_the_slope_of_the_residuals(monkeypatch, more, zeros, options):
    free = {**FREE, **dict.fromkeys(zeros)}
    found = descents(monkeypatch, {"C": POINTS, **more}, free, **options)
    assert len(found) == 3
    for descent, z in found:
        jacobian = descent.jacobian(z)
        steps = STEP * np.eye(len(z))
        ends = [[descent.residuals(z + side * step) for step in steps] for side in (1, -1)]
        slopes = (np.array(ends[0]) - np.array(ends[1])).T / (2 * STEP)
        usable = np.isfinite(slopes).all(axis=0)
        assert usable.sum() >= len(z) - 2
        np.testing.assert_allclose(jacobian[:, usable], slopes[:, usable], atol=1e-6)


def test_a_parameter_that_is_not_asked_for_has_no_slope(monkeypatch):
    (descent, z), *_ = descents(
        monkeypatch, {"theta_2": CRANK / 5, "theta_0": CRANK}, FREE
    )  # fmt: skip
    names = descent.problem.names
    jacobian = descent.jacobian(z)
    assert not jacobian[:, [names.index("x_C"), names.index("y_O")]].any()
    assert np.abs(jacobian[:, names.index("l_1")]).max() > 1e-3
