"""Chrono's tests of joints in absolute coordinates: place, attitude and rows of each case."""

import numpy as np
from scipy.spatial.transform import Rotation

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
DOWN = np.array([0.0, 0.0, -9.80665])
ASIDE = np.array([1.0, 2.0, 3.0])


def _hanging(kind, turn, place=ZERO, moments=(0.04, 0.1, 0.1), arm=2 * X, **law):
    """One body, turned as the joint is, whose joint is at `place`."""
    body = Body(1.0, np.diag(moments), place + turn @ arm, turn)
    a, p, s = turn @ Z, place, -arm
    loads = []
    if kind == "pin":
        rows = pin(GROUND, p, a, 0, s, Z)
    elif kind == "ball":
        rows = ball(GROUND, p, 0, s)
    elif kind == "cross":
        rows = [*ball(GROUND, p, 0, s), across(GROUND, turn @ X, 0, Y)]
    else:
        rows = [along(GROUND, e, GROUND, p, 0, s) for e in (turn @ X, turn @ Y)]
        rows += [across(GROUND, e, 0, Z) for e in (turn @ X, turn @ Y)]
        if kind == "slide":
            rows.append(across(GROUND, turn @ X, 0, Y))
    if law:
        loads.append(_torsion(turn, **law))
    joints = {"joint": rows}
    return World([body], joints, loads, DOWN)


def _torsion(turn, k, c, n=0.0):
    """On the body; the angle stays below half a turn."""

    def torque(at):
        a, here = turn @ Z, at.R[0] @ X
        angle = np.arctan2(here @ (turn @ Y), here @ (turn @ X))
        return (-(k + n * abs(angle)) * angle - c * at.w[0] @ a) * a

    def load(at, t, wrench):
        push(wrench, 0, ZERO, torque=torque(at))

    load.torque = torque
    return load


def _driven(turn, v):
    plate = Body(1.0, AXES, ZERO, turn, v * turn @ Z)
    rows = [along(GROUND, turn @ e, GROUND, ZERO, 0, ZERO) for e in (X, Y)]
    rows += [across(GROUND, turn @ a, 0, b) for a, b in ((X, Y), (Y, Z), (Z, X))]
    drive = [along(GROUND, turn @ Z, GROUND, ZERO, 0, ZERO, v)]
    return World([plate], {"joint": rows, "drive": drive}, gravity=DOWN)


def _rod(place, turn):
    """The massless rod is a distance from a point and a line across the pin's axis."""
    body = Body(1.0, np.diag([0.1, 0.04, 0.1]), place + 2 * (X + Y))
    rows = [
        along(GROUND, turn @ Z, GROUND, place, 0, -2 * Y),
        apart(GROUND, place, 0, -2 * Y, 2.0),
    ]
    return World([body], {"ball": rows}, gravity=DOWN)


def _line(place, arm, start, turn=AXES, **law):
    body = Body(1.0, np.diag([0.04, 0.1, 0.1]), start, turn)
    if not law:
        return World([body], {"line": [apart(GROUND, place, 0, arm, 2.0)]}, gravity=DOWN)
    k, c, n, relaxed = law["k"], law["c"], law.get("n", 0.0), law.get("relaxed", 2.0)

    def pull(length, rate):
        stretch = length - relaxed
        return k * stretch + n * abs(stretch) * stretch + c * rate

    if relaxed:
        load = line_force(GROUND, place, 0, arm, pull)
    else:

        def load(at, t, wrench):
            push(wrench, 0, -k * at.r[0] - c * at.v[0])

    return World([body], loads=[load], gravity=DOWN)


def _spring_on_ground(world, at, t):
    """The springs' force on the ground: what they do not do to the body."""
    wrench = np.zeros((2, 6))
    world.loads[0](at, t, wrench)
    return -wrench[0, :3]


_flat, _slanted = turned(X, -np.pi / 2), turned(X, -np.pi / 4)
_UNIVERSAL = {"moments": (0.1, 0.1, 0.04), "arm": -2 * Z}
_ACROSS = {"place": ASIDE, "arm": 2 * X, "start": np.array([-1.0, 4.0, 3.0])}
_ON = {"place": ZERO, "arm": 2 * X, "start": 4 * Y, "turn": turned(Z, -np.pi / 2)}
_BENT = {"k": 50.0, "n": 10.0, "c": 5.0}
_SHORT = {"k": 10.0, "c": 0.5, "relaxed": 0.0}

WORLDS = {
    "Revolute_Case01": lambda: _hanging("pin", _flat),
    "Revolute_Case02": lambda: _hanging("pin", _slanted, ASIDE),
    "Spherical_Case01": lambda: _hanging("ball", AXES),
    "Spherical_Case02": lambda: _hanging("ball", _slanted, ASIDE),
    "Universal_Case01": lambda: _hanging("cross", turned(X, np.pi / 2), **_UNIVERSAL),
    "Universal_Case02": lambda: _hanging("cross", turned(Y, np.pi / 2), **_UNIVERSAL),
    "Universal_Case03": lambda: _hanging("cross", turned(X - Y, np.pi / 2), **_UNIVERSAL),
    "Cylindrical_Case01": lambda: _hanging("sleeve", AXES),
    "Cylindrical_Case02": lambda: _hanging("sleeve", _flat),
    "Cylindrical_Case03": lambda: _hanging("sleeve", _slanted, ASIDE),
    "Prismatic_Case01": lambda: _hanging("slide", AXES),
    "Prismatic_Case02": lambda: _hanging("slide", _slanted, ASIDE),
    "Prismatic_Case03": lambda: _hanging("slide", _flat, ASIDE),
    "Distance_Case01": lambda: _line(ZERO, ZERO, 2 * Y),
    "Distance_Case02": lambda: _line(**_ACROSS),
    "Distance_Case03": lambda: _line(**_ON),
    "RevSpherical_Case01": lambda: _rod(ZERO, AXES),
    "RevSpherical_Case02": lambda: _rod(ASIDE, _slanted),
    "RotSpring_Case01": lambda: _hanging("pin", _flat, k=200.0, c=10.0),
    "RotSpring_Case02": lambda: _hanging("pin", _flat, k=50.0, n=10.0, c=10.0),
    "TranSpring_Case01": lambda: _line(ZERO, ZERO, ZERO, **_SHORT),
    "TranSpring_Case02": lambda: _line(ZERO, ZERO, 2 * Y, k=100.0, c=5.0),
    "TranSpringCB_Case01": lambda: _line(ZERO, ZERO, ZERO, **_SHORT),
    "TranSpringCB_Case02": lambda: _line(ZERO, ZERO, 2 * Y, k=100.0, c=5.0),
    "TranSpringCB_Case03": lambda: _line(**_ACROSS, **_BENT),
    "TranSpringCB_Case04": lambda: _line(**_ON, **_BENT),
    "LinActuator_Case01": lambda: _driven(AXES, 1.0),
    "LinActuator_Case02": lambda: _driven(turned(Y, np.pi / 4), 0.5),
}
CASES_ASIDE = (
    *("Revolute_Case02", "Spherical_Case02", "Cylindrical_Case03"),
    *("Prismatic_Case02", "Prismatic_Case03", "Distance_Case02", "RevSpherical_Case02"),
)


def _loads_of_joint(world, at, t, place):
    """Force and torque on the ground, about the place of the joint there."""
    joint = next(iter(world.joints), None)
    if joint is None:
        return _spring_on_ground(world, at, t), ZERO
    force, torque = world.reaction(at, t, joint, 0, place)
    if world.loads:
        torque = torque + world.loads[0].torque(at)
    return -force, -torque


def converged(name, times):
    """Positions, quaternions and loads on the ground at the times, as ADAMS reports them."""
    world = WORLDS[name]()
    place = ASIDE if name in CASES_ASIDE else ZERO
    series = {}
    for t, at in zip(times, world.motion(times), strict=True):
        force, torque = _loads_of_joint(world, at, t, place)
        found = {"Pos": at.r[0], "Quat": Rotation.from_matrix(at.R[0]).as_quat()[[3, 0, 1, 2]]}
        if "drive" in world.joints:
            found |= {"RforceP": force, "RtorqueP": torque}
            found["RforceA"], found["RtorqueA"] = world.reaction(at, t, "drive", 0, at.r[0])
        elif name.startswith("RevSph"):
            eye = at.point(0, -2 * Y)[1]
            on_body = world.reaction(at, t, "ball", 0, eye)
            found |= {"Rforce_Body1": force, "Rtorque_Body1": torque}
            found |= {"Rforce_Body2": on_body[0], "Rtorque_Body2": on_body[1]}
        else:
            found |= {"Rforce": force, "Rtorque": torque}
        for what, values in found.items():
            series.setdefault(what, []).append(np.asarray(values).tolist())
    return series
