"""Models of the literature, as people write them, against SymPy's own numbers.

A few in every run; all the others, which take a few seconds of compiling each, are slow tests.
"""

import numpy as np
import pytest

from tests.validation.models.catalogue import MODELS
from tests.validation.models.reference import SympyNumbers
from tests.validation.models.use import compiled, driven, started

ALWAYS = (
    *("compound_pendulum", "spherical_pendulum", "chaplygin_sleigh", "scotch_yoke"),
    *("puck_with_dry_friction", "quadrotor_by_quaternions"),
)
SLOW = sorted(MODELS.keys() - set(ALWAYS))
STATES = 20


@pytest.fixture(params=[*ALWAYS, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def derived(request):
    """A model's name and its script."""
    return request.param, MODELS[request.param].derive()


@pytest.mark.filterwarnings("ignore:.*not in the equations:UserWarning")
def test_rates_and_motion_are_sympys(derived):
    _, script = derived
    sympy, model = SympyNumbers(script), driven(compiled(script), script)
    draw = np.random.default_rng(7)
    for _ in range(STATES):
        y = sympy.random_state(draw)
        expected = sympy.rates(0.0, y)
        found = model.rhs(0.0, y)
        assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()
    y0 = started(model, script)
    sol = model.simulate(script.t_end, y0)
    assert sol.t[-1] == script.t_end
    motion = sympy.motion(script.t_end, y0)
    size = np.abs(motion.y).max(axis=1) + 1.0
    assert (np.abs(sol.y[-1] - motion.y[:, -1]) < 1e-6 * size).all()
