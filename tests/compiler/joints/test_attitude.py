"""Free and ball joints by quaternions: closed forms, angles, and what no pole costs."""

import numpy as np
import pytest
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, SphericalJoint, inertia

import mechc
from mechc.errors import ValueOutOfBoundsError

pytestmark = pytest.mark.slow

MOMENTS = (2.0, 3.0, 1.0)  # x is the middle axis, about which a body does not turn steadily
MASS, G = 1.5, 9.81
OFFSET = np.array([0.3, -0.2, 0.1])  # of the joint's point from the mass centre
TOP = {"m": 15.0, "d": 1.0, "spin": 0.46875, "across": 0.234375}


def bodies(moments, mass):
    ground, body = RigidBody("ground"), RigidBody("body", mass=mass)
    body.central_inertia = inertia(body.frame, *moments)
    return ground, body


@pytest.fixture(scope="module")
def free():
    ground, body = bodies(MOMENTS, MASS)
    x, y, z = OFFSET
    joint = mechc.FreeJoint("free", ground, body, child_point=x * body.x + y * body.y + z * body.z)
    mechanism = mechc.from_joints("free_body", [joint], gravity=-G * ground.z)
    return mechc.compile(mechanism, outputs=("energy", "momenta", "points", "reactions"))


@pytest.fixture(scope="module")
def top():
    """The heavy top of the library on a ball joint, its axis the body's y."""
    ground, body = bodies((TOP["across"], TOP["spin"], TOP["across"]), TOP["m"])
    ball = mechc.BallJoint("ball", ground, body, child_point=-TOP["d"] * body.y)
    mechanism = mechc.from_joints("ball_top", [ball], gravity=-G * ground.z)
    return mechc.compile(mechanism, outputs=("energy", "points", "reactions"))


def turned(q, vectors):
    """Vectors of the body's axes in those of the ground, by Rodrigues' formula."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, v = q[..., :1], q[..., 1:]
    return vectors + 2 * np.cross(v, np.cross(v, vectors) + w * vectors)


def test_a_free_body_names_its_coordinates_and_starts_unturned(free):
    assert free.coordinates == tuple(f"{x}_free" for x in ("x", "y", "z", "q0", "q1", "q2", "q3"))
    assert free.speeds == tuple(f"{k}{x}_free" for k in "vw" for x in "xyz")
    units = [free.quantities[n].unit for n in (*free.coordinates, *free.speeds)]
    assert units == ["m"] * 3 + ["1"] * 4 + ["m/s"] * 3 + ["rad/s"] * 3
    assert free.constraint_names == ()
    assert free.assemble({"x_free": 2.0}).tolist() == [2, 0, 0, 1, *[0] * 9]
    assert free.assemble({"q3_free": 1.0})[3:7].tolist() == [0, 0, 0, 1]


def test_a_body_tumbles_a_thousand_turns_without_a_pole(free):
    """Its mass centre is at rest, off the joint's point; no constraint keeps the quaternion."""
    w = np.array([2.0, 1e-3, 2e-3])
    start = free.assemble({}, dict(zip(free.speeds, [*np.cross(w, OFFSET), *w], strict=True)))
    end = 1000 * 2 * np.pi / 2.0
    for method in ("auto", "dop853"):
        sol = free.simulate(end, start, rtol=1e-12, method=method)
        assert sol.status.ok
        q, spin = sol.y[:, 3:7], sol.y[:, 10:]
        assert spin[:, 0].min() < -1.9 < 1.9 < spin[:, 0].max()  # it tumbles
        angular = turned(q, spin * MOMENTS)
        assert np.abs(angular - angular[0]).max() < 1e-10 * np.linalg.norm(angular[0])
        turning = 0.5 * (spin**2 * MOMENTS).sum(axis=1)
        assert np.ptp(turning) < 1e-10 * turning[0]
        assert np.abs((q**2).sum(axis=1) - 1).max() < 1e-10
        centre = sol.y[:, :3] - turned(q, np.broadcast_to(OFFSET, spin.shape))
        falling = -OFFSET - 0.5 * G * np.multiply.outer(sol.t**2, [0, 0, 1])
        assert np.abs(centre - falling).max() < 1e-10 * np.abs(falling).max()


def test_every_multiple_of_a_quaternion_is_the_same_attitude(free):
    y = np.random.default_rng(3).uniform(-1, 1, 13)
    other = y.copy()
    other[3:7] *= -7.3
    np.testing.assert_allclose(free.points(other), free.points(y), rtol=1e-13)
    np.testing.assert_allclose(free.rhs(0.0, other)[7:], free.rhs(0.0, y)[7:], rtol=1e-12)


@pytest.mark.parametrize("run", ["simulate", "simulate_batch"])
def test_a_quaternion_of_zeros_is_refused(free, run):
    nowhere = np.zeros(free.assemble().shape)
    with pytest.raises(ValueOutOfBoundsError, match="q0_free, q1_free, q2_free, q3_free"):
        getattr(free, run)(1.0, nowhere)


def test_nothing_holds_a_free_body(free):
    force, torque = free.reactions(np.random.default_rng(4).uniform(-1, 1, (5, 13)))
    assert np.abs(force).max() < 1e-13
    assert np.abs(torque).max() < 1e-13


def test_a_ball_joint_moves_as_sympys_by_angles_and_holds_what_newton_says(top):
    """The same body by three angles; and the joint's force from the mass centre's acceleration."""
    ground, body = bodies((TOP["across"], TOP["spin"], TOP["across"]), TOP["m"])
    joint = SphericalJoint("ball", ground, body, child_point=-TOP["d"] * body.y)
    angles = mechc.compile(
        mechc.from_joints("angle_top", [joint], gravity=-G * ground.z), outputs=("points",)
    )
    start = top.assemble({}, {"wy_ball": 150.0, "wz_ball": -4.61538})
    same = angles.assemble({}, {"u1_ball": 150.0, "u2_ball": -4.61538})
    ends = [m.simulate(1.0, y, rtol=1e-11).y for m, y in ((top, start), (angles, same))]
    places = [m.points(y[-1])[-1] for m, y in zip((top, angles), ends, strict=True)]
    np.testing.assert_allclose(*places, atol=1e-10)

    y = np.random.default_rng(5).uniform(-1, 1, 7)
    w, rate = y[4:], top.rhs(0.0, y)[4:]
    arm = np.array([0, TOP["d"], 0])
    centre = turned(y[:4], np.cross(rate, arm) + np.cross(w, np.cross(w, arm)))
    force, torque = top.reactions(y)
    np.testing.assert_allclose(force[0], TOP["m"] * (centre + np.array([0, 0, G])), rtol=1e-12)
    assert np.abs(torque).max() < 1e-12


def test_the_heavy_top_takes_ordinary_steps_at_the_tightest_tolerance(top):
    """By angles, which pass near their pole, dop853 takes twice as many."""
    by_angles = mechc.load("heavy_top")
    start = top.assemble({}, {"wy_ball": 150.0, "wz_ball": -4.61538})
    runs = [
        model.simulate(2.0, y, rtol=1e-12, method="dop853")
        for model, y in ((top, start), (by_angles, by_angles.assemble()))
    ]
    places = [m.points(s.y[-1])[-1] for m, s in zip((top, by_angles), runs, strict=True)]
    np.testing.assert_allclose(*places, atol=1e-12)
    steps = [sol.stats["steps"] for sol in runs]
    loose = top.simulate(2.0, start, rtol=1e-9, method="dop853").stats["steps"]
    assert steps[0] < 10 ** (3 / 8) * 1.2 * loose  # as order 8 says
    assert steps[0] < steps[1] < 3 * steps[0]  # rounding beside the pole shortens no step


def test_a_loop_with_a_ball_joint_closes_and_stays_closed():
    """A crank, a rod between two balls, a slider: from the crank's angle alone."""
    ground, crank = RigidBody("ground"), bodies((0.1, 0.1, 0.1), 1.0)[1]
    rod, slider = (RigidBody(name, mass=0.5) for name in ("rod", "slider"))
    rod.central_inertia = inertia(rod.frame, 0.01, 0.04, 0.04)
    main = PinJoint("main", ground, crank, joint_axis=ground.z)
    ball = mechc.BallJoint("ball", crank, rod, parent_point=0.2 * crank.x, child_point=-0.5 * rod.x)
    guide = PrismaticJoint(
        "guide", ground, slider, parent_point=0.1 * ground.z, joint_axis=ground.x
    )
    end = mechc.Cut.spherical("end", rod, slider, parent_point=0.5 * rod.x)
    mechanism = mechc.from_joints("rssr", [main, ball, guide, end], gravity=-G * ground.y)
    model = mechc.compile(mechanism, outputs=("energy", "points"))
    y = model.assemble({"q_main": 0.5}, {"u_main": 3.0})
    place = 0.2 * np.cos(0.5) + np.sqrt(1 - 0.1**2 - (0.2 * np.sin(0.5)) ** 2)
    assert y[model.coordinates.index("q_guide")] == pytest.approx(place, rel=1e-13)
    sol = model.simulate(5.0, y, rtol=1e-10)
    assert sol.status.ok
    assert sol.closure.max() < 1e-12
    assert np.ptp(sol.energy) < 1e-8 * np.abs(sol.energy).max()
    turned_by = sol["q_main"]
    place = 0.2 * np.cos(turned_by) + np.sqrt(1 - 0.1**2 - (0.2 * np.sin(turned_by)) ** 2)
    np.testing.assert_allclose(sol["q_guide"], place, rtol=1e-12)
