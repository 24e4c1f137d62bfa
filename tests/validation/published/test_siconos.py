"""Friction and impact as Siconos computes them, and as mechanics has them in closed form.

Recorded by Siconos 4 (siconos-tutorials, examples/mechanics), time steps of Moreau and Jean.
"""

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import quad
from sympy.physics.mechanics import dynamicsymbols

import mechc


@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_a_mass_with_dry_friction_rests_after_seven_half_swings(method):
    """FrictionOscillator: unit mass, spring and friction; each half swing takes 2 m away."""
    x, v = dynamicsymbols("x v")
    oscillator = mechc.compile(mechc.from_equations([x], [v], [[1]], [-x]))
    friction = mechc.DryFriction("v", 1.0)
    sol = oscillator.simulate(100.0, [12.0, 6.0], events=[friction], rtol=1e-11, method=method)
    ends, rest = np.asarray(sol.events[0].t), np.arctan2(6, 13)
    np.testing.assert_allclose(ends[-1], rest + 7 * np.pi, rtol=1e-9)
    np.testing.assert_allclose(sol.y[-1], [15 - np.sqrt(205), 0.0], rtol=0, atol=1e-9)
    assert abs(sol.y[-1, 0] - 0.6820441351954105) < 2e-4  # Siconos, steps of 0.01 s


def test_a_stick_bounces_on_its_tip_without_the_energy_that_newtons_law_gives_it():
    """ImpactingStick: restitution 1, friction 0.01; the slip changes its sign in the impact."""
    x, y, theta, u, v, omega = dynamicsymbols("x y theta u v omega")
    stick = mechc.compile(
        mechc.from_equations([x, y, theta], [u, v, omega], sm.diag(1, 1, "1/12"), [0, -10, 0])
    )
    tip = mechc.Stop(
        "y - 0.5*cos(theta)", restitution=1.0, friction=0.01, slip="u + 0.5*cos(theta)*omega"
    )
    angle = np.pi / 4
    start = [0.5 * np.sin(angle), 0.5 * np.cos(angle) + 0.01, angle, -0.5, 0.1, 0.1]
    sol = stick.simulate(0.2, start, events=[tip], rtol=1e-11)
    recorded = [0.2529172311983667, 0.2471693300826099, 1.081891493988364,
                -0.5068672606709300, -1.213273932906967, 3.212070578753687]  # fmt: skip
    first, second = sol.events[0].t
    energies = [_energy(sol(t)) for t in (0.0, first, second)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-10)  # Newton's law would add to it
    assert energies[2] < energies[1] - 1e-4  # friction
    assert _energy(recorded) > energies[0] + 1e-4
    assert "law='poisson'" in str(sol.status)
    np.testing.assert_allclose(sol.y[-1, :3], recorded[:3], rtol=0, atol=2e-4)


def _energy(y):
    return (y[3] ** 2 + y[4] ** 2 + y[5] ** 2 / 12) / 2 + 10 * y[1]


def test_a_follower_bounces_with_the_period_of_its_spring():
    """CamFollower-Rheonomous: its cam is recorded and not in its constraint; restitution 0.8."""
    x, v = dynamicsymbols("x v")
    follower = mechc.compile(mechc.from_equations([x], [v], [["1.221"]], [-1430.8 * x]))
    stop = mechc.Stop("x", restitution=0.8)
    sol = follower.simulate(1.0, [0.4, 0.4], events=[stop], rtol=1e-11)
    rate = np.sqrt(1430.8 / 1.221)
    first = (np.pi / 2 + np.arctan2(0.4 / rate, 0.4)) / rate
    hits = first + np.arange(11) * np.pi / rate
    np.testing.assert_allclose(sol.events[0].t, hits, rtol=1e-10)
    speed = rate * np.hypot(0.4, 0.4 / rate) * 0.8**11
    np.testing.assert_allclose(
        sol.y[-1, 0], speed / rate * np.sin(rate * (1 - hits[-1])), rtol=1e-9
    )
    assert abs(sol.y[-1, 0] - 0.0320275670) < 1e-3  # Siconos, steps of 0.1 ms


def test_a_block_rocks_as_housner_has_it():
    """Corners without restitution: G. W. Housner, Bull. Seism. Soc. Am. 53 (1963), eqs. 1 to 5.

    Siconos's rocking block has an impact law of its own for two contacts.
    """
    x, y, theta, u, v, omega = dynamicsymbols("x y theta u v omega")
    half, height, g, tilt = 0.1, 0.3, 9.81, 0.15
    inertia = sm.diag(1, 1, "1/30")
    block = mechc.compile(mechc.from_equations([x, y, theta], [u, v, omega], inertia, [0, -g, 0]))
    corners = [
        mechc.Stop(
            f"y + {at}*sin(theta) - {height}*cos(theta)", restitution=0.0, friction=1.0,
            slip=f"u + ({height}*cos(theta) - {at}*sin(theta))*omega",
        )
        for at in (-half, half)
    ]  # fmt: skip
    s, c = np.sin(tilt), np.cos(tilt)
    start = [half * c - height * s, half * s + height * c, tilt, 0, 0, 0]
    sol = block.simulate(1.6, start, events=corners, rtol=1e-11)
    hits = np.sort(np.concatenate([corner.t for corner in sol.events]))
    np.testing.assert_allclose(hits, _housners_impacts(half, height, g, tilt, 6), rtol=1e-8)


def _housners_impacts(half, height, g, tilt, count):
    """Times of impacts of a block that is let go at an angle."""
    radius, angle = np.hypot(half, height), np.arctan2(half, height)
    kept = 1 - 1.5 * np.sin(angle) ** 2
    times, t = [], 0.0
    for _ in range(count):
        times.append(t + _quarter(tilt, angle, 3 * g / (4 * radius)))
        rise = kept**2 * (np.cos(angle - tilt) - np.cos(angle))
        tilt = angle - np.arccos(np.cos(angle) + rise)
        t = times[-1] + _quarter(tilt, angle, 3 * g / (4 * radius))
    return times


def _quarter(tilt, angle, squared):
    """The time from rest at an angle to upright; s = sqrt(tilt - theta)."""

    def integrand(s):
        height = np.cos(angle - tilt) - np.cos(angle - tilt + s * s)
        return 2 * s / np.sqrt(2 * squared * height)

    return quad(integrand, 0, np.sqrt(tilt), epsabs=1e-13, epsrel=1e-12)[0]
