"""The closure curve: its states are on the loop, and its motion is the exact one."""

import numpy as np
import pytest

import mechc
from benchmarks.problems.data import four_bar_state
from benchmarks.references.closure_curve import Geometry
from benchmarks.stability.random_starts import cases

REFERENCE = Geometry(
    np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[-1.0, 1.0, 1.0]]), np.array([[1.0, 2.0, 3.0]]),
    np.array([False]),
)  # fmt: skip


def test_states_of_every_kind_of_geometry_keep_the_loop_closed():
    rng = np.random.default_rng(4)
    names, geometry = cases(rng, 5, 12)
    y = np.stack([rng.uniform(0, 2 * np.pi, len(names)), rng.normal(0, 3, len(names))])
    state, lengths = geometry.state(y), geometry.lengths
    links = lengths[:, :3] * np.exp(1j * state[:, :3])
    assert np.abs(links.sum(1) - lengths[:, 3]).max() < 1e-12
    assert np.abs((1j * links * state[:, 3:]).sum(1)).max() < 1e-10


def test_the_energy_is_that_of_the_bodies():
    model, y = mechc.load("four_bar"), np.array([[0.7], [2.0]])
    moving, resting = REFERENCE.energy(y), REFERENCE.energy(y * [[1], [0]])
    kinetic = model.kinetic_energy(REFERENCE.state(y))
    assert moving - resting == pytest.approx(kinetic, rel=1e-12)


def test_the_motion_through_change_points_is_the_exact_one():
    """From rest at 85 degrees, whose psi is found by bisection."""
    psi = np.linspace(0, 2 * np.pi, 4001)

    def crank(angle):
        return REFERENCE.state(np.array([[angle], [0.0]]))[0]

    wanted = four_bar_state("change_point", 0.0)
    nearest = min(psi, key=lambda angle: np.abs(crank(angle) - wanted).max())
    low, high = nearest - 2e-3, nearest + 2e-3
    rising = crank(high)[0] > crank(low)[0]
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if (crank(middle)[0] < wanted[0]) == rising else (low, middle)
    y = REFERENCE.integrate(np.array([[low], [0.0]]), np.array([5.0]))[0]
    found, exact = REFERENCE.state(y)[0], four_bar_state("change_point", 5.0)
    np.testing.assert_allclose(np.exp(1j * found[:3]), np.exp(1j * exact[:3]), atol=1e-9)
    np.testing.assert_allclose(found[3:], exact[3:], atol=1e-8)
