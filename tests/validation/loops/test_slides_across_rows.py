"""A slide that is perpendicular to the direction of a row: it acts there by rounding alone, which
says nothing about lengths."""

import numpy as np
import pytest
from mechc_codegen.description.joints.cuts import Cut
from sympy import Rational, Symbol
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, inertia

import mechc


@pytest.fixture(scope="module")
def model():
    """A crank that moves a slider along a rocker."""
    ground, rocker, slider, crank = map(RigidBody, ("ground", "rocker", "slider", "crank"))
    for body in (rocker, slider, crank):
        body.mass, body.central_inertia = 1, inertia(body.frame, 0.1, 0.12, 0.13)
    joints = [
        PinJoint("rocks", ground, rocker, joint_axis=ground.z),
        PrismaticJoint("slides", rocker, slider, joint_axis=rocker.x),
        PinJoint("turns", ground, crank, parent_point=ground.x, child_point=-0.75 * crank.x,
                 joint_axis=ground.z),
        Cut.pin("tip", crank, slider, parent_point=0.75 * crank.x, joint_axis=crank.z),
    ]  # fmt: skip
    made = mechc.from_joints("inverted_slider_crank", joints, gravity=-9.81 * ground.y)
    return mechc.compile(made)


@pytest.mark.parametrize("angle", [np.pi / 2, np.pi / 2 - 0.1, np.pi / 2 + 1e-9])
def test_loops_close_where_it_is_so_at_the_start(model, angle):
    start = model.assemble({"q_rocks": angle}, guess={"q_turns": 2.3, "q_slides": 1.1})
    assert np.abs(model.constraints(start)).max() < 1e-14
    exact = np.cos(angle) + np.sqrt(1.5**2 - np.sin(angle) ** 2)  # from the pivot to the tip
    assert start[1] == pytest.approx(exact, abs=1e-12)
    start[3:] = np.linalg.svd(model.constraint_jacobian(start))[2][2]
    run = model.simulate(2.0, start, rtol=1e-9)
    assert run.status.ok
    assert np.abs(run.output("constraints")).max() < 1e-13
    assert np.ptp(run.energy) < 1e-8


@pytest.mark.parametrize("method", ["dop853", "gauss8", "radau5"])
def test_a_slide_near_zero_is_closed_where_no_row_contains_an_angle(method):
    """A ring on an arm that swings, held 0.5 mm from the pivot by a law whose terms are 0.2 m: a
    length follows from the masses, and with it the rounding of the gap."""
    frame, arm, ring = (RigidBody(name, mass=1) for name in ("frame", "arm", "ring"))
    for body in (arm, ring):
        body.central_inertia = inertia(body.frame, 0.4, 0.3, 0.5)
    swing = PinJoint("swing", frame, arm, child_point=-arm.y, joint_axis=frame.z)
    slide = PrismaticJoint("slide", arm, ring, joint_axis=arm.x)
    law = slide.coordinates[0] - Rational(747, 1000) * Rational(28, 100) - Symbol("d")
    model = mechc.compile(
        mechc.from_joints(
            "held ring", [swing, slide], gravity=-9.81 * frame.y,
            configuration_constraints=[mechc.Constraint("law", law, "m")],
            parameters={"d": -0.20966},
        )
    )  # fmt: skip
    sol = model.simulate(1.5, [0.98, -0.0005, -1.0, 0.0], method=method)
    assert sol.status.ok
    assert np.abs(sol["q_slide"] + 0.0005).max() < 1e-16
