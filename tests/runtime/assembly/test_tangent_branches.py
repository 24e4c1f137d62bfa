"""Starts exactly at a change point: the speeds say along which branch the motion goes, or an error
says that they do not."""

import numpy as np
import pytest

from mechc.errors import AssemblyError, ValueOutOfBoundsError

IN_LINE = {"theta_0": np.pi}
FIRST_PASSAGE = 0.77535955435707638  # of the swing from rest at 85 degrees, lengths 1, 2, 3, 4
HALF_PERIOD = 2.314411413480138
TURN = 762.1436450943  # degrees


def energetic(model, state):
    """The state with the speeds of the swing from rest at 85 degrees."""
    rest = model.assemble({"theta_0": np.radians(85)})
    drop = model.energy(rest) - model.potential_energy(state)
    state = state.copy()
    state[3:] *= np.sqrt(drop / model.kinetic_energy(state))
    return state


def test_there_is_one_state_for_every_branch(model):
    """theta_1 / theta_2 = -3 -+ sqrt 6 to second order, and the closure's velocity."""
    ways = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    assert ways.shape == (2, 6)
    np.testing.assert_allclose(ways[:, :3], [[np.pi, 0, 0]] * 2, rtol=0, atol=1e-14)
    ratios = np.sort(ways[:, 4] / ways[:, 5])
    np.testing.assert_allclose(ratios, [-3 - np.sqrt(6), -3 + np.sqrt(6)], rtol=1e-13)
    np.testing.assert_allclose(ways[:, 3:] @ [-1, 2, 3], 0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("lengths", [(1, 2, 1, 2), (1, 1, 2, 2), (3, 2, 4, 5)])
def test_other_linkages_have_their_branches_too(model, lengths):
    """Along each the closure holds to third order: the gap falls as the cube of the way."""
    params = {f"l_{k}": float(length) for k, length in enumerate(lengths)}
    for crank in (0.0, np.pi):
        if crank == np.pi and lengths == (3, 2, 4, 5):
            continue  # out of reach
        ways = model.assemblies({"theta_0": crank}, speeds={"omega_0": 1.0}, params=params)
        assert len(ways) == 2
        assert (ways[:, 0] == crank).all()
        assert np.abs(np.diff(ways[:, 3:], axis=0)).max() > 0.5
        rows = model.constraint_jacobian(ways, params)
        for way, jacobian in zip(ways, rows, strict=True):
            normal = np.linalg.svd(jacobian)[0][:, -1]
            beside = [np.append(way[:3] + step * way[3:], np.zeros(3)) for step in (1e-3, -1e-3)]
            bend = normal @ model.constraints(np.array(beside), params).sum(axis=0)
            assert abs(bend) < 1e-10  # 1e-6 on no branch


def test_several_branches_are_listed_unless_something_decides(model):
    with pytest.raises(AssemblyError, match=r"change point.*2 branches: .*-0\.289898.*0\.689898"):
        model.assemble(IN_LINE, speeds={"omega_0": 1.0})
    ways = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    for way in ways:
        near = {"omega_1": way[4] + 0.1}
        np.testing.assert_array_equal(model.assemble(IN_LINE, {"omega_0": 1.0}, near), way)
        both = {"omega_0": 1.0, "omega_1": way[4]}
        np.testing.assert_allclose(model.assemble(IN_LINE, both), way, rtol=0, atol=1e-12)


def test_speeds_along_no_branch_are_refused_with_those_that_are(model):
    with pytest.raises(AssemblyError, match=r"no branch .*omega_1 = 0\.3\..*omega_1 = 0\.689898"):
        model.assemble(IN_LINE, speeds={"omega_0": 1.0, "omega_1": 0.3})


def test_rest_at_a_change_point_is_a_state_from_which_nothing_follows(model):
    start = model.assemble(IN_LINE)
    np.testing.assert_array_equal(start[3:], 0.0)
    sol = model.simulate(1.0, start)
    assert sol.status.code == "at a change point"
    assert "model.assemblies" in str(sol.status)
    off = np.append(start[:3], [1.0, 2.0, -1.0])  # closes to first order, on neither branch
    assert model.simulate(1.0, off).status.code == "at a change point"


@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_the_motion_goes_on_along_the_branch_in_both_directions(model, method):
    """The swing from rest at 85 degrees, from its first passage on and back."""
    ways = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    ends = []
    for way in ways:
        start = energetic(model, way)
        ahead = model.simulate(HALF_PERIOD - FIRST_PASSAGE, start, rtol=1e-11, method=method)
        back = model.simulate(-FIRST_PASSAGE, start, rtol=1e-11, method=method)
        assert ahead.status.ok
        assert back.status.ok
        for sol in (ahead, back):
            assert sol.closure.max() < 1e-13
            assert sol.velocity_closure.max() < 1e-12
            assert sol.energy_drift < 1e-9
            times = np.linspace(*sol.span, 300)
            states = sol(times)
            assert np.abs(model.constraints(states)).max() < 1e-13
            assert np.abs(model.velocity_constraints(states)).max() < 1e-12
            assert np.abs(np.diff(states[:, :3], axis=0)).max() < 0.1
        ends.append((*np.degrees([back.y[-1, 0], ahead.y[-1, 0]]), back.y[-1, 3], ahead.y[-1, 3]))
    right = min(ends, key=lambda end: abs(end[0] - 85))
    np.testing.assert_allclose(right, [85.0, TURN, 0, 0], rtol=0, atol=2e-6)
    other = max(ends, key=lambda end: abs(end[0] - 85))
    assert abs(other[0] - 85) > 1


@pytest.mark.parametrize("lockstep", [False, True])
def test_batches_and_steppers_start_there_too(model, lockstep):
    ways = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    alone = np.array([model.simulate(1.5, way, rtol=1e-10).y[-1] for way in ways])
    batch = model.simulate_batch(1.5, ways, rtol=1e-10, lockstep=lockstep)
    np.testing.assert_allclose(batch.y, alone, rtol=0, atol=1e-9 if lockstep else 0.0)
    stepper = model.stepper(ways[0], rtol=1e-10)
    for _ in range(15):
        y = stepper.step(0.1)
    np.testing.assert_allclose(y, alone[0], rtol=0, atol=1e-9)


def test_events_are_found_from_there_on(model):
    (way, _) = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    (found,) = model.simulate(1.0, way, events="theta_0 - 3.3").events
    np.testing.assert_allclose(found.y[:, 0], 3.3, rtol=0, atol=1e-12)


def test_a_span_that_ends_beside_the_change_point_is_covered(model):
    (way, _) = model.assemblies(IN_LINE, speeds={"omega_0": 1.0})
    sol = model.simulate(0.01, way, t_eval=[0.0, 0.005, 0.01])
    whole = model.simulate(0.1, way)
    np.testing.assert_allclose(sol.y, whole(sol.t), rtol=0, atol=1e-10)
    np.testing.assert_array_equal(sol.t, [0.0, 0.005, 0.01])
    with pytest.raises(ValueOutOfBoundsError, match="covers"):
        sol(0.02)
