"""Checks of options that several tools share."""

import numpy as np

import mechc
from tests.support.differences import apart
from tests.support.pendulums import pushed_mass


def has_the_options_of_simulate(tool):
    """Check ``mechc.jax`` or ``mechc.torch``: the motion is that of simulate with the same options,
    and each option changes it."""
    model = mechc.compile(pushed_mass(), defaults={"m": 2.0, "k": 1.0}, outputs=("sensitivities",))
    y0, options = [0.1, 0.2], {"inputs": {"F": "sin(2*t)"}, "rtol": 1e-6, "method": "dop853"}

    def end(t0, **given):
        return np.asarray(tool(model, t0=t0, **given)(2.0, y0))

    found = end(0.3, **options)
    np.testing.assert_array_equal(found, model.simulate((0.3, 2.0), y0, **options).y[-1])
    assert apart(found, end(0.0, **options)) > 1e-3
    assert apart(found, end(0.3, **{**options, "inputs": {"F": 0.0}})) > 1e-3
    assert apart(found, end(0.3, **{**options, "method": "auto"})) > 1e-12
