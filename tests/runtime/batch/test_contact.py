"""Contact that lasts and friction in a batch: every member is the run that `simulate` makes."""

import numpy as np
import pytest

import mechc
from tests.support.impacts import block

pytestmark = pytest.mark.slow
REST = mechc.Stop("q_0", 0.5)


def members_are_those_of_simulate(model, starts, events, inputs=None, **given):
    times = np.linspace(0.0, 1.5, 5)
    batch = model.simulate_batch(
        1.5, starts, events=events, t_eval=times, progress=False, inputs=inputs, **given,
        lockstep=False,
    )  # fmt: skip
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


def test_numbers_of_motions_with_contact_that_lasts(ball):
    """A ball comes to rest: the area below each flight is 2 v^3 / (3 g^2)."""
    asked = ["max(q_0)", "mean(q_0)", "first(q_0 < 0.1)", "max(u_0)", "final(energy)"]
    starts = [[0.0, 0.0], [0.2, 0.0], [50.0, 0.0]]
    batch = ball.simulate_batch(1.5, starts, events=REST, reduce=asked, rtol=1e-12, progress=False)
    assert batch.ok.all()
    v = np.sqrt(2 * 9.81 * 0.2)
    area = v**3 / (3 * 9.81**2) + 2 * (v / 2) ** 3 / (3 * 9.81**2) / (1 - 1 / 8)
    np.testing.assert_allclose(batch["max(q_0)"], [0.0, 0.2, 50.0], atol=1e-15)
    assert batch["mean(q_0)"][1] == pytest.approx(area / 1.5, rel=1e-9)
    falls = np.sqrt(2 * 0.1 / 9.81)
    np.testing.assert_allclose(batch["first(q_0<0.1)"], [np.nan, falls, np.nan], rtol=1e-12)
    assert batch["max(u_0)"][1] == pytest.approx(v / 2, rel=1e-12)
    np.testing.assert_allclose(batch["final(energy)"], [0, 0, 9.81 * 50], atol=1e-12)


def test_numbers_of_bounces_are_those_of_the_motion(ball):
    """Extremes within and at the ends of steps, jumps, means: against many samples."""
    stop, start = mechc.Stop("q_0", 0.9, terminal=4), [0.5, 2.3]
    for method in ("gauss8", "dop853"):
        more = {"events": stop, "method": method, "rtol": 1e-11}
        one = ball.simulate(3.0, start, **more)
        t = np.linspace(0.0, one.t[-1], 300_001)
        q, u = one(t).T
        every = np.append(u, one.events[0].y[:, 1])
        energy = 9.81 * q + u**2 / 2
        wanted = {
            "max(q_0)": q.max(), "min(u_0)": every.min(), "range(u_0)": np.ptp(every),
            "mean(energy)": np.trapezoid(energy, t) / t[-1],
            "mean(abs(u_0))": np.trapezoid(np.abs(u), t) / t[-1],
            "max(abs(u_0))": np.abs(every).max(),
            "first(u_0 > 1)": t[1:][(u[:-1] <= 1) & (u[1:] > 1)][0],
            "first(u_0 < -2)": t[u < -2][0], "first(q_0 = 0.3)": t[q < 0.3][0],
            "first(q_0 > 0.7)": t[q > 0.7][0], "final(q_0)": 0.0,
            "min(kinetic_energy)": (u**2).min() / 2,
        }  # fmt: skip
        batch = ball.simulate_batch(3.0, [start], reduce=list(wanted), progress=False, **more)
        for text, value in wanted.items():
            np.testing.assert_allclose(batch[text][0], value, rtol=1e-4, atol=1e-8, err_msg=text)


def test_blocks_with_friction():
    """A block slides until mu g has taken its speed; reductions see all of it."""
    model = block()
    stop = mechc.Stop("y", friction=0.5, slip="v_x")
    batch = model.simulate_batch(
        1.5, [[0, 0, 2, 0.0]], {"a": 0.0}, events=stop, reduce=["max(x)", "first(v_x < 1)"]
    )
    assert batch["max(x)"][0] == pytest.approx(2.0 / 9.81 / 0.5, rel=1e-9)
    assert batch["first(v_x<1)"][0] == pytest.approx(1.0 / 9.81 / 0.5, rel=1e-9)
    for events in (
        mechc.Stop("y", 0.4, friction=0.5, slip="v_x"),
        [mechc.Stop("y"), mechc.DryFriction("v_x", 0.5, "m*g*cos(a)")],
    ):
        starts = np.array([[0, 0, 2, 0], [0, 0, 0, 0], [0, 0.1, 1, 0.0]])
        members_are_those_of_simulate(model, starts, events, params={"a": 0.25})


def test_forces_of_each_member(pushed):
    starts, forces = np.zeros((3, 2)), {"F": np.array([-1.0, 1.0, -2.0])}
    batch = members_are_those_of_simulate(pushed, starts, mechc.Stop("q"), forces)
    np.testing.assert_array_equal(batch.y[:, 0] > 0.5, [False, True, False])
    members_are_those_of_simulate(pushed, starts, mechc.DryFriction("u", 1.5), forces)
