"""Bodies that hit what stands there, and the times of a bouncing ball."""

import numpy as np
from sympy import Symbol, cos, sin, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from benchmarks.problems.particle import on_a_line, particle

G = 9.81
TIP_GAP, TIP_SLIP = "y - l*sin(theta)", "v_x + l*sin(theta)*omega"


def points_on_a_line(name, count, force, **options):
    """Particles that move along a line, each under the force(q, u, m) on it."""
    q, u, m = dynamicsymbols(f"q_:{count}"), dynamicsymbols(f"u_:{count}"), Symbol("m")
    forces = [force(place, speed, m) for place, speed in zip(q, u, strict=True)]
    kane = on_a_line(q, u, forces, [m] * count)
    return mechc.compile(kane, name=name, defaults={"m": 1.0}, **options)


def impacts(restitution, count, height=1.0):
    """Times of the impacts of a ball that falls from rest."""
    fall = np.sqrt(2 * height / G)
    flights = 2 * fall * restitution ** np.arange(1, count)
    return fall + np.concatenate([[0.0], np.cumsum(flights)])


def block():
    """A particle of 2 kg at x along and y above a slope a."""
    x, y, v_x, v_y = dynamicsymbols("x y v_x v_y")
    m, g, a = symbols("m g a")
    kane = particle([x, y], [v_x, v_y], [-m * g * sin(a), -m * g * cos(a)])
    return mechc.compile(kane, name="block", defaults={"m": 2.0, "g": 9.81, "a": 0.3})


def rod():
    """A thin rod of the half length l, whose tip at -l along it touches a floor."""
    x, y, theta, v_x, v_y, omega = dynamicsymbols("x y theta v_x v_y omega")
    m, g, l = Symbol("m"), Symbol("g"), Symbol("l")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    turned = frame.orientnew("B", "Axis", [theta, frame.z])
    turned.set_ang_vel(frame, omega * frame.z)
    centre = origin.locatenew("C", x * frame.x + y * frame.y)
    centre.set_vel(frame, v_x * frame.x + v_y * frame.y)
    body = RigidBody("rod", centre, turned, m, (inertia(turned, 0, 0, m * l**2 / 3), centre))
    t = dynamicsymbols._t
    rates = [x.diff(t) - v_x, y.diff(t) - v_y, theta.diff(t) - omega]
    kane = KanesMethod(frame, [x, y, theta], [v_x, v_y, omega], kd_eqs=rates)
    kane.kanes_equations([body], [(centre, -m * g * frame.y)])
    return mechc.compile(kane, name="rod", defaults={"m": 1.0, "g": 9.81, "l": 1.0})


class FreeBody:
    """A body with the unit mass matrix, and contacts at its start whose rows are parameters."""

    def __init__(self, contacts):
        self.contacts, self.freedoms = contacts, 4 * contacts
        q, u = (dynamicsymbols(f"{name}_:{self.freedoms}") for name in "qu")
        self.normal, self.tangent = (
            symbols(f"{name}_:{contacts}(:{self.freedoms})") for name in ("normal", "tangent")
        )
        self.friction, self.restitution = (
            symbols(f"{name}_:{contacts}") for name in ("friction", "restitution")
        )
        parameters = (*self.normal, *self.tangent, *self.friction, *self.restitution)
        none = Symbol("none")  # the load is none: it names the parameters
        forces = [none * sum(parameters) * speed for speed in u]
        kane = on_a_line(q, u, forces, [1] * self.freedoms)
        self.model = mechc.compile(kane, name="free_body", defaults={"none": 0.0})

        def along(rows, k, values):
            row = rows[k * self.freedoms : (k + 1) * self.freedoms]
            return sum(a * b for a, b in zip(row, values, strict=True))

        self.gaps = [along(self.normal, k, q) for k in range(contacts)]
        self.slips = [along(self.tangent, k, u) for k in range(contacts)]

    def hit(self, normal, tangent, u, friction, restitution, law="newton"):
        """The change of the speeds u (n,) by the impact at all contacts, rows (contacts, n) and
        coefficients (contacts,) given, and the run."""
        n, none = len(u), np.zeros(self.freedoms - len(u))
        rows = [np.concatenate([row, none]) for row in (*normal, *tangent)]
        names = (*self.normal, *self.tangent, *self.friction, *self.restitution)
        values = np.concatenate([*rows, friction, restitution])
        stops = [
            mechc.Stop(self.gaps[k], self.restitution[k], friction=self.friction[k],
                       slip=self.slips[k], law=law)
            for k in range(self.contacts)
        ]  # fmt: skip
        start = np.concatenate([np.zeros(self.freedoms), u, none])
        sol = self.model.simulate(1e-9, start, dict(zip(names, values, strict=True)), events=stops)
        assert np.abs(sol.y[0, self.freedoms + n :]).max(initial=0.0) == 0.0
        return sol.y[0, self.freedoms : self.freedoms + n] - u, sol
