"""Which bodies slide, along which lines, from joints and from points written by hand."""

from __future__ import annotations

from typing import Any

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings, Source
from mechc_codegen.drawing.plan import picture_plan
from mechc_codegen.frontend.read import read
from mechc_codegen.frontend.sympy_joints import from_joints
from mechc_codegen.library.catalogue import shipped_mechanism
from sympy import Rational, Symbol, cos, sin, sqrt, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

q, s, u, v = dynamicsymbols("q s u v")
t = dynamicsymbols._t
m, l, a = symbols("m l a", positive=True)


def sliders_of(mechanism: Mechanism, added: Drawing | None = None) -> dict[str, Any]:
    """Label -> (its direction's components, whether it is a block)."""
    known = {p.symbol.name for p in mechanism.parameters}
    plan = picture_plan(mechanism, added or Drawing(), known)
    return {
        label: (plan.points[beyond - 1][1][0][1], is_block)
        for label, _, is_block, _, beyond in plan.sliders
    }


def kane(place: Any, frame: ReferenceFrame, origin: Point, body: Any, *turning: Any) -> Mechanism:
    """A body whose mass centre is placed from the origin, by coordinates among q and s."""
    coordinates = [x for x, _ in turning] or [s]
    centre = body.masscenter
    centre.set_pos(origin, place)
    origin.set_vel(frame, 0)
    centre.set_vel(frame, place.dt(frame))
    speeds = [u, v][: len(coordinates)]
    rates = [x.diff(t) - w for x, w in zip(coordinates, speeds, strict=True)]
    method = KanesMethod(frame, coordinates, speeds, rates)
    method.kanes_equations([body], [(centre, -m * frame.y)])
    return convert(read(method), ConversionSettings())


def rigid(name: str, frame: ReferenceFrame) -> RigidBody:
    centre = Point(f"{name}_centre")
    return RigidBody(name, centre, frame, m, (inertia(frame, m, m, m), centre))


def engine() -> Mechanism:
    block, crank, piston = (RigidBody(name) for name in ("block", "crank", "piston"))
    pin = PinJoint("main", block, crank, child_point=-l * crank.x, joint_axis=block.z)
    bore = PrismaticJoint("bore", block, piston, parent_point=a * block.x, joint_axis=block.y)
    return from_joints("engine", [pin, bore])


def test_a_piston_slides_in_its_bore_and_its_bore_is_no_hinge() -> None:
    made = engine()
    assert sliders_of(made) == {"piston": ((0, 1, 0), True)}
    plan = picture_plan(made, Drawing(), {"l", "a"})
    assert plan.drawing.ground == ("block_masscenter",)
    assert "piston_masscenter" in plan.names


def test_a_guide_that_turns_carries_its_direction_along() -> None:
    block, arm, sleeve = (RigidBody(name) for name in ("block", "arm", "sleeve"))
    pin = PinJoint("pin", block, arm, joint_axis=block.z)
    slide = PrismaticJoint("slide", arm, sleeve, joint_axis=arm.x)
    plan = picture_plan(from_joints("arm", [pin, slide]), Drawing(), ())
    ((label, _, is_block, base, beyond),) = plan.sliders
    assert (label, is_block) == ("sleeve", True)
    frame, along = plan.points[beyond - 1][1][0]
    assert along == (1, 0, 0)
    assert frame != 0  # not the inertial one
    assert plan.points[beyond - 1][0] == base


def test_the_direction_of_a_slope_and_a_law_of_motion_with_dead_points() -> None:
    frame, origin = ReferenceFrame("N"), Point("O")
    slope = s * (cos(a) * frame.x + sin(a) * frame.y)
    ((along, is_block),) = sliders_of(kane(slope, frame, origin, rigid("cart", frame))).values()
    assert (along, is_block) == ((cos(a), sin(a), 0), True)
    reach = (l * cos(s) + sqrt(9 * l**2 - l**2 * sin(s) ** 2)) * frame.x + a * frame.y
    assert sliders_of(kane(reach, frame, Point("O"), rigid("cart", frame))) == {
        "cart": ((1, 0, 0), True)
    }


def test_what_turns_flies_or_falls_does_not_slide() -> None:
    frame = ReferenceFrame("N")
    wheel = frame.orientnew("W", "Axis", (-s / a, frame.z))
    assert not sliders_of(kane(s * frame.x + a * frame.y, frame, Point("O"), rigid("wheel", wheel)))
    plane = q * frame.x + s * frame.y
    assert not sliders_of(kane(plane, frame, Point("O"), rigid("plate", frame), (q, 0), (s, 0)))
    curved = s * frame.x + s**2 * frame.y
    assert not sliders_of(kane(curved, frame, Point("O"), rigid("bead", frame)))
    assert not sliders_of(kane(s * frame.y, frame, Point("O"), Particle("ball", Point("P"), m)))


def test_a_particle_slides_where_a_link_leads_to_it_or_its_line_turns() -> None:
    frame, origin = ReferenceFrame("N"), Point("O")
    ball = Particle("ball", Point("P"), m)
    made = kane(s * frame.x, frame, origin, ball)
    rail = Drawing(links=(("rod", ("O", "P")),))
    assert sliders_of(made, rail) == {"ball": ((1, 0, 0), True)}
    arm = frame.orientnew("A", "Axis", (q, frame.z))
    bead = Particle("bead", Point("B"), m)
    turning = kane(s * arm.x, frame, Point("O"), bead, (q, 0), (s, 0))
    assert sliders_of(turning) == {"bead": ((1, 0, 0), False)}


def test_a_block_stands_for_a_slider_whose_solid_is_drawn_in_space_alone() -> None:
    made = shipped_mechanism("slider_crank")
    known = {p.symbol.name for p in made.parameters}
    for in_space in (False, True):
        plan = picture_plan(made, Drawing(), known, in_space=in_space)
        assert [is_block for _, _, is_block, *_ in plan.sliders] == [not in_space]


# -- what else is drawn ---------------------------------------------------------------------------


def rolling_disc(*, located: bool, down: Any = 0) -> Mechanism:
    """A disc that rolls along a line; its contact's velocity is zero, as many write it."""
    frame, origin, r = ReferenceFrame("N"), Point("O"), Symbol("r", positive=True)
    wheel = frame.orientnew("W", "Axis", (q, frame.z))
    wheel.set_ang_vel(frame, u * frame.z)
    contact = Point("contact")
    if located:
        contact.set_pos(origin, -r * q * frame.x)
    contact.set_vel(frame, 0)
    centre = contact.locatenew("centre", r * frame.y)
    centre.v2pt_theory(contact, frame, wheel)
    central = inertia(frame, m * r**2 / 4, m * r**2 / 4, m * r**2 / 2)  # of the frame that is fixed
    body = RigidBody("disc", centre, wheel, m, (central, centre))
    method = KanesMethod(frame, [q], [u], [q.diff(t) - u])
    method.kanes_equations([body], [(centre, -m * (Symbol("g") * frame.y + down * frame.x))])
    return convert(read(method), ConversionSettings())


def test_the_origin_is_at_rest_and_not_the_point_of_contact() -> None:
    """A contact's velocity is zero and its place moves: a disc turned on the spot."""
    assert rolling_disc(located=True).origin.name == "O"
    assert rolling_disc(located=False).origin.name == "contact"  # all that is known


def test_the_potential_is_that_of_the_place_and_not_of_the_contact() -> None:
    """On a slope a disc that rolls loses height, though none above its contact."""
    h, r = Symbol("h"), Symbol("r", positive=True)
    potential = rolling_disc(located=True, down=h).potential
    assert potential is not None
    assert (potential.diff(q) + m * h * r).simplify() == 0


def test_a_wheel_turns_though_its_inertia_is_written_in_a_frame_at_rest() -> None:
    made = rolling_disc(located=True)
    plan = picture_plan(made, Drawing(), {"r", "m", "g"}, in_space=True)
    ((shape, _, frame),) = plan.solids
    r = Symbol("r", positive=True)
    assert shape.kind == "inertia"
    assert [entry.simplify() for entry in shape.entries] == [
        r**2 / 4, r**2 / 4, r**2 / 2, 0, 0, 0,
    ]  # fmt: skip
    assert shape.frame.name == "W"
    assert frame != 0


def test_the_title_names_the_bodies() -> None:
    assert rolling_disc(located=True).title == "disc"
    frame = ReferenceFrame("N")
    assert Source("LagrangesMethod", frame, (q, s), (u, v), ()).title == "q and s"


@pytest.mark.parametrize(
    ("count", "title"), [(2, "b0 and b1"), (4, "b0, b1, b2 and b3"), (6, "b0, b1, b2 and 3 more")]
)
def test_a_title_names_a_few(count: int, title: str) -> None:
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    points = [origin.locatenew(f"P{k}", (s + Rational(k)) * frame.x) for k in range(count)]
    for point in points:
        point.set_vel(frame, v * frame.x)
    method = KanesMethod(frame, [s], [v], [s.diff(t) - v])
    method.kanes_equations([Particle(f"b{k}", p, m) for k, p in enumerate(points)], [])
    assert read(method).title == title
