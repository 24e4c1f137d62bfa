"""Modelica's examples in absolute coordinates: the recorded signals, by their names.

What parts of steel weigh comes from `loops`; all else is written again.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from ..scenes.loops import G, box, cylinder
from . import minimal
from .absolute import (
    AXES,
    GROUND,
    ZERO,
    Body,
    World,
    across,
    along,
    apart,
    ball,
    line_force,
    pin,
    push,
    turned,
)

X, Y, Z = AXES
DOWN = -G * Y
SEAT, SEAT_TURN = np.array([0.2, -0.3, 0.2]), Rotation.from_euler("XYZ", (10, 55, 68), True)


def _series(world, times, signals):
    """Signals (functions of a pose) by name at the times."""
    poses = world.motion(times)
    return {name: [float(value(at)) for at in poses] for name, value in signals.items()}


def _member(line, diameter, place, **more):
    """A cylinder of steel along a line from a place."""
    line, place = np.asarray(line, float), np.asarray(place, float)
    length = np.linalg.norm(line)
    mass, about, across_it = cylinder(length, diameter)
    e = line / length
    tensor = across_it * AXES + (about - across_it) * np.outer(e, e)
    return Body(mass, tensor, place + line / 2, **more)


def _middle(i, p, j, s, k):
    """Body k is halfway between two points."""

    def row(e):
        def one(at, t):
            (arm_i, x, vx, ax), (arm_j, y, vy, ay) = at.point(i, p), at.point(j, s)
            jacobian = [
                (i, e, np.cross(arm_i, e)), (j, e, np.cross(arm_j, e)), (k, -2 * e, ZERO),
            ]  # fmt: skip
            gap, rate = x + y - 2 * at.r[k], vx + vy - 2 * at.v[k]
            return e @ gap, e @ rate, jacobian, e @ (ax + ay), 0.0

        return one

    return [row(e) for e in AXES]


def fourbar(times, rod=None):
    """The rod is a distance, a distance with a mass in its middle, or a body."""
    line, spin = np.array([-1.0, 0.3, 0.1]), 5.235987755982989 * X
    b1 = _member((0, 0.5, 0.1), 0.05, ZERO, spin=spin)
    b1.velocity = np.cross(spin, b1.place)
    b2 = _member((0, 0.2, 0), 0.05, X)
    bodies, end1, end2 = [b1, b2], -b1.place + [0, 0.5, 0.1], 0.1 * Y
    # the slide has b2's speed at the start: the distance of the ends does not change
    ends = np.array([0, 0.5, 0.1]), np.array([1.0, 0.2, 0])
    b2.velocity = line @ np.cross(spin, ends[0]) / line[0] * X
    joints = {
        "j1": pin(GROUND, ZERO, X, 0, -b1.place, X),
        "j2": [along(GROUND, e, GROUND, 0.1 * Y, 1, ZERO) for e in (Y, Z)]
        + [across(GROUND, a, 1, b) for a, b in ((X, Y), (Y, Z), (Z, X))],
    }
    if rod == "body":
        body = _member(line, 0.05, ends[1])
        turn = np.cross(line, np.cross(spin, ends[0]) - b2.velocity) / (line @ line)
        body.spin = turn + line * _spin_along(line, turn)
        body.velocity = b2.velocity + np.cross(body.spin, line / 2)
        bodies.append(body)
        joints["cross"] = [*ball(1, end2, 2, -line / 2), across(1, Y, 2, Z)]
        joints["ball"] = ball(0, end1, 2, line / 2)
    else:
        joints["rod"] = [apart(0, end1, 1, end2, np.linalg.norm(line))]
    if rod == "mass":
        half = (ends[0] + ends[1]) / 2
        bodies.append(Body(1.0, AXES, half, velocity=(np.cross(spin, ends[0]) + b2.velocity) / 2))
        joints["mass"] = _middle(0, end1, 1, end2, 2)
    world = World(bodies, joints, gravity=DOWN, extra=(0.0,), rates=lambda at, t: [at.w[0] @ X])
    return _series(world, times, {"j1.phi": lambda at: at.extra[0], "j1.w": lambda at: at.w[0] @ X})


def _spin_along(line, turn):
    """How fast the rod turns about itself, so that its z stays across the slide's y."""
    # (ω × z) · y = 0 with ω = turn + line s
    return -np.cross(turn, Z) @ Y / (np.cross(line, Z) @ Y)


def _planar(j, place):
    """Body j stays in the plane z = 0 of its place and does not turn out of it."""
    return [along(GROUND, Z, GROUND, place, j, ZERO), across(GROUND, Z, j, X),
            across(GROUND, Z, j, Y)]  # fmt: skip


def _hinge(i, p, j, s):
    return [along(GROUND, e, i, p, j, s) for e in (X, Y)]


def _bar(line, width, place):
    length = np.linalg.norm(line)
    mass, _, _, moment = box(length, width, width)
    return Body(mass, np.diag([1.0, 1.0, moment]), np.asarray(place, float) + line / 2)


def planar_fourbar(times):
    lines = [np.array(line) for line in ([0.4, 0, 0], [0.1, 1.1, 0], [0.65, 0.1, 0])]
    places = ZERO, lines[0], np.array([-0.15, 1, 0])
    bodies = [_bar(line, 0.05, place) for line, place in zip(lines, places, strict=True)]
    a, b, d = (line / 2 for line in lines)
    joints = {
        f"plane{k}": _planar(k, ZERO) for k in range(3)
    } | {
        "first": _hinge(GROUND, ZERO, 0, -a),
        "second": _hinge(0, a, 1, -b),
        "third": _hinge(GROUND, places[2], 2, -d),
        "fourth": _hinge(2, d, 1, b),
    }  # fmt: skip

    def damper(at, t, wrench):
        push(wrench, 0, ZERO, torque=-0.1 * at.w[0])

    world = World(bodies, joints, [damper], DOWN, extra=(0.0,), rates=lambda at, t: [at.w[0] @ Z])
    signals = {"revolute1.phi": lambda at: at.extra[0], "revolute1.w": lambda at: at.w[0] @ Z}
    return _series(world, times, signals)


def _frame_signals(arm, prefix, names=("frame_a.r_0", "v_0")):
    signals = {}
    for n in range(3):
        signals[f"{prefix[0]}{names[0]}[{n + 1}]"] = lambda at, n=n: at.point(0, arm)[1][n]
        signals[f"{prefix[1]}{names[1]}[{n + 1}]"] = lambda at, n=n: at.point(0, arm)[2][n]
    return signals


def _spins(name, body=0, axes=(1, 2, 3)):
    return {f"{name}.w_a[{n}]": lambda at, n=n: (at.R[body].T @ at.w[body])[n - 1] for n in axes}


def free_body(times):
    turn = Rotation.from_euler("XYZ", 3 * [0.174532925199433]).as_matrix()
    body = Body(1.0, AXES, np.array([0.2, -0.5, 0.1]) + turn @ (0.2 * X), turn)
    loads = [
        line_force(GROUND, place, 0, arm, lambda length, rate: 20 * length)
        for place, arm in ((ZERO, -0.2 * X), (0.8 * X, 0.2 * X))
    ]
    signals = _frame_signals(-0.2 * X, ("body.body.", "body.")) | _spins("body.body")
    return _series(World([body], loads=loads, gravity=DOWN), times, signals)


def spring_damper(times):
    spin = 0.03490658503988659 * Z
    body = Body(1.0, 0.1 * AXES, np.array([0.3, -0.4, 0]), spin=spin)
    body.velocity = np.cross(spin, -0.2 * Y)
    load = line_force(
        GROUND, 0.3 * X, 0, 0.2 * Y, lambda length, rate: 30 * (length - 0.1) + 2 * rate
    )
    signals = _frame_signals(0.2 * Y, ("body1.", "body1.")) | _spins("body1")
    return _series(World([body], loads=[load], gravity=DOWN), times, signals)


def constraint(times, kind, eye=0.2 * X):
    turn = SEAT_TURN.as_matrix()
    arm = -0.2 * X
    body = Body(1.0, AXES, SEAT - turn @ arm, turn)
    if kind == "slides":
        rows = [along(GROUND, turn @ Z, GROUND, SEAT, 0, arm)]
        rows += [across(GROUND, turn @ a, 0, b) for a, b in ((X, Y), (Y, Z), (Z, X))]
    else:
        rows = ball(GROUND, SEAT, 0, arm)
        if kind == "pin":
            rows += [across(GROUND, turn @ e, 0, Y) for e in (X, Z)]
        if kind == "cross":
            rows.append(across(GROUND, turn @ Z, 0, X))
    spring = line_force(GROUND, np.array([0.8, 0, 0.3]), 0, eye, lambda length, rate: 20 * length)
    world = World([body], {"seat": rows}, [spring], DOWN)
    signals = _spins("bodyOfConstraint.body")
    if kind == "slides":
        signals = _frame_signals(arm, 2 * ("bodyOfConstraint.",), ("r_0", "v_0"))
        for e, name in ((turn @ X, "x"), (turn @ Y, "y")):
            signals[f"jointPrismatic_{name}.s"] = lambda at, e=e: e @ (at.point(0, arm)[1] - SEAT)
            signals[f"jointPrismatic_{name}.v"] = lambda at, e=e: e @ at.v[0]
    return _series(world, times, signals)


def gyroscope(times):
    arm = _member((0.25, 0, 0), 0.05, ZERO)
    aslant = turned(Y, np.pi / 4)
    mass, about, across_it = cylinder(0.2, 0.1)
    rotor = Body(
        mass, np.diag([about, across_it, across_it]), 0.25 * X, aslant, spin=10 * aslant @ X
    )
    axis = aslant @ X
    joints = {
        "ball": ball(GROUND, ZERO, 0, -0.125 * X),
        "axle": pin(0, 0.125 * X, axis, 1, ZERO, X),
    }

    def turning(at):
        return (at.w[1] - at.w[0]) @ (at.R[0] @ axis)

    world = World(
        [arm, rotor], joints, gravity=DOWN, extra=(0.0,), rates=lambda at, t: [turning(at)]
    )
    signals = _spins("bodyCylinder2.body", 1) | _spins("bodyCylinder3.body", 0)
    signals |= {"revolute.phi": lambda at: at.extra[0], "revolute.w": turning}
    return _series(world, times, signals)


def double_pendulum(times):
    bodies = [_bar(0.5 * X, 0.06, 0.5 * k * X) for k in range(2)]
    joints = {f"plane{k}": _planar(k, ZERO) for k in range(2)}
    joints["first"] = _hinge(GROUND, ZERO, 0, -0.25 * X)
    joints["second"] = _hinge(0, 0.25 * X, 1, -0.25 * X)

    def damper(at, t, wrench):
        push(wrench, 0, ZERO, torque=-0.1 * at.w[0])

    def turning(at):
        return at.w[1] @ Z - at.w[0] @ Z

    world = World(
        bodies, joints, [damper], DOWN, (0.0, 0.0), lambda at, t: [at.w[0] @ Z, turning(at)]
    )
    signals = {"revolute1.phi": lambda at: at.extra[0], "revolute1.w": lambda at: at.w[0] @ Z}
    signals |= {"revolute2.phi": lambda at: at.extra[1], "revolute2.w": turning}
    return _series(world, times, signals)


def sprung_pendulum(times):
    """A body whose x points to the pin, which gives it the moment of the arm's turning."""
    body = Body(1.0, AXES, 0.5 * X)
    rows = [*_planar(0, ZERO), along(0, Y, GROUND, ZERO, 0, ZERO)]
    spring = line_force(GROUND, ZERO, 0, ZERO, lambda length, rate: 20 * (length - 0.2) + rate)
    world = World([body], {"arm": rows}, [spring], DOWN, (0.0,), lambda at, t: [at.w[0] @ Z])
    signals = {"revolute.phi": lambda at: at.extra[0], "revolute.w": lambda at: at.w[0] @ Z}
    signals |= {
        "prismatic.s": lambda at: (at.R[0] @ X) @ at.r[0],
        "prismatic.v": lambda at: (at.R[0] @ X) @ at.v[0],
    }
    return _series(world, times, signals)


def _two(times, spring):
    if spring:
        bodies, places = (("body3", "r_0"), ("body4", "r_0")), [(0, 0.8, 0), (0.3, 0.8, 0)]
        return minimal.orbits(times, bodies, places, [(0.6, 0, 0)] * 2, spring)
    bodies = ("body1", "frame_a.r_0"), ("body2", "frame_a.r_0")
    return minimal.orbits(
        times, bodies, [(0, 0.6, 0), (0.6, 0.6, 0)], [(1, 0, 0), (0.6, 0, 0)], 0.0
    )


def _driven_set(times):
    return minimal.wheel_set(
        times,
        lambda t: (-2 * np.sin(2 * np.pi * t), -2 * np.sin(2 * np.pi * t + 1.5707963267949)),
        lambda t: (0.0, 0.0),
    )


def _pulled_set(times):
    return minimal.wheel_set(times, lambda t: (0.0, 0.0), _ramp, (1.0, 2.0))


def _ramp(t):
    return 1 - np.clip(t - 1, 0, 1), 2 * np.clip(t - 1, 0, 1)


CONVERGED = {
    "Fourbar1": lambda times: fourbar(times, "body"),
    "Fourbar2": fourbar,
    "Fourbar_analytic": fourbar,
    "SphericalAndUniversal": fourbar,
    "UniversalSpherical": fourbar,
    "SphericalSpherical": lambda times: fourbar(times, "mass"),
    "PlanarFourbar": planar_fourbar,
    "PlanarLoops_analytic": minimal.filtered,
    "Engine1a": lambda times: minimal.engine_of_one(times, False),
    "Engine1b": lambda times: minimal.engine_of_one(times, True),
    "Engine1b_analytic": lambda times: minimal.engine_of_one(times, True),
    "EngineV6": lambda times: minimal.engine_of_six(times, False),
    "EngineV6_analytic": lambda times: minimal.engine_of_six(times, True),
    "RollingWheel": minimal.wheel,
    "RollingWheelSetDriving": _driven_set,
    "RollingWheelSetPulling": _pulled_set,
    "PointGravity": lambda times: _two(times, 0.0),
    "PointGravityWithPointMasses": lambda times: _two(times, 10.0),
    "FreeBody": free_body,
    "SpringDamperSystem": spring_damper,
    "RevoluteConstraint": lambda times: constraint(times, "pin"),
    "SphericalConstraint": lambda times: constraint(times, "ball"),
    "UniversalConstraint": lambda times: constraint(times, "cross", np.array([0.3, 0.15, 0.2])),
    "PrismaticConstraint": lambda times: constraint(times, "slides"),
    "GyroscopicEffects": gyroscope,
    "DoublePendulum": double_pendulum,
    "PendulumWithSpringDamper": sprung_pendulum,
    "LineForceWithTwoMasses": minimal.telescope,
}
