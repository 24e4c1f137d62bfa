"""Contact that lasts and friction in a batch: every member is the run that `simulate` makes."""

import numpy as np
import pytest

import mechc
from tests.support.impacts import block, points_on_a_line
from tests.support.pendulums import pushed_mass

pytestmark = pytest.mark.slow
REST = mechc.Stop("q_0", 0.5)


@pytest.fixture(scope="module")
def ball():
    return points_on_a_line("ball", 1, lambda q, u, m: -9.81 * m)


def members_are_those_of_simulate(model, starts, events, inputs=None, **given):
    times = np.linspace(0.0, 1.5, 5)
    batch = model.simulate_batch(
        1.5, starts, events=events, t_eval=times, progress=False, inputs=inputs, **given
    )
    for k, start in enumerate(starts):
        own = {n: x[k] if np.ndim(x) else x for n, x in (inputs or {}).items()} or None
        one = model.simulate(1.5, start, events=events, inputs=own, **given)
        assert batch.status(k).code == one.status.code
        assert batch.steps[k] == one.stats["steps"]
        assert batch.event_counts[k].tolist() == [len(record.t) for record in one.events]
        np.testing.assert_array_equal(batch.y[k], one.y[-1])
        np.testing.assert_array_equal(batch.y_eval[k], one(times))
    return batch


def test_balls_rest_and_begin_at_rest_beside_those_that_fly(ball):
    """Once what lay on the floor at the start fell through it."""
    starts = np.array([[0, 0], [1e-12, 0], [0, -1], [0, 1], [-1e-17, 0], [1, 0], [50, 0.0]])
    batch = members_are_those_of_simulate(ball, starts, REST)
    np.testing.assert_allclose(batch.y[:6], 0.0, atol=1e-12)
    assert batch.y[6, 0] == pytest.approx(50 - 9.81 / 2 * 1.5**2)
    within = ball.simulate_batch(1.5, [[1, 0], [-0.1, 0.0]], events=REST, progress=False)
    assert [within.status(k).code for k in range(2)] == ["finished", "open at the start"]


def test_with_numbers_of_the_whole_motion_members_end_where_contact_begins(ball):
    batch = ball.simulate_batch(
        1.5, [[0.0, 0.0], [0.2, 0.0], [50.0, 0.0]], events=REST, reduce=["max(q_0)"], progress=False
    )
    assert [batch.status(k).code for k in range(3)] == [
        "resets accumulate", "resets accumulate", "finished",
    ]  # fmt: skip
    np.testing.assert_array_equal(batch["max(q_0)"], [np.nan, 0.2, 50.0])
    assert batch.t[0] == 0.0


def test_blocks_with_friction():
    model = block()
    for events in (
        mechc.Stop("y", 0.4, friction=0.5, slip="v_x"),
        [mechc.Stop("y"), mechc.DryFriction("v_x", 0.5, "m*g*cos(a)")],
    ):
        starts = np.array([[0, 0, 2, 0], [0, 0, 0, 0], [0, 0.1, 1, 0.0]])
        members_are_those_of_simulate(model, starts, events, params={"a": 0.25})


def test_forces_of_each_member():
    model = mechc.compile(pushed_mass(), name="pushed", defaults={"m": 2.0, "k": 0.0})
    starts, forces = np.zeros((3, 2)), {"F": np.array([-1.0, 1.0, -2.0])}
    batch = members_are_those_of_simulate(model, starts, mechc.Stop("q"), forces)
    np.testing.assert_array_equal(batch.y[:, 0] > 0.5, [False, True, False])
    members_are_those_of_simulate(model, starts, mechc.DryFriction("u", 1.5), forces)
