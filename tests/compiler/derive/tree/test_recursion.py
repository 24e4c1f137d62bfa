"""What a user has to give is the same for both forms of the derivation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.derive.derive_equations import LEAST_TREE, drop_parameters
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree import recursion
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Rational, cos, pi, sin, symbols
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, dynamicsymbols, inertia

import mechc

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


def robot(folder, name, loop=""):
    """A chain of nine pins in space, of which two follow the second, with a branch."""
    links, joints = ['<link name="g"/>'], list[str]()
    for k in range(1, 10):
        on, axis = ("g" if k == 1 else f"l{k - 1}" if k < 9 else "l4"), np.roll([1, 0, 0], k)
        links.append(
            f'<link name="l{k}"><inertial><origin xyz="0.1 {0.02 * k} -0.2" rpy="0.1 0.2 0.3"/>'
            f'<mass value="{1 + 0.1 * k}"/><inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" '
            'iyz="0" izz="0.04"/></inertial></link>'
        )
        mimic = {5: '<mimic joint="j2" multiplier="-0.7" offset="0.3"/>',
                 9: '<mimic joint="j2" multiplier="2"/>'}.get(k, "")  # fmt: skip
        joints.append(
            f'<joint name="j{k}" type="continuous"><parent link="{on}"/><child link="l{k}"/>'
            f'<origin xyz="0.05 0 -0.4"/><axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>{mimic}</joint>'
        )
    path = folder / f"{name}.urdf"
    path.write_text(f'<robot name="{name}">{"".join([*links, *joints])}{loop}</robot>')
    return mechc.from_urdf(path)


def test_speeds_that_move_several_links_are_walked_as_they_are_written_out(tmp_path, monkeypatch):
    """One follows another on its own way to the ground, and one on another branch."""
    written = mechc.compile(robot(tmp_path, "written"))
    monkeypatch.setattr(recursion, "LEAST_SHARED", 2)
    walked = mechc.compile(robot(tmp_path, "walked"))
    assert (written.system.data["walked"], walked.system.data["walked"]) == (0, 9)
    states = np.random.default_rng(3).uniform(-1.5, 1.5, (20, 14))
    for name in ("mass_matrix", "forcing", "rates", "kinetic_energy"):
        found, wanted = walked.output(name, states), written.output(name, states)
        np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-10)


def test_so_are_those_of_loops(tmp_path):
    """Two ends of the branches stay as far apart: the same by the whole equations of motion."""
    loop = (
        '<constraint name="C" type="{}"><parent link="l8"/><child link="l9"/>'
        '<parent_origin xyz="0 0 -0.1"/><child_origin xyz="0.6 0.2 -0.3"/></constraint>'
    ).format("spherical")
    walked = mechc.compile(robot(tmp_path, "walked_loop", loop))
    assert walked.system.data["walked"] == 9
    free = mechc.compile(robot(tmp_path, "free"))
    state = walked.assemble(speeds={"u_j1": 0.8, "u_j3": -0.5})
    rows = walked.constraint_jacobian(state)
    mass, forcing = free.mass_matrix(state), free.forcing(state)
    rates = walked.rhs(0.0, state)[7:]
    balance = mass @ rates - forcing  # of the rows' forces alone
    multipliers = np.linalg.lstsq(rows.T, -balance, rcond=None)[0]
    np.testing.assert_allclose(rows.T @ multipliers, -balance, atol=1e-9)
    step = 1e-5
    ahead, behind = (
        walked.constraints(state + sign * step * np.concatenate([state[7:], rates])
                           + np.concatenate([rates, np.zeros(7)]) * step**2 / 2)
        for sign in (1, -1)
    )  # fmt: skip
    np.testing.assert_allclose(ahead + behind - 2 * walked.constraints(state), 0, atol=1e-13)
