"""Reactions that redundant constraints share are marked, all others do not depend on the cut."""

import warnings

import numpy as np
import pytest
from sympy import Rational, Symbol
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia

import mechc
from mechc.analysis.shared_reactions import undetermined_reactions
from tests.support.linkages.jointed import four_bar

WEIGHT = 20 * 9.81  # N
Y = np.array([0.3, 0.0])
HEIGHTS = {"lower": -Rational(4, 5), "upper": Rational(4, 5)}  # of the hinges, m


def door(cut, apart=0, down="z"):
    """A leaf on two hinges about the same axis, of which one is cut, and the upper one ``apart``
    from the axis."""
    ground, leaf = RigidBody("ground"), RigidBody("leaf")
    leaf.mass, leaf.central_inertia = 20, inertia(leaf.frame, 1, 2, 3)

    def places(name):
        height, width = HEIGHTS[name], Rational(2, 5) + (apart if name == "upper" else 0)
        return height * ground.z, height * leaf.z - width * leaf.x

    other = next(name for name in HEIGHTS if name != cut)
    pin = PinJoint(other, ground, leaf, *dynamicsymbols("q u"), *places(other), joint_axis=ground.z)
    closing = mechc.Cut.pin(cut, ground, leaf, *places(cut), joint_axis=ground.z)
    gravity = -9.81 * getattr(ground, down)
    mechanism = mechc.from_joints("door", [pin, closing], ground=ground, gravity=gravity)
    return mechc.compile(mechanism, outputs=("reactions",))


@pytest.mark.parametrize("cut", HEIGHTS)
def test_how_two_hinges_share_a_door_is_not_determined(cut):
    """All of it is on the hinge that is not cut; a warning says that this is a choice."""
    model = door(cut)
    with pytest.warns(mechc.UndeterminedReactionWarning) as told:
        force, _ = model.reactions(Y)
    np.testing.assert_allclose(force.sum(axis=0), [0, 0, WEIGHT], rtol=0, atol=1e-9)
    (other,) = {*HEIGHTS} - {cut}
    assert force[model.joint_names.index(other), 2] == pytest.approx(WEIGHT)
    assert f"({other}: force z, torque x y)" in str(told[0].message)
    assert told[0].filename == __file__
    found = model.redundant_constraints()
    assert [f"{cut} along ground_frame.{axis}: always holds" for axis in "xyz"] == [
        str(each) for each in found[:3]
    ]
    assert len(found) == 5
    with pytest.warns(mechc.UndeterminedReactionWarning, match="force z"):
        model.simulate(0.01, Y).output("reaction_forces")
    marked = undetermined_reactions(model.system, np.zeros(0), 0.0)
    assert marked[:, :5].all()  # not the torque about the hinges, which is none
    assert not marked[:, 5].any()


@pytest.mark.parametrize("apart", [[0.1, 0.0], [0.0, 0.1], np.append(np.linspace(0.1, 0, 9), 0.1)])
def test_of_many_parameter_sets_each_may_be_redundant(apart):
    model = door("upper", Symbol("e"), down="x")
    with pytest.warns(mechc.UndeterminedReactionWarning, match="force x y"):
        model.reactions(Y, {"e": apart})


def test_in_a_plane_forces_along_it_do_not_depend_on_the_cut():
    """Nothing acts across the plane: what the pins might share there is zero, and not told."""
    found = []
    for cut in (0, 3):
        model = mechc.compile(four_bar(cut), outputs=("reactions",))
        marked = undetermined_reactions(model.system, model.system.parameter_set.defaults, 0.0)
        assert (marked == [False, False, True, True, True, False]).all()
        shipped = mechc.load("four_bar").assemble({"theta_0": 1.4835})[:3]
        to_pins = np.array([[1, 0, 0], [-1, 1, 0], [0, -1, 1], [0, 0, 1.0]])
        kept = to_pins[[k for k in range(4) if k != cut]]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            force, torque = model.reactions(np.append(kept @ shipped, np.zeros(3)))
        order = np.argsort(model.joint_names)
        found.append((np.abs(force[order]), torque[order]))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-10)
    assert np.abs(found[0][0]).max() > 1.0
