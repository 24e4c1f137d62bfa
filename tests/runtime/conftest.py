"""The shipped four-bar, and a cache of compiled scenes that belongs to the tests alone."""

import numpy as np
import pytest

import mechc


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MECHC_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "compiled"))
        yield


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
