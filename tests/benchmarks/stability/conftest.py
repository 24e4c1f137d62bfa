"""Runs that are judged."""

import pytest

import mechc


@pytest.fixture
def regular():
    """A finished run of the regular four-bar."""
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.0}, params={"l_3": 3.5})
    return model.simulate(1.0, y0, {"l_3": 3.5})
