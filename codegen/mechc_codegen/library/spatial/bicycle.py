"""The bicycle of Whipple: two wheels that roll without slip, a frame with its rider, a fork.

Geometry and values after J.P. Meijaard, J.M. Papadopoulos, A. Ruina, A.L. Schwab: Linearized
dynamics equations for the balance and steer of a bicycle, Proc. R. Soc. A 463 (2007), table 1.
Axes: x forward, y to the right, z down.  The wheels touch the plane z = 0; the rear wheel does by
the choice of coordinates, the front wheel by a constraint.  Neither slips, forwards or sideways:
one holonomic and four nonholonomic constraints on eight coordinates and speeds.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from sympy import Expr, Symbol, sqrt, symbols
from sympy import cos as cosine
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

from mechc_codegen.description.mechanism import Constraint, Drawing, Load, Mechanism, Parameter
from mechc_codegen.description.solid import Solid
from mechc_codegen.library.parts import (
    coordinates,
    fixed_point,
    locate,
    parameter,
    speeds,
    turn_frame,
    weight,
)

# Where the rear wheel touches the ground, yaw, roll, pitch of the frame (when upright the tilt of
# the steer axis), angle of the rear wheel, steer angle, angle of the front wheel; and their rates.
NAMES = ("x", "y", "yaw", "roll", "pitch", "rear", "steer", "front")
INDEPENDENT = ("roll", "rear", "steer")
ANGLES = ("yaw", "roll", "pitch of the frame", "rear wheel", "steer", "front wheel")
q = dict(zip(NAMES, dynamicsymbols(",".join(NAMES)), strict=True))
u = dict(zip(NAMES, dynamicsymbols(",".join(f"{name}_rate" for name in NAMES)), strict=True))

# The steer axis: its distance from the rear wheel's centre and from the front wheel's, and the
# distance along it between the two.
behind, ahead, along = symbols("behind ahead along")
r_rear, r_front, g = symbols("r_rear r_front g")
lean_torque, steer_torque = symbols("lean_torque steer_torque")


class BicycleParts(NamedTuple):
    """The parts that both formulations of the bicycle share."""

    frame: ReferenceFrame
    origin: Point
    points: tuple[Point, ...]
    bodies: list[RigidBody]
    loads: list[Load]
    height: Expr  # of the front wheel's lowest point, downwards
    slip: list[Expr]  # of the rear wheel: forwards, sideways
    slip_ahead: list[Expr]  # of the front wheel: forwards, sideways, downwards
    wheels: tuple[Solid, ...]


def whipple_bicycle() -> Mechanism:
    """The bicycle of the library, whose parameters are by default those of table 1.

    It starts upright at 4.8 m/s with a roll rate, as from a push.  Between 4.3 m/s (weave) and
    6.0 m/s (capsize) the bicycle is stable: it steers into the fall and returns upright.
    ``lean_torque`` and ``steer_torque`` are zero.
    """
    made = bicycle_parts()
    return Mechanism(
        name="bicycle",
        title="Whipple's bicycle",
        frame=made.frame,
        origin=made.origin,
        coordinates=(
            *coordinates([q["x"], q["y"]], "m", *[f"{x} of the rear contact" for x in "xy"]),
            *coordinates([q[name] for name in NAMES[2:]], "rad", *ANGLES),
        ),
        speeds=(
            *speeds([u["x"], u["y"]], "m/s", *[f"rate of {x}" for x in "xy"]),
            *speeds([u[name] for name in NAMES[2:]], "rad/s", *[f"rate of: {a}" for a in ANGLES]),
        ),
        kinematics=tuple(u.values()),
        parameters=tuple(_parameter(name, value) for name, value in values().items()),
        bodies=tuple(made.bodies),
        loads=tuple(made.loads),
        configuration_constraints=(Constraint("front wheel on the ground", made.height, "m"),),
        motion_constraints=(
            *_without_slip("rear", made.slip),
            *_without_slip("front", made.slip_ahead[:2]),
        ),
        points=made.points,
        drawing=Drawing(
            links=(("bicycle", ("rear hub", "head", "front hub")),),
            traced=("rear contact", "front hub"),
            view=("x", "-y"),  # from above
            solids=made.wheels,
        ),
        start={name: 0.0 for name in NAMES if name != "pitch"}
        | {"rear_rate": -SPEED / R_REAR, "roll_rate": PUSH, "steer_rate": 0.0},
        preference=cosine(q["pitch"]),  # the frame is not upside down
    )


def _without_slip(which: str, slip: list[Expr]) -> list[Constraint]:
    ways = ("forwards", "sideways")
    return [
        Constraint(f"{which} wheel, no slip {way}", rate, "m/s")
        for way, rate in zip(ways, slip, strict=True)
    ]


def bicycle() -> KanesMethod:
    """Kane's method with its equations formed; roll, rear wheel and steer are independent.

    The parameters ``lean_torque`` (on the frame, about the line of the rear wheel) and
    ``steer_torque`` (on the fork, from the frame) are for measuring the mass matrix; the
    potential energy is that of the weights alone.
    """
    made = bicycle_parts()
    method = KanesMethod(
        made.frame,
        q_ind=[q[name] for name in NAMES if name != "pitch"],
        q_dependent=[q["pitch"]],
        configuration_constraints=[made.height],
        u_ind=[u[name] for name in INDEPENDENT],
        u_dependent=[u[name] for name in NAMES if name not in INDEPENDENT],
        velocity_constraints=[*made.slip, *made.slip_ahead],
        kd_eqs=[q[name].diff() - u[name] for name in NAMES],
        constraint_solver="CRAMER",
    )
    method.kanes_equations(made.bodies, made.loads)
    return method


def bicycle_parts() -> BicycleParts:
    """Frames, points, bodies and loads; wheel contacts with the ground, and their slip."""
    N, yaw, leaning, frame, fork, rear, front = _frames()
    origin = fixed_point("O", N)
    touch = origin.locatenew("rear contact", q["x"] * N.x + q["y"] * N.y)
    touch.set_vel(N, u["x"] * N.x + u["y"] * N.y)
    hub = locate("rear hub", touch, -r_rear * leaning.z, leaning, N)
    head = locate("head", hub, behind * frame.x, frame, N)
    nose = locate("front hub", head, along * frame.z + ahead * fork.x, fork, N)
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
    return BicycleParts(
        N, origin, (touch, hub, head, nose), bodies, loads,
        height=(nose.pos_from(touch) + r_front * down).dot(N.z),
        slip=[slip.dot(axis) for axis in (yaw.x, yaw.y)],
        slip_ahead=[slip_ahead.dot(axis) for axis in (yaw.x, yaw.y, yaw.z)],
        wheels=(
            Solid.wheel("rear wheel", hub, rear, r_rear, "y"),
            Solid.wheel("front wheel", nose, front, r_front, "y"),
        ),
    )  # fmt: skip


def _frames() -> tuple[ReferenceFrame, ...]:
    """Frames: inertial, yaw, roll, rear frame, fork, rear wheel, front wheel; each from another."""
    frames = {"": ReferenceFrame("N")}
    turns = (
        *(("yaw", "", "z"), ("roll", "yaw", "x"), ("pitch", "roll", "y")),
        *(("steer", "pitch", "z"), ("rear", "pitch", "y"), ("front", "steer", "y")),
    )
    for name, before, axis in turns:
        start = frames[before]
        frames[name] = turn_frame(name, start, q[name], u[name], getattr(start, axis))
    return tuple(frames.values())


def _body(name: str, hub: Point, frame: ReferenceFrame, N: ReferenceFrame) -> RigidBody:
    """A part of the frame, symmetric about its plane, its mass centre seen from a hub."""
    x, z, mass, xx, yy, zz, xz = _symbols(name, "x z m I_xx I_yy I_zz I_xz")
    centre = locate(f"centre of {name}", hub, x * frame.x + z * frame.z, frame, N)
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
        found |= _with_suffix(name, m=mass, I_xx=xx, I_yy=yy)
    hubs = {"rear_frame": (0.0, -R_REAR), "front_frame": (WHEEL_BASE, -R_FRONT)}
    for name, (x, z, mass, xx, yy, zz, xz) in FRAMES.items():
        x, z = x - hubs[name][0], z - hubs[name][1]
        found |= _with_suffix(name, m=mass, x=x * c - z * s, z=x * s + z * c, I_yy=yy)
        found |= _with_suffix(
            name,
            I_xx=xx * c**2 - 2 * xz * s * c + zz * s**2,
            I_zz=xx * s**2 + 2 * xz * s * c + zz * c**2,
            I_xz=(xx - zz) * s * c + xz * (c**2 - s**2),
        )
    return found


def _with_suffix(name: str, **given: float) -> dict[str, float]:
    return {f"{key}_{name}": value for key, value in given.items()}


# -- names and units of the values -----------------------------------------------------------------

SPEED, PUSH = 4.8, 0.5  # m/s, rad/s of roll: the start
PARAMETERS = {
    "g": ("m/s^2", "acceleration of free fall, along z"),
    "r_rear": ("m", "radius of the rear wheel"),
    "r_front": ("m", "radius of the front wheel"),
    "lean_torque": ("N m", "torque on the frame, about the line of the rear wheel"),
    "steer_torque": ("N m", "torque on the fork, from the frame"),
    "behind": ("m", "distance of the rear hub from the steer axis"),
    "ahead": ("m", "distance of the front hub from the steer axis"),
    "along": ("m", "distance of the hubs along the steer axis"),
}
OF_BODIES = {
    "m": ("kg", "mass of the {}"),
    "x": ("m", "mass centre of the {}, from its hub across the steer axis"),
    "z": ("m", "mass centre of the {}, from its hub along the steer axis"),
    "I_xx": ("kg m^2", "moment of inertia of the {} about x"),
    "I_yy": ("kg m^2", "moment of inertia of the {} about y"),
    "I_zz": ("kg m^2", "moment of inertia of the {} about z"),
    "I_xz": ("kg m^2", "product of inertia of the {}"),
}
POSITIVE = ("r_rear", "r_front", "m", "I_xx", "I_yy", "I_zz")


def _parameter(name: str, value: float) -> Parameter:
    kind, body = name, ""
    if name not in PARAMETERS:
        body = next(b for b in (*WHEELS, *FRAMES) if name.endswith(f"_{b}"))
        kind = name.removesuffix(f"_{body}")
    unit, about = (PARAMETERS | OF_BODIES)[kind]
    about = about.format(body.replace("_", " "))
    return parameter(Symbol(name), value, unit, about, positive=kind in POSITIVE)
