"""Impulses with friction: the laws of restitution and Coulomb's hold, and energy never grows."""

import numpy as np
import pytest

from tests.support.impacts import FreeBody

pytestmark = pytest.mark.compiles  # more parameters than a tape holds


@pytest.fixture(scope="module")
def bodies():
    return {contacts: FreeBody(contacts) for contacts in (1, 2, 3)}


@pytest.mark.slow
@pytest.mark.parametrize("contacts", [1, 2, 3])
def test_the_laws_hold_and_energy_never_grows(contacts, bodies):
    """Rates, slips and impulses after an impact; as many freedoms as determine the impulses."""
    rng = np.random.default_rng(contacts)
    kept = 0
    for _ in range(40):
        normal, tangent = rng.normal(size=(2, contacts, 2 * contacts + 1))
        u = rng.normal(size=2 * contacts + 1)
        u -= 2.0 * np.linalg.pinv(normal) @ np.maximum(normal @ u, 0.0)  # all gaps close
        mu, e = rng.uniform(0.0, 1.0, contacts), np.full(contacts, rng.uniform(0.0, 1.0))
        change, _ = bodies[contacts].hit(normal, tangent, u, mu, e)
        p = np.linalg.lstsq(np.vstack([normal, tangent]).T, change, rcond=None)[0]
        pressed, along = p[:contacts], p[contacts:]
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


@pytest.mark.slow
def test_without_slip_a_ball_spins_up_by_coulombs_law(bodies):
    """A sphere that lands with backspin: J = m (1 + e) w, p_t = mu J or what stops its slip."""
    inertia, radius = 0.4, 1.0  # of a unit mass
    scale = np.array([1.0, 1.0, 1 / np.sqrt(inertia)])
    normal, tangent = np.array([[0.0, 1.0, 0.0]]), np.array([[1.0, 0.0, radius]]) * scale
    for mu, sticks in ((0.1, False), (0.9, True)):
        u = np.array([1.0, -2.0, 0.5 / scale[2]])
        change, _ = bodies[1].hit(normal, tangent, u, [mu], [0.5])
        assert change[1] == pytest.approx(3.0, rel=1e-12)
        expected = -1.5 / (1 + 1 / inertia) if sticks else -mu * 3.0
        assert change[0] == pytest.approx(expected, rel=1e-12)


# -- Poisson's law ---------------------------------------------------------------------------------


def two_rods(theta, omega):
    """Kane & Levinson's double pendulum, Dynamics (1985): two rods of 1 kg and 1 m, angles from the
    vertical, whose tip hits a floor.  Mass matrix, rows of its height and of its place along the
    floor, speeds."""
    a, b = theta
    coupling = np.cos(a - b) / 2
    mass = np.array([[4 / 3, coupling], [coupling, 1 / 3]])
    return mass, np.sin([theta]), np.cos([theta]), np.array(omega)


def of_one_contact(a, w, slip, mu, e):
    """Impulses (2,) in closed form: one contact that sticks or slides at the end of each phase."""
    pressing = -np.linalg.solve(a, [w, slip])
    if abs(pressing[1]) > mu * pressing[0]:
        for way in (1.0, -1.0):
            normal = -w / (a[0, 0] - way * mu * a[0, 1])
            pressing = np.array([normal, -way * mu * normal])
            if normal >= 0 and way * (slip + a[1] @ pressing) >= 0:
                break
    again = e * pressing[0]
    rest = -(slip + a[1] @ pressing + a[1, 0] * again) / a[1, 1]
    return pressing + np.array([again, np.clip(rest, -mu * again, mu * again)])


@pytest.mark.parametrize(("e", "mu"), [(0.5, 0.5), (0.7, 0.25), (0.7, 0.5), (1.0, 0.5)])
def test_poissons_law_takes_energy_where_newtons_gives_it(e, mu, bodies):
    mass, normal, tangent, u = two_rods(np.radians([20.0, 30.0]), [-0.1, -0.2])
    root = np.linalg.cholesky(mass)
    rows = np.vstack([normal, tangent])
    rows, v = np.linalg.solve(root, rows.T).T, root.T @ u
    w, slip = rows @ v
    (newton, lowered), (poisson, whole) = (
        bodies[1].hit(rows[:1], rows[1:], v, [mu], [e], law) for law in ("newton", "poisson")
    )
    wanted = of_one_contact(rows @ rows.T, w, slip, mu, e)
    np.testing.assert_allclose(poisson, wanted @ rows, rtol=1e-12, atol=1e-15)
    before, after = v @ v, (v + poisson) @ (v + poisson)
    assert whole.stats["lowered_impacts"] == 0
    assert after < before - 1e-3
    assert lowered.stats["lowered_impacts"] == 1  # else energy would grow
    assert (v + newton) @ (v + newton) == pytest.approx(before, rel=1e-12)


def projected(a, n, rates, mu, restored, steps=60_000):
    """Impulses (2, n) by projections onto p >= ``restored`` and |p_t| <= mu p (Alart & Curnier
    1991): p+ = project(p - r (A p + rates)) until nothing changes."""
    p, r = np.zeros(2 * n), 0.5 / np.linalg.norm(a, 2)
    for _ in range(steps):
        moved = p - r * (a @ p + rates)
        normal = np.maximum(moved[:n], restored)
        found = np.concatenate([normal, np.clip(moved[n:], -mu * normal, mu * normal)])
        if np.abs(found - p).max() < 1e-15:
            break
        p = found
    return p


@pytest.mark.parametrize("contacts", [1, 2, 3])
def test_compression_and_expansion_of_several_contacts(contacts, bodies):
    """Against projections; with little friction, and rows far from dependent, for one solution."""
    rng, n = np.random.default_rng(contacts), contacts
    for _ in range(12):
        normal, tangent = rng.normal(size=(2, n, 4 * n))
        u, mu = rng.normal(size=4 * n), rng.uniform(0.0, 0.3, n)
        e = np.full(n, rng.uniform(0.0, 1.0))
        u -= 2.0 * np.linalg.pinv(normal) @ np.maximum(normal @ u, 0.0)  # all gaps close
        rows = np.vstack([normal, tangent])
        a, rates = rows @ rows.T, rows @ u
        pressing = projected(a, n, rates, mu, np.zeros(n))
        wanted = pressing + projected(a, n, rates + a @ pressing, mu, e * pressing[:n])
        found, _ = bodies[n].hit(normal, tangent, u, mu, e, "poisson")
        np.testing.assert_allclose(found, wanted @ rows, atol=1e-9)
        assert (u + found) @ (u + found) <= u @ u + 1e-12


def test_different_restitutions_give_no_energy_by_poissons_law(bodies):
    rng, n = np.random.default_rng(3), 2
    for _ in range(60):
        normal, tangent = rng.normal(size=(2, n, 3))
        u, mu, e = rng.normal(size=3), rng.uniform(0, 0.5, n), rng.uniform(0, 1, n)
        change, _ = bodies[n].hit(normal, tangent, u, mu, e, "poisson")
        assert (u + change) @ (u + change) <= u @ u + 1e-12
