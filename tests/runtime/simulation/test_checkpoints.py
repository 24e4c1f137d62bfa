"""Runs with checkpoints: the same motion and the same gradients to the last bit, in less memory."""

import numpy as np
import pytest

import mechc
from tests.runtime.sensitivities.test_loops import REGULAR, START, bar
from tests.runtime.sensitivities.test_run import GIVEN, swing
from tests.support import LOCKSTEP, by

__all__ = ["bar", "swing"]  # compiled scenes of other tests
pytestmark = pytest.mark.slow  # compiles much
BY = ["l_3", "m_1", "g", "theta_0", "omega_0"]
# Methods for scenes with loops.
SPANS = {"gauss8": 40.0, LOCKSTEP: 100.0, "dop853": 40.0, "dopri5": 10.0, "radau5": 3.0}
LITTLE = {  # bytes; saved states are larger where lanes are wider
    "gauss8": 1.6e5, LOCKSTEP: 1.4e5, "dop853": 1.3e5, "dopri5": 1.3e5, "radau5": 3e5,
}  # fmt: skip
OBJECTIVES = ({"end": "kinetic_energy"}, {"end": "kinetic_energy", "integral": "kinetic_energy"})


@pytest.fixture(autouse=True)
def own_parts(bar, swing):
    """Saved states of the unit of a kind are as large as its bounds."""
    for model in (bar, swing):
        model.wait_compiled()


def same(plain, checked, by, objectives=OBJECTIVES):
    """The motion, and gradients."""
    assert len(checked.record.pieces) > 3
    plain.system.wait()  # other code evaluates outputs of many states, as soon as it is compiled
    np.testing.assert_array_equal(plain.t, checked.t)
    np.testing.assert_array_equal(plain.y, checked.y)
    times = np.linspace(*plain.span, 37)[::-1]
    np.testing.assert_array_equal(plain(times), checked(times))
    for objective in objectives:
        one, two = (sol.gradient(by=by, **objective) for sol in (plain, checked))
        assert one.value == two.value
        assert dict(one) == dict(two)


@pytest.mark.parametrize("method", SPANS)
def test_gradients_have_the_same_bits(bar, method):
    """Where every second checkpoint was dropped, once or twice."""
    given, policy = (SPANS[method], START, REGULAR), {**by(method), "rtol": 1e-9}
    plain = bar.simulate(*given, **policy)
    checked = bar.simulate(*given, checkpoints=LITTLE[method], **policy)
    assert len(checked.record.pieces) <= checked.stats["steps"] / 128 + 1
    same(plain, checked, BY, OBJECTIVES if method == "gauss8" else OBJECTIVES[:1])


def test_past_change_points(bar):
    start = {"theta_0": np.radians(85)}
    plain = bar.simulate(40.0, start, rtol=1e-10)
    checked = bar.simulate(40.0, start, rtol=1e-10, checkpoints=2e5)
    assert len(plain.change_points) > 10
    assert plain.change_points == checked.change_points
    np.testing.assert_array_equal(plain.y, checked.y)
    one, two = (sol.gradient(end="theta_0", by=["m_1", "theta_0"]) for sol in (plain, checked))
    assert dict(one) == dict(two)


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_of_inputs_that_jump_and_by_their_samples(swing, method):
    """Checkpoints lie within and at the ends of the segments that inputs divide a run into."""
    times = np.linspace(0.0, 80.0, 161)
    kind = "previous" if method == "dop853" else "linear"
    push = mechc.Signal(times, np.sin(times**2), kind, breaks="samples")
    policy = {"inputs": {"F": push}, **by(method), "rtol": 1e-8}
    runs = [
        swing.simulate(80.0, {"q": 0.7, "u": -0.5}, GIVEN, checkpoints=memory, **policy)
        for memory in (None, 2e5)
    ]
    same(*runs, ["l", "c", "q", "F[3]", "F[160]"])
    one, two = (sol.gradient(end="q", by=["F"])["F"] for sol in runs)
    np.testing.assert_array_equal(one, two)


def test_backwards_and_what_a_solution_tells(bar):
    plain, checked = (
        bar.simulate((30.0, 0.0), START, REGULAR, checkpoints=memory) for memory in (None, 2e5)
    )
    same(plain, checked, BY)
    told = [dict(sol.stats) for sol in (plain, checked)]
    for stats in told:
        del stats["wall_s"]
    assert told[0] == told[1]
    assert plain.status == checked.status
    np.testing.assert_array_equal(plain.energy, checked.energy)
    assert plain.record.times().tolist() == checked.record.times().tolist()


def test_a_bound_too_small_for_a_run_is_a_status(bar):
    sol = bar.simulate(500.0, START, REGULAR, rtol=1e-12, checkpoints=1e5)
    assert sol.status.code == "memory limit"
    assert 0.0 < sol.span[1] < 500.0
    assert len(sol.t) == sol.stats["steps"] + 1


def test_what_is_refused_is_named(bar):
    given = (1.0, START, REGULAR)
    for more in ({"events": [lambda t, y: y[0]]}, {"sensitivities": ["l_3"]}):
        with pytest.raises(mechc.ValueOutOfBoundsError, match="neither events= nor sensitiv"):
            bar.simulate(*given, checkpoints=2e5, **more)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="checkpoints"):
        bar.simulate(*given, checkpoints=-1.0)


def test_an_input_that_is_another_one_the_second_time_is_refused(swing):
    held = {"F": 0.3}
    given = {"q": 0.7, "u": -0.5}, GIVEN
    sol = swing.simulate(50.0, *given, inputs={"F": lambda t: held["F"]}, checkpoints=2e5)
    assert np.isfinite(sol(1.0)).all()
    held["F"] = 0.4
    with pytest.raises(mechc.MechcError, match="is another one when it is computed again"):
        sol(sol.span[1])
