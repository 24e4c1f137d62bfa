"""Impulses with friction: Newton's and Coulomb's laws hold, and energy never grows."""

import numpy as np
import pytest

from mechc.simulation.contact.impacts import after_impact
from mechc.simulation.contact.laws import Numbers
from mechc.simulation.contact.place import Place


def place_of(normal, tangent, u, friction, restitution):
    """Contacts of a body with the unit mass matrix and the speeds u."""
    n, none = len(normal), np.zeros(len(normal))
    numbers = Numbers(
        none, normal @ u, none, normal, tangent @ u, none, tangent, restitution, friction, friction
    )
    metric, y = np.eye(len(u)), np.append(0.0 * u, u)
    return Place(0.0, y, u, numbers, metric, normal, tangent, None, metric[:0]), n


@pytest.mark.parametrize("contacts", [1, 2, 3])
def test_the_laws_hold_and_energy_never_grows(contacts):
    """Rates, slips and impulses after an impact; as many freedoms as determine the impulses."""
    rng = np.random.default_rng(contacts)
    kept = 0
    for _ in range(40):
        normal, tangent = rng.normal(size=(2, contacts, 2 * contacts + 1))
        u = rng.normal(size=2 * contacts + 1)
        u -= 2.0 * np.linalg.pinv(normal) @ np.maximum(normal @ u, 0.0)  # all gaps close
        mu, e = rng.uniform(0.0, 1.0, contacts), np.full(contacts, rng.uniform(0.0, 1.0))
        place, n = place_of(normal, tangent, u, mu, e)
        every = np.ones(n, bool)
        change, _ = after_impact(place, every, e, every)
        p = np.linalg.lstsq(np.vstack([normal, tangent]).T, change, rcond=None)[0]
        pressed, along = p[:n], p[n:]
        before, after, slip = normal @ u, normal @ (u + change), tangent @ (u + change)
        assert (u + change) @ (u + change) <= u @ u + 1e-12
        assert (pressed >= -1e-10).all()
        assert (np.abs(along) <= mu * pressed + 1e-10).all()
        slides = np.abs(slip) > 1e-9
        np.testing.assert_allclose((along + mu * pressed * np.sign(slip))[slides], 0, atol=1e-10)
        assert (after >= -1e-10).all()
        free = after + e * before
        if (free >= -1e-10).all():  # the whole restitution
            kept += 1
            np.testing.assert_allclose(pressed * free, 0, atol=1e-9)
    assert kept > 30


def test_without_slip_a_ball_spins_up_by_coulombs_law():
    """A sphere that lands with backspin: J = m (1 + e) w, p_t = mu J or what stops its slip."""
    inertia, radius = 0.4, 1.0  # of a unit mass
    scale = np.array([1.0, 1.0, 1 / np.sqrt(inertia)])
    normal, tangent = np.array([[0.0, 1.0, 0.0]]), np.array([[1.0, 0.0, radius]]) * scale
    for mu, sticks in ((0.1, False), (0.9, True)):
        u = np.array([1.0, -2.0, 0.5 / scale[2]])
        place, _ = place_of(normal, tangent, u, np.array([mu]), np.array([0.5]))
        change, _ = after_impact(place, np.array([True]), np.array([0.5]), np.array([True]))
        assert change[1] == pytest.approx(3.0, rel=1e-12)
        expected = -1.5 / (1 + 1 / inertia) if sticks else -mu * 3.0
        assert change[0] == pytest.approx(expected, rel=1e-12)
