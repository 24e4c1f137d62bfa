"""Results may be written over what they are computed from, as NumPy's are."""

import numpy as np
import pytest


@pytest.mark.parametrize("count", [1, 3, 8, 17, 40])
def test_every_shift_of_out_against_the_states_gives_the_same(model, regular, count):
    params, start = regular
    width = len(start)
    draw = np.random.default_rng(6)
    states = start + 1e-3 * draw.standard_normal((count, width))
    wanted = model.rhs(0.0, states, params)
    for shift in range(-width * min(count, 12), width * min(count, 12) + 1):
        memory = np.zeros(3 * states.size + 2 * width)
        first = states.size + width
        y = memory[first : first + states.size].reshape(states.shape)
        out = memory[first + shift : first + shift + states.size].reshape(states.shape)
        y[...] = states
        assert model.rhs(0.0, y, params, out) is out
        assert np.array_equal(out, wanted), shift


def test_out_may_be_a_view_of_the_parameters(model, regular):
    _, start = regular
    values = np.array([model.defaults[name] for name in model.parameters])
    wanted = model.rhs(0.0, start[None], values.copy())
    out = values[: len(start)][None]
    assert np.array_equal(model.rhs(0.0, start[None], values, out), wanted)
