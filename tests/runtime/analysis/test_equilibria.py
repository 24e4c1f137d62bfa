"""Equilibria and the limits of a coordinate."""

import numpy as np
import pytest
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from mechc.errors import MechcError, UnknownNameError
from tests.support.linkages.loops import spatial_four_bar

PARAMS = {"l_3": 3.5}


def falling():
    """A mass on a vertical rail."""
    q, u = dynamicsymbols("q u")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", q * frame.x)
    point.set_vel(frame, u * frame.x)
    kane = KanesMethod(frame, [q], [u], kd_eqs=[q.diff() - u])
    kane.kanes_equations([Particle("mass", point, 1)], [(point, -9.81 * frame.x)])
    return kane


@pytest.fixture(scope="module")
def model():
    return mechc.load("four_bar")


@pytest.fixture(scope="module")
def found(model):
    return model.equilibria(PARAMS)


def test_an_equilibrium_stays_at_rest(model, found):
    assert found
    for equilibrium in found:
        assert np.abs(model.rhs(0.0, equilibrium.y, PARAMS)).max() < 1e-10
        assert np.abs(model.constraints(equilibrium.y, PARAMS)).max() < 1e-14


def test_both_circuits_of_a_crank_rocker_have_a_least_and_a_greatest_potential(model, found):
    assert [e.stable for e in found] == [True, True, False, False]
    heights = {True: [], False: []}
    for e in found:
        heights[e.stable].append(float(model.potential_energy(e.y, PARAMS)))
    # The linkage mirrored in the ground line has the opposite potential.
    assert sorted(heights[True]) == pytest.approx(sorted(-v for v in heights[False]), abs=1e-12)


def test_stable_means_that_a_push_comes_back(model, found):
    for equilibrium in found:
        y = model.assemble(
            {"theta_0": equilibrium.y[0] + 1e-4},
            guess={"theta_1": equilibrium.y[1]},
            params=PARAMS,
        )
        sol = model.simulate(2.0, y, PARAMS)
        strayed = np.abs(sol["theta_0"] - equilibrium.y[0]).max()
        assert (strayed < 1.1e-4) == equilibrium.stable


@pytest.mark.slow
def test_a_coupler_that_may_spin_has_equilibria_that_are_neutral():
    """Mirrored in the plane of its axes, the linkage has the opposite potential."""
    model = mechc.compile(spatial_four_bar())
    found = model.equilibria()
    assert found
    for equilibrium in found:
        assert np.abs(model.rhs(0.0, equilibrium.y)).max() < 1e-10
        assert np.abs(model.constraints(equilibrium.y)).max() < 1e-13
        assert (equilibrium.stable, equilibrium.neutral) == (False, 1)
    heights = sorted({round(float(model.potential_energy(e.y)), 8) for e in found})
    np.testing.assert_allclose(heights, -np.array(heights)[::-1], atol=1e-8)


def test_where_there_is_no_equilibrium_an_error_says_so():
    with pytest.raises(MechcError, match="no equilibrium was found from 48 configurations"):
        mechc.compile(falling()).equilibria()


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        ({"l_0": 2.5}, [(-97.903207726, 97.903207726)]),
        ({"l_3": 3.5}, [(-180, 180)]),
        ({}, [(-180, 180)]),
    ],
    ids=["rocks through 0", "turns fully", "turns fully, with a change point"],
)
def test_limits_of_the_crank(model, lengths, expected):
    ranges = np.degrees(model.limits("theta_0", lengths))
    assert ranges == pytest.approx(np.array(expected), abs=1e-8)


def test_a_crank_that_rocks_on_two_sides_has_two_ranges(model):
    lengths = {"l_0": 2.0, "l_1": 1.0, "l_2": 2.5, "l_3": 2.4}
    ranges = model.limits("theta_0", lengths)
    # |l_1 - l_2| <= distance of p_1 from the rocker's pivot <= l_1 + l_2
    at = lambda d: np.arccos((2.0**2 + 2.4**2 - d**2) / (2 * 2.0 * 2.4))  # noqa: E731
    low, high = at(1.5), at(3.5)
    assert np.array(ranges) == pytest.approx(np.array([(-high, -low), (low, high)]), abs=1e-8)


def test_an_unknown_coordinate_is_refused(model):
    with pytest.raises(UnknownNameError, match="theta_0"):
        model.limits("theta0")
