"""Reaction forces are arrows at their joints, in N, and loads where they act."""

from __future__ import annotations

import numpy as np
import pytest
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.drawing.plan import picture_plan
from sympy import cos, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    dynamicsymbols,
)

import mechc
from mechc.results.view.page import view_data
from tests.support.linkages.jointed import chain
from tests.support.page_data import floats


def test_the_joints_of_a_hanging_chain_carry_what_hangs_below() -> None:
    outputs = ("energy", "reactions")
    model = mechc.compile(chain(2), outputs=outputs)
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
    model = mechc.compile(chain(2))
    sol = model.simulate(0.1, dict.fromkeys(model.coordinates, 0.0))
    assert view_data(sol)["arrows"] == []


def test_loads_are_arrows_where_they_act() -> None:
    """A weight, and a force that turns with an arm and depends on its rate and on an input."""
    q, u, push = dynamicsymbols("q u push")
    m, length, c, g = symbols("m l c g")
    ground, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(ground, 0)
    arm = ground.orientnew("A", "Axis", (q, ground.z))
    arm.set_ang_vel(ground, u * ground.z)
    tip = origin.locatenew("tip", length * arm.x)
    tip.v2pt_theory(origin, ground, arm)
    kane = KanesMethod(ground, [q], [u], kd_eqs=[q.diff() - u])
    loads = [(tip, -m * g * ground.y), (tip, (push - c * q.diff()) * arm.y), (arm, u * arm.z)]
    kane.kanes_equations([Particle("bob", tip, m)], loads)
    values = {"m": 2.0, "l": 0.5, "c": 0.3, "g": 9.81}
    model = mechc.compile(kane, defaults=values, inputs={push: 4 * cos(q)})
    sol = model.simulate(1.0, {"q": 0.4, "u": 1.0})
    data = view_data(sol)
    assert [arrow["label"] for arrow in data["loads"]] == ["force on tip", "force on tip"]
    angle, rate = sol(np.linspace(0.0, 1.0, data["frames"])).T
    size = 4 * np.cos(angle) - 0.3 * rate
    across = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
    weight, follower = (floats(arrow["force"]).reshape(-1, 3) for arrow in data["loads"])
    np.testing.assert_allclose(weight, np.broadcast_to([0.0, -19.62, 0.0], weight.shape), rtol=1e-6)
    np.testing.assert_allclose(follower, size[:, None] * across, atol=1e-5)
    (place, _) = (floats(arrow["at"]).reshape(-1, 3) for arrow in data["loads"])
    np.testing.assert_allclose(np.linalg.norm(place + data["origin"], axis=1), 0.5, rtol=1e-6)


def test_forces_by_inputs_of_a_run_are_not_known_and_not_drawn() -> None:
    found = picture_plan(pushed_point(), Drawing(), {"m"}, in_space=True)
    assert [label for label, _, _ in found.loads] == ["force on second"]


def pushed_point() -> mechc.Mechanism:
    x, v, push = dynamicsymbols("x v push")
    m = symbols("m")
    ground, origin = ReferenceFrame("N"), Point("O")
    first, second = (origin.locatenew(name, x * ground.x) for name in ("first", "second"))
    return mechc.Mechanism(
        name="point", title="", frame=ground, origin=origin,
        coordinates=(mechc.Coordinate(x, mechc.Quantity("m", "")),),
        speeds=(mechc.Speed(v, mechc.Quantity("m/s", "")),), kinematics=(v,),
        parameters=(mechc.Parameter(m, 1.0, mechc.Quantity("kg", "")),),
        bodies=(Particle("p", first, m),), inputs={push: None},
        loads=((first, push * ground.x), (second, -m * v * ground.x)),
    )  # fmt: skip
