"""Muscles of SymPy reach a drawing with their paths, from wherever they are given."""

from __future__ import annotations

from typing import Any

import pytest
from mechc_codegen.description.drawing import Drawing, Muscle, Wrap, muscles_in
from mechc_codegen.drawing.plan import ARC, picture_plan
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Symbol, cos, sin
from sympy.physics.biomechanics import ZerothOrderActivation
from sympy.physics.mechanics import (
    LinearPathway,
    LinearSpring,
    ObstacleSetPathway,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    WrappingCylinder,
    WrappingPathway,
    WrappingSphere,
    dynamicsymbols,
)

from tests.support.actuators import ACTUATED, muscle, q, r, u

N, O = ReferenceFrame("N"), Point("O")
A, B, C = (O.locatenew(name, k * N.x) for k, name in enumerate("ABC"))


class Pulling:
    """What a muscle of SymPy has that is drawn."""

    name, activation = "biceps", dynamicsymbols("a_biceps")

    def __init__(self, pathway: Any) -> None:
        self.pathway = pathway


def test_the_path_of_a_muscle_is_that_of_its_pathway() -> None:
    start, end = O.locatenew("start", r * N.x), Point("end")
    end.set_pos(O, r * (cos(q) * N.x + sin(q) * N.y))
    paths = {
        LinearPathway(A, B): (A, B),
        ObstacleSetPathway(A, B, C): (A, B, C),
        WrappingPathway(start, end, WrappingCylinder(r, O, N.z)): (start, Wrap(O, N.z), end),
        WrappingPathway(start, end, WrappingSphere(r, O)): (start, Wrap(O), end),
    }
    for pathway, path in paths.items():
        assert Muscle.of(Pulling(pathway)) == Muscle("biceps", path, Pulling.activation)
    made = muscle(LinearPathway(A, B))
    assert muscles_in([made, LinearSpring(1, LinearPathway(A, B)), (A, N.x), made]) == (
        Muscle("biceps", (A, B), made.a),
    )
    assert muscles_in({made.a: made.a}) == muscles_in(None) == ()


@pytest.mark.parametrize(
    "path", [(), (A,), (Wrap(O), A), (A, Wrap(O)), (A, Wrap(O), Wrap(O), B), ("A", "B"), (A, B, 1)]
)
def test_a_path_that_is_none_is_refused(path: Any) -> None:
    with pytest.raises(MechanismError, match=r"muscle m: its path is two points or more, with wra"):
        Muscle("m", path, 1.0)  # type: ignore[arg-type]


def test_a_muscle_that_is_none_is_refused() -> None:
    with pytest.raises(MechanismError, match="'biceps' is not a muscle: give one of sympy"):
        Drawing(muscles=("biceps",))  # type: ignore[arg-type]


def test_muscles_among_the_actuators_of_a_system_are_drawn() -> None:
    (found,) = read(ACTUATED["muscle"]()).muscles
    assert [stop.name for stop in found.path] == ["hook", "tip"]  # type: ignore[union-attr]
    assert read(ACTUATED["stretched spring and damper"]()).muscles == ()


def jointed(activation: Any, **more: Any) -> Any:
    """A rod on a pin with a muscle from a hook to a grip, and one around the pin."""
    ground, rod = RigidBody("ground"), RigidBody("rod", mass=Symbol("m"))
    pin = PinJoint("pin", ground, rod, q, u, child_point=-Symbol("l") * rod.x, joint_axis=ground.z)
    hook = ground.masscenter.locatenew("hook", Symbol("h") * ground.y)
    pulling = Pulling(LinearPathway(hook, rod.masscenter))
    pulling.activation = activation
    wrapped = Muscle(
        "wrapped", (hook, Wrap(ground.masscenter, -ground.z), rod.masscenter), activation
    )
    return from_joints(
        "arm",
        [pin],
        ground=ground,
        loads=[(rod.masscenter, activation * rod.y)],
        drawing=Drawing(muscles=(pulling, wrapped)),  # type: ignore[arg-type]
        **more,
    )


def test_a_plan_has_the_points_of_a_path_and_the_arcs_around_a_surface() -> None:
    a = dynamicsymbols("a")
    arm = jointed(a, states={a: -a})
    plan = picture_plan(arm, Drawing(), {"m", "l", "h"})
    (_, straight, first), (label, around, second) = plan.muscles
    assert straight == ("hook", "rod_masscenter")
    assert (first, second, label) == (a, a, "wrapped")
    assert around[0] == "hook"
    assert around[-1] == "rod_masscenter"
    assert around[1:-1] == tuple(f".wrapped 1 {part}" for part in range(1, ARC))
    assert {*around} <= {*plan.names}
    assert len(plan.names) == len(plan.places)
    assert plan.places[-1] == len(plan.points) + ARC - 1
    assert picture_plan(arm, Drawing(), {"m", "l"}).muscles == []  # it is not known where hook is


def test_an_activation_that_a_run_gives_is_known_by_its_name() -> None:
    a = dynamicsymbols("a")
    known = {"m", "l", "h"}
    given = picture_plan(jointed(a), Drawing(), known)
    assert [activation for *_, activation in given.muscles] == ["a", "a"]
    bound = picture_plan(jointed(a, inputs={a: q**2}), Drawing(), known)
    assert [activation for *_, activation in bound.muscles] == [q**2, q**2]
    scaled = picture_plan(jointed(a / 2), Drawing(), known)
    assert [activation for *_, activation in scaled.muscles] == [None, None]


def test_a_muscle_is_not_drawn_again_as_a_spring() -> None:
    ground, rod = RigidBody("ground"), RigidBody("rod", mass=Symbol("m"))
    pin = PinJoint("pin", ground, rod, q, u, child_point=-Symbol("l") * rod.x, joint_axis=ground.z)
    hook = ground.masscenter.locatenew("hook", Symbol("h") * ground.y)
    made = muscle(LinearPathway(hook, rod.masscenter))
    spring = LinearSpring(Symbol("k"), LinearPathway(hook, rod.masscenter))
    arm = from_joints("arm", [pin], ground=ground, loads=[made], states=made)
    known = {p.symbol.name for p in arm.parameters}
    drawing = picture_plan(arm, Drawing(), known, in_space=True).drawing
    assert [each.label for each in drawing.muscles] == ["biceps"]
    assert drawing.springs == drawing.dampers == ()
    springy = from_joints("arm", [pin], ground=ground, loads=[spring])
    drawing = picture_plan(springy, Drawing(), {"m", "l", "h", "k"}, in_space=True).drawing
    assert [label for label, _ in drawing.springs] == ["spring hook rod_masscenter"]


def test_without_dynamics_the_activation_is_the_excitation() -> None:
    made = muscle(LinearPathway(A, B))
    made._activation_dynamics = ZerothOrderActivation("biceps")
    (found,) = muscles_in(made)
    assert found.activation == dynamicsymbols("e_biceps")
