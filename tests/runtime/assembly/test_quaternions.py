"""A platform that turns by a quaternion, whose length is no freedom, about a ball."""

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation
from sympy.physics.mechanics import RigidBody, inertia

import mechc
from mechc.assembly.initial_values import filled_start
from tests.support.differences import extrapolated
from tests.support.linkages.loops import platform_on_a_ball


@pytest.fixture(scope="module")
def platform():
    return mechc.compile(platform_on_a_ball(), outputs=())


def gaps(x, a, rod):
    """Of the three rods, of a vector of rotation."""
    turn = Rotation.from_rotvec(x).as_matrix()
    moved = [1.0 - 0.9 * np.sin(a), 0.9 * np.cos(a), 0.0]
    ends = turn[:, 0] - moved, turn[:, 1] - [0, 0, 1], turn[:, 2] - [1, 1, 0]
    return np.linalg.norm(ends, axis=1) - [rod, 1.3, 1.6]


def attitude(model, q):
    components = [model.coordinates.index(f"q{k}_ball") for k in (1, 2, 3, 0)]
    return Rotation.from_quat(q[..., components]).as_matrix()


def lengths(model, q):
    return np.linalg.norm(
        q[..., [model.coordinates.index(f"q{k}_ball") for k in range(4)]], axis=-1
    )


@pytest.mark.slow
def test_one_coordinate_determines_the_others(platform):
    values = np.linspace(0.0, 0.6, 13)
    sweep = platform.sweep_positions("a", values)
    np.testing.assert_allclose(lengths(platform, sweep.q), 1.0, atol=1e-15)
    x = Rotation.from_matrix(attitude(platform, sweep.q[0])).as_rotvec()
    for a, q in zip(values, sweep.q, strict=True):
        x = root(gaps, x, (a, 0.7), tol=1e-13).x
        expected = Rotation.from_rotvec(x).as_matrix()
        np.testing.assert_allclose(attitude(platform, q), expected, atol=1e-12)
    along = extrapolated(lambda h: platform.sweep_positions("a", [0.3, 0.3 + h]).q[1], 1e-2)
    np.testing.assert_allclose(sweep.ratios[values == 0.3][0], along, atol=1e-8)


@pytest.mark.slow
def test_positions_by_the_length_of_a_rod(platform):
    sweep = platform.sweep_positions("a", [0.0, 0.3])
    found = sweep.sensitivity("r")[1]
    moved = extrapolated(
        lambda h: platform.sweep_positions("a", [0.0, 0.3], params={"r": 0.7 + h}).q[1],
        1e-2,
    )
    np.testing.assert_allclose(found, moved, atol=1e-8)


def test_a_sweep_ends_where_the_range_does(platform):
    sweep = platform.sweep_positions("a", np.linspace(0.0, np.pi, 40))
    ends = np.array(platform.limits("a"))
    assert np.abs(ends - sweep.end).min() < 1e-9
    reached = sweep.q[~np.isnan(sweep.q).any(axis=1)]
    x = Rotation.from_matrix(attitude(platform, reached[-1])).as_rotvec()
    inside, outside = (root(gaps, x, (sweep.end + d, 0.7), tol=1e-13) for d in (-1e-4, 1e-4))
    assert np.abs(inside.fun).max() < 1e-12
    assert np.abs(outside.fun).max() > 1e-6


def test_each_attitude_is_one_assembly(platform):
    found = platform.assemblies({"a": 0.0})
    turns = attitude(platform, found[:, : len(platform.coordinates)])
    starts = np.random.default_rng(3).normal(size=(80, 3))
    solved = (root(gaps, x, (0.0, 0.7), tol=1e-13) for x in starts)
    closed = [each.x for each in solved if np.abs(each.fun).max() < 1e-12]
    by_hand = [Rotation.from_rotvec(x).as_matrix() for x in closed]
    away = np.array([[np.abs(turn - each).max() for turn in turns] for each in by_hand])
    assert (away.min(axis=1) < 1e-9).all(), "it has all of them"
    assert (away.min(axis=0) < 1e-9).all(), "and no others"


@pytest.mark.slow
def test_each_attitude_is_one_equilibrium(platform):
    found = [e.y[: len(platform.coordinates)] for e in platform.equilibria()]
    np.testing.assert_allclose(lengths(platform, np.array(found)), 1.0, atol=1e-15)
    turns = attitude(platform, np.array(found)).reshape(-1, 9)
    told = np.hstack([np.array(found)[:, [platform.coordinates.index("a")]], turns])
    for i in range(len(told)):
        for j in range(i):
            assert np.abs(told[i] - told[j]).max() > 1e-3


def test_batches_assemble_likewise(platform):
    batch = platform.simulate_batch(1e-3, {"a": np.array([0.0, 0.2])})
    for member, a in zip(batch, [0.0, 0.2], strict=True):
        np.testing.assert_allclose(member.y[0], platform.assemble({"a": a}), atol=1e-12)


def test_a_start_with_a_whole_quaternion_is_kept_beside_what_is_given():
    ground, body = RigidBody("ground"), RigidBody("body", mass=2)
    body.central_inertia = inertia(body.frame, 1, 2, 3)
    names = "x_fly", "y_fly", "z_fly", "q0_fly", "q1_fly", "q2_fly", "q3_fly"
    start = dict(zip(names, (0.0, 0.1, 0.2, 0.6, 0.0, 0.8, 0.0), strict=True))
    flying = mechc.from_joints("flying", [mechc.FreeJoint("fly", ground, body)], start=start)
    model = mechc.compile(flying, outputs=())
    filled, _, _ = filled_start(model.system, {"x_fly": 5.0}, {}, {})
    assert filled == {**start, "x_fly": 5.0}
