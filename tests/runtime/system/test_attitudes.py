"""Quaternions in equations of the user's own, whose frames are turned by them as they stand."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
    kinematic_equations,
)

import mechc

CASES = {
    "is zero, which is no attitude": np.zeros(7),
    "has the length 2;.*divide it by its length \\(1, 0, 0, 0\\)": np.array([2.0, *[0.0] * 6]),
}


@pytest.fixture(scope="module")
def body() -> mechc.Model:
    return mechc.load("rigid_body", outputs=())


@pytest.mark.parametrize("told", CASES)
def test_no_attitude_is_refused_at_every_door(body: mechc.Model, told: str) -> None:
    y0 = CASES[told]
    with pytest.raises(mechc.ValueOutOfBoundsError, match=told):
        body.simulate(1.0, y0)
    with pytest.raises(mechc.ValueOutOfBoundsError, match=told):
        body.simulate_batch(1.0, np.vstack([np.eye(7)[0], y0]))
    with pytest.raises(mechc.ValueOutOfBoundsError, match=told):
        body.assemble(dict(zip(body.coordinates, y0[:4].tolist(), strict=True)))


def test_without_a_component_the_body_is_unturned(body: mechc.Model) -> None:
    assert body.assemble({})[:4].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_rounded_decimals_are_an_attitude(body: mechc.Model) -> None:
    assert body.simulate(0.1, {"e_0": 0.7071, "e_3": 0.7071}).status.ok


def rod_on_a_plane() -> mechc.Model:
    """A rod of 1 m on a ball joint, whose tip stays at the height h."""
    e, w, h = dynamicsymbols("e0:4"), dynamicsymbols("wx wy wz"), Symbol("h")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    B = N.orientnew("B", "Quaternion", e)
    B.set_ang_vel(N, w[0] * B.x + w[1] * B.y + w[2] * B.z)
    middle, tip = O.locatenew("middle", B.x / 2), O.locatenew("tip", B.x)
    for point in (middle, tip):
        point.v2pt_theory(O, N, B)
    kane = KanesMethod(
        N, e[:3], w[:2], kinematic_equations(w, e, "Quaternion"), q_dependent=e[3:],
        u_dependent=w[2:], configuration_constraints=[tip.pos_from(O).dot(N.z) - h],
        velocity_constraints=[tip.vel(N).dot(N.z)],
    )  # fmt: skip
    kane.kanes_equations([RigidBody("rod", middle, B, 1, (inertia(B, 1, 1, 1), middle))], [])
    return mechc.compile(kane, name="rod_on_a_plane", defaults={"h": 0.5}, outputs=())


def test_loops_are_closed_at_length_one() -> None:
    """Else the rod would be longer than it is: a search of closed loops alone stretches it."""
    model = rod_on_a_plane()
    near = model.assemble({}, guess={"e0": 0.97, "e2": -0.25})
    typed = {"e0": 0.966, "e1": 0.0, "e3": 0.0}
    batch = model.simulate_batch(0.01, typed | {"e0": [0.966, 0.9655]})
    for y in (near, model.assemble(typed, guess={"e2": -0.25}), *batch.y0):
        assert np.linalg.norm(y[:4]) == pytest.approx(1.0, abs=1e-14)
        assert abs(model.constraints(y)).max() < 1e-14
    given = {"e0": 0.95, "e1": 0.1}
    kept = model.assemble(given, guess={"e2": -0.25, "e3": 0.1})
    assert np.linalg.norm(kept[:4]) == pytest.approx(1.0, abs=1e-14)
    assert kept[:2].tolist() == [*given.values()]
