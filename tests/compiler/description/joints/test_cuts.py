"""Rods as they are described: lengths, what is refused, rows, bounds of the symbol, the picture."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import PinJoint, Point, RigidBody, dynamicsymbols, inertia

import mechc
from mechc.errors import MechcError, ValueOutOfBoundsError

L, g = sm.symbols("L g")


def cranks():
    """The ground and two cranks about parallel pins, a metre apart."""
    ground, crank, rocker = (RigidBody(name, mass=1) for name in ("ground", "crank", "rocker"))
    for body in (crank, rocker):
        body.central_inertia = inertia(body.frame, 0, 0, 0.1)
    pins = [
        PinJoint("A", ground, crank, child_point=-0.2 * crank.x, joint_axis=ground.z),
        PinJoint("D", ground, rocker, parent_point=ground.x, child_point=-0.3 * rocker.x,
                 joint_axis=ground.z),
    ]  # fmt: skip
    return ground, crank, rocker, pins


def four_bar(length=L, **more):
    _, crank, rocker, pins = cranks()
    tie = mechc.Cut.rod("tie", crank, rocker, length, 0.2 * crank.x, 0.3 * rocker.x)
    return mechc.from_joints("four_bar", [*pins, tie], **more)


class Inches:
    """A quantity of pint, as far as it is asked."""

    magnitude = 10.0

    def to(self, unit):
        assert unit == "m"
        return type("", (), {"magnitude": 0.254})


@pytest.mark.parametrize(
    ("given", "length"),
    [("900 mm", 0.9), ("90cm", 0.9), ("0.9 m", 0.9), ("9e-1", 0.9), (0.9, 0.9), (2, 2),
     (Inches(), 0.254), (L + 0.1, L + 0.1), (sm.Rational(9, 10), 0.9)],
)  # fmt: skip
def test_a_length_is_a_number_an_expression_or_a_text_with_its_unit(given, length):
    (closure,) = four_bar(given).closures
    assert sm.simplify(closure.length - length) == 0
    assert closure.rows == (("tie", "m"),)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            0,
            r"the rod tie: its length is positive, not 0; for points that coincide write",
        ),
        ("-3 mm", "its length is positive, not -3 mm"),
        (sm.nan, "its length is positive, not nan"),
        (sm.Symbol("k", negative=True), "its length is positive, but k is declared not to be"),
        (dynamicsymbols("s"), r"contains s\(t\), which varies with time"),
        ("3 furlong", "tie: its length: 'furlong' in '3 furlong' is not .*; use m or cm or mm"),
        ("__import__('os')", "is not an expression"),
        (None, "the rod tie: length: None is not an expression"),
    ],
)
def test_lengths_that_are_none_are_refused(given, words):
    with pytest.raises(MechcError, match=words):
        four_bar(given)


def test_a_symbol_is_positive_and_in_metres():
    made = four_bar(parameters={"L": 0.9})
    assert made.rows == ("tie",)
    model = mechc.compile(made, outputs=())
    y = model.assemble({"q_A": 0.5}, params={"L": "0.8 m"}, guess={"q_D": 1.0})
    assert abs(model.constraints(y, {"L": 0.8})).max() < 1e-15
    with pytest.raises(ValueOutOfBoundsError, match=r"L = -1 m \(length of the rod tie\)"):
        model.assemble({"q_A": 0.5}, params={"L": -1})
    for make in (lambda: four_bar(parameters={"L": 0}),
                 lambda: mechc.compile(four_bar(), defaults={"L": -0.9})):  # fmt: skip
        with pytest.raises(MechcError, match="the length L of the rod tie is positive, not"):
            make()


def test_points_that_cannot_be_held_apart_are_refused():
    ground, crank, rocker, pins = cranks()
    on_crank = crank.masscenter.locatenew("P", 0.1 * crank.x)

    def refused(words, *rod):
        with pytest.raises(MechcError, match=words):
            mechc.from_joints("linkage", [*pins, mechc.Cut.rod("tie", *rod)])

    refused("the joint tie joins crank to itself", crank, crank, 1, 0.1 * crank.x)
    refused("the rod tie: its points .* and P keep their distance in every configuration",
            crank, rocker, 1, 0.2 * crank.x, on_crank)  # fmt: skip
    refused("coincide in every configuration; for bodies that share a point write",
            crank, ground, 1, -0.2 * crank.x, 0 * ground.x)  # fmt: skip
    refused("the point lost is not located from the origin", crank, rocker, 1, Point("lost"))
    with pytest.raises(MechcError, match="the child is the ground, so child_point must be a Point"):
        mechc.Cut.rod("tie", crank, None, 1)
    with pytest.raises(MechcError, match="'L' in the length of tie is neither a parameter"):
        replace(four_bar(parameters={"L": 0.9}), parameters=())


def test_a_rod_that_always_holds_is_omitted():
    ground, crank, _, pins = cranks()
    spoke = mechc.Cut.rod("spoke", crank, ground, 0.4, 0.2 * crank.x, 0 * ground.x)
    model = mechc.compile(mechc.from_joints("wheel", [*pins, spoke]), outputs=("reactions",))
    assert model.constraint_names == ()
    assert model.joint_names == ("A", "D", "spoke")
    with pytest.warns(mechc.UndeterminedReactionWarning, match=r"\(A: force x y\)"):
        assert not model.reactions([0.1, 0.2, 3.0, 0.0]).force[2].any()
    assert [each.name for each in model.redundant_constraints()] == ["spoke"]


def test_parent_and_child_may_be_exchanged():
    """The ground may be the child of a cut, which places nothing."""
    ground, crank, _, pins = cranks()
    P = ground.masscenter.locatenew("P", 0.3 * ground.y)
    for ends in (((ground, crank), (P, 0.2 * crank.x)), ((crank, ground), (0.2 * crank.x, P))):
        tie = mechc.Cut.rod("tie", *ends[0], 0.4, *ends[1])
        model = mechc.compile(mechc.from_joints("held", [*pins, tie]), outputs=("multipliers",))
        assert model.constraints([0.3, 0.1, 0, 0]) == pytest.approx(
            [(np.hypot(0.4 * np.cos(0.3), 0.4 * np.sin(0.3) - 0.3) ** 2 - 0.16) / 0.8]
        )


def test_a_rod_is_drawn_whatever_else_is():
    made = four_bar(0.9)
    link = ("tie", ("tie_crank_joint", "tie_rocker_joint"))
    assert link in made.drawing.links
    plain = replace(made, drawing=mechc.Drawing())
    alone = mechc.Drawing(links=(("crank", ("ground_masscenter", "tie_crank_joint")),))
    for each in (made, plain, replace(made, drawing=alone)):
        picture = mechc.compile(each, outputs=()).picture
        (drawn,) = [line for label, line in picture.skeleton if label == "tie"]
        at = picture.points(np.array([[0.5, 1.2, 0, 0]]), np.zeros((1, 0)), np.zeros(1))[0]
        ends = [at[picture.point_names.index(name)] for name in drawn]
        assert ends[0] == pytest.approx([0.4 * np.cos(0.5), 0.4 * np.sin(0.5), 0])
        assert ends[1] == pytest.approx([1 + 0.6 * np.cos(1.2), 0.6 * np.sin(1.2), 0])
