"""The problems as rigid bodies with joints; all numbers are the problem's parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import cos, pi, sin

import numpy as np

from ..problems.problem import Array, NotExpressibleError, Problem
from .rigid_bodies import GROUND, ORIGIN, Bodies, Body, Spring, Top, Vector, X, Y, Z

Values = Mapping[str, float]


def rigid_bodies(problem: Problem) -> Bodies:
    """The problem for an engine.

    Raises
    ------
    NotExpressibleError
        If the problem is none of those that are described here.
    """
    for name, describe in DESCRIBED.items():
        if problem.name.startswith(name):
            return describe(problem.values, len(problem.start) // 2)
    raise NotExpressibleError("not described as rigid bodies on hinges and slides")


def _four_bar(p: Values, count: int) -> Bodies:
    bodies = [
        _rod(f"l_{k}", p[f"m_{k}"], p[f"l_{k}"], k - 1, p[f"l_{k - 1}"] if k else 0.0, p[f"I_{k}"])
        for k in range(count)
    ]
    pivot, end = (GROUND, _along(p["l_3"])), (2, _along(p["l_2"]))
    return Bodies(
        tuple(bodies), _differences(count), loops=((end, pivot),), gravity=(0.0, -p["g"], 0.0)
    )


def _pendulum(p: Values, count: int) -> Bodies:
    """Point masses on massless links, along -y at zero."""
    ends = [(0.0, -p[f"l_{k}"], 0.0) for k in range(count)]
    bodies = [
        Body(f"link_{k}", k - 1, ends[k - 1] if k else ORIGIN, p[f"m_{k}"], ends[k], ORIGIN)
        for k in range(count)
    ]
    return Bodies(tuple(bodies), _differences(count), gravity=(0.0, -p["g"], 0.0))


def _slider_crank(p: Values, count: int) -> Bodies:
    """Crank and rod; the slider is a separate body, to which the rod's end is pinned."""
    bodies = (
        _rod("crank", p["m_0"], p["l_0"], GROUND),
        _rod("rod", p["m_1"], p["l_1"], 0, p["l_0"]),
        Body("slider", GROUND, ORIGIN, p["m_2"], ORIGIN, ORIGIN, X, "slide"),
    )
    turns = np.eye(count)
    turns[:2, :2] = _differences(2)
    pin = ((1, _along(p["l_1"])), (2, ORIGIN))
    return Bodies(bodies, turns, loops=(pin,), torque=p["T"])


def _windows(p: Values, count: int) -> Bodies:
    """Uprights on their pivots; every coupler is the child of one upright and pinned to the next.

    The model's angles are relative, along a chain of couplers, whose children are the uprights with
    their feet last.  The whole scene is turned by ``tilt``, gravity included.
    """
    m, l, tilt = p["m"], p["l"], p["tilt"]
    bodies, turns, offset = [_rod("upright_0", m, l, GROUND)], np.eye(count), np.zeros(count)
    ground = np.array([cos(tilt), sin(tilt), 0.0])
    offset[0] = tilt
    loops = []
    for k in range(1, count, 2):
        i = k // 2 + 1
        bodies.append(_rod(f"coupler_{i}", m, l, k - 1, l))
        foot = tuple((i * l * ground).tolist())
        bodies.append(replace(_rod(f"upright_{i}", m, l, GROUND), place=foot))
        loops.append(((k, _along(l)), (k + 1, _along(l))))
        # The coupler's angle is relative to an upright described from its other end.
        if i > 1:
            turns[k, k - 1], offset[k] = -1.0, -pi
        turns[k + 1, [0, *range(1, k + 1, 2)]], offset[k + 1] = 1.0, tilt + pi
    gravity = (p["g"] * sin(tilt), -p["g"] * cos(tilt), 0.0)
    return Bodies(tuple(bodies), turns, tuple(loops), gravity=gravity, offset=offset)


def _andrews(p: Values, count: int) -> Bodies:
    """In the order K1, K2, K3, K5, K4, K7, K6, in which a body comes after its parent."""

    def body(k: int, on: int, place: Vector, x: float, y: float) -> Body:
        about = p[f"I_{k}"]
        return Body(f"K{k}", on, place, p[f"m_{k}"], (x, y, 0.0), (about, about, about))

    A, B, C = ((p[f"x{name}"], p[f"y{name}"], 0.0) for name in "abc")
    F, G, H = _along(p["rr"]), _along(p["zt"]), (0.0, -p["u"], 0.0)
    bodies = (
        body(1, GROUND, ORIGIN, p["ra"], 0.0),
        body(2, 0, F, -p["da"], 0.0),
        body(3, GROUND, B, p["sb"], -p["sa"]),
        body(5, GROUND, A, p["ta"], -p["tb"]),
        body(4, 3, G, 0.0, p["ea"] - p["e"]),
        body(7, GROUND, A, p["ub"], -p["ua"]),
        body(6, 5, H, p["zf"] - p["fa"], 0.0),
    )
    E = (1, _along(-p["d"]))
    ends = ((2, (0.0, -p["ss"], 0.0)), (4, (0.0, -p["e"], 0.0)), (6, _along(p["zf"])))
    spring = Spring(((GROUND, C), (2, (p["sd"], -p["sc"], 0.0))), p["c"], 0.0, p["l_0"])
    turns = np.eye(count)[[0, 1, 2, 4, 3, 6, 5]]
    return Bodies(bodies, turns, tuple((E, end) for end in ends), (spring,), torque=p["T"])


def _flyball_governor(p: Values, count: int) -> Bodies:
    """Shaft, slider, two rods with the masses at their ends, and a spring-damper to each."""
    l, b = p["l"], p["b"]
    shaft, along = _prism(p["m"], l, p["a"])
    edge = p["m_s"] * p["h"] ** 2 / 6
    bodies = [
        Body("shaft", GROUND, ORIGIN, p["m"], (0.0, 0.0, l / 2), (shaft, shaft, along)),
        Body("slider", 0, ORIGIN, p["m_s"], ORIGIN, (edge, edge, edge), Z, "slide"),
    ]
    # A rod and the point mass at its end are one body.
    mass = p["m"] + p["m_b"]
    centre = (p["m"] / 2 + p["m_b"]) * l / mass
    about = shaft + p["m"] * (centre - l / 2) ** 2 + p["m_b"] * (l - centre) ** 2
    springs = []
    for k, side in enumerate((1.0, -1.0), start=2):
        hinge, down = (side * b, 0.0, l), (0.0, side, 0.0)
        inertia = (along, about, about)
        bodies.append(Body(f"rod_{k - 1}", 0, hinge, mass, _along(side * centre), inertia, down))
        ends = ((k, _along(side * l / 2)), (1, _along(side * b)))
        springs.append(Spring(ends, p["k"], p["c"], p["l_0"]))
    weight = (0.0, 0.0, -p["g"])
    return Bodies(tuple(bodies), np.eye(count), springs=tuple(springs), gravity=weight)


def _heavy_top(p: Values, count: int) -> Bodies:
    """On a ball joint.

    Three hinges cannot be used: the mass centre passes straight below the fixed point (the angular
    momentum about the vertical is minus the spin's), where two of their axes come in line.
    """
    inertia = (p["I_t"], p["I_s"], p["I_t"])
    top = Body("top", GROUND, ORIGIN, p["m"], (0.0, p["d"], 0.0), inertia, Y, "ball")
    return Top((top,), np.eye(count), gravity=(0.0, 0.0, -p["g"]))


def _rod(
    name: str, mass: float, length: float, on: int, x: float = 0.0, about: float | None = None
) -> Body:
    """A thin uniform rod along its x axis; ``about`` replaces its moment of inertia."""
    about = mass * length**2 / 12 if about is None else about
    return Body(name, on, _along(x), mass, _along(length / 2), (0.0, about, about))


def _prism(mass: float, length: float, width: float) -> tuple[float, float]:
    """Moments of inertia of a prism of square section across and along its axis."""
    return mass * (length**2 + width**2) / 12, mass * width**2 / 6


def _along(x: float) -> Vector:
    return (x, 0.0, 0.0)


def _differences(count: int) -> Array:
    """Angles at hinges from the links' absolute angles."""
    return np.eye(count) - np.eye(count, k=-1)


DESCRIBED: dict[str, Callable[[Values, int], Bodies]] = {
    "four_bar": _four_bar, "pendulum": _pendulum, "slider_crank": _slider_crank,
    "windows": _windows, "andrews": _andrews, "flyball_governor": _flyball_governor,
    "heavy_top": _heavy_top,
}  # fmt: skip
