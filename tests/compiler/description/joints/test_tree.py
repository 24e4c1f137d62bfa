"""Mechanisms described by joints: what is taken from them, and what is refused."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.convert.stationary import Stationary
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.mechanism import Mechanism, Parameter, Quantity
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.frontend.read import read
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Symbol, sqrt
from sympy.physics.mechanics import (
    Force,
    Particle,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    WeldJoint,
    dynamicsymbols,
)

l = Symbol("l")


def bodies(*names: str) -> list[RigidBody]:
    return [RigidBody(name) for name in ("ground", *names)]


def pins(ground: RigidBody, *links: RigidBody) -> list[PinJoint]:
    """Each link on the one before, by a pin about z."""
    every = (ground, *links)
    return [
        PinJoint(f"pin_{b.name}", a, b, parent_point=l * a.x, joint_axis=a.z)
        for a, b in pairwise(every)
    ]


def test_everything_that_joints_say_is_taken_from_them() -> None:
    ground, a, b, c = bodies("a", "b", "c")
    joints = [*pins(ground, a, b), PrismaticJoint("slide", b, c, joint_axis=b.x)]
    made = from_joints("three", joints, parameters={"l": 2})
    assert [body.name for body in made.bodies] == ["a", "b", "c"]
    assert made.frame is ground.frame
    assert made.origin is ground.masscenter
    assert made.kinematics == made.u == tuple(u for joint in joints for u in joint.speeds)
    assert [x.quantity.unit for x in (*made.coordinates, *made.speeds)] == [
        "rad", "rad", "m", "rad/s", "rad/s", "m/s",
    ]  # fmt: skip
    assert {str(p.symbol): p.default for p in made.parameters} == {
        "a_ixx": None, "a_iyy": None, "a_izz": None, "a_izx": None, "a_ixy": None, "a_iyz": None,
    } | {
        f"{n}_{k}": None for n in "bc" for k in ("ixx", "iyy", "izz", "izx", "ixy", "iyz")
    } | {"a_mass": None, "b_mass": None, "c_mass": None, "l": 2}  # fmt: skip
    (pin, _, slide) = made.joints
    assert (pin.parent, pin.child) == (None, a)  # None is the ground
    assert (slide.parent_interframe, slide.child_interframe) == (b.frame, c.frame)
    assert slide.coordinates == tuple(joints[2].coordinates)


def test_points_and_picture_come_from_joints_each_place_once() -> None:
    ground, a, b = bodies("a", "b")
    made = from_joints("two", pins(ground, a, b))
    names = [p.name for p in made.points]
    # The pins are at the mass centres of their children, which are not named again.
    assert names == ["pin_a_ground_joint", "pin_b_a_joint"]
    assert made.drawing.ground == ("pin_a_ground_joint",)
    assert dict(made.drawing.links) == {"a": ("pin_a_ground_joint", "pin_b_a_joint")}


def test_parameters_may_be_given_whole() -> None:
    ground, a = bodies("a")
    given = Parameter(l, 3.0, Quantity("m", "offset of the pin", lower=0))
    made = from_joints("one", pins(ground, a), parameters=[given], units={"a_mass": "kg"})
    assert made.parameters[0] == given
    assert {p.quantity.unit for p in made.parameters} == {"m", "kg", ""}


def test_a_loop_without_a_cut_is_refused_by_the_joint_that_closes_it() -> None:
    ground, a, b = bodies("a", "b")
    joints, places = pins(ground, a, b), (ground.masscenter, b.masscenter)
    with pytest.raises(MechanismError, match=r"joint pin_b closes .* x already.* must be a cut"):
        Mechanism(**described(joints, ground, extra=[Joint("x", None, b, *places)]))


def test_a_joint_of_sympy_that_closes_a_loop_is_told_how_to_be_written() -> None:
    ground, a, b = bodies("a", "b")
    joints = pins(ground, a, b)
    joints.append(PinJoint("close", b, a, joint_axis=b.z))
    with pytest.raises(MechanismError, match=r"joint close closes .* write mechc\.Cut\.pin\('clo"):
        from_joints("two", joints, ground=ground)


def described(joints: Any, ground: RigidBody, extra: Any = ()) -> dict[str, Any]:
    made = from_joints("two", joints, ground=ground)
    kept = {name: getattr(made, name) for name in made.__dataclass_fields__}
    return kept | {"joints": (*extra, *joints)}


def test_joints_that_do_not_reach_the_ground_are_refused_by_the_bodies_that_hang_in_the_air() -> (
    None
):
    ground, a, b, c = bodies("a", "b", "c")
    joints = [*pins(ground, a), *pins(b, c)]
    with pytest.raises(MechanismError, match="no joint leads from the ground to b, c"):
        from_joints("apart", joints, ground=ground)
    with pytest.raises(MechanismError, match=r"here these are ground, b; give ground="):
        from_joints("apart", joints)


def test_a_name_twice_is_refused() -> None:
    ground, a, b = bodies("a", "b")
    joints = [PinJoint("pin", ground, a), WeldJoint("pin", a, b)]
    with pytest.raises(MechanismError, match="more than one joint is called 'pin'"):
        from_joints("twice", joints)


def test_what_is_no_joint_is_refused() -> None:
    with pytest.raises(MechanismError, match="is not a joint"):
        from_joints("nothing", [Point("P")])


def test_a_body_that_is_not_there_is_named() -> None:
    ground, a, b = bodies("a", "b")
    joints = pins(ground, a, b)
    kept = described(joints, ground)
    with pytest.raises(MechanismError, match="joint pin_b joins b, which is not among the bodies"):
        Mechanism(**kept | {"bodies": (a,)})


# -- cuts -----------------------------------------------------------------------------------------


def test_a_cut_pin_holds_two_rows_in_a_plane_and_five_in_space() -> None:
    for spatial, held in ((False, 2), (True, 5)):
        ground, a, b = bodies("a", "b")
        joints = pins(ground, a, b)
        if spatial:
            c = RigidBody("c")
            joints.append(PinJoint("about_y", b, c, joint_axis=b.y))
            b = c
        cut = Cut.pin("cut", ground, b, l * ground.y, l * b.x, joint_axis=ground.z)
        made = from_joints("loop", [*joints, cut])
        assert len(made.holonomic) == held
        assert [unit for _, unit in made.holonomic] == ["m"] * min(held, 3) + ["1"] * (held - 3)


def test_a_mechanism_made_again_from_its_fields_is_the_same() -> None:
    ground, a, b = bodies("a", "b")
    cut = Cut.pin("cut", ground, b, l * ground.y, l * b.x, joint_axis=ground.z)
    made = from_joints("loop", [*pins(ground, a, b), cut])
    again = Mechanism(**{name: getattr(made, name) for name in made.__dataclass_fields__})
    assert again.holonomic == made.holonomic
    assert again.joints == made.joints


def test_the_axis_of_a_cut_has_two_square_directions_whatever_it_is() -> None:
    ground, a = bodies("a")
    for axis in (ground.x, ground.x + ground.z, ground.x + l * ground.y - ground.z):
        across = Cut.cylindrical("cut", ground, a, joint_axis=axis).axes
        assert across is not None
        one, other = across
        assert [v.simplify() for v in (one.dot(axis), other.dot(axis), one.dot(other))] == [0] * 3
        assert one.magnitude().simplify() == other.magnitude().simplify() == 1


def test_what_a_cut_needs_and_was_not_given_is_named() -> None:
    ground, a = bodies("a")
    point, frame = Point("P"), ReferenceFrame("F")
    frame.orient_axis(a.frame, a.z, dynamicsymbols("q"))
    turning, nothing = dynamicsymbols("q") * ground.x, (None, None, None)
    refused = {
        "parent is the ground, so parent_point": lambda: Cut.pin("cut", None, a),
        "give parent_interframe": lambda: Cut.pin("cut", None, a, point),
        "child_interframe F is not fixed": lambda: Cut.pin("cut", ground, a, *nothing, frame),
        "axis is the zero vector": lambda: Cut.pin("cut", ground, a, joint_axis=0 * ground.x),
        "is not fixed in ground_frame": lambda: Cut.pin("cut", ground, a, joint_axis=turning),
        "give child_interframe as a frame": lambda: Cut.pin(
            "cut", ground, Particle("p"), *nothing, ground.x
        ),
    }
    for message, make in refused.items():
        with pytest.raises(MechanismError, match=message):
            make()


def test_a_cut_at_a_point_that_is_nowhere_is_named() -> None:
    ground, a = bodies("a")
    lost = Cut.spherical("cut", ground, a, None, Point("lost"))
    with pytest.raises(MechanismError, match="joint cut: the point lost is not located"):
        from_joints("lost", [*pins(ground, a), lost])


def test_vectors_for_interframes_point_the_x_axes_along_them() -> None:
    ground, a = bodies("a")
    cut = Cut.weld("cut", ground, a, parent_interframe=ground.x + ground.y)
    assert cut.parent_interframe is not None
    assert cut.parent_interframe.x.dot(ground.x) == sqrt(2) / 2


# -- Systems --------------------------------------------------------------------------------------


def system_of(ground: RigidBody, joints: Any) -> System:
    system = System.from_newtonian(ground)
    system.add_joints(*joints)
    return system


def test_the_joints_of_a_system_are_those_of_its_mechanism() -> None:
    ground, a, b = bodies("a", "b")
    joints = pins(ground, a, b)
    made = convert(read(system_of(ground, joints)), ConversionSettings())
    assert [j.name for j in made.joints] == ["pin_a", "pin_b"]
    assert [(j.parent, j.child) for j in made.joints] == [(None, a), (a, b)]
    for mine, theirs in zip(made.joints, joints, strict=True):
        assert mine.parent_point is theirs.parent_point
        assert mine.child_point is theirs.child_point
        assert mine.parent_interframe is theirs.parent_interframe
        assert mine.child_interframe is theirs.child_interframe
        assert mine.speeds == tuple(theirs.speeds)


def test_weights_of_a_system_that_are_all_alike_are_gravity_with_its_potential() -> None:
    g = Symbol("g")
    ground, a, b = bodies("a", "b")
    system = system_of(ground, pins(ground, a, b))
    system.apply_uniform_gravity(-g * ground.y)
    made = convert(read(system), ConversionSettings())
    assert made.gravity == -g * ground.y
    assert {place for place, _ in made.loads} <= {ground.masscenter}
    assert not made.unknown_potentials
    system.add_loads(Force(b.masscenter, g * ground.x))  # one weighs otherwise
    made = convert(read(system), ConversionSettings())
    assert made.gravity is None
    assert len(made.loads) == 4


def test_what_turns_or_moves_otherwise_is_another_scene() -> None:
    def named(change: Any) -> str | None:
        ground, a, b = bodies("a", "b")
        joints = pins(ground, a, b)
        change(ground, a, b)
        return CompileRequest(
            system_of(ground, joints), CompileOptions(ConversionSettings())
        ).digest

    u = dynamicsymbols("u_pin_a")
    changes = [
        lambda ground, a, b: None,
        lambda ground, a, b: a.frame.set_ang_vel(ground.frame, 2 * u * ground.z),
        lambda ground, a, b: a.masscenter.set_vel(ground.frame, u * ground.x),
        lambda ground, a, b: b.masscenter.set_vel(ground.frame, u * ground.x),
        lambda ground, a, b: b.frame.set_ang_vel(ground.frame, u * ground.z),
        lambda ground, a, b: b.masscenter.set_acc(ground.frame, 0),
    ]
    names = [named(change) for change in changes]
    assert names[0] == named(changes[0])
    assert len(set(names)) == len(names)


def test_what_is_at_rest_is_told_from_what_moves() -> None:
    ground, a, b, c = bodies("a", "b", "c")
    slide = dynamicsymbols("x") * ground.x
    joints = [
        *pins(ground, a),
        WeldJoint("weld", ground, b, parent_point=l * ground.x + 2 * ground.y),
        WeldJoint("on", a, c, parent_point=l * a.x),
    ]
    rest = Stationary(ground.frame)
    assert [rest.body(body) for body in (ground, a, b, c)] == [True, False, True, False]
    assert joints[0].child_point is a.masscenter
    assert rest.place(a.masscenter)  # it turns about its mass centre, which stays
    moved = ground.masscenter.locatenew("moved", slide)
    ground.masscenter.set_vel(ground.frame, 0)
    assert not rest.place(moved)
    moved.set_vel(ground.frame, 0)
    assert rest.place(moved)  # as it was said
