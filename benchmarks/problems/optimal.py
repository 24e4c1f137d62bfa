"""Optimal motions with known costs.

double integrator   in least time over d with a force of at most F: 2 sqrt(m d / F)
brachistochrone     of a bead: a cycloid, angle sqrt(radius / g) (Johann Bernoulli 1696)
crane               its load over 4 m in 2.5 s with the least square of the force
five-bar            between two poses of a robot in least time, with bounded torques
thrown ball         at a target through one impact, with the least speed
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy as sm
from scipy.integrate import solve_bvp
from scipy.optimize import fsolve, minimize_scalar
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

G = 9.81
OUTPUTS = ("energy", "points", "sensitivities")


@dataclass(frozen=True)
class OptimalMotion:
    """A model, the arguments of ``optimise``, and the cost that is known, computed otherwise."""

    model: Any
    arguments: tuple[Any, ...]
    options: dict[str, Any]
    known: Callable[[], float]

    def optimise(self, **options: Any) -> Any:
        """The motion that is found."""
        return self.model.optimise(*self.arguments, **{**self.options, **options})


@cache
def double_integrator() -> OptimalMotion:
    x, v, force = dynamicsymbols("x v F")
    mass = sm.Symbol("m")
    cart = mechc.from_equations([x], [v], [[mass]], [force], name="cart", defaults={mass: 2.0})
    options = {"final": "duration", "end": {"x": 3.0, "v": 0.0}, "kind": "previous"}
    arguments = (1.0, 9.0), [0.0, 0.0], {"F": (-1.5, 1.5)}
    return OptimalMotion(
        mechc.compile(cart, outputs=("sensitivities",)), arguments, {**options, "intervals": 20},
        lambda: 2.0 * np.sqrt(2.0 * 3.0 / 1.5),
    )  # fmt: skip


RADIUS, ANGLE = 0.8, 2.4  # of the cycloid, up to which its rolling circle turns


@cache
def brachistochrone() -> OptimalMotion:
    """The bead runs down a wire whose slope at every time is found."""
    s, v, x, y, slope = dynamicsymbols("s v x y slope")
    bead = mechc.from_equations(
        [s], [v], None, [G * sm.sin(slope)], name="bead",
        states={x: v * sm.cos(slope), y: v * sm.sin(slope)},
    )  # fmt: skip
    end = {"x": RADIUS * (ANGLE - np.sin(ANGLE)), "y": RADIUS * (1.0 - np.cos(ANGLE))}
    options = {"final": "duration", "end": end, "inputs": {"slope": 0.5}, "intervals": 10}
    return OptimalMotion(
        mechc.compile(bead, outputs=("sensitivities",)),
        ((0.3, 4.0), [0.0, 0.0, 0.0, 0.0], {"slope": (-1.6, 1.6)}), options,
        lambda: ANGLE * np.sqrt(RADIUS / G),
    )  # fmt: skip


TROLLEY, LOAD, ROPE, WAY, SECONDS = 2.0, 3.0, 1.5, 4.0, 2.5


@cache
def crane() -> OptimalMotion:
    """A load on a rope under a trolley, from rest to rest."""
    x, angle, v, w, force = dynamicsymbols("x angle v w force")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    trolley = origin.locatenew("trolley", x * frame.x)
    trolley.set_vel(frame, v * frame.x)
    rope = frame.orientnew("rope", "Axis", (angle, frame.z))
    rope.set_ang_vel(frame, w * frame.z)
    load = trolley.locatenew("load", -ROPE * rope.y)
    load.v2pt_theory(trolley, frame, rope)
    t = dynamicsymbols._t
    method = KanesMethod(frame, [x, angle], [v, w], kd_eqs=[x.diff(t) - v, angle.diff(t) - w])
    bodies = [Particle("trolley", trolley, TROLLEY), Particle("load", load, LOAD)]
    method.kanes_equations(bodies, [(trolley, force * frame.x), (load, -LOAD * G * frame.y)])
    end = {"x": WAY, "angle": 0.0, "v": 0.0, "w": 0.0}
    return OptimalMotion(
        mechc.compile(method, name="crane", outputs=OUTPUTS),
        (SECONDS, [0.0, 0.0, 0.0, 0.0], {"force": None}),
        {"integral": "force**2", "end": end, "intervals": 20}, _least_force_of_crane,
    )  # fmt: skip


def _least_force_of_crane() -> float:
    """By Pontryagin's conditions, a boundary-value problem of eight equations, on a mesh of
    SciPy's, to some nine digits."""
    z, costates = sm.symbols("x a v w"), sm.symbols("l1:5")
    (_, a, v, w), force = z, sm.Symbol("F")
    mass = sm.Matrix([[TROLLEY + LOAD, LOAD * ROPE * sm.cos(a)],
                      [LOAD * ROPE * sm.cos(a), LOAD * ROPE**2]])  # fmt: skip
    push = sm.Matrix([force + LOAD * ROPE * w**2 * sm.sin(a), -LOAD * G * ROPE * sm.sin(a)])
    rates = [v, w, *mass.LUsolve(push)]
    hamiltonian = force**2 + sum(p * f for p, f in zip(costates, rates, strict=True))
    best = {force: sm.solve(hamiltonian.diff(force), force)[0]}
    every = [*rates, *(-hamiltonian.diff(one) for one in z), force**2]
    function = sm.lambdify([z, costates], [one.subs(best) for one in every], cse=True)
    last = np.array([WAY, 0.0, 0.0, 0.0])

    def equations(t: Any, y: Any) -> Any:
        return np.array([np.broadcast_to(row, t.shape) for row in function(y[:4], y[4:8])])

    t, guess = np.linspace(0.0, SECONDS, 200), np.zeros((9, 200))
    guess[0], guess[2] = WAY * t / SECONDS, WAY / SECONDS
    found = solve_bvp(
        equations, lambda one, two: np.array([*one[:4], one[8], *(two[:4] - last)]), t, guess,
        tol=1e-7, max_nodes=100_000,
    )  # fmt: skip
    if not found.success:
        raise ArithmeticError(found.message)
    return float(found.y[8, -1])


ARM, FOREARM, HALF, ROD = 0.2, 0.3, 0.06, 0.2  # m, m, m between the motors and their middle, kg
GUESS = {"q_left_elbow": -1.5, "q_right_elbow": 1.5}  # the elbows are outside
POSES = (-0.12, 0.30), (0.12, 0.38)


@cache
def five_bar() -> OptimalMotion:
    """Two motors on the ground hold a pen by four rods; of a level robot, without gravity."""
    ground, joints, loads, lower = RigidBody("ground"), [], [], []
    reach = sm.Symbol("l")  # of the arms
    for side, sign in (("left", -1), ("right", 1)):
        arm, fore = _rod(f"{side} arm", reach), _rod(f"{side} forearm", FOREARM)
        joints += [
            PinJoint(side, ground, arm, parent_point=sign * HALF * ground.x,
                     child_point=-reach / 2 * arm.x, joint_axis=ground.z),
            PinJoint(f"{side}_elbow", arm, fore, parent_point=reach / 2 * arm.x,
                     child_point=-FOREARM / 2 * fore.x, joint_axis=arm.z),
        ]  # fmt: skip
        loads.append((arm.frame, dynamicsymbols(f"T_{side}") * ground.z))
        lower.append(fore)
    pen = mechc.Cut.pin(
        "pen", *lower, parent_point=FOREARM / 2 * lower[0].x,
        child_point=FOREARM / 2 * lower[1].x, joint_axis=lower[0].z,
    )  # fmt: skip
    robot = mechc.from_joints("five_bar", [*joints, pen], loads=loads, parameters={"l": ARM})
    still = {"u_left": 0.0, "u_right": 0.0}
    torques = {"T_left": (-1.0, 1.0), "T_right": (-1.0, 1.0)}
    return OptimalMotion(
        mechc.compile(robot, outputs=OUTPUTS), ((0.05, 0.6), {**_pose(POSES[0]), **still}, torques),
        {"final": "duration", "end": {**_pose(POSES[1]), **still}, "intervals": 60,
         "kind": "previous", "guess": GUESS}, _least_time_of_five_bar,
    )  # fmt: skip


def _rod(name: str, length: Any) -> Any:
    body = RigidBody(name, mass=ROD)
    body.central_inertia = ROD * length**2 / 12 * inertia(body.frame, 0, 1, 1)
    return body


def _pose(pen: tuple[float, float]) -> dict[str, float]:
    """The angles of the motors for a place of the pen."""
    found = {}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        across, up = pen[0] - sign * HALF, pen[1]
        reach = np.hypot(across, up)
        bend = np.arccos((ARM**2 + reach**2 - FOREARM**2) / (2.0 * ARM * reach))
        found[f"q_{side}"] = float(np.arctan2(up, across) - sign * bend)
    return found


def _least_time_of_five_bar() -> float:
    """Both torques are at a bound at all times: the left one turns about once, the right one twice.
    The three times and the duration are the root of four equations at the end."""
    problem = five_bar()
    model, (_, y0, _) = problem.model, problem.arguments
    end = problem.options["end"]

    def misses(times: Any) -> list[float]:
        one, two, three, last = np.cumsum(np.abs(times))
        inputs = {
            "T_left": mechc.Signal([0.0, two, last], [-1.0, 1.0, 1.0], "previous"),
            "T_right": mechc.Signal([0.0, one, three, last], [-1.0, 1.0, -1.0, -1.0], "previous"),
        }
        rest = {name: y0[name] for name in model.coordinates if name in y0}
        start = model.assemble(rest, {"u_left": 0.0, "u_right": 0.0}, GUESS)
        sol = model.simulate(last, start, inputs=inputs, rtol=1e-11)
        return [float(sol[name][-1]) - value for name, value in end.items()]

    times, _, flag, told = fsolve(
        misses, [0.100, 0.002, 0.104, 0.029], xtol=1e-12, full_output=True
    )
    if flag != 1:
        raise ArithmeticError(told)
    return float(np.sum(times))


HIGH, FAR, UP, KEPT = 1.0, 6.0, 0.5, 0.8  # m, m, m; of the speed of the impact


@cache
def thrown_ball() -> OptimalMotion:
    x, y, v, w = dynamicsymbols("x y v w")
    units = {"x": "m", "y": "m", "v": "m/s", "w": "m/s"}
    ball = mechc.from_equations([x, y], [v, w], None, [0, -G], name="ball", units=units)
    options = {
        "final": "v[0]**2 + w[0]**2", "end": {"x": FAR, "y": UP}, "intervals": 4,
        "free": {"v": (0.0, 10.0), "w": (-10.0, 10.0)},
        "events": [mechc.Stop("y", restitution=KEPT)],
    }  # fmt: skip
    start = {"x": 0.0, "y": HIGH, "v": 3.0, "w": 3.0}
    return OptimalMotion(
        mechc.compile(ball, outputs=("sensitivities",)), ((0.3, 3.0), start), options,
        lambda: float(minimize_scalar(_square_of_speed, bounds=(-1.0, 7.0), method="bounded",
                                      options={"xatol": 1e-12}).fun),
    )  # fmt: skip


def _square_of_speed(w: float) -> float:
    """v² + w² of a ball thrown upwards by w that meets the target after an impact, falling."""
    down = np.sqrt(w * w + 2.0 * G * HIGH)
    up = KEPT * down
    time = (w + down) / G + (up + np.sqrt(up * up - 2.0 * G * UP)) / G
    return float((FAR / time) ** 2 + w * w)


PROBLEMS = {
    "double integrator": double_integrator, "brachistochrone": brachistochrone, "crane": crane,
    "five-bar": five_bar, "thrown ball": thrown_ball,
}  # fmt: skip
