"""Quantities that are named, over time."""

import numpy as np
import pytest

import mechc


def test_chosen_quantities_have_a_panel_for_each_unit(sol):
    figure = sol.plot("theta_0", "theta_1", "omega_0", "energy")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["angle (°)", "angular speed (°/s)", "energy (J)"]
    assert [len(axes.lines) for axes in figure.axes] == [2, 1, 1]
    radians = sol.plot("theta_0", degrees=False).axes[0]
    assert radians.get_ylabel() == "angle (rad)"
    degrees = figure.axes[0].lines[0].get_ydata()
    np.testing.assert_allclose(np.degrees(radians.lines[0].get_ydata()), degrees)


def test_what_cannot_be_drawn_is_told(sol):
    with pytest.raises(mechc.UnknownNameError, match="did you mean 'theta_0'"):
        sol.plot("theta0")
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"points has the shape"):
        sol.plot("points")
