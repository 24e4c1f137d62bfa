"""States moved onto closed loops: closed, smooth, and the identity where they are."""

import numpy as np
import pytest

import mechc
from mechc.assembly.closed import Retraction
from mechc.errors import AssemblyError
from tests.support.pendulums import bob_of_a_moved_pivot


@pytest.fixture(scope="module")
def bar():
    model = mechc.load("four_bar", outputs=("energy", "sensitivities"))
    p = model.system.parameter_set.resolve({"l_3": 3.5})
    y = model.assemble({"theta_0": 1.2}, {"omega_0": 0.7}, params=p)
    return model.system, y, p, Retraction.at(model.system, y, p, 0.0)


def test_a_closed_state_stays(bar):
    system, y, p, retraction = bar
    np.testing.assert_allclose(retraction.close(system, y, p, 0.0).y, y, atol=1e-14)


def test_an_open_state_is_closed_and_its_derivatives_are_those_of_differences(bar):
    system, y, p, retraction = bar
    moved = y + 0.05 * np.random.default_rng(2).normal(size=len(y))
    one = retraction.close(system, moved, p, 0.0)
    assert np.abs(system.constraints(one.y, p)).max() < 1e-12
    assert np.abs(system.velocity_constraints(one.y, p)).max() < 1e-12
    for of, by, slopes in ((moved, 0, one.by_state), (p, 1, one.by_parameters)):
        for i in range(len(of)):
            side = np.zeros(len(of))
            side[i] = 1e-6
            ends = [
                retraction.close(system, moved + (by == 0) * sign * side if by == 0 else moved,
                                 p + sign * side if by else p, 0.0).y
                for sign in (1.0, -1.0)
            ]  # fmt: skip
            np.testing.assert_allclose(slopes[:, i], (ends[0] - ends[1]) / 2e-6, atol=1e-7)


def test_a_state_from_which_no_loop_closes(bar):
    system, y, _, retraction = bar
    with pytest.raises(AssemblyError, match="do not close near"):
        retraction.close(system, y, system.parameter_set.resolve({"l_3": 9.0}), 0.0)


def test_a_scene_without_loops_is_left_as_it_is():
    system = mechc.load("pendulum", outputs=("energy", "points", "sensitivities")).system
    p, y = system.parameter_set.resolve(None), np.array([0.3, 0.2])
    one = Retraction.at(system, y, p, 0.0).close(system, y, p, 0.0)
    np.testing.assert_array_equal(one.by_state, np.eye(2))


def test_an_input_in_a_constraint_moves_the_closed_state():
    """The pivot of a bob: nearer to it a state is moved farther."""
    defaults = {"m": 2.0, "l": 1.3}
    model = mechc.compile(bob_of_a_moved_pivot()[0], outputs=("sensitivities",), defaults=defaults)

    def system(r):
        at = [lambda t, value=value: value for value in r]
        return model.with_inputs({"r": tuple(at)}).system

    p, r = model.system.parameter_set.resolve(None), np.array([0.2, -0.4, 0.7])
    y = np.array([0.7, -1.1, 0.5, 0.4])
    retraction = Retraction.at(system(r), y, p, 0.0)
    found = retraction.close(system(r), y, p, 0.0).by_inputs
    assert model.input_values == ("r", "r'", "r''")
    for k, side in enumerate(1e-6 * np.eye(3)):
        one, two = (retraction.close(system(r + s), y, p, 0.0).y for s in (side, -side))
        np.testing.assert_allclose(found[:, k], (one - two) / 2e-6, atol=1e-8)
    assert np.abs(found[:, :2]).max() > 0.1
