"""Constraints that are written out, walked link by link: their derivatives, and their forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mechc_codegen.derive import derive_equations
from mechc_codegen.description.mechanism import Mechanism
from numpy.typing import NDArray
from sympy import Rational, Symbol, cos, sin
from sympy.physics.mechanics import (
    CylindricalJoint,
    PinJoint,
    PrismaticJoint,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

Array = NDArray[np.float64]
STEP = 1e-4  # of differences of fifth order
t, given = dynamicsymbols._t, dynamicsymbols("given")
a, b = Symbol("a"), Symbol("b")


@pytest.fixture(autouse=True)
def walked(monkeypatch):
    monkeypatch.setattr(derive_equations, "LEAST_TREE", 1)
    monkeypatch.setattr(derive_equations, "LEAST_WRITTEN", 1)


def machine(case: str, name: str = "") -> Mechanism:
    """Four bodies on two branches: pin, slide, ball and cylindrical joint, or also a cut."""
    base, *bodies = (RigidBody(name, mass=Rational(6, 5)) for name in ("base", *"vwxz"))
    for body in bodies:
        body.central_inertia = inertia(body.frame, 0.2, 0.25, 0.3, 0.01, -0.02, 0.03)
    v, w, x, z = bodies
    joints: list[Any] = [
        PinJoint("pin", base, v, child_point=v.x / 3, joint_axis=base.z + 2 * base.x),
        PrismaticJoint("slide", v, w, parent_point=a * v.x, joint_axis=v.y),
        mechc.BallJoint("ball", w, x, parent_point=w.z / 3, child_point=x.x / 4),
        CylindricalJoint("both", v, z, parent_point=v.z / 2, child_point=z.y / 5, joint_axis=v.x),
    ]
    q = {str(s.func): s for joint in joints for s in joint.coordinates}
    u = {str(s.func): s for joint in joints for s in joint.speeds}
    configuration = {
        "motors": [],
        "gear": [mechc.Constraint("gear", q["q_pin"] - b * q["q_slide"] + given, "m")],
        "curve": [
            mechc.Constraint("curve", sin(q["q_pin"]) + q["q1_both"] * q["q0_both"] - t**2, "m")
        ],
        "speeds": [],
        "loop": [mechc.Constraint("law", q["q_slide"] + q["q1_both"] - sin(t), "m")],
    }[case]
    turned = joints[2].speeds
    motion = {
        "speeds": [
            mechc.Constraint("one", u["u_pin"] - b * cos(q["q_slide"]) * turned[1] - t, "m/s"),
            mechc.Constraint("other", turned[0] + turned[2] - u["u1_both"] * (1 + t), "m/s"),
        ]
    }.get(case, [])
    motors = {
        "motors": [
            mechc.Motor("pin", angle=b * sin(3 * t) + given, gear=20, inertia=Rational(1, 50)),
            mechc.Motor("slide", speed=cos(2 * t)),
        ]
    }.get(case, [])
    if case == "loop":
        joints.append(mechc.Cut.rod("rod", w, z, b, parent_point=w.x))
    return mechc.from_joints(
        name or f"rows_{case}", joints, gravity=-9.8 * base.y, motors=motors,
        configuration_constraints=configuration, motion_constraints=motion,
        parameters={a: 0.7, b: 0.9},
    )  # fmt: skip


def compiled(case: str, name: str = "", outputs: Any = ("multipliers",)) -> Any:
    model = mechc.compile(machine(case, name), outputs=outputs)
    return model.with_inputs({"given": "0.3*cos(2*t)"}) if model.inputs else model


def slope(function: Any, y: Array, along: Array, passing: float = 0.0) -> Array:
    """The derivative of a function of state and time, by differences."""
    near, far = (
        function(y + k * STEP * along, 0.8 + k * STEP * passing)
        - function(y - k * STEP * along, 0.8 - k * STEP * passing)
        for k in (1, 2)
    )
    return np.asarray((8 * near - far) / (12 * STEP))


CASES = ["motors", "gear", "curve", "speeds", "loop"]


@pytest.mark.parametrize("case", CASES)
def test_rows_are_derivatives_of_the_constraints(case):
    """J and b of their rates, gamma of J u + b; M u' + J^T lambda = F, at a state off them."""
    model = compiled(case)
    assert model.system.data["walked"] > 0
    coordinates = len(model.coordinates)
    y = np.random.default_rng(4).uniform(-0.9, 0.9, coordinates + len(model.speeds))
    u = y[coordinates:]

    def value(name: str, y: Array, t: float) -> Array:
        return np.asarray(model.output(name, y, t=t))

    def rate(y: Array, t: float) -> Array:
        return value("velocity_constraints", y, t)

    rows, motion = value("constraint_jacobian", y, 0.8), model.rhs(0.8, y)
    holonomic = model.system.scene.holonomic
    if holonomic:
        moved = np.concatenate([motion[:coordinates], 0 * u])
        gap = slope(lambda y, t: value("constraints", y, t), y, moved, 1.0)
        np.testing.assert_allclose(rate(y, 0.8)[:holonomic], gap, atol=1e-10)
    for k, unit in enumerate(np.eye(len(u))):
        by_speed = slope(rate, y, np.concatenate([np.zeros(coordinates), unit]))
        np.testing.assert_allclose(rows[:, k], by_speed, atol=1e-10)
    size = max(1.0, np.abs(motion).max())
    np.testing.assert_allclose(slope(rate, y, motion, 1.0) / size, 0, atol=1e-8)
    forces = rows.T @ value("multipliers", y, 0.8)
    left = value("mass_matrix", y, 0.8) @ motion[coordinates:] + forces - value("forcing", y, 0.8)
    np.testing.assert_allclose(left / max(size, np.abs(forces).max()), 0, atol=1e-10)


@pytest.mark.parametrize("case", ["motors", pytest.param("speeds", marks=pytest.mark.slow)])
def test_derivatives_of_the_motion_are_those_of_its_rates(case):
    model = compiled(case, outputs=("sensitivities",))
    size = len(model.coordinates) + len(model.speeds)
    y = np.random.default_rng(6).uniform(-0.5, 0.5, size)
    found = model.state_jacobian(y, t=0.8)
    for k, unit in enumerate(np.eye(size)):
        wanted = slope(lambda y, t: model.rhs(t, y), y, unit)
        np.testing.assert_allclose(found[:, k], wanted, atol=1e-7 * np.abs(found).max())


@pytest.mark.slow(cases=1)
@pytest.mark.parametrize("case", CASES)
def test_they_are_those_of_expanded_equations(case, monkeypatch):
    outputs = ("energy", "multipliers")
    walked = compiled(case, outputs=outputs)
    monkeypatch.setattr(derive_equations, "LEAST_TREE", 99)
    monkeypatch.setattr(derive_equations, "LEAST_WRITTEN", 99)
    written = compiled(case, f"expanded_{case}", outputs)
    assert (walked.system.data["walked"] > 0, written.system.data["walked"]) == (True, 0)
    size = len(walked.coordinates) + len(walked.speeds)
    state = np.random.default_rng(2).uniform(-0.8, 0.8, size)
    for name in ("rates", "multipliers", "energy"):
        found, wanted = (m.output(name, state, t=0.6) for m in (walked, written))
        np.testing.assert_allclose(found, wanted, atol=1e-8 * max(1, np.abs(wanted).max()))


def chain(name: str, count: int, **more: Any) -> Any:
    """Pins in a row in space, with axes in turn along z and x."""
    base, *links = (RigidBody(f"link_{k}", mass=1) for k in range(count + 1))
    for link in links:
        link.central_inertia = inertia(link.frame, 0.1, 0.02, 0.1)
    joints = [
        PinJoint(f"j{k}", before, link, parent_point=before.y / 4, child_point=-link.y / 4,
                 joint_axis=before.z if k % 2 else before.x)
        for k, (before, link) in enumerate(zip([base, *links], links, strict=False))
    ]  # fmt: skip
    q = [joint.coordinates[0] for joint in joints]
    rows = more.pop("rows", lambda q: ())(q)
    return mechc.compile(
        mechc.from_joints(
            name, joints, gravity=-9.8 * base.y, configuration_constraints=rows, **more
        )
    )


def test_a_driven_chain_follows_its_laws_and_needs_the_torque_that_makes_them(monkeypatch):
    """A robot's arm with two joints driven by laws of time, and the same arm by their torques."""
    monkeypatch.undo()
    laws = [mechc.Motor("j1", angle=sin(2 * t), gear=30, inertia=1e-4), mechc.Motor("j4", speed=1)]
    driven = chain("driven", 7, motors=laws)
    assert driven.system.data["walked"] > 0
    start = dict.fromkeys(driven.coordinates, 0.0) | {"q_j4": 0.2}
    sol = driven.simulate(0.6, start, t_eval=np.linspace(0, 0.6, 121))
    np.testing.assert_allclose(sol["q_j1"], np.sin(2 * sol.t), atol=1e-12)
    np.testing.assert_allclose(sol["q_j4"], 0.2 + sol.t, atol=1e-8)
    torques = [
        mechc.Motor("j1", torque=dynamicsymbols("M_1"), gear=30, inertia=1e-4),
        mechc.Motor("j4", torque=dynamicsymbols("M_4")),
    ]
    free = chain("free", 7, motors=torques)
    recorded = {f"M_{k}": mechc.Signal(sol.t, sol[f"j{k}_torque"], kind="cubic") for k in (1, 4)}
    again = free.simulate(0.6, sol.y[0], inputs=recorded)
    np.testing.assert_allclose(again.y[-1], sol.y[-1], atol=1e-6)


def test_friction_rests_beside_rows_on_speeds_alone():
    """Such rows tell no change point, whoever computes the rates."""
    driven = chain("rubbing", 4, motors=[mechc.Motor("j1", speed=cos(t))])
    assert driven.system.data["walked"] > 0
    sol = driven.simulate(1.0, {"q_j2": 0.4}, events=mechc.DryFriction("u_j3", 2.0))
    assert sol.status.ok
    assert sol.segments[-1].contacts[0].startswith(("sticks", "slides"))


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_rows_of_any_size_close(size):
    """The rounding of a row's value grows with it."""

    def rows(q: Any) -> Any:
        law = size * (q[1] - 3 * q[3] + q[2] ** 2 + sin(7 * t) / 3)
        return (mechc.Constraint("law", law, "m"),)

    model = chain("scaled", 4, rows=rows)
    sol = model.simulate(0.3, dict.fromkeys(("q_j0", "q_j1", "q_j2"), 0.2))
    assert sol.status.ok
    assert np.abs(sol.output("constraints")).max() < 1e-14 * size


def test_a_row_acts_where_its_speed_has_no_dead_point():
    """A follower moves by (1 - cos q) / 5, not at all at q = 0, where its cam turns."""
    base, follower, cam, last = (RigidBody(name, mass=1) for name in ("base", "f", "cam", "last"))
    for body in (follower, cam, last):
        body.central_inertia = inertia(body.frame, 0.1, 0.2, 0.3)
    q, u = dynamicsymbols("q u")
    place = (1 - cos(q)) / 5 * base.x
    slide = mechc.Joint(
        "slide", None, follower, base.masscenter, follower.masscenter, base.frame, follower.frame
    )
    follower.frame.orient_axis(base.frame, base.z, 0)
    follower.masscenter.set_pos(base.masscenter, place)
    turn = PinJoint("turn", base, cam, coordinates=q, speeds=u, joint_axis=base.z)
    end = PinJoint("end", cam, last, parent_point=cam.x, joint_axis=cam.y)
    drive = mechc.Constraint("drive", u - 2 * cos(t) + end.speeds[0], "rad/s")
    model = mechc.compile(
        mechc.from_joints("cam", [slide, turn, end], ground=base, motion_constraints=[drive])
    )
    assert model.system.data["walked"] > 0
    rows = model.constraint_jacobian(np.zeros(4), t=0.0)
    np.testing.assert_allclose(rows, [[1, 1]], atol=1e-14)
