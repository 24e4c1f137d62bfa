"""Wheels that roll and blades that do not slip: nonholonomic constraints of a KanesMethod."""

from __future__ import annotations

from . import expressions
from .writer import Writer


def write(w: Writer) -> None:
    """An upright wheel, or a cart that steers, in the plane."""
    w.line('N, O = ReferenceFrame("N"), Point("O")')
    w.line("O.set_vel(N, 0)")
    wheel = w.chance(0.5)
    w.note("rolling wheel" if wheel else "blade")
    q = [w.state(name, -0.5, 0.5) for name in ("x", "y", "psi")]
    if wheel:
        q.append(w.state("theta", -0.5, 0.5))
    u = [w.state(f"u{k}", -1.0, 1.0) for k in range(len(q))]
    w.line("rates = {" + ", ".join(f"{a}.diff(t): {v}" for a, v in zip(q, u, strict=True)) + "}")
    w.line('A = N.orientnew("A", "Axis", [psi, N.z])')
    w.line('P = O.locatenew("P", x * N.x + y * N.y)')
    w.line(f"P.set_vel(N, {u[0]} * N.x + {u[1]} * N.y)")
    m = w.value("m", 0.5, 2.0)
    frame = "A"
    if wheel:
        w.line('B = A.orientnew("B", "Axis", [theta, A.y])')
        frame = "B"
    J = [w.value("J", 0.2, 0.5) for _ in range(2)]
    w.line(f'body0 = me.RigidBody("body0", P, {frame}, {m}, '
           f"(me.inertia({frame}, {J[0]}, {J[1]}, {J[0]}), P))")  # fmt: skip
    torque = w.one_of([expressions.drive(w), expressions.restoring(w, "psi")])
    loads = [f"(A, ({torque} + {expressions.damping(w, u[2])}) * N.z)"]
    if wheel:
        r = w.value("r", 0.3, 0.8)
        law = w.one_of([expressions.restoring(w, "theta"), expressions.drive(w)])
        loads.append(f"(B, ({law}) * A.y)")
        rows = [f"{u[0]} - {r} * {u[3]} * sm.cos(psi)", f"{u[1]} - {r} * {u[3]} * sm.sin(psi)"]
        free, bound = [u[2], u[3]], [u[0], u[1]]
    else:
        loads.append(f"(P, ({expressions.restoring(w, 'x')}) * N.x)")
        rows = [f"{u[0]} * sm.sin(psi) - {u[1]} * sm.cos(psi)"]
        free, bound = [u[0], u[2]], [u[1]]
    w.line(f"q, u = [{', '.join(q)}], [{', '.join(free + bound)}]")
    w.line(f"velocity, loads = [{', '.join(rows)}], [{', '.join(loads)}]")
    independent = f"[{', '.join(free)}], kd_eqs=[a - r for a, r in rates.items()]"
    dependent = f"u_dependent=[{', '.join(bound)}], velocity_constraints=velocity"
    w.line(f"formed = me.KanesMethod(N, q, {independent}, {dependent})")
    w.line("formed.kanes_equations([body0], loads)")
    w.line("described = formed")
