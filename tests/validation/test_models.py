"""Models of the literature, as people write them, against SymPy's own numbers.

One in every run; all the others, which take a few seconds of compiling each, are slow tests.
"""

import numpy as np
import pytest

from tests.validation.models.catalogue import MODELS
from tests.validation.models.reference import SympyNumbers
from tests.validation.models.table import HEADINGS, row
from tests.validation.models.use import compiled, driven, started

ALWAYS = ("compound_pendulum",)
SLOW = sorted(MODELS.keys() - set(ALWAYS))
STATES = 20


@pytest.fixture(
    params=[*ALWAYS, *(pytest.param(name, marks=pytest.mark.slow(cases=6)) for name in SLOW)]
)
def script(request):
    """What a model's script holds."""
    return MODELS[request.param].derive()


@pytest.mark.filterwarnings("ignore:.*not in the equations:mechc.UnusedValueWarning")
def test_rates_and_motion_are_sympys(script):
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


def test_every_model_says_where_its_equations_come_from():
    assert len(MODELS) >= 60
    assert all(len(model.source) > 30 for model in MODELS.values())


@pytest.mark.slow
def test_the_table_has_a_figure_under_every_heading():
    figures = dict(zip(HEADINGS, row("projectile_with_drag"), strict=True))
    assert all(figure >= 0.0 for figure in figures.values())
    assert figures["difference"] < 1e-10
    assert figures["solve_ivp/motion"] > 5
    assert figures["error"] < 1e-5
