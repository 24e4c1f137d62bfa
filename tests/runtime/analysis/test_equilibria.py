"""Equilibria and the limits of a coordinate."""

import numpy as np
import pytest
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc.errors import MechcError, UnknownNameError
from tests.support.linkages import dyads
from tests.support.linkages.loops import spatial_four_bar

PARAMS = {"l_3": 3.5}


def falling():
    """A mass on a vertical rail."""
    q, u = dynamicsymbols("q u")
    return particle([q], [u], [-9.81], 1)


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


@pytest.mark.parametrize("links", [2, pytest.param(5, marks=pytest.mark.slow)])
def test_every_link_of_a_chain_hangs_or_stands(links):
    model = mechc.load("pendulum", links=links)
    found = model.equilibria()
    turns = np.array([e.y[:links] for e in found]) - found[0].y[:links]
    assert np.abs(np.sin(turns)).max() < 1e-9
    assert len({tuple(np.cos(turn).round()) for turn in turns}) == 2**links
    assert sum(e.stable for e in found) == 1
    assert found.expected < 2**links + 0.5
    assert found.unexplored < 0.05


def test_one_that_is_far_from_all_found_is_said_to_be_missing():
    """A chain of five links, searched too little."""
    found = mechc.load("pendulum", links=2).equilibria(most_starts=6)
    assert len(found) + 0.5 <= found.expected
    assert found.searches == 6


def watt_six_bar():
    """Point masses at the joints of a six-bar on rods without mass, and its potential m g y.

    Lagrange's method, in Cartesian coordinates; the crank goes round.
    """
    shape, masses = dyads.watt(0.0), {"A": 1.0, "B": 2.0, "C": 0.5, "F": 1.5}
    names = ["A", *shape.joints]
    q = {name: dynamicsymbols(f"x_{name} y_{name}") for name in names}
    places = {"O": (0.0, 0.0), "D": shape.known["D"], "G": shape.known["G"], **q}
    rows = [
        ((places[a][0] - places[b][0]) ** 2 + (places[a][1] - places[b][1]) ** 2 - length**2) / 2
        for a, b, length in [("O", "A", 1.0), *shape.rods]
    ]
    kinetic = sum(masses[n] * (x.diff() ** 2 + y.diff() ** 2) / 2 for n, (x, y) in q.items())
    potential = sum(masses[n] * 9.81 * y for n, (_, y) in q.items())
    method = LagrangesMethod(
        kinetic - potential, [c for pair in q.values() for c in pair], hol_coneqs=rows
    )
    method.form_lagranges_equations()
    return method, masses


@pytest.mark.slow
def test_equilibria_of_a_six_bar_are_where_its_height_along_each_circuit_turns():
    """By intersecting circles at 4,000 angles of the crank, for each of the eight circuits."""
    method, masses = watt_six_bar()
    angles = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    others = [masses[n] for n in dyads.watt(0.0).joints]
    heights = np.array(
        [masses["A"] * np.sin(a) + dyads.watt(a).assemblies()[:, :, 1] @ others for a in angles]
    )
    rises = np.roll(heights, -1, axis=0) > heights
    before = np.roll(rises, 1, axis=0)
    places = [
        (lowest, heights[k, circuit])
        for circuit in range(heights.shape[1])
        for lowest in (True, False)
        for k in np.flatnonzero((rises & ~before if lowest else before & ~rises)[:, circuit])
    ]
    assert len(places) == 16
    found = mechc.compile(method).equilibria()
    own = [(e.stable, float(e.y[1:8:2] @ list(masses.values()))) for e in found]
    for lowest in (True, False):
        expected, seen = (sorted(h for low, h in each if low == lowest) for each in (places, own))
        assert seen == pytest.approx(expected, abs=1e-5)


def test_where_there_is_no_equilibrium_an_error_says_so():
    with pytest.raises(MechcError, match="no equilibrium was found from 8192 configurations"):
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
