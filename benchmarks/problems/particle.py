"""Particles by Kane's method, as SymPy describes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sympy import Expr, Symbol
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

t = dynamicsymbols._t


def particle(
    q: Sequence[Expr], u: Sequence[Expr], force: Sequence[Any], mass: Any = None, *,
    closed: Sequence[Expr] = (), potential: Any = 0,
) -> KanesMethod:  # fmt: skip
    """A mass m, or another, at q along the axes of a frame, moving at u, under a force along them.

    Constraints of its place make the last coordinates dependent.
    """
    frame, origin, free = ReferenceFrame("N"), Point("O"), len(q) - len(closed)
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", _along(frame, q))
    point.set_vel(frame, _along(frame, u))
    body = Particle("mass", point, Symbol("m") if mass is None else mass)
    body.potential_energy = potential
    kane = KanesMethod(
        frame, q[:free], u[:free], kd_eqs=_rates(q, u), q_dependent=q[free:], u_dependent=u[free:],
        configuration_constraints=list(closed), velocity_constraints=[x.diff(t) for x in closed],
    )  # fmt: skip
    kane.kanes_equations([body], [(point, _along(frame, force))])
    return kane


def on_a_line(
    q: Sequence[Expr], u: Sequence[Expr], forces: Sequence[Any], masses: Sequence[Any],
    names: Sequence[str] = (),
) -> KanesMethod:  # fmt: skip
    """Particles at q along one line, each under its force along it."""
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    bodies, loads = [], []
    for k, (place, speed) in enumerate(zip(q, u, strict=True)):
        point = origin.locatenew(names[k] if names else f"P_{k}", place * frame.x)
        point.set_vel(frame, speed * frame.x)
        bodies.append(Particle(names[k] if names else f"body_{k}", point, masses[k]))
        loads.append((point, forces[k] * frame.x))
    kane = KanesMethod(frame, q, u, kd_eqs=_rates(q, u))
    kane.kanes_equations(bodies, loads)
    return kane


def _along(frame: ReferenceFrame, parts: Sequence[Any]) -> Vector:
    axes = (frame.x, frame.y, frame.z)
    return sum((x * axis for x, axis in zip(parts, axes, strict=False)), 0 * frame.x)


def _rates(q: Sequence[Expr], u: Sequence[Expr]) -> list[Expr]:
    return [a.diff(t) - b for a, b in zip(q, u, strict=True)]
