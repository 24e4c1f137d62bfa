"""The shipped four-bar, and scenes on a line."""

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support.impacts import points_on_a_line
from tests.support.pendulums import pushed_mass


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Everything happens in a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


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


# -- on a line ------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def ball():
    """Falls; its stop may stand at a height h, with a restitution e that nothing else contains."""
    more = {"e": 0.5, "h": 0.0}
    return points_on_a_line("ball", 1, lambda q, u, m: -9.81 * m, parameters=more)


@pytest.fixture(scope="session")
def five_springs():
    return points_on_a_line("five_springs", 5, lambda q, u, m: -4 * m * q)


@pytest.fixture(scope="session")
def pushed():
    """2 kg, pushed by the input F; its spring is 0 N/m unless a test says."""
    kane, power = pushed_mass(), {"power": dynamicsymbols("F") * dynamicsymbols("u")}
    defaults = {"m": 2.0, "k": 0.0}
    return mechc.compile(kane, name="slider", defaults=defaults, outputs=("energy", power))
