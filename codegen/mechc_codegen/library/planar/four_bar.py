"""The planar four-bar linkage: three moving links on two ground pivots, one closed loop.

The crank turns about O, the rocker about the ground pivot R, the coupler joins them.  Every
link has a frame, turned about z from the inertial frame by the link's angle, so the
three angles are absolute.
"""

from __future__ import annotations

from math import pi

from sympy import Expr, Symbol, cos, sin, symbols
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, dot, dynamicsymbols, inertia
from sympy.physics.vector import Vector

from mechc_codegen.description.drawing import Link
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.mechanism import (
    Constraint,
    Drawing,
    Load,
    Mechanism,
    Parameter,
    Quantity,
)
from mechc_codegen.library.parts import (
    coordinates,
    fixed_point,
    locate,
    parameter,
    speeds,
    turn_frame,
    weight,
)
from mechc_codegen.library.planar.four_bar_geometry import geometry_notes

LINKS = ("crank", "coupler", "rocker")
JOINTS = ("O", "p_1", "p_2", "p_3")


def four_bar(
    *,
    crank_torque: bool | Expr = False,
    crank_speed: bool | Expr = False,
    friction: bool = False,
    coupler_point: bool = False,
    placed: bool = False,
) -> Mechanism:
    """The four-bar linkage, with weight and options.

    Parameters
    ----------
    crank_torque
        A torque about z on the crank: ``True`` for a constant parameter ``T_0`` (N m), or an
        expression of time.
    crank_speed
        The crank's angular speed is prescribed: ``True`` for a constant parameter ``Omega_0``
        (rad/s), or an expression of time.
    friction
        Viscous friction in the four joints, with coefficients ``c_0`` ... ``c_3`` (N m s).
    coupler_point
        A point C fixed to the coupler at ``x_C`` along and ``y_C`` across it from p_1 (m);
        its path is traced.
    placed
        The ground pivot O lies at ``x_O``, ``y_O`` (m), and the ground line at the angle ``alpha``
        (rad) from the x axis; the angles of the links are from the x axis.
    """
    theta, omega = dynamicsymbols("theta_0:3"), dynamicsymbols("omega_0:3")
    l, m, I, g = symbols("l_0:4"), symbols("m_0:3"), symbols("I_0:3"), Symbol("g")
    parameters = _parameters(l, m, I, g)

    # One frame a link, turned about z; joints p_k+1 = p_k + l_k e_k.x from the origin on, and mass
    # centres in the links' middles.
    r = ReferenceFrame("r")
    e = [turn_frame(f"e_{k}", r, theta[k], omega[k], r.z) for k in range(3)]
    origin, along_ground = fixed_point("O", r), r.x
    p, bodies = [origin], list[RigidBody]()
    if placed:
        origin, p[0], along_ground = _placed_ground(r, parameters)
    for k in range(3):
        p.append(locate(f"p_{k + 1}", p[k], l[k] * e[k].x, e[k], r))
        centre = locate(f"g_{k}", p[k], l[k] / 2 * e[k].x, e[k], r)
        bodies.append(RigidBody(LINKS[k], centre, e[k], m[k], (inertia(e[k], 0, 0, I[k]), centre)))
    loads = [weight(body, origin, g, r.y) for body in bodies]
    points, traced, motion = [*p, *(body.masscenter for body in bodies)], ["p_1", "p_2"], []
    links: list[Link] = [(LINKS[k], (JOINTS[k], JOINTS[k + 1])) for k in range(3)]

    # Besides the weight, only the loads of options.
    if crank_torque is not False:
        torque = _constant_or_given(crank_torque, "T_0", "N m", "torque on the crank", parameters)
        loads.append((e[0], torque * r.z))
    if crank_speed is not False:
        speed = _constant_or_given(
            crank_speed, "Omega_0", "rad/s", "prescribed crank speed", parameters
        )
        motion.append(Constraint("prescribed crank speed", omega[0] - speed, "rad/s"))
    if friction:
        loads += _joint_friction(r, e, omega, parameters)
    if coupler_point:
        x, y = symbols("x_C y_C")
        parameters += [
            parameter(x, 1.0, "m", "coupler point, along the coupler from p_1"),
            parameter(y, 0.5, "m", "coupler point, across the coupler from p_1"),
        ]
        points.append(locate("C", p[1], x * e[1].x + y * e[1].y, e[1], r))
        traced = ["C"]
        links.append(("coupler point", ("p_1", "C", "p_2")))

    options = {  # those that have an effect
        "crank_torque": crank_torque is not False,
        "crank_speed": crank_speed is not False,
        "friction": friction,
        "coupler_point": coupler_point,
        "placed": placed,
    }

    return Mechanism(
        name="four_bar",
        title="Planar four-bar linkage",
        frame=r,
        origin=origin,
        coordinates=coordinates(
            theta, "rad", *[f"angle of the {link} from the ground line" for link in LINKS]
        ),
        speeds=speeds(omega, "rad/s", *[f"angular velocity of the {link}" for link in LINKS]),
        kinematics=tuple(omega),
        parameters=tuple(parameters),
        bodies=tuple(bodies),
        loads=tuple(loads),
        joints=_joints(
            p, p[0].locatenew("R", l[3] * along_ground), bodies, (r, *e), (theta, omega)
        ),
        motion_constraints=tuple(motion),
        points=tuple(points),
        frames=tuple(e),
        drawing=Drawing(links=tuple(links), ground=("O", "p_3"), traced=tuple(traced)),
        start={"theta_0": 85 * pi / 180} | ({} if motion else {"omega_0": 0.0}),
        preference=dot(e[2].x ^ e[1].x, r.z),  # elbow up: sin(theta_1 - theta_2) > 0
        notes=None if placed else geometry_notes,
        skipped=tuple(name for name, used in options.items() if not used),
    )


def _placed_ground(r: ReferenceFrame, parameters: list[Parameter]) -> tuple[Point, Point, Vector]:
    """The origin, the ground pivot O, and the direction of the ground line."""
    x, y, alpha = symbols("x_O y_O alpha")
    parameters += [
        parameter(x, 0.0, "m", "ground pivot O along x"),
        parameter(y, 0.0, "m", "ground pivot O along y"),
        parameter(alpha, 0.0, "rad", "angle of the ground line from the x axis"),
    ]
    origin = fixed_point("N", r)
    return origin, locate("O", origin, x * r.x + y * r.y, r, r), cos(alpha) * r.x + sin(alpha) * r.y


def _joints(
    p: list[Point], pivot: Point, bodies: list[RigidBody],
    frames: tuple[ReferenceFrame, ...], states: tuple[list[Expr], list[Expr]],
) -> tuple[Joint, ...]:  # fmt: skip
    """Pins from link to link; the last one closes the loop at the ground pivot R."""
    r, links, (theta, omega) = frames[0], (None, *bodies), states
    pins = [
        Joint(
            JOINTS[k], links[k], links[k + 1], p[k], p[k], frames[k], frames[k + 1],
            tuple(theta[max(k - 1, 0) : k + 1]), tuple(omega[max(k - 1, 0) : k + 1]),
        )
        for k in range(3)
    ]  # fmt: skip
    last = Cut(
        JOINTS[3], None, bodies[2], pivot, p[3], r, frames[3], (theta[2],), (omega[2],),
        axes=(r.x, r.y), labels=("closure along x", "closure along y"),
    )  # fmt: skip
    return (*pins, last)


def _parameters(
    l: tuple[Symbol, ...], m: tuple[Symbol, ...], I: tuple[Symbol, ...], g: Symbol
) -> list[Parameter]:
    """Defaults of the reference scene: 1, 2, 3, 4 m; 1, 2, 3 kg; thin uniform rods."""
    links = [*LINKS, "ground"]
    lengths = [
        parameter(l[k], k + 1.0, "m", f"length of the {links[k]}", positive=True) for k in range(4)
    ]
    masses = [
        parameter(m[k], k + 1.0, "kg", f"mass of the {LINKS[k]}", positive=True) for k in range(3)
    ]
    about = "moment of inertia of the {} about its mass centre (follows m l^2/12 unless set)"
    inertias = [
        parameter(I[k], m[k] * l[k] ** 2 / 12, "kg m^2", about.format(LINKS[k]), positive=True)
        for k in range(3)
    ]
    fall = parameter(g, 9.81, "m/s^2", "acceleration of free fall, along -y")
    return [*lengths, *masses, *inertias, fall]


def _constant_or_given(
    given: bool | Expr, name: str, unit: str, description: str, parameters: list[Parameter]
) -> Expr:
    if given is not True:
        return given
    parameters.append(parameter(Symbol(name), 0.0, unit, description))
    return parameters[-1].symbol


def _joint_friction(
    r: ReferenceFrame, e: list[ReferenceFrame], omega: list[Expr], parameters: list[Parameter]
) -> list[Load]:
    """Torque -c_k times the relative speed in joint k, and its reaction on the link before."""
    c = symbols("c_0:4")
    parameters += [
        Parameter(c[k], 0.0, Quantity("N m s", f"viscous friction at {JOINTS[k]}", 0, closed=True))
        for k in range(4)
    ]
    relative = [omega[0], omega[1] - omega[0], omega[2] - omega[1], -omega[2]]
    loads = [(e[k], -c[k] * relative[k] * r.z) for k in range(3)]
    reactions = [(e[k - 1], c[k] * relative[k] * r.z) for k in range(1, 4)]
    return loads + reactions
