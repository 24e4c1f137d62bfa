"""Equilibria and the limits of a coordinate."""

import numpy as np
import pytest
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    dynamicsymbols,
)

import mechc
from benchmarks.problems.particle import particle
from mechc.errors import MechcError, UnknownNameError
from tests.support.linkages import dyads
from tests.support.linkages.loops import spatial_four_bar
from tests.support.pendulums import pendulum, pushed_mass

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
    """Mirrored in the plane of its axes, the linkage has the opposite potential.

    Every attitude of the coupler has two sets of angles, between which spinning does not lead.
    """
    model = mechc.compile(spatial_four_bar())
    found = model.equilibria()
    assert [each.kind for each in found] == ["neutral", "neutral", "unstable", "unstable"] * 2
    assert {each.free for each in found} == {("q_0, q_1, q_2",)}
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


# -- kinds ----------------------------------------------------------------------------------------


def zieglers_column():
    """Two rods with masses 2 m and m at their ends, springs k and dampers c in their joints, and
    P along the outer rod (Ziegler 1952, Ingenieur-Archiv 20)."""
    q, u = dynamicsymbols("q1 q2"), dynamicsymbols("u1 u2")
    m, l, k, c, P = symbols("m l k c P")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    start, ends, rods = origin, [], []
    for name, angle, speed in zip("AB", q, u, strict=True):
        rods.append(frame.orientnew(name, "Axis", (angle, frame.z)))
        rods[-1].set_ang_vel(frame, speed * frame.z)
        ends.append(start.locatenew(f"end {name}", l * rods[-1].x))
        ends[-1].v2pt_theory(start, frame, rods[-1])
        start = ends[-1]
    inner, outer = k * q[0] + c * u[0], k * (q[1] - q[0]) + c * (u[1] - u[0])
    method = KanesMethod(frame, q, u, [a.diff() - b for a, b in zip(q, u, strict=True)])
    method.kanes_equations(
        [Particle("B", ends[0], 2 * m), Particle("C", ends[1], m)],
        [(rods[0], (outer - inner) * frame.z), (rods[1], -outer * frame.z),
         (start, -P * rods[1].x)],
    )  # fmt: skip
    return mechc.compile(method, name="column", defaults={"m": 1.5, "l": 0.8, "k": 20.0, "c": 0.0})


def straight(found):
    """The equilibrium in which everything is zero."""
    (only,) = (e for e in found if np.abs(e.y).max() < 1e-6)
    return only


def test_a_column_under_a_follower_load_flutters_from_its_published_load_on():
    """P l / k = 7/2 - sqrt 2 without damping; with equal dampers 41/28 + c^2 / (2 k m l^2)."""
    column, unit = zieglers_column(), 20.0 / 0.8
    flutter = 3.5 - np.sqrt(2.0)
    for load, kind in (
        (0.5, "stable"),
        (0.9999, "stable"),
        (1.0001, "unstable"),
        (1.2, "unstable"),
    ):
        upright = straight(column.equilibria({"P": load * flutter * unit}))
        assert (upright.kind, upright.stable) == (kind, kind == "stable")
        assert upright.neutral == 0
        assert (upright.eigenvalues[0].real > 1e-3) == (kind == "unstable")
        assert abs(upright.eigenvalues[0].imag) > 1.0
    damped = 41.0 / 28.0 + 0.3**2 / (2 * 20.0 * 1.5 * 0.8**2)
    for load, kind in ((0.9999, "stable"), (1.0001, "unstable")):
        given = {"P": load * damped * unit, "c": 0.3}
        assert straight(column.equilibria(given)).kind == kind


def test_a_pendulum_hangs_and_stands():
    hanging, standing = mechc.compile(pendulum()).equilibria()
    assert (hanging.kind, standing.kind) == ("stable", "unstable")
    np.testing.assert_allclose(hanging.eigenvalues.real, 0.0, atol=1e-14)
    np.testing.assert_allclose(np.abs(hanging.eigenvalues.imag), np.sqrt(9.81), rtol=1e-12)
    np.testing.assert_allclose(standing.eigenvalues, [np.sqrt(9.81), -np.sqrt(9.81)], rtol=1e-12)


@pytest.mark.parametrize(("damper", "kind"), [(0.2, "stable"), (0.0, "stable"), (-0.2, "unstable")])
def test_a_negative_damper_makes_an_equilibrium_unstable(damper, kind):
    q, u = dynamicsymbols("q u")
    c, k = symbols("c k")
    model = mechc.compile(particle([q], [u], [-k * q - c * u]), defaults={"m": 2.0, "k": 3.0})
    (found,) = model.equilibria({"c": damper})
    assert (found.kind, found.neutral) == (kind, 0)
    np.testing.assert_allclose(found.eigenvalues.real, -damper / 4.0, atol=1e-14)
    (free,) = model.equilibria({"c": damper, "k": 0.0})[:1]
    assert (free.kind, free.neutral) == ("unstable" if damper < 0 else "neutral", 1)


def test_a_loop_with_a_negative_damper_in_its_joint():
    """A bob on a rod in Cartesian coordinates: the lower equilibrium, with a damper and without."""
    x, y, u, v = dynamicsymbols("x y u v")
    c = symbols("c")
    bob = mechc.from_equations(
        [x, y], [u, v], [[2, 0], [0, 2]], [-c * u, -19.62 - c * v], name="bob",
        kinematics=[x.diff() - u, y.diff() - v], constraints=[x**2 + y**2 - 1],
    )  # fmt: skip
    model = mechc.compile(bob, defaults={"c": 0.0})
    for damper, kinds in ((0.0, ("stable", "unstable")), (-0.2, ("unstable", "unstable"))):
        found = sorted(model.equilibria({"c": damper}), key=lambda e: e.y[1])
        assert tuple(e.kind for e in found) == kinds
        roots = np.roots([2.0, damper, 19.62])
        np.testing.assert_allclose(np.sort_complex(found[0].eigenvalues), np.sort_complex(roots))


def test_an_equilibrium_where_branches_cross_is_undecided():
    """A bead that may leave the crossing of two rails along each, drawn back by springs."""
    x, y, u, v = dynamicsymbols("x y u v")
    bead = mechc.from_equations(
        [x, y], [u, v], [[1, 0], [0, 1]], [-x, -2 * y], name="bead",
        kinematics=[x.diff() - u, y.diff() - v], constraints=[x * y],
    )  # fmt: skip
    (found,) = mechc.compile(bead).equilibria()
    assert (found.kind, found.stable, len(found.eigenvalues)) == ("undecided", False, 0)


def test_loads_that_are_unknown_functions_of_the_state_are_refused():
    model = mechc.compile(pushed_mass(), name="slider", defaults={"m": 2.0, "k": 3.0})
    assert model.with_inputs({"F": 1.0}).equilibria()[0].stable
    pushed = model.with_inputs({"F": lambda t, q, u: 0.2 * u[0]})
    with pytest.raises(MechcError, match="how F depend on the state is not known"):
        pushed.equilibria()
