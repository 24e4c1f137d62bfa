"""Quaternions in equations of the user's own, whose frames are turned by them as they stand."""

from __future__ import annotations

import numpy as np
import pytest

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
