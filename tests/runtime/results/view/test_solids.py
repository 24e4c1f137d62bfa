"""A body of which the inertia is known is shown as the uniform body that has it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.results.view.page import view_data
from mechc.results.view.solids import body_of_inertia
from tests.support.page_data import floats


def per_mass(kind: str, sizes: np.ndarray) -> np.ndarray:
    """Central moments of a uniform body per mass, in its own axes (textbook formulas)."""
    if kind == "ball":
        return 0.4 * sizes[0] ** 2 * np.eye(3)
    if kind == "disc":
        across = sizes[0] ** 2 / 4 + sizes[1] ** 2 / 12
        return np.diag([across, sizes[0] ** 2 / 2, across])
    a, b, c = sizes**2 / 12
    return np.diag([b + c, a + c, a + b])


def six(moments: np.ndarray) -> np.ndarray:
    return moments[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [("ball", [0.3]), ("disc", [0.5, 0.1]), ("disc", [0.1, 2.0]), ("box", [1.0, 0.4, 0.25])],
)
def test_the_body_has_the_inertia(kind: str, sizes: list[float]) -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    given = turn @ per_mass(kind, np.array(sizes)) @ turn.T
    found = body_of_inertia(six(given))
    assert found is not None
    assert found[0] == kind
    assert sorted(found[1]) == pytest.approx(sorted(sizes), rel=1e-9)
    assert np.linalg.det(found[2]) == pytest.approx(1.0)
    made = found[2] @ per_mass(found[0], found[1]) @ found[2].T
    np.testing.assert_allclose(made, given, atol=1e-12)


@pytest.mark.parametrize("moments", [[0, 0, 1], [0, 0, 0], [1, 1, 3], [np.nan, 1, 1]])
def test_there_is_no_body_with_such_moments(moments: list[float]) -> None:
    assert body_of_inertia(np.array([*moments, 0, 0, 0], dtype=float)) is None


def rolling_disc() -> KanesMethod:
    """A disc that turns about its fixed axis z, beside a weight's direction -y."""
    q, u = dynamicsymbols("q u")
    m, r, g = symbols("m r g", positive=True)
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    disc = frame.orientnew("A", "Axis", (q, frame.x))
    disc.set_ang_vel(frame, u * frame.x)
    centre = origin.locatenew("C", r * disc.z)
    centre.v2pt_theory(origin, frame, disc)
    moments = inertia(disc, m * r**2 / 4, m * r**2 / 4, m * r**2 / 2)
    body = RigidBody("disc", centre, disc, m, (moments, centre))
    method = KanesMethod(frame, [q], [u], [q.diff() - u])
    method.kanes_equations([body], [(centre, -m * g * frame.y)])
    return method


def test_solids_go_with_their_bodies() -> None:
    method = rolling_disc()
    model = mechc.compile(method, defaults={"m": 2.0, "r": 0.4, "g": 9.81})
    sol = model.simulate(0.5, {"q": 0.3, "u": 0.0})
    data = view_data(sol)
    assert data["up"] == [0.0, 1.0, 0.0]
    (solid,) = data["solids"]
    assert (solid["kind"], solid["label"], solid["inferred"]) == ("disc", "disc", True)
    assert solid["sizes"][0] == pytest.approx(0.4)
    rows = floats(data["placed"]).reshape(data["frames"], 7).astype(float)
    t = np.linspace(0.0, 0.5, data["frames"])
    q = sol(t)[:, 0]
    away = np.stack([0 * q, -0.4 * np.sin(q), 0.4 * np.cos(q)], axis=-1)
    np.testing.assert_allclose(rows[:, :3] + data["origin"], away, atol=1e-6)
    axis = Rotation.from_quat(rows[:, 3:]).apply([0.0, 1.0, 0.0])  # the disc's axis on the page
    np.testing.assert_allclose(np.abs((axis * away).sum(axis=1)), 0.4, atol=1e-6)
    assert ((rows[1:, 3:] * rows[:-1, 3:]).sum(axis=1) > 0.9).all()
