"""Rows of cuts that are walked: derivatives of their constraints, forces that keep them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mechc_codegen.derive import derive_equations
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from numpy.typing import NDArray
from sympy import Rational, sqrt, symbols
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, inertia

import mechc

Array = NDArray[np.float64]
STEP = 1e-4  # of differences of fifth order
KINDS = ["pin", "spherical", "universal", "weld", "prismatic", "cylindrical", "planar", "rod"]


@pytest.fixture(autouse=True)
def walked(monkeypatch):
    monkeypatch.setattr(derive_equations, "LEAST_TREE", 1)
    monkeypatch.setattr(derive_equations, "LEAST_WRITTEN", 1)


def body(name: str) -> RigidBody:
    made = RigidBody(name, mass=Rational(6, 5))
    made.central_inertia = inertia(made.frame, 0.2, 0.25, 0.3, 0.01, -0.02, 0.03)
    return made


def machine(kind: str, *, free: bool, ground: bool, name: str = "") -> Mechanism:
    """Three bodies in a row, the last two by a pin and by a slide or a ball, with one cut."""
    base, a, b, c = (RigidBody("base"), *map(body, "abc"))
    first = (
        mechc.FreeJoint("free", base, a)
        if free
        else PinJoint("first", base, a, child_point=a.x / 3, joint_axis=base.z + 2 * base.x)
    )
    middle = PinJoint("middle", a, b, parent_point=a.x, child_point=b.y / 2, joint_axis=a.y)
    last = (
        PrismaticJoint("last", b, c, parent_point=b.z / 3, joint_axis=b.x)
        if ground
        else mechc.BallJoint("last", b, c, parent_point=b.z / 3, child_point=c.x / 4)
    )
    other = base if ground else a
    more: dict[str, Any] = {"length": Rational(4, 3)} if kind == "rod" else {}
    if kind in ("pin", "prismatic", "cylindrical"):
        more = {"joint_axis": other.x + other.y}
    cut = getattr(Cut, kind)(
        "cut", other, c, parent_point=other.x + other.z / 2, child_point=c.y / 3 - c.z, **more
    )
    label = name or f"{kind}_{free:d}{ground:d}"
    return mechc.from_joints(label, [first, middle, last, cut], gravity=-9.8 * base.y)


def slope(function: Any, at: Array, along: Array) -> Array:
    """The derivative of a function of the state, by differences."""
    near, far = (function(at + k * STEP * along) - function(at - k * STEP * along) for k in (1, 2))
    return (8 * near - far) / (12 * STEP)


@pytest.mark.parametrize(
    ("free", "ground"),
    [(False, True), pytest.param(True, False, marks=pytest.mark.slow(cases=2)),
     pytest.param(True, True, marks=pytest.mark.slow)],
)  # fmt: skip
@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_derivatives_of_the_constraints(kind, free, ground):
    """At states that need not be closed: J of the constraints, gamma of J u; M u' + J^T l = F."""
    model = mechc.compile(machine(kind, free=free, ground=ground), outputs=("multipliers",))
    assert model.system.data["walked"] > 0
    coordinates = len(model.coordinates)
    state = np.random.default_rng(5).uniform(-0.9, 0.9, coordinates + len(model.speeds))
    q, u = np.split(state, [coordinates])
    rows = model.constraint_jacobian(state)
    for k, unit in enumerate(np.eye(len(u))):
        rates = model.rhs(0.0, np.concatenate([q, unit]))
        along = np.concatenate([rates[:coordinates], 0 * u])
        np.testing.assert_allclose(rows[:, k], slope(model.constraints, state, along), atol=1e-10)
    gradient = model.system.constraint_gradient(state, np.zeros(0))
    for k, unit in enumerate(np.eye(coordinates)):
        expected = slope(model.constraints, state, np.concatenate([unit, 0 * u]))
        np.testing.assert_allclose(gradient[..., k].ravel(), expected, atol=1e-10)
    if np.linalg.matrix_rank(rows, tol=1e-6) < len(rows):
        return  # the rows do not determine the motion
    motion = model.rhs(0.0, state)
    size = max(1.0, np.abs(motion).max())

    def opening(y: Array) -> Array:
        return model.output("velocity_constraints", y)

    np.testing.assert_allclose(opening(state), rows @ u, atol=1e-12)
    np.testing.assert_allclose(slope(opening, state, motion) / size, 0, atol=1e-8)
    forces = rows.T @ model.output("multipliers", state)
    left = model.mass_matrix(state) @ motion[coordinates:] + forces - model.forcing(state)
    np.testing.assert_allclose(left / max(size, np.abs(forces).max()), 0, atol=1e-10)


@pytest.mark.slow(cases=1)
@pytest.mark.parametrize("kind", ["universal", "weld", "planar", "rod"])
def test_they_are_those_of_expanded_equations(kind, monkeypatch):
    outputs = ("energy", "reactions", "multipliers", "sensitivities")
    walked = mechc.compile(machine(kind, free=False, ground=True), outputs=outputs)
    monkeypatch.setattr(derive_equations, "LEAST_TREE", 99)
    monkeypatch.setattr(derive_equations, "LEAST_WRITTEN", 99)
    plain = machine(kind, free=False, ground=True, name=f"written_{kind}")
    written = mechc.compile(plain, outputs=outputs)
    assert (walked.system.data["walked"] > 0, written.system.data["walked"]) == (True, 0)
    assert walked.system.data.get("cut_directions") == written.system.data.get("cut_directions")
    size = len(walked.coordinates) + len(walked.speeds)
    states = np.random.default_rng(2).uniform(-0.8, 0.8, (3, size))
    for name in ("constraints", "rates", "multipliers", "reaction_forces", "reaction_torques",
                 "kinetic_energy", "potential_energy", "state_jacobian"):  # fmt: skip
        for state in states:
            found, wanted = walked.output(name, state), written.output(name, state)
            np.testing.assert_allclose(found, wanted, atol=1e-8 * max(1, np.abs(wanted).max()))


def test_a_pin_in_a_slot_of_a_moving_bar_has_the_rows_of_its_constraint(monkeypatch):
    """The axis of a cut of one's own turns with its bar."""
    monkeypatch.undo()
    base, *bars = (RigidBody("base"), *(body(f"b{k}") for k in range(7)))
    joints: list[Any] = [
        PinJoint(f"j{k}", before, bar, parent_point=before.x / 2, child_point=-bar.x / 2,
                 joint_axis=before.z)
        for k, (before, bar) in enumerate(zip([base, *bars], bars, strict=False))
    ]  # fmt: skip
    ends = (bars[0].masscenter.locatenew("s", 0.3 * bars[0].y), bars[6].masscenter)
    joints.append(Cut("slot", bars[0], bars[6], *ends, axes=(bars[0].y,)))
    model = mechc.compile(mechc.from_joints("slot", joints, gravity=-9.8 * base.y))
    assert model.system.data["walked"] == 7
    start = model.assemble(guess={f"q_j{k}": 0.9 * (-1) ** k for k in range(7)})
    rows = [slope(model.constraints, start, unit)[0] for unit in np.eye(14)[:7]]
    np.testing.assert_allclose(model.constraint_jacobian(start)[0], rows, atol=1e-10)
    run = model.simulate(1.0, start, rtol=1e-9)
    assert run.status.ok
    assert np.ptp(run.energy) < 1e-8


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_rows_of_which_most_are_redundant_hold_in_lanes(method):
    """A weld across a pin: what is left of its other rows is exactly zero in some lanes."""
    base, a, b = RigidBody("base"), body("a"), body("b")
    pin = (-0.87 * a.x - 0.76 * a.y, -0.01 * b.x - 0.47 * b.y)  # from both mass centres
    weld = (0.85 * b.x - 0.41 * b.y, pin[0] + 0.86 * a.x + 0.06 * a.y)
    joints = [
        PinJoint("one", base, a, child_point=-0.88 * a.x - 0.79 * a.y, joint_axis=base.z),
        PinJoint("two", a, b, parent_point=pin[0], child_point=pin[1], joint_axis=a.z),
        Cut.weld("held", b, a, parent_point=weld[0], child_point=weld[1]),
    ]
    model = mechc.compile(mechc.from_joints("held", joints, gravity=-9.8 * base.y))
    start = model.assemble(guess={"q_one": -0.0536, "q_two": 1e-17}, speeds={"u_one": 0.3})
    run = model.simulate(1.0, start, rtol=1e-9, method=method, max_steps=1000)
    assert run.status.ok
    assert np.ptp(run.energy) < 1e-9


def test_roots_of_differences_of_lengths_are_taken(monkeypatch):
    """Values drawn for parameters may make them imaginary."""
    monkeypatch.undo()
    base, *bars = (RigidBody("base"), *(body(f"b{k}") for k in range(7)))
    joints: list[Any] = [
        PinJoint(f"j{k}", before, bar, parent_point=before.x / 2, joint_axis=before.z)
        for k, (before, bar) in enumerate(zip([base, *bars], bars, strict=False))
    ]
    length, height = symbols("length height", positive=True)
    joints.append(Cut.rod("rod", base, bars[6], sqrt(length**2 - height**2), child_point=bars[6].x))
    values = {"length": 2.0, "height": 1.0}
    model = mechc.compile(mechc.from_joints("rooted", joints, parameters=values))
    assert model.system.data["walked"] == 7
    state = model.assemble(guess={f"q_j{k}": 0.5 * (-1) ** k for k in range(7)})
    assert np.abs(model.constraints(state)).max() < 1e-14


def test_rows_without_a_pivot_on_one_of_two_branches_are_solved_together():
    """Directions that slides do not change, beside a branch whose rows are well conditioned."""
    base, *parts = (RigidBody("base"), *(body(f"p{k}") for k in range(7)))
    one, two, root, arm, wagon, slide, tip = parts
    joints = [
        PinJoint("a", base, one, parent_point=base.y * 2, child_point=one.x / 2, joint_axis=base.z),
        PinJoint("b", one, two, parent_point=one.y / 2, child_point=two.x / 2, joint_axis=one.x),
        Cut.rod("r", base, two, 2, child_point=two.x + two.y),
        PinJoint("c", base, root, child_point=root.x / 3, joint_axis=base.x),
        PinJoint("d", root, arm, parent_point=root.y, child_point=arm.z / 3, joint_axis=root.y),
        PrismaticJoint("e", arm, wagon, joint_axis=arm.x),
        PrismaticJoint("f", wagon, slide, joint_axis=wagon.y),
        PinJoint("g", slide, tip, parent_point=slide.z / 4, child_point=tip.x / 5,
                 joint_axis=slide.z),
        Cut.planar("h", base, tip, child_point=tip.y),
    ]  # fmt: skip
    model = mechc.compile(mechc.from_joints("branches", joints, gravity=-9.8 * base.y))
    assert model.system.data["walked"] > 0
    states = np.random.default_rng(4).uniform(-0.7, 0.7, (4, 14))
    rows, rates = model.constraint_jacobian(states), model.output("rates", states)[:, 7:]
    assert np.isfinite(rates).all()
    for row, rate, mass, force in zip(
        rows, rates, model.mass_matrix(states), model.forcing(states), strict=True
    ):
        left = mass @ rate - force  # of the rows' forces alone
        by_rows = row.T @ np.linalg.lstsq(row.T, left, rcond=None)[0]
        np.testing.assert_allclose(left, by_rows, atol=1e-9 * max(1, np.abs(left).max()))


def test_a_row_that_never_changes_has_no_change_point():
    """A slide that is held, on a body that turns."""
    base, a, b = RigidBody("base"), body("a"), body("b")
    joints = [
        PinJoint("turns", base, a, child_point=a.x / 3, joint_axis=base.z),
        PrismaticJoint("slides", a, b, parent_point=a.y / 4, joint_axis=a.x),
        Cut.prismatic("held", base, b, parent_point=base.y / 4, joint_axis=base.x),
    ]
    model = mechc.compile(mechc.from_joints("held_slide", joints, gravity=-9.8 * base.y))
    assert model.system.data["walked"] > 0
    start = model.assemble(guess={"q_turns": 1e-17, "q_slides": 0.2}, speeds={"u_slides": 0.3})
    for method in ("auto", "dop853", "gauss8"):
        run = model.simulate(1.0, start, rtol=1e-9, method=method)
        assert run.status.ok, run.status
        assert np.ptp(run.energy) < 1e-9
