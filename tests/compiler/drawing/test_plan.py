"""What a picture in space has beyond the plane one: solids, springs and dampers, the weight."""

from __future__ import annotations

from typing import Any

import pytest
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.mechanism import (
    Coordinate,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
)
from mechc_codegen.description.solid import Solid
from mechc_codegen.drawing.plan import PicturePlan, picture_plan
from mechc_codegen.errors import MechanismError
from sympy import symbols
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols

k, c, g, m, l, push = symbols("k c g m l push", positive=True)
x, v = dynamicsymbols("x v")
N, O = ReferenceFrame("N"), Point("O")
SEAT = O.locatenew("seat", l * N.y)
MASS = O.locatenew("mass", x * N.x)
for point in (O, SEAT):
    point.set_vel(N, 0)
MASS.set_vel(N, v * N.x)
WAY = MASS.pos_from(SEAT)


def mechanism(loads: tuple[Any, ...], **more: Any) -> Mechanism:
    values = (k, c, g, m, l, push)
    return Mechanism(
        name="mass", title="", frame=N, origin=O,
        coordinates=(Coordinate(x, Quantity("m", "")),), speeds=(Speed(v, Quantity("m/s", "")),),
        kinematics=(v,), parameters=tuple(Parameter(s, 1.0, Quantity("", "")) for s in values),
        bodies=(Particle("mass", MASS, m),), loads=loads, points=(O, SEAT, MASS), **more,
    )  # fmt: skip


def plan(loads: tuple[Any, ...], added: Drawing | None = None, **more: Any) -> PicturePlan:
    known = {str(s) for s in (k, c, g, m, l, push)}
    return picture_plan(mechanism(loads, **more), added or Drawing(), known, in_space=True)


def pair(force: Any) -> tuple[Any, ...]:
    return ((MASS, force), (SEAT, -force))


def test_opposite_forces_along_the_line_are_a_spring_or_a_damper() -> None:
    ((label, ends),) = plan(pair(-k * WAY)).drawing.springs
    assert label == "spring mass seat"
    assert set(ends) == {"mass", "seat"}
    damped = plan(pair(-c * v * WAY)).drawing
    assert (len(damped.dampers), damped.springs) == (1, ())
    both = plan((*pair(-c * v * WAY), *pair(-k * WAY))).drawing
    assert (len(both.springs), both.dampers) == (1, ())


@pytest.mark.parametrize("force", [k * N.x, -k * x * N.y], ids=["along x", "along y"])
def test_other_opposite_forces_are_not(force: Any) -> None:
    drawing = plan(pair(force)).drawing
    assert drawing.springs == drawing.dampers == ()


def test_the_weight_is_told_from_other_forces() -> None:
    assert plan(((MASS, push * N.x), (MASS, -m * g * N.z))).weight == (0, 0, -g)
    assert plan(((MASS, push * N.x),)).weight is None
    assert plan((), gravity=-g * N.y).weight == (0, -g, 0)


def test_a_force_at_a_place_that_is_not_known_is_not_drawn() -> None:
    """The seat's, by the length of a model that has none."""
    loads = ((MASS, push * N.x), (SEAT, push * N.x))
    assert [name for name, _, _ in plan(loads).loads] == ["mass", "seat"]
    known = {str(s) for s in (k, c, g, m, push)}
    found = picture_plan(mechanism(loads), Drawing(), known, in_space=True)
    assert [name for name, _, _ in found.loads] == ["mass"]


def test_a_particle_is_a_mass_and_a_given_solid_takes_its_place() -> None:
    assert [s.kind for s, _, _ in plan(()).solids] == ["mass"]
    ((shape, _, frame),) = plan((), Drawing(solids=(Solid.box("b", MASS, N, (l, 1, 2)),))).solids
    assert (shape.kind, shape.entries, frame) == ("box", (l, 1, 2), 0)


def test_a_body_whose_inertia_changes_in_its_frame_has_none() -> None:
    A = N.orientnew("A", "Axis", (x, N.z))
    A.set_ang_vel(N, v * N.z)
    turning = RigidBody("body", MASS, A, m, (N.x.outer(N.x) * m + A.y.outer(A.y) * m, MASS))
    assert plan((), drawn=(turning,)).solids[1:] == []


def test_springs_given_are_not_found_again() -> None:
    given = Drawing(springs=(("mine", (SEAT, MASS)),))
    assert plan(pair(-k * WAY), given).drawing.springs == (("mine", ("seat", "mass")),)


def test_wrong_solids_and_springs_are_told() -> None:
    with pytest.raises(MechanismError, match="not known where"):
        plan((), Drawing(solids=(Solid.ball("far", Point("far"), 1),)))
    with pytest.raises(MechanismError, match="parameters only"):
        plan((), Drawing(solids=(Solid.ball("b", MASS, x),)))
    for wrong in (-1, "l", float("nan"), None):
        with pytest.raises(MechanismError, match="not a length"):
            Solid.ball("b", MASS, wrong)
    with pytest.raises(MechanismError, match="three sides"):
        Solid.box("b", MASS, N, (1, 2))
    with pytest.raises(MechanismError, match="axis"):
        Solid.wheel("w", MASS, N, 1, "w")
    with pytest.raises(MechanismError, match="two points"):
        Drawing(springs=(("s", (SEAT,)),))
    with pytest.raises(MechanismError, match="not a Solid"):
        Drawing(solids=("ball",))  # type: ignore[arg-type]
