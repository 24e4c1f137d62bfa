"""Redundant constraints change nothing but the multipliers, which are the least ones."""

import numpy as np
import pytest

import mechc
from benchmarks.problems.redundant import spatial, two_rockers
from tests.support.marks import slow_among

T_END = 5.0
TILT = {"tilt_0": 0.3, "tilt_1": 0.7}
pytestmark = pytest.mark.slow  # scenes that take long to compile

MAKERS = {"spatial": (spatial, TILT, 2), "two_rockers": (two_rockers, {}, 3)}


@pytest.fixture(scope="module", params=slow_among(MAKERS, {"spatial"}))
def scene(request):
    """Model, its parameters beside l_3, rank of its rows."""
    make, params, rank = MAKERS[request.param]
    return mechc.compile(make()), params, rank


@pytest.fixture(scope="module")
def planar():
    return mechc.load("four_bar")


def start_of(model, planar, ground):
    """The planar start at 85 degrees from rest, with the other rocker where the rocker is."""
    q = planar.assemble({"theta_0": np.radians(85)}, params={"l_3": ground})[[0, 1, 2, 2]]
    return np.append(q[: len(model.coordinates)], np.zeros(len(model.speeds)))


def both(scene, planar, ground, **policy):
    """The run with redundant rows and the planar one."""
    model, params, _ = scene
    start = start_of(model, planar, ground)
    plain = np.append(start[:3], np.zeros(3))
    return (
        model.simulate(T_END, start, {"l_3": ground, **params}, **policy),
        planar.simulate(T_END, plain, {"l_3": ground}, **policy),
    )


@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_the_motion_is_the_planar_one(scene, planar, method):
    sol, plain = both(scene, planar, 3.5, rtol=1e-12, method=method)
    assert sol.status.ok
    times = np.linspace(0, T_END, 400)
    np.testing.assert_allclose(sol(times)[:, :3], plain(times)[:, :3], rtol=0, atol=1e-10)
    assert sol.closure.max() < 1e-13
    assert sol.velocity_closure.max() < 1e-12


def test_change_points_are_passed_and_reported_all_the_same(scene, planar):
    sol, plain = both(scene, planar, 4.0, rtol=1e-9, method="dop853")
    assert len(sol.change_points) == len(plain.change_points) == 4
    times = [[c.t for c in run.change_points] for run in (sol, plain)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-7)
    np.testing.assert_allclose(sol.y[-1, :3], plain.y[-1, :3], rtol=0, atol=1e-7)


@pytest.mark.parametrize("method", ["dopri5", "gauss8", "radau5"])
def test_beside_change_points_no_run_is_wrong_without_a_word(scene, planar, method):
    sol, plain = both(scene, planar, 4.0, rtol=1e-7, method=method)
    assert sol.status.ok or sol.status.code == "undecided"
    times = np.linspace(0, sol.status.t, 200)
    np.testing.assert_allclose(sol(times)[:, :3], plain(times)[:, :3], rtol=0, atol=1e-3)


def test_multipliers_are_the_least_that_give_the_reactions(scene, planar):
    model, params, rank = scene
    given = {"l_3": 3.5, **params}
    sol = model.simulate(T_END, start_of(model, planar, 3.5), given)
    y = sol(np.random.default_rng(0).uniform(0, T_END, 100))
    rows = model.constraint_jacobian(y, given)
    assert (np.linalg.matrix_rank(rows, tol=1e-9) == rank).all()
    rates = model.rhs(0, y, given)[:, len(model.coordinates) :]
    inertia = (model.mass_matrix(y, given) @ rates[:, :, None])[:, :, 0]
    reaction = model.forcing(y, given) - inertia
    columns = np.swapaxes(rows, 1, 2)
    least = (np.linalg.pinv(columns, rcond=1e-9) @ reaction[:, :, None])[:, :, 0]
    scale = np.abs(least).max()
    np.testing.assert_allclose(model.multipliers(y, given), least, rtol=0, atol=1e-12 * scale)
    one = [model.multipliers(state, given) for state in y[:7]]  # not in lanes
    np.testing.assert_allclose(one, least[:7], rtol=0, atol=1e-12 * scale)


def test_the_report_names_what_is_redundant(scene, planar):
    model, _, rank = scene
    found = model.redundant_constraints()
    assert len(found) == len(model.constraint_names) - rank
    for redundancy in found:
        assert f"  {redundancy}" in model.report()
        assert redundancy.name in model.constraint_names
    if rank == 3:
        assert "other rocker along y: follows from" in str(found[-1])
    else:
        assert str(found[-1]).endswith("of axis with y: always holds")
        shares = np.array(found[0].shares)  # place along c, of that along a and b
        a, b, c = (axis(model, n) for n in "abc")
        np.testing.assert_allclose(shares @ [a, b], c, atol=1e-12)
    assert planar.redundant_constraints() == ()
    assert "redundant constraints: none" in planar.report()


def axis(model, name):
    """In the plane's x and y: the axis along which the row called ``name`` measures."""
    row = model.constraint_names.index(f"closure of the rocker of place along {name}")
    flat = [0.0, np.pi / 2, 0.0]  # crank along x, coupler along y
    state = np.append(flat, [0.0, 0.0, 0.0])
    entries = model.constraint_jacobian(state)[row]
    return np.array([-entries[1] / 2, entries[0] / 1])
