"""The problems as Pinocchio has them: a tree of joints, each with the bodies that it moves.

Angles are those of a link against the one that carries it, so mechc's coordinates, which are
mostly absolute, are a matrix times them.  A loop is cut and held by a point constraint; springs
act as joint torques, from the virtual work of their length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from _problem import Array, Problem
from mechc_codegen.description.mechanism import Mechanism
from peers import NotExpressibleError
from scipy.spatial.transform import Rotation

Values = Mapping[str, float]
Place = tuple[float, float, float]
O: Place = (0.0, 0.0, 0.0)
# Stiffness (1/s^2) and damping (1/s) of gaps, critical, as in its example of closed loops; without
# them errors are two or three times as large.
STABILISED = (10.0, 2 * 10.0**0.5)


@dataclass(frozen=True, eq=False)
class Tree:
    """A model, what closes its loops, and how its state is that of mechc.

    Attributes
    ----------
    model, loops
        ``pinocchio.Model`` and ``RigidConstraintModel`` of every cut joint.
    torque
        The joint torques of loads that are no gravity, of q and v.
    into, back
        From mechc's state [q, u] to [q, v] of the model, and back.
    """

    model: Any
    into: Callable[[Array], Array]
    back: Callable[[Array], Array]
    torque: Callable[[Array, Array], Array]
    loops: tuple[Any, ...] = ()


def tree_of(problem: Problem) -> Tree:
    """The model of a problem.

    Raises
    ------
    NotExpressibleError
        For mechanisms that have no model here, with the reason.
    """
    if problem.name in NOT_EXPRESSIBLE:
        raise NotExpressibleError(NOT_EXPRESSIBLE[problem.name])
    given = problem.mechanism()
    name = given.name if isinstance(given, Mechanism) else problem.name
    for start, build in BUILDERS.items():
        if name.startswith(start):
            return build(problem.values, len(problem.start) // 2)
    raise NotExpressibleError(f"no model of {name!r} is written for Pinocchio")


NOT_EXPRESSIBLE = {
    "bicycle": "its constraints hold points and frames together; wheels that roll are neither",
    "car_axis": "its constraints do not depend on time",
}


# -- what the models are made of -------------------------------------------------------------------


class Builder:
    """Joints and bodies one after the other; a joint is known by its number, the ground by 0."""

    def __init__(self, gravity: Place = O) -> None:
        import pinocchio

        self.pin = pinocchio
        self.model = pinocchio.Model()
        self.model.gravity.linear = np.array(gravity)
        self.loops: list[Any] = []

    def joint(self, kind: str, on: int, at: Place = O) -> int:
        """A joint of a kind such as "RZ" at a place of the body that carries it."""
        joint = getattr(self.pin, f"JointModel{kind}")()
        name = f"joint_{self.model.njoints}"
        return int(self.model.addJoint(on, joint, self._placed(at), name))

    def body(self, on: int, mass: float, centre: Place, moments: Place = O) -> None:
        """A body that a joint moves, its principal moments about the mass centre."""
        inertia = self.pin.Inertia(mass, np.array(centre), np.diag(moments))
        self.model.appendBodyToJoint(on, inertia, self.pin.SE3.Identity())

    def rod(self, on: int, mass: float, length: float) -> None:
        """A uniform thin rod along x."""
        about = mass * length**2 / 12
        self.body(on, mass, (length / 2, 0, 0), (0, about, about))

    def close(self, one: int, at: Place, other: int, there: Place) -> None:
        """Two points of two bodies stay together; what drifts apart is drawn back."""
        loop = self.pin.RigidConstraintModel(
            self.pin.ContactType.CONTACT_3D, self.model,
            one, self._placed(at), other, self._placed(there), self.pin.ReferenceFrame.LOCAL,
        )  # fmt: skip
        loop.setBaumgarteCorrectorParameters(self.pin.BaumgarteCorrectorParameters(*STABILISED))
        self.loops.append(loop)

    def linear(self, turns: Array, torque: Callable[[Array, Array], Array] | None = None) -> Tree:
        """The tree whose joint coordinates are ``turns`` times mechc's."""
        none, n = np.zeros(len(turns)), len(turns)
        back = np.linalg.inv(turns)
        return Tree(
            self.model,
            lambda y: np.concatenate([turns @ y[:n], turns @ y[n:]]),
            lambda x: np.concatenate([back @ x[:n], back @ x[n:]]),
            torque or (lambda q, v: none),
            tuple(self.loops),
        )

    def _placed(self, at: Place) -> Any:
        return self.pin.SE3(np.eye(3), np.array(at, float))


def differences(count: int) -> Array:
    """Angles of a chain against the link before, from angles of their own."""
    return np.eye(count) - np.eye(count, k=-1)


# -- open trees ------------------------------------------------------------------------------------


def pendulum(p: Values, count: int) -> Tree:
    """Point masses on massless links that hang down at angle zero."""
    build, link, end = Builder((0, -p["g"], 0)), 0, O
    for k in range(count):
        link, end = build.joint("RZ", link, end), (0.0, -p[f"l_{k}"], 0.0)
        build.body(link, p[f"m_{k}"], end)
    return build.linear(differences(count))


def heavy_top(p: Values, count: int) -> Tree:
    """Three joints in one point: its axis about x and z, and the spin about the axis.

    Their angles are smooth: the axis passes the vertical and stays away from x.
    """
    build, joint = Builder((0, 0, -p["g"])), 0
    for kind in ("RX", "RZ", "RY"):
        joint = build.joint(kind, joint)
    build.body(joint, p["m"], (0, p["d"], 0), (p["I_t"], p["I_s"], p["I_t"]))
    none = np.zeros(3)
    return Tree(build.model, _from_body_rates, _to_body_rates, lambda q, v: none)


def _from_body_rates(state: Array) -> Array:
    """Joint angles and their rates from precession, nutation, spin and the body's rates."""
    psi, theta, phi, w_x, w_y, w_z = state
    attitude = _turn("z", psi) @ _turn("x", theta) @ _turn("y", phi)
    x, y, z = attitude[:, 1]
    alpha, beta = np.arctan2(z, y), np.arctan2(-x, np.hypot(y, z))
    gamma = _about_y(_turn("z", -beta) @ _turn("x", -alpha) @ attitude)
    c, s = np.cos(gamma), np.sin(gamma)
    by_alpha = (w_x * c + w_z * s) / np.cos(beta)
    return np.array(
        [alpha, beta, gamma, by_alpha, w_z * c - w_x * s, w_y + by_alpha * np.sin(beta)]
    )


def _to_body_rates(state: Array) -> Array:
    alpha, beta, gamma, by_alpha, by_beta, by_gamma = state
    attitude = _turn("x", alpha) @ _turn("z", beta) @ _turn("y", gamma)
    x, y, z = attitude[:, 1]
    psi, theta = np.arctan2(-x, y), np.arctan2(z, np.hypot(x, y))
    phi = _about_y(_turn("x", -theta) @ _turn("z", -psi) @ attitude)
    c, s, across = np.cos(gamma), np.sin(gamma), by_alpha * np.cos(beta)
    w_y = by_gamma - by_alpha * np.sin(beta)
    return np.array([psi, theta, phi, across * c - by_beta * s, w_y, across * s + by_beta * c])


def _turn(axis: str, angle: float) -> Array:
    return Rotation.from_euler(axis, angle).as_matrix()


def _about_y(turn: Array) -> float:
    """The angle of a rotation that is one about y."""
    return float(np.arctan2(turn[0, 2], turn[0, 0]))


def flyball_governor(p: Values, count: int) -> Tree:
    """Shaft, slider on it, a rod with its mass to either side, and the two spring dampers."""
    l, a, b, h = (p[name] for name in ("l", "a", "b", "h"))
    thick, thin = p["m"] * (l**2 + a**2) / 12, p["m"] * a**2 / 6
    build = Builder((0, 0, -p["g"]))
    shaft = build.joint("RZ", 0)
    build.body(shaft, p["m"], (0, 0, l / 2), (thick, thick, thin))
    slider = build.joint("PZ", shaft)
    build.body(slider, p["m_s"], O, (p["m_s"] * h**2 / 6,) * 3)
    for sign in (1, -1):
        rod = build.joint("RY", shaft, (sign * b, 0, l))
        build.body(rod, p["m"], (sign * l / 2, 0, 0), (thin, thick, thick))
        build.body(rod, p["m_b"], (sign * l, 0, 0))

    def torque(q: Array, v: Array) -> Array:
        # A spring's arm from its seat to the rod's middle, in the plane of the shaft.
        tau = np.zeros(4)
        for k, sign in ((2, 1), (3, -1)):
            alpha, rate = sign * q[k], sign * v[k]
            out, drop = l / 2 * np.cos(alpha), l / 2 * np.sin(alpha)
            up = l - drop - q[1]
            length = np.hypot(out, up)
            by_alpha, by_s = -(out * drop + up * out) / length, -up / length
            stretching = by_alpha * rate + by_s * v[1]
            tension = p["k"] * (length - p["l_0"]) + p["c"] * stretching
            tau[k] = -sign * tension * by_alpha
            tau[1] -= tension * by_s
        return tau

    return build.linear(np.diag([1.0, 1.0, 1.0, -1.0]), torque)


# -- closed loops ----------------------------------------------------------------------------------


def four_bar(p: Values, count: int) -> Tree:
    """Crank, coupler and rocker in a chain; the rocker's end is held at the ground pivot."""
    build, link, end = Builder((0, -p["g"], 0)), 0, O
    for k in range(3):
        link, length = build.joint("RZ", link, end), p[f"l_{k}"]
        about = p[f"I_{k}"]
        build.body(link, p[f"m_{k}"], (length / 2, 0, 0), (0, about, about))
        end = (length, 0.0, 0.0)
    build.close(link, end, 0, (p["l_3"], 0, 0))
    return build.linear(differences(3))


def slider_crank(p: Values, count: int) -> Tree:
    """Crank and rod in a chain, the slider on the ground; the rod's end is on the slider."""
    build = Builder()
    crank = build.joint("RZ", 0)
    rod = build.joint("RZ", crank, (p["l_0"], 0, 0))
    slider = build.joint("PX", 0)
    build.rod(crank, p["m_0"], p["l_0"])
    build.rod(rod, p["m_1"], p["l_1"])
    build.body(slider, p["m_2"], O)
    build.close(rod, (p["l_1"], 0, 0), slider, O)
    drive = np.array([p["T"], 0.0, 0.0])
    return build.linear(np.array([[1.0, 0, 0], [-1, 1, 0], [0, 0, 1]]), lambda q, v: drive)


def windows(p: Values, count: int) -> Tree:
    """Couplers in a chain from the first upright, an upright down from each; gravity turns along.

    The angle of the whole scene changes nothing in the scene's own axes.
    """
    l, m = p["l"], p["m"]
    build = Builder((0, -p["g"], 0))
    carrier = build.joint("RZ", 0)
    build.rod(carrier, m, l)
    for window in range(1, count // 2 + 1):
        carrier = build.joint("RZ", carrier, (l, 0, 0))
        upright = build.joint("RZ", carrier, (l, 0, 0))
        build.rod(carrier, m, l)
        build.rod(upright, m, l)
        build.close(upright, (l, 0, 0), 0, (window * l, 0, 0))
    return build.linear(np.eye(count))


def andrews(p: Values, count: int) -> Tree:
    """K1-K2, K3, K5-K4 and K7-K6 from the ground; K2's end E is held at those of K3, K4, K6."""
    build = Builder()
    k1 = build.joint("RZ", 0)
    k2 = build.joint("RZ", k1, (p["rr"], 0, 0))
    k3 = build.joint("RZ", 0, (p["xb"], p["yb"], 0))
    k5 = build.joint("RZ", 0, (p["xa"], p["ya"], 0))
    k4 = build.joint("RZ", k5, (p["zt"], 0, 0))
    k7 = build.joint("RZ", 0, (p["xa"], p["ya"], 0))
    k6 = build.joint("RZ", k7, (0, -p["u"], 0))
    centres: dict[int, tuple[int, Place]] = {
        1: (k1, (p["ra"], 0, 0)),
        2: (k2, (-p["da"], 0, 0)),
        3: (k3, (p["sb"], -p["sa"], 0)),
        4: (k4, (0, -(p["e"] - p["ea"]), 0)),
        5: (k5, (p["ta"], -p["tb"], 0)),
        6: (k6, (p["zf"] - p["fa"], 0, 0)),
        7: (k7, (p["ub"], -p["ua"], 0)),
    }
    for k, (joint, centre) in centres.items():
        build.body(joint, p[f"m_{k}"], centre, (0, p[f"I_{k}"], p[f"I_{k}"]))
    for joint, end in ((k3, (0, -p["ss"], 0)), (k4, (0, -p["e"], 0)), (k6, (p["zf"], 0, 0))):
        build.close(k2, (-p["d"], 0, 0), joint, end)
    order = [0, 1, 2, 4, 3, 6, 5]  # beta, Theta, gamma, delta, Phi, epsilon, Omega
    return build.linear(np.eye(7)[order], _squeezing_torque(p))


def _squeezing_torque(p: Values) -> Callable[[Array, Array], Array]:
    """The motor's on K1, and that of the spring from C to D on K3."""
    base = np.array([p["xb"] - p["xc"], p["yb"] - p["yc"]])

    def torque(q: Array, v: Array) -> Array:
        c, s = np.cos(q[2]), np.sin(q[2])
        reach = np.array([p["sd"] * c + p["sc"] * s, p["sd"] * s - p["sc"] * c])
        arm = base + reach
        length = np.hypot(*arm)
        by_gamma = (arm[1] * reach[0] - arm[0] * reach[1]) / length
        tau = np.zeros(7)
        tau[0], tau[2] = p["T"], -p["c"] * (length - p["l_0"]) * by_gamma
        return tau

    return torque


BUILDERS: Mapping[str, Callable[[Values, int], Tree]] = {
    "pendulum": pendulum,
    "heavy_top": heavy_top,
    "flyball_governor": flyball_governor,
    "four_bar": four_bar,
    "slider_crank": slider_crank,
    "windows": windows,
    "andrews": andrews,
}
