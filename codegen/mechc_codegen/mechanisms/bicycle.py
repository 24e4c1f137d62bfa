"""The bicycle of Whipple: two wheels that roll without slip, a frame with its rider, a fork.

Geometry and values after J.P. Meijaard, J.M. Papadopoulos, A. Ruina, A.L. Schwab: Linearized
dynamics equations for the balance and steer of a bicycle, Proc. R. Soc. A 463 (2007), table 1.
Axes: x forward, y to the right, z down.  The wheels touch the plane z = 0; the rear wheel does by
the choice of coordinates, the front wheel by a constraint.  Neither slips, forwards or sideways:
one holonomic and four nonholonomic constraints on eight coordinates and speeds.
"""

from __future__ import annotations

from math import cos, pi, sin

from sympy import Symbol, sqrt, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

from mechc_codegen.mechanisms.parts import fixed_point, located, weight

# Where the rear wheel touches the ground, yaw, roll, pitch of the frame (when upright the tilt of
# the steer axis), angle of the rear wheel, steer angle, angle of the front wheel; and their rates.
NAMES = ("x", "y", "yaw", "roll", "pitch", "rear", "steer", "front")
INDEPENDENT = ("roll", "rear", "steer")
q = dict(zip(NAMES, dynamicsymbols(",".join(NAMES)), strict=True))
u = dict(zip(NAMES, dynamicsymbols(",".join(f"{name}_rate" for name in NAMES)), strict=True))

# Of the steer axis: its distance from the rear wheel's centre and from the front wheel's, and the
# distance along it between the two.
behind, ahead, along = symbols("behind ahead along")
r_rear, r_front, g = symbols("r_rear r_front g")
lean_torque, steer_torque = symbols("lean_torque steer_torque")


def bicycle() -> KanesMethod:
    """Kane's method with its equations formed; roll, rear wheel and steer are independent.

    The parameters ``lean_torque`` (on the frame, about the line of the rear wheel) and
    ``steer_torque`` (on the fork, from the frame) are for measuring the mass matrix; the
    potential energy is that of the weights alone.
    """
    N, yaw, leaning, frame, fork, rear, front = _frames()
    touch = fixed_point("O", N).locatenew("rear contact", q["x"] * N.x + q["y"] * N.y)
    touch.set_vel(N, u["x"] * N.x + u["y"] * N.y)
    hub = located("rear hub", touch, -r_rear * leaning.z, leaning, N)
    head = located("head", hub, behind * frame.x, frame, N)
    nose = located("front hub", head, along * frame.z + ahead * fork.x, fork, N)
    down = N.z - N.z.dot(fork.y) * fork.y
    down /= sqrt(1 - N.z.dot(fork.y) ** 2)

    bodies = [
        _body("rear_frame", hub, frame, N),
        _body("front_frame", nose, fork, N),
        _wheel("rear_wheel", hub, rear, frame),
        _wheel("front_wheel", nose, front, fork),
    ]
    loads = [weight(body, touch, g, -N.z) for body in bodies]
    loads += [(frame, lean_torque * yaw.x - steer_torque * frame.z), (fork, steer_torque * frame.z)]
    slip = hub.vel(N) + rear.ang_vel_in(N).cross(r_rear * leaning.z)
    slip_ahead = nose.vel(N) + front.ang_vel_in(N).cross(r_front * down)
    method = KanesMethod(
        N,
        q_ind=[q[name] for name in NAMES if name != "pitch"],
        q_dependent=[q["pitch"]],
        configuration_constraints=[(nose.pos_from(touch) + r_front * down).dot(N.z)],
        u_ind=[u[name] for name in INDEPENDENT],
        u_dependent=[u[name] for name in NAMES if name not in INDEPENDENT],
        velocity_constraints=[
            *(slip.dot(axis) for axis in (yaw.x, yaw.y)),
            *(slip_ahead.dot(axis) for axis in (yaw.x, yaw.y, yaw.z)),
        ],
        kd_eqs=[q[name].diff() - u[name] for name in NAMES],
        constraint_solver="CRAMER",
    )
    method.kanes_equations(bodies, loads)
    return method


def _frames() -> tuple[ReferenceFrame, ...]:
    """Inertial, yaw, roll, rear frame, fork, rear wheel, front wheel, one turned from the other."""
    frames = {"": ReferenceFrame("N")}
    turns = (
        *(("yaw", "", "z"), ("roll", "yaw", "x"), ("pitch", "roll", "y")),
        *(("steer", "pitch", "z"), ("rear", "pitch", "y"), ("front", "steer", "y")),
    )
    for name, before, axis in turns:
        start = frames[before]
        frames[name] = start.orientnew(name, "Axis", (q[name], getattr(start, axis)))
        frames[name].set_ang_vel(start, u[name] * getattr(start, axis))
    return tuple(frames.values())


def _body(name: str, hub: Point, frame: ReferenceFrame, N: ReferenceFrame) -> RigidBody:
    """A part of the frame, symmetric about its plane, its mass centre seen from a hub."""
    x, z, mass, xx, yy, zz, xz = _symbols(name, "x z m I_xx I_yy I_zz I_xz")
    centre = located(f"centre of {name}", hub, x * frame.x + z * frame.z, frame, N)
    return RigidBody(name, centre, frame, mass, (inertia(frame, xx, yy, zz, 0, 0, xz), centre))


def _wheel(name: str, hub: Point, wheel: ReferenceFrame, holder: ReferenceFrame) -> RigidBody:
    """A body of revolution: its inertia is that in the frame that holds it."""
    mass, xx, yy = _symbols(name, "m I_xx I_yy")
    return RigidBody(name, hub, wheel, mass, (inertia(holder, xx, yy, xx), hub))


def _symbols(name: str, wanted: str) -> tuple[Symbol, ...]:
    return tuple(Symbol(f"{each}_{name}") for each in wanted.split())


# -- the values of table 1, which refer to x forward and z down with the bicycle upright -----------

TILT = pi / 10
WHEEL_BASE, TRAIL, R_REAR, R_FRONT, G = 1.02, 0.08, 0.3, 0.35, 9.81
WHEELS = {"rear_wheel": (2.0, 0.0603, 0.12), "front_wheel": (3.0, 0.1405, 0.28)}
# x and z of the mass centre, mass, moments xx, yy, zz, xz
FRAMES = {
    "rear_frame": (0.3, -0.9, 85.0, 9.2, 11.0, 2.8, 2.4),
    "front_frame": (0.9, -0.7, 4.0, 0.05892, 0.06, 0.00708, -0.00756),
}


def values() -> dict[str, float]:
    """Parameters of :func:`bicycle`: what the table says, along and across the steer axis."""
    c, s = cos(TILT), sin(TILT)
    found = {"g": G, "r_rear": R_REAR, "r_front": R_FRONT, "lean_torque": 0.0, "steer_torque": 0.0}
    found["behind"] = c * (WHEEL_BASE + TRAIL) - R_REAR * s
    found["ahead"] = R_FRONT * s - c * TRAIL
    found["along"] = (R_REAR - R_FRONT + s * (found["behind"] + found["ahead"])) / c
    for name, (mass, xx, yy) in WHEELS.items():
        found |= _named(name, m=mass, I_xx=xx, I_yy=yy)
    hubs = {"rear_frame": (0.0, -R_REAR), "front_frame": (WHEEL_BASE, -R_FRONT)}
    for name, (x, z, mass, xx, yy, zz, xz) in FRAMES.items():
        x, z = x - hubs[name][0], z - hubs[name][1]
        found |= _named(name, m=mass, x=x * c - z * s, z=x * s + z * c, I_yy=yy)
        found |= _named(
            name,
            I_xx=xx * c**2 - 2 * xz * s * c + zz * s**2,
            I_zz=xx * s**2 + 2 * xz * s * c + zz * c**2,
            I_xz=(xx - zz) * s * c + xz * (c**2 - s**2),
        )
    return found


def _named(name: str, **given: float) -> dict[str, float]:
    return {f"{key}_{name}": value for key, value in given.items()}
