"""The car axis of the Test Set for IVP Solvers: a bar on two springs over a bumpy road.

The left wheel stays on the ground at O, the right one moves by (x_b(t), y_b(t)); the bar keeps
its length, and its left end stays perpendicular to the axle: both constraints are holonomic, the
second one depends on time.
"""

from __future__ import annotations

from sympy import sin, sqrt, symbols
from sympy.physics.mechanics import Particle, ReferenceFrame, dot, dynamicsymbols

from mechc_codegen.description.mechanism import Constraint, Drawing, Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, parameter, speeds, t, weight

ENDS = ("x of the left", "y of the left", "x of the right", "y of the right")


def car_axis() -> Mechanism:
    """A bar whose ends have mass and stand on springs; one wheel rests, the other follows the road.

    The numbers are those of the test set, which are scaled: not those of a car.
    """
    x_l, y_l, x_r, y_r = q = dynamicsymbols("x_l y_l x_r y_r")
    u = dynamicsymbols("vx_l vy_l vx_r vy_r")
    L, L0, radius, omega, m, c, g = symbols("L L_0 r omega m c g")
    frame = ReferenceFrame("r")
    origin = fixed_point("O", frame)

    # The right wheel rides over the road: y_b given, x_b by the axle's length.
    y_b = radius * sin(omega * t)
    wheel_place = sqrt(L**2 - y_b**2) * frame.x + y_b * frame.y
    wheel = origin.locatenew("wheel", wheel_place)
    wheel.set_vel(frame, wheel_place.dt(frame))

    # The bar's ends carry the mass; a spring stands below each.
    left = origin.locatenew("left", x_l * frame.x + y_l * frame.y)
    right = origin.locatenew("right", x_r * frame.x + y_r * frame.y)
    left.set_vel(frame, u[0] * frame.x + u[1] * frame.y)
    right.set_vel(frame, u[2] * frame.x + u[3] * frame.y)
    bodies = (Particle("left", left, m), Particle("right", right, m))
    loads = [weight(body, origin, g, frame.y) for body in bodies]
    for body, foot in zip(bodies, (origin, wheel), strict=True):
        arm = body.point.pos_from(foot)
        length = sqrt(dot(arm, arm))
        force = c * (L0 - length) / length * arm
        body.potential_energy += c * (length - L0) ** 2 / 2
        loads += [(body.point, force), (foot, -force)]

    bar = left.pos_from(right)
    return Mechanism(
        name="car_axis",
        title="Car axis on a bumpy road",
        frame=frame,
        origin=origin,
        coordinates=coordinates(q, "m", *[f"{what} end" for what in ENDS]),
        speeds=speeds(u, "m/s", *[f"{what} end, rate" for what in ENDS]),
        kinematics=tuple(u),
        parameters=(
            parameter(L, 1.0, "m", "length of the bar and of the axle", positive=True),
            parameter(L0, 0.5, "m", "rest length of the springs", positive=True),
            parameter(radius, 0.1, "m", "height of the bumps"),
            parameter(omega, 10.0, "rad/s", "frequency of the bumps"),
            parameter(m, 0.0005, "kg", "mass at each end", positive=True),  # M eps^2/2
            parameter(c, 1.0, "N/m", "stiffness of the springs", positive=True),
            parameter(g, 1.0, "m/s^2", "acceleration of free fall, along -y"),
        ),
        bodies=bodies,
        loads=tuple(loads),
        configuration_constraints=(
            Constraint(
                "left end across the axle",
                dot(left.pos_from(origin), wheel.pos_from(origin)),
                "m^2",
            ),
            Constraint("length of the bar", dot(bar, bar) - L**2, "m^2"),
        ),
        points=(origin, wheel, left, right),
        drawing=Drawing(
            links=(("car", ("O", "left", "right", "wheel")),),
            ground=("O",),
            traced=("left", "right", "wheel"),
        ),
        start={"y_l": 0.5, "y_r": 0.5, "vy_l": 0.0, "vy_r": 0.0},
        preference=x_r - x_l,  # the bar points the way the axle does
    )
