"""Mechanisms described by joints move as those described by frames and points do."""

import numpy as np
import pytest
from mechc_codegen.derive import derive_equations as stage
from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.recursion import derive_tree
from sympy import Symbol, cos
from sympy.physics.mechanics import (
    CylindricalJoint,
    PinJoint,
    PlanarJoint,
    PrismaticJoint,
    RigidBody,
    SphericalJoint,
    System,
    WeldJoint,
    inertia,
)

import mechc
from tests.support.linkages.jointed import CHAIN, chain, four_bar, tree


def states_of(model, count=4, seed=1):
    return np.random.default_rng(seed).uniform(
        -1, 1, (count, len(model.coordinates + model.speeds))
    )


@pytest.mark.slow
def test_a_four_bar_of_pins_moves_as_the_shipped_one():
    model, shipped = mechc.compile(four_bar()), mechc.load("four_bar")
    start = shipped.assemble({"theta_0": 1.4835}, speeds={"omega_0": 0.4})
    relative = np.diff(start[:3], prepend=0.0), np.diff(start[3:], prepend=0.0)
    sol = model.simulate(2.0, np.concatenate(relative))
    theta = shipped.simulate(2.0, start).q[-1]
    assert np.allclose(np.cumsum(sol.q[-1]), theta, rtol=0, atol=1e-7)


@pytest.mark.slow
def test_a_four_bar_is_the_same_whichever_pin_is_cut():
    shipped = mechc.load("four_bar")
    y = shipped.assemble({"theta_0": 1.4835}, speeds={"omega_0": 0.4})
    theta, omega = y[:3], y[3:]
    alpha = shipped.rhs(0.0, y)[3:]
    to_pins = np.array([[1, 0, 0], [-1, 1, 0], [0, -1, 1], [0, 0, 1.0]])
    for cut in range(4):
        model = mechc.compile(four_bar(cut))
        kept = to_pins[[k for k in range(4) if k != cut]]
        state = np.concatenate([kept @ theta, kept @ omega])
        assert np.allclose(model.constraints(state), 0, atol=1e-14)
        assert np.allclose(model.rhs(0.0, state)[3:], kept @ alpha, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_a_tree_of_joints_is_walked_and_says_what_written_out_equations_say(monkeypatch):
    mechanism = tree(3, 3)
    assert len(mechanism.u) == 10
    walked = mechc.compile(mechanism, outputs=())
    monkeypatch.setattr(stage, "LEAST_TREE", 99)
    written = mechc.compile(mechanism, name="written_out", outputs=())  # not from the cache
    assert (walked.system.data["walked"] > 0, written.system.data["walked"]) == (True, 0)
    y = states_of(walked)
    assert np.allclose(walked.rhs(0.0, y), written.rhs(0.0, y), rtol=1e-10, atol=1e-10)


def test_velocities_set_otherwise_than_positions_change_are_not_walked():
    mechanism = chain(7)
    centre = mechanism.bodies[2].masscenter
    derive_tree(mechanism)  # as SymPy's joints set them they are
    centre.set_vel(mechanism.frame, mechanism.u[0] * mechanism.frame.x)
    with pytest.raises(NotATreeError, match="velocity of rod_2"):
        derive_tree(mechanism)


@pytest.mark.compiles  # larger than a tape holds
def test_joints_of_every_kind_are_taken_as_a_system_takes_them():
    ground, *bodies = (RigidBody(name) for name in ("ground", "a", "b", "c", "d", "e", "f"))
    for body in bodies:
        body.mass, body.central_inertia = 1, inertia(body.frame, 1, 2, 3)
    a, b, c, d, e, f = bodies
    joints = [
        PrismaticJoint("slide", ground, a, joint_axis=ground.y),
        CylindricalJoint("bush", a, b, parent_point=a.x, joint_axis=a.x + a.z),
        PlanarJoint("table", b, c, parent_point=b.y, child_interframe=c.y),
        SphericalJoint("ball", c, d, child_point=d.x + d.y, rot_order=213),
        WeldJoint("weld", d, e, parent_point=d.z, child_point=e.x),
        PinJoint("pin", a, f, parent_point=a.x, child_point=f.z, parent_interframe=a.y),
    ]
    gravity = Symbol("g") * (ground.x - 2 * ground.z)
    mechanism = mechc.from_joints("all", joints, gravity=gravity, parameters={"g": 3.0})
    model = mechc.compile(mechanism)
    assert stage.derive_equations(mechanism).tree is not None
    assert [u for u in model.units.values() if u][:9] == ["m", "rad", "m", "rad", "m", "m"] + [
        "rad"
    ] * 3

    system = System.from_newtonian(ground)
    system.add_joints(*joints)
    system.apply_uniform_gravity(gravity)
    other = mechc.compile(system, defaults={"g": 3.0})
    y = states_of(model)
    order = [model.coordinates.index(q) for q in other.coordinates]
    both = [*order, *(len(order) + model.speeds.index(u) for u in other.speeds)]
    mine, theirs = model.rhs(0.0, y)[:, both], other.rhs(0.0, y[:, both])
    assert np.allclose(mine, theirs, rtol=1e-10, atol=1e-10)
    assert np.allclose(model.energy(y), other.energy(y[:, both]), rtol=1e-12)


def spatial_pair(make):
    """Two bodies free in space by slides and a ball each, with a cut between them."""
    ground = RigidBody("ground")
    ends = []
    for name in ("left", "right"):
        at = ground
        for k, axis in enumerate((ground.x, ground.y, ground.z)):
            carriage = RigidBody(f"{name}_{k}")
            carriage.mass, carriage.central_inertia = 1, inertia(carriage.frame, 1, 1, 1)
            joint = PrismaticJoint(
                f"slide_{name}_{k}", at, carriage, joint_axis=axis.express(at.frame)
            )
            ends.append(joint)
            at = carriage
        body = RigidBody(name)
        body.mass, body.central_inertia = 1, inertia(body.frame, 1, 2, 3)
        ends.append(SphericalJoint(f"ball_{name}", at, body))
    left, right = ends[3].child, ends[7].child
    cut = make("cut", left, right, left.x, right.y - right.z)
    return mechc.from_joints("pair", [*ends, cut], ground=ground)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    ("kind", "held"),
    [
        ("pin", 5),
        ("spherical", 3),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (("weld", 6), ("prismatic", 5), ("cylindrical", 4), ("planar", 3))
        ),
    ],
)
def test_a_cut_in_space_leaves_the_motion_that_its_kind_leaves(kind, held):
    model = mechc.compile(spatial_pair(getattr(mechc.Cut, kind)), outputs=())
    assert len(model.constraint_names) == held
    y = closed(model)
    assert np.linalg.matrix_rank(model.constraint_jacobian(y), tol=1e-6) == held
    assert np.allclose(model.constraints(y), 0, atol=1e-12)
    rates = model.rhs(0.0, y)
    ahead = y + 1e-6 * rates  # what holds the joint holds its speeds, too
    assert np.allclose(model.velocity_constraints(ahead), 0, atol=1e-9)


def closed(model, seed=3):
    """A closed state with speeds that keep it, by Newton's method."""
    size = len(model.coordinates)
    y = np.random.default_rng(seed).uniform(-0.5, 0.5, 2 * size)
    for _ in range(50):
        y[:size] -= np.linalg.lstsq(model.constraint_jacobian(y), model.constraints(y), rcond=1e-9)[
            0
        ]
    jacobian = model.constraint_jacobian(y)
    y[size:] -= np.linalg.lstsq(jacobian, model.velocity_constraints(y), rcond=1e-9)[0]
    return y


def test_a_chain_takes_its_values_by_name():
    model = mechc.compile(chain(2), outputs=())
    assert dict(model.defaults) == CHAIN
    q, u = np.array([0.3, 0.4]), np.zeros(2)
    m, l, g = (CHAIN[k] for k in "mlg")
    weight = -m * g * l * np.array([1.5 * cos(0.3) + 0.5 * cos(0.7), 0.5 * cos(0.7)], dtype=float)
    assert np.allclose(model.forcing(np.concatenate([q, u])), weight, rtol=1e-14)
