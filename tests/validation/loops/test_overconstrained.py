"""Overconstrained loops: rows that are redundant on closed configurations only."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from tests.support.linkages.loops import bennett, bricard, parallel_cranks

pytestmark = pytest.mark.slow  # scenes that take long to compile

T_END = 10.0
METHODS = ("dopri5", "dop853", "gauss8", "radau5")


def moves_as(model, q, exact, rtol, method):
    """A run from rest ends where it should, its loops closed."""
    sol = model.simulate(T_END, np.append(q, np.zeros(len(q))), rtol=rtol, method=method)
    assert sol.status.ok
    assert np.abs(sol.q[-1] - exact).max() < 100 * rtol + 1e-10
    assert sol.closure.max() < 1e-13


# -- three cranks: a pendulum ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def cranks():
    return mechc.compile(parallel_cranks(3))


def pendulum(count, start):
    """The angle at the end: cranks of 1 kg turn, the bar of 1 kg goes along with their ends."""
    inertia, moment = count / 3 + 1, 9.81 * (count / 2 + 1)
    run = solve_ivp(
        lambda t, y: [y[1], -moment / inertia * np.cos(y[0])], (0, T_END), [start, 0.0],
        method="DOP853", rtol=3e-14, atol=1e-14,
    )  # fmt: skip
    return run.y[0, -1]


def crank_angles(model, angle):
    """Relative angles: the bar keeps its direction."""
    return np.array([-angle if name == "q_bar" else angle for name in model.coordinates])


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8"])
def test_parallel_cranks_move_as_a_pendulum(cranks, method, rtol):
    start = crank_angles(cranks, 1.0)
    moves_as(cranks, start, crank_angles(cranks, pendulum(3, 1.0)), rtol, method)


def test_five_parallel_cranks_move_as_a_pendulum():
    model = mechc.compile(parallel_cranks(5))
    exact = crank_angles(model, pendulum(5, 1.0))
    for method in METHODS:
        for rtol in (1e-3, 1e-6, 1e-9):
            moves_as(model, crank_angles(model, 1.0), exact, rtol, method)


def test_a_start_typed_with_few_digits_is_closed_and_not_thrown(cranks):
    angles = np.round(crank_angles(cranks, 1.0), 9)
    angles += 0, 3e-9, 0, -2e-9
    start = np.append(angles, np.zeros(4))
    sol = cranks.simulate(1.0, start, rtol=1e-9)
    assert np.abs(sol.y[0] - start).max() < 1e-8
    assert np.ptp(sol.energy) < 1e-7


# -- single loops in space ------------------------------------------------------------------------

# Their closed curves are known in closed form, f(q_0, q_1) = 0.  Along such a curve the motion has
# one coordinate: G v' + G' v^2 / 2 + V' = 0, derivatives by complex steps (Squire & Trapp 1998).


def bennett_slopes(a, b):
    """Of sin(a/2) sin(b/2) - k cos(a/2) cos(b/2), by a and b; k = -sin 60 / sin 30 degrees."""
    k, a, b = -np.sqrt(3.0), a / 2, b / 2
    by_a = np.cos(a) * np.sin(b) + k * np.sin(a) * np.cos(b)
    return by_a, np.sin(a) * np.cos(b) + k * np.cos(a) * np.sin(b)


def bricard_slopes(a, b):
    """Of cos a + cos b + cos a cos b, by a and b."""
    return -np.sin(a) * (1 + np.cos(b)), -np.sin(b) * (1 + np.cos(a))


def tangent(slopes, pattern, a, b):
    """Rates of all angles along the curve; pattern: what multiples of a and b each angle is."""
    by_a, by_b = slopes(a, b)
    return pattern @ np.array([-by_b, by_a]) / np.sqrt(by_a**2 + by_b**2)


def turned(about, angle):
    """Rotation (3, 3) about axis 0 or 2."""
    c, s, i, j = np.cos(angle), np.sin(angle), (about + 1) % 3, (about + 2) % 3
    matrix = np.eye(3, dtype=complex)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def kinetic_and_potential(links, gravity, q, rates):
    """T and V of rods of 1 kg joined in a row, each turned about its axis at its near end."""
    frame, end = np.eye(3, dtype=complex), np.zeros(3, dtype=complex)
    spin, velocity = np.zeros(3, dtype=complex), np.zeros(3, dtype=complex)
    kinetic = potential = 0.0
    length, angle = links[-1]
    end = end + length * frame[:, 0]
    for k in range(len(links) - 1):
        frame = frame @ turned(0, angle) @ turned(2, q[k])
        spin = spin + rates[k] * frame[:, 2]
        length, angle = links[k]
        half = length / 2 * frame[:, 0]
        moving = velocity + np.cross(spin, half)
        own = frame.T @ spin
        inertia = length**2 * np.array([1 / 50, 1 / 12, 1 / 12])
        kinetic = kinetic + (moving @ moving + inertia @ own**2) / 2
        potential = potential - gravity @ (end + half)
        end, velocity = end + 2 * half, velocity + 2 * np.cross(spin, half)
    return kinetic, potential


def on_curve(links, gravity, slopes, pattern, start):
    """All angles at the end, from rest."""

    def terms(a, b):
        rates = tangent(slopes, pattern, a, b)
        kinetic, potential = kinetic_and_potential(links, gravity, pattern @ [a, b], rates)
        return 2 * kinetic, potential, rates

    def along(t, y):
        step = 1e-100
        inertia, _, rates = terms(y[0], y[1])
        by_a, by_b = np.linalg.lstsq(pattern, rates.real, rcond=None)[0]
        slope, force, _ = terms(y[0] + 1j * step * by_a, y[1] + 1j * step * by_b)
        change = -(slope.imag * y[2] ** 2 / 2 + force.imag) / step / inertia.real
        return [by_a * y[2], by_b * y[2], change]

    run = solve_ivp(along, (0, T_END), [*start[:2], 0.0], method="DOP853", rtol=3e-13, atol=1e-13)
    return pattern @ run.y[:2, -1]


def exact_bennett():
    links = [(2.0, np.pi / 2), (1.0, np.pi / 6)] * 2
    pattern = np.array([[1, 0], [0, 1], [-1, 0]])
    gravity = np.array([0, -9.81, -1.0])
    return on_curve(links, gravity, bennett_slopes, pattern, bennett_start())


def exact_bricard():
    links = [(1.0, np.pi / 2), (1.0, -np.pi / 2)] * 3
    pattern = np.array([[1, 0], [0, 1]] * 3)[:5]
    gravity = np.array([0, -9.81, 0.0])
    return on_curve(links, gravity, bricard_slopes, pattern, bricard_start())


BENNETT_END = np.array([-3.549871172274, -6.971771242479, 3.549871172274])
BRICARD_END = np.array([-1.521824205124, 1.617481313424] * 3)[:5]


def bennett_start():
    """tan(q_0/2) tan(q_1/2) = sin((a + b)/2) / sin((b - a)/2) and q_2 = -q_0."""
    ratio = np.sin(np.pi / 3) / np.sin(-np.pi / 6)
    return np.array([1.0, 2 * np.arctan(ratio / np.tan(0.5)), -1.0])


def bricard_start():
    """cos q_0 + cos q_1 + cos q_0 cos q_1 = 0, every other angle the same."""
    first = 1.2
    other = np.arccos(-np.cos(first) / (1 + np.cos(first)))
    return np.array([first, other, first, other, first])


@pytest.fixture(scope="module")
def six_bar():
    return mechc.compile(bricard())


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_bricards_linkage_moves_as_on_its_closed_curve(six_bar, method, rtol):
    moves_as(six_bar, bricard_start(), BRICARD_END, rtol, method)


def test_the_row_of_bricards_linkage_that_is_redundant_is_named(six_bar):
    (found,) = six_bar.redundant_constraints()
    assert found.name in six_bar.constraint_names
    assert len(found.follows_from) > 1
    assert f"  {found}" in six_bar.report()


def test_bennetts_linkage_moves_as_on_its_closed_curve():
    assert np.allclose(exact_bennett(), BENNETT_END, rtol=0, atol=2e-11)
    model = mechc.compile(bennett())
    for method in METHODS:
        for rtol in (1e-3, 1e-6, 1e-9):
            moves_as(model, bennett_start(), BENNETT_END, rtol, method)


def test_the_end_of_bricards_linkage_is_that_of_its_closed_curve():
    assert np.allclose(exact_bricard(), BRICARD_END, rtol=0, atol=2e-11)
