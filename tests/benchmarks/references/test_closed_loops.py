"""The digits of the closed loops: on their curves, with their energies."""

import mpmath
import numpy as np
import pytest

from benchmarks.problems.data import reference
from benchmarks.references.closed_loops import LOOPS

ENDS = {  # integrated in doubles with derivatives of the kinetic energy along the curve
    "bennett": [-3.549871172274, -6.971771242479, 3.549871172274],
    "bricard": ([-1.521824205124, 1.617481313424] * 3)[:5],
}
GAPS = {
    "bennett": lambda a, b: mpmath.tan(a / 2) * mpmath.tan(b / 2) + mpmath.sqrt(3),
    "bricard": lambda a, b: mpmath.cos(a) + mpmath.cos(b) + mpmath.cos(a) * mpmath.cos(b),
}


@pytest.mark.parametrize("name", LOOPS)
def test_the_ends_are_those_of_another_form_and_lie_on_the_curve(name):
    data = reference("closed_loops")
    assert data["digits"] >= 30
    end = [mpmath.mpf(x) for x in data[name]["end"]]
    size = len(end) // 2
    np.testing.assert_allclose(np.array(end[:size], float), ENDS[name], rtol=0, atol=2e-11)
    assert abs(GAPS[name](*end[:2])) < mpmath.mpf(10) ** -28


@pytest.mark.parametrize("name", LOOPS)
def test_the_ends_have_the_energy_of_the_start(name):
    """From positions of the rods, of which the equation of motion knows the weights' power only."""
    loop, states = LOOPS[name](), [reference("closed_loops")[name][at] for at in ("start", "end")]
    links = [(float(length), float(angle)) for length, angle in loop.links]
    gravity = np.array([float(g) for g in loop.gravity])
    both = []
    for state in states:
        q, u = np.array(state, float).reshape(2, -1)
        both.append(kinetic_and_potential(links, gravity, q, u))
    assert both[0][0] == 0.0
    assert both[1][0] > 0.1
    assert sum(both[1]) == pytest.approx(both[0][1], abs=1e-12)


def turned(about, angle):
    """Rotation (3, 3) about axis 0 or 2."""
    c, s, i, j = np.cos(angle), np.sin(angle), (about + 1) % 3, (about + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def kinetic_and_potential(links, gravity, q, rates):
    """T and V of rods of 1 kg joined in a row, each turned about its axis at its near end."""
    frame, end = np.eye(3), np.zeros(3)
    spin, velocity = np.zeros(3), np.zeros(3)
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
