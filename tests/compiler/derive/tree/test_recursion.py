"""What a user has to give is the same for both forms of the derivation."""

from __future__ import annotations

from typing import Any

import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.derive.derive_equations import LEAST_TREE, drop_parameters
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Rational, cos, pi, sin, symbols
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, dynamicsymbols, inertia

r, l, m, g = symbols("r l m g", positive=True)
T = dynamicsymbols("T")
NOTHING_BESIDES = OutputRequest(outputs=frozenset())


def engine(cylinders: int) -> Mechanism:
    """A crank with rods and pistons; three of them have seven speeds."""
    block, crank = RigidBody("block"), RigidBody("crank", mass=m)
    joints: list[Any] = [PinJoint("main", block, crank, joint_axis=block.z)]
    for k in range(cylinders):
        rod, piston = RigidBody(f"rod{k}", mass=m), RigidBody(f"piston{k}", mass=m)
        rod.central_inertia = inertia(rod.frame, 0, 0, m * l**2 / 12)
        angle = 2 * pi * Rational(k, cylinders)
        pin = r * (cos(angle) * crank.x + sin(angle) * crank.y)
        joints += [
            PinJoint(
                f"big{k}",
                crank,
                rod,
                parent_point=pin,
                child_point=-l / 2 * rod.x,
                joint_axis=crank.z,
            ),
            PrismaticJoint(f"bore{k}", block, piston, joint_axis=block.y),
            Cut.pin(f"wrist{k}", rod, piston, parent_point=l / 2 * rod.x, joint_axis=rod.z),
        ]
    return from_joints("engine", joints, loads=[(crank.frame, T * block.z)], gravity=-g * block.y)


def wrist() -> Mechanism:
    """Links in space that turn about z, then slide, then turn about y."""
    ground, base, slide, hand = (
        RigidBody(name, mass=m) for name in ["ground", "base", "slide", "hand"]
    )
    joints = [
        PinJoint("yaw", ground, base, child_point=-l * base.x, joint_axis=ground.z),
        PrismaticJoint("reach", base, slide, joint_axis=base.x),
        PinJoint("pitch", slide, hand, child_point=-l * hand.x, joint_axis=slide.y),
    ]
    return from_joints("wrist", joints, gravity=-g * ground.z)


def parameters(mechanism: Mechanism, form: Any) -> set[str]:
    equations = form(mechanism, NOTHING_BESIDES)
    kept, _ = drop_parameters(mechanism, equations, NOTHING_BESIDES)
    return {str(p.symbol) for p in kept}


@pytest.mark.parametrize("made", [engine(1), engine(3), wrist()], ids=["one", "three", "wrist"])
def test_the_parameters_are(made: Mechanism) -> None:
    assert parameters(made, derive_tree) == parameters(made, derive)


def test_a_piston_needs_no_moment_of_inertia() -> None:
    assert parameters(engine(3), derive_tree) == {"r", "l", "m", "g", "crank_izz"}
    assert {"base_izz", "slide_izz"} <= parameters(wrist(), derive_tree)
    assert not {"base_ixx", "slide_iyy"} & parameters(wrist(), derive_tree)


@pytest.mark.parametrize("cylinders", [2, 3])
def test_a_torque_is_no_input_of_the_closing_of_loops(cylinders: int) -> None:
    made = engine(cylinders)
    assert (len(made.speeds) >= LEAST_TREE) == (cylinders == 3)
    data = optimised_scene(made, NOTHING_BESIDES, Stopwatch()).metadata
    closing = {"constraints", "velocity_constraints", "constraint_jacobian"}
    assert closing <= {*data["free_of_inputs"]}
    assert "mass_matrix" in data["free_of_inputs"]
    assert not {"forcing", "tree_wrench"} & {*data["free_of_inputs"]}
    assert data["inputs"][0]["name"] == "T"
