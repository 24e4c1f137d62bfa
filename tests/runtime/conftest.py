"""The shipped four-bar."""

import numpy as np
import pytest

import mechc


@pytest.fixture(scope="session")
def model():
    return mechc.load("four_bar")


@pytest.fixture(scope="session")
def regular(model):
    """Lengths 1, 2, 3, 3.5 m, from rest at 85 degrees: (parameters, start)."""
    params = {"l_3": 3.5}
    return params, model.assemble({"theta_0": np.radians(85)}, params=params)


@pytest.fixture(scope="session")
def sol(model, regular):
    """Two seconds of the regular four-bar."""
    params, start = regular
    return model.simulate((0, 2), start, params)
