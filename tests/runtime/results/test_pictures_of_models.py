"""Promises of docs/drawing.md: models of users are drawn, and pay nothing until they are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sympy import Symbol, cos, sin, symbols
from sympy.physics.mechanics import (
    LagrangesMethod,
    Lagrangian,
    Particle,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
)

import mechc
from mechc.results import figures
from mechc.results.animation import animate
from mechc.results.sampling import sample
from mechc.system.picture import Picture
from tests.support import fake_linkage
from tests.support.fake_linkage import FakeModel
from tests.support.page_data import floats
from tests.support.sympy_objects import four_bar_kane

LENGTHS = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5, "rho": 1.0, "g": 9.81}


def compiled(thing: Any, **given: Any) -> mechc.Model:
    return mechc.compile(thing, **given)


def hanging_bob(*, inertial: bool = False, bodies: bool = True) -> LagrangesMethod:
    """A bob on a massless rod below a cart; ``inertial``: located along the inertial axes."""
    x, a = dynamicsymbols("x a")
    l, m, g = symbols("l m g")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    rod = frame.orientnew("A", "Axis", (a, frame.z))
    arm = l * (sin(a) * frame.x - cos(a) * frame.y) if inertial else -l * rod.y
    cart_at = origin.locatenew("C", x * frame.x)
    bob_at = cart_at.locatenew("P", arm)
    for point in (cart_at, bob_at):
        point.set_vel(frame, point.pos_from(origin).dt(frame))
    cart, bob = Particle("cart", cart_at, m), Particle("bob", bob_at, m)
    bob.potential_energy = m * g * bob_at.pos_from(origin).dot(frame.y)
    given = [cart, bob] if bodies else None
    method = LagrangesMethod(Lagrangian(frame, cart, bob), [x, a], bodies=given, frame=frame)
    method.form_lagranges_equations()
    return method


@pytest.fixture(scope="module")
def four_bar() -> mechc.Model:
    return compiled(four_bar_kane(), defaults=LENGTHS)


def test_points_of_a_kanes_method_are_where_its_links_put_them(four_bar: mechc.Model) -> None:
    picture = four_bar.picture
    y = np.random.default_rng(3).normal(size=(4, 6))
    got = picture.points(y, four_bar.system.parameter_set.defaults, 0.0)
    place = dict(zip(picture.point_names, np.moveaxis(got, -2, 0), strict=True))
    angles = np.cumsum(y[:, :3], axis=1)
    links = [LENGTHS[f"l_{k}"] * np.exp(1j * angles[:, k]) for k in range(3)]
    ends = np.cumsum([np.zeros(4), *links], axis=0)
    corners = ("ground_masscenter", "joint_1_rod_0_joint", "joint_2_rod_1_joint", "end")
    for name, end in zip(corners, ends, strict=True):
        np.testing.assert_allclose(place[name], np.stack([end.real, end.imag, 0 * end.real], -1))
    for k, (label, line) in enumerate(picture.skeleton):
        assert (label, line[0], line[-1]) == (f"rod_{k}", corners[k], corners[k + 1])


def test_ground_is_where_a_point_is_fixed_also_by_the_closing(four_bar: mechc.Model) -> None:
    guess = {"q_1": 2.0, "q_2": -2.0}
    run = sample(four_bar.simulate(0.5, four_bar.assemble({"q_0": -1.0}, guess=guess)), 50)
    assert four_bar.picture.ground == ("ground_masscenter",)
    assert run.ground == ("ground_masscenter", "end")
    assert "end" not in run.traced
    assert set(run.traced) == {"joint_1_rod_0_joint", "joint_2_rod_1_joint"}
    start = four_bar.assemble({"q_0": -1.0}, guess=guess)
    at_rest = sample(four_bar.simulate(0.5, start, {"g": 0.0}), 50)
    assert at_rest.ground == ("ground_masscenter",)  # points that rest tell nothing where all do


def test_a_picture_compiles_nothing_and_is_made_when_it_is_drawn() -> None:
    model = compiled(hanging_bob(), defaults={"l": 1.0, "m": 1.0, "g": 9.81})
    sol = model.simulate(0.5, {"x": 0.0, "a": 0.5, "x_dot": 0.0, "a_dot": 0.0})
    assert Picture not in model.system.cache
    said = [
        text.get_text() for text in figures.picture("paths", sol).axes[0].get_legend().get_texts()
    ]
    assert {"path of $C$", "path of $P$"} <= set(said)
    assert model.point_names == ()
    assert "points" not in model.system.scene.outputs


@pytest.mark.parametrize("inertial", [False, True])
def test_a_particle_at_a_constant_distance_is_on_a_rod(inertial: bool) -> None:
    picture = compiled(hanging_bob(inertial=inertial)).picture
    assert picture.skeleton == (("bob", ("C", "P")),)
    assert picture.ground == ()  # the cart moves
    got = picture.points(np.array([2.0, 0.3, 0.0, 0.0]), np.array([9.81, 0.5, 1.0]), 0.0)
    np.testing.assert_allclose(got, [[2, 0, 0], [2 + np.sin(0.3) / 2, -np.cos(0.3) / 2, 0]])


def test_what_the_user_draws_adds_to_what_is_found() -> None:
    drawing = mechc.Drawing(links=(("rail", ("O", "C")),), ground=("O",), view=("x", "z"))
    picture = compiled(hanging_bob(), drawing=drawing).picture
    assert picture.skeleton == (("bob", ("C", "P")), ("rail", ("O", "C")))
    assert (picture.ground, picture.traced, picture.view) == (("O",), ("C", "P"), ("x", "z"))


def test_a_drawing_names_points_that_are_there() -> None:
    with pytest.raises(mechc.MechanismError, match=r"no point 'Q' .* the points are C, P, O"):
        compiled(hanging_bob(), drawing=mechc.Drawing(traced=("Q",)))


def test_two_objects_with_the_same_equations_have_their_own_pictures() -> None:
    drawn, bare = compiled(hanging_bob()), compiled(hanging_bob(bodies=False))
    assert drawn.picture.skeleton
    assert not bare.picture.skeleton


def crank() -> PinJoint:
    ground, body = RigidBody("ground"), RigidBody("crank", mass=Symbol("m"))
    near = -Symbol("l") * body.x
    return PinJoint("pin", ground, body, child_point=near, joint_axis=ground.z)


def test_joints_keep_their_picture_beside_the_users() -> None:
    pin = crank()
    tip = pin.child.masscenter.locatenew("tip", Symbol("l") * pin.child.x)
    own = mechc.Drawing(links=(("pointer", (pin.child.masscenter, tip)),), traced=(tip,))
    mechanism = mechc.from_joints("crank", [pin], drawing=own, parameters={"m": 1, "l": 2})
    picture = compiled(mechanism, outputs=()).picture
    assert [label for label, _ in picture.skeleton] == ["crank", "pointer"]
    assert picture.traced == ("tip",)
    assert len(picture.ground) == 1


def test_a_system_is_drawn_and_a_length_without_a_value_is_left_out() -> None:
    pin = crank()
    pin.child.masscenter.locatenew("nowhere", Symbol("d") * pin.child.x)
    system = System.from_newtonian(pin.parent)
    system.add_joints(pin)
    picture = compiled(system, form="kane").picture
    assert [len(line) for _, line in picture.skeleton] == [2]
    assert "nowhere" not in picture.point_names


def test_a_slider_is_a_block_on_a_guide_of_the_length_of_its_travel() -> None:
    ground, cart = RigidBody("ground"), RigidBody("cart", mass=Symbol("m"))
    slide = PrismaticJoint("slide", ground, cart, joint_axis=3 * ground.x + 4 * ground.y)
    spring = -Symbol("k") * slide.coordinates[0]
    pull = (cart.masscenter, spring * (3 * ground.x + 4 * ground.y) / 5)
    made = mechc.from_joints("cart", [slide], loads=[pull], parameters={"m": 1.0, "k": 1.0})
    sol = compiled(made, outputs=("energy", "points")).simulate(7.0, {"q_slide": 2.0})
    data = animate(sol).data
    ((begin, end, at),) = [guide["points"] for guide in data["guides"]]
    assert data["guides"][0]["label"] == "cart"
    assert data["guides"][0]["block"] is True
    tracks = floats(data["tracks"]).reshape(data["frames"], -1, 2) + data["origin"]
    travel = np.cos(data["step"] * np.arange(data["frames"]))[:, None] * 2.0 * np.array([0.6, 0.8])
    np.testing.assert_allclose(tracks[:, at], travel, atol=1e-5)
    np.testing.assert_allclose(np.ptp(tracks[:, [begin, end]], axis=0), 0.0, atol=1e-5)
    length = np.linalg.norm(tracks[0, end] - tracks[0, begin])
    assert length == pytest.approx(4.0 * 1.4, rel=1e-3)
    assert data["ground"] == []
    patches = figures.picture("paths", sol).axes[0].patches
    assert [patch.angle % 180 for patch in patches] == pytest.approx([53.13] * 2, abs=0.01)


def test_two_ends_that_a_loop_joins_have_one_path() -> None:
    class Doubled(FakeModel):
        def points(self, y: Any, params: Any = None, t: Any = 0.0) -> Any:
            places = fake_linkage.joints(y[..., :3])
            return np.concatenate([places, places[..., 2:3, :] + 1e-12], axis=-2)

    own = (*FakeModel.point_names, "p_2 again")
    model = Doubled(point_names=own, traced=("p_1", "p_2", "p_2 again"))
    run = sample(replace(fake_linkage.run(), system=model), 40)
    assert run.traced == ("p_1", "p_2")


def test_the_pictures_of_the_library_are_their_own() -> None:
    model = mechc.load("four_bar")
    assert model.picture.points == model.system.points
