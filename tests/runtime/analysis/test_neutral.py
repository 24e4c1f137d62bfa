"""Families of equilibria: one of each is found, with the directions in which it is free."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import RigidBody, dynamicsymbols, inertia

import mechc
from benchmarks.problems.particle import particle

x, y, angle, u, v, w = dynamicsymbols("x y angle u v w")


def kinds(found):
    return [(each.kind, each.neutral, each.free) for each in found]


def test_a_cart_stays_anywhere_with_its_pendulum_down_or_up():
    """Lagrange's equations of a cart of 2 kg and a bob of 1 kg on 0.5 m."""
    mass = [[3, 0.5 * sm.cos(angle)], [0.5 * sm.cos(angle), 0.25]]
    forcing = [0.5 * sm.sin(angle) * w**2, -9.81 * 0.5 * sm.sin(angle)]
    cart = mechc.compile(mechc.from_equations([x, angle], [u, w], mass, forcing, name="cart"))
    hanging, standing = cart.equilibria()
    assert kinds([hanging, standing]) == [("neutral", 1, ("x",)), ("unstable", 1, ("x",))]
    for each, cosine in ((hanging, 1.0), (standing, -1.0)):
        np.testing.assert_allclose(np.cos(each.y[1]), cosine, rtol=1e-12)
        np.testing.assert_allclose(each.directions, [[1.0, 0.0]], atol=1e-9)


def test_a_wheel_rolls_to_where_it_stays():
    radius = sm.Symbol("r")
    wheel = mechc.from_equations(
        [x, angle], [u, w], sm.diag(2, 0.1), [0, 0], name="wheel",
        constraints=[x - radius * angle], defaults={radius: 0.25},
    )  # fmt: skip
    (found,) = mechc.compile(wheel).equilibria()
    assert kinds([found]) == [("neutral", 1, ("x, angle",))]
    np.testing.assert_allclose(found.directions, [[1.0, 1.0 / 0.25]], rtol=1e-9)


def test_a_blade_has_more_equilibria_than_it_slides_to():
    blade = mechc.from_equations(
        [x, y, angle], [u, v, w], sm.diag(2, 2, 0.3), [0, 0, 0], name="blade",
        velocity_constraints=[u * sm.sin(angle) - v * sm.cos(angle)],
    )  # fmt: skip
    (found,) = mechc.compile(blade).equilibria()
    assert kinds([found]) == [("neutral", 2, ("x", "y", "angle"))]
    np.testing.assert_allclose(found.directions, np.eye(3), atol=1e-9)


def test_the_floor_of_a_round_channel_is_one_family_and_its_middle_another():
    """V = (x^2 + y^2 - 1)^2 / 4: rests on the unit circle, and on the hill in its middle."""
    push = 1 - x**2 - y**2
    bead = mechc.compile(particle([x, y], [u, v], [x * push, y * push], 1))
    floor, hill = bead.equilibria()
    assert kinds([floor, hill]) == [("neutral", 1, ("x, y",)), ("unstable", 0, ())]
    np.testing.assert_allclose(np.hypot(*floor.y[:2]), 1.0, rtol=1e-9)
    np.testing.assert_allclose(floor.directions @ floor.y[:2], 0.0, atol=1e-8)
    np.testing.assert_allclose(hill.y, 0.0, atol=1e-9)


def test_parallel_valleys_are_families_apart():
    """V = (y^2 - 1)^2 / 4, level along x."""
    valleys = mechc.compile(particle([x, y], [u, v], [0, y - y**3], 1)).equilibria()
    assert [each.free for each in valleys] == [("x",)] * 3
    at = {round(float(each.y[1]), 9): each.kind for each in valleys}
    assert at == {-1.0: "neutral", 1.0: "neutral", 0.0: "unstable"}


def test_a_spring_that_is_soft_at_first_keeps_its_equilibrium_in_one_place():
    """V = x^4 / 4: the linear model is neutral, and there is one equilibrium."""
    (found,) = mechc.compile(particle([x], [u], [-(x**3)], 1)).equilibria()
    assert kinds([found]) == [("neutral", 1, ())]
    assert found.directions.shape == (0, 1)


@pytest.mark.slow(cases=1)
def test_a_free_body_stays_in_every_place_and_attitude():
    space, ball = RigidBody("space"), RigidBody("ball", mass=1)
    ball.central_inertia = inertia(ball.frame, 1, 2, 3)
    body = mechc.from_joints("ball", [mechc.FreeJoint("free", space, ball)])
    (found,) = mechc.compile(body).equilibria()
    assert (found.neutral, len(found.free)) == (6, 6)
    quaternion = found.y[3:7]
    np.testing.assert_allclose(np.linalg.norm(quaternion), 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.directions[:, 3:] @ quaternion, 0.0, atol=1e-9)
