"""Reaction forces are arrows at their joints, in N."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.results.view.page import view_data
from tests.support.linkages.jointed import chain
from tests.support.page_data import floats


def test_the_joints_of_a_hanging_chain_carry_what_hangs_below() -> None:
    outputs = ("energy", "reactions")
    model = mechc.compile(chain(2), backend="numpy", outputs=outputs)
    rest = dict.fromkeys(model.coordinates, 0.0)
    rest[model.coordinates[0]] = hanging_angle(model)
    sol = model.simulate(0.1, rest)
    data = view_data(sol)
    assert [arrow["label"] for arrow in data["arrows"]] == [
        f"reaction in {name}" for name in model.joint_names
    ]
    weight = model.defaults["m"] * model.defaults["g"]
    for arrow, below in zip(data["arrows"], (2, 1), strict=True):
        forces = floats(arrow["force"]).reshape(-1, 3)
        np.testing.assert_allclose(np.linalg.norm(forces, axis=1), below * weight, rtol=1e-6)
    first, second = (floats(arrow["at"]).reshape(-1, 3) for arrow in data["arrows"])
    np.testing.assert_allclose(
        np.linalg.norm(second - first, axis=1), model.defaults["l"], rtol=1e-6
    )
    assert data["arrows"][0]["usual"] == pytest.approx(2 * weight, rel=0.05)


def hanging_angle(model: mechc.Model) -> float:
    """The first angle at which the straight chain has its least potential energy."""
    angles = np.arange(4) * np.pi / 2
    states = np.zeros((4, len(model.coordinates) + len(model.speeds)))
    states[:, 0] = angles
    return float(angles[np.argmin(model.potential_energy(states))])


def test_a_model_without_reactions_has_no_arrows() -> None:
    model = mechc.compile(chain(2), backend="numpy")
    sol = model.simulate(0.1, dict.fromkeys(model.coordinates, 0.0))
    assert view_data(sol)["arrows"] == []
