"""Forces in pictures: reactions at their joints, in N, and loads where they act, by a scale."""

from __future__ import annotations

import re

import numpy as np
import pytest
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.drawing.plan import picture_plan
from sympy import cos, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.results.animation import animate
from mechc.results.player.forces import round_down
from mechc.results.view.page import view_data
from tests.support import fake_linkage
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
    assert data["forces"] == ["arrows"]  # loads are shown when they are switched on
    (place, _) = (floats(arrow["at"]).reshape(-1, 3) for arrow in data["loads"])
    np.testing.assert_allclose(np.linalg.norm(place + data["origin"], axis=1), 0.5, rtol=1e-6)


G, MASS, LENGTH = 9.81, 2.0, 0.5


@pytest.fixture(scope="module")
def hanging() -> mechc.Solution:
    """A bob at rest on a rod, by a pin, with a weight that is a load."""
    rod, ground = RigidBody("rod", mass=MASS), RigidBody("ground")
    rod.central_inertia = inertia(rod.frame, 0, 0, 0.1)
    q, u = dynamicsymbols("q u")
    pin = PinJoint("pin", ground, rod, q, u, child_point=LENGTH * rod.y, joint_axis=ground.z)
    weight = (rod.masscenter, -MASS * G * ground.y)
    model = mechc.compile(mechc.from_joints("rod", [pin], ground=ground, loads=[weight]))
    return model.simulate(1.0, {"q": 0.0, "u": 0.0})


def test_arrows_of_a_plot_are_as_long_as_its_scale_says(hanging: mechc.Solution) -> None:
    """The pin carries the weight: both arrows, at both ends of the run."""
    axes = hanging.plot(forces=True).axes[0]
    told = [text.get_text() for text in axes.get_legend().get_texts()]
    for kind, way in (("reactions", 1.0), ("loads", -1.0)):
        (words,) = (
            re.fullmatch(rf"{kind}, (\S+) m is (\S+) N", text) for text in told if kind in text
        )
        scale = float(words[1]) / float(words[2])
        arrows = [x for x in axes.texts if way * (x.xy[1] - x.xyann[1]) > 0]
        assert len(arrows) == 2
        for arrow in arrows:
            np.testing.assert_allclose(
                np.subtract(arrow.xy, arrow.xyann), [0, way * scale * MASS * G]
            )
            np.testing.assert_allclose(arrow.xyann, [0.0, 0.0 if way > 0 else -LENGTH], atol=1e-9)
            assert 0.1 * LENGTH < scale * MASS * G <= 0.4 * LENGTH


def test_an_animation_has_the_forces_that_are_asked_for(hanging: mechc.Solution) -> None:
    data = animate(hanging).data
    assert data["arrows"] == data["loads"] == data["forces"] == []
    data = animate(hanging, forces=True).data
    assert data["forces"] == ["arrows", "loads"]
    for key, way in (("arrows", 1.0), ("loads", -1.0)):
        (arrow,) = data[key]
        forces = floats(arrow["force"]).reshape(-1, 2)
        np.testing.assert_allclose(
            forces, way * np.tile([0, MASS * G], (len(forces), 1)), atol=1e-6
        )
        assert arrow["usual"] == pytest.approx(MASS * G)
    for asked, kinds in (("pin", ["arrows"]), (["rod_masscenter"], ["loads"]), ([], [])):
        assert animate(hanging, forces=asked).data["forces"] == kinds
        assert view_data(hanging, forces=asked)["forces"] == kinds


def test_reactions_that_are_asked_for_are_compiled_when_they_are(hanging: mechc.Solution) -> None:
    assert "reaction_forces" not in hanging.system.scene.outputs
    assert view_data(hanging)["arrows"] == []
    assert [arrow["label"] for arrow in view_data(hanging, forces="pin")["arrows"]] == [
        "reaction in pin"
    ]


def test_forces_that_are_none_are_refused(hanging: mechc.Solution) -> None:
    for asked in ("pine", 3, ["pin", "pine"]):
        with pytest.raises(mechc.UnknownNameError, match="no joint or point with a force to draw"):
            hanging.animate(forces=asked)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="forces are drawn beside the paths"):
        hanging.plot("q", forces=True)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="has no force to draw"):
        animate(fake_linkage.run(1.0), forces=True)


def test_a_scale_is_a_round_number() -> None:
    for value, least in ((1.0, 1.0), (4.9, 2.0), (5.0, 5.0), (0.03, 0.02), (999.0, 500.0)):
        assert round_down(value) == pytest.approx(least)


def test_forces_by_inputs_of_a_run_are_not_known_and_not_drawn() -> None:
    found = picture_plan(pushed_point(), Drawing(), {"m"}, in_space=True)
    assert [name for name, _, _ in found.loads] == ["second"]


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
