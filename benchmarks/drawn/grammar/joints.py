"""Mechanisms by their joints: a ``System`` of SymPy, and the same by ``mechc.from_joints``."""

from __future__ import annotations

from . import expressions
from .writer import Writer

AXES = ("x", "y", "z")


def write(w: Writer) -> None:
    """A chain of one to three joints, with actuators and gravity."""
    count, planar = int(w.rng.choice([1, 2, 3], p=[0.3, 0.5, 0.2])), w.chance(0.5)
    w.note(f"coordinates: {count}")
    w.line('ground = me.RigidBody("ground")')
    w.line("ground.masscenter.set_vel(ground.frame, 0)")
    made, bodies, loads, before = [], [], [], "ground"
    for k in range(count):
        name = f"link{k}"
        moments = [w.value("J", 0.3, 0.5) for _ in range(3)]
        w.line(f'{name} = me.RigidBody("{name}", mass={w.value("m", 0.5, 2.0)})')
        w.line(f"{name}.central_inertia = me.inertia({name}.frame, {', '.join(moments)})")
        loads += _joint(w, k, before, name, planar)
        made.append(f"joint{k}")
        bodies.append(name)
        before = name if w.chance(0.8) else before
    if w.chance(0.35):
        loads.append(_actuator(w, bodies))
    w.line(f"joints = [{', '.join(made)}]")
    w.line(f"loads = [{', '.join(loads)}]")
    down = w.one_of(["-{g} * ground.y", "{g} * ground.x"]).format(g=w.value("g", 8.0, 11.0))
    w.line(f"gravity = {down}")
    w.line("formed = me.System.from_newtonian(ground)")
    w.line("formed.add_joints(*joints)")
    w.line("formed.apply_uniform_gravity(gravity)")
    w.line("formed.add_loads(*(x for load in loads for x in (load.to_loads() if isinstance(load, "
           "me.ActuatorBase) else [load])))")  # fmt: skip
    w.line("formed.form_eoms()")
    if w.chance(0.5):
        w.note("as a System")
        w.line("described = formed")
    else:
        w.note("as mechc.from_joints")
        w.line('described = mechc.from_joints("drawn", joints, gravity=gravity, loads=loads)')
    w.line("q, u = [*formed.q], [*formed.u]")


def _joint(w: Writer, k: int, parent: str, child: str, planar: bool) -> list[str]:
    kind = w.one_of(["PinJoint", "PinJoint", "PrismaticJoint"])
    w.note(f"joint: {kind}")
    axis = "z" if planar and kind == "PinJoint" else w.one_of(AXES[: 2 if planar else 3])
    arm = w.one_of([a for a in AXES[: 2 if planar else 3] if a != axis])
    places = ""
    if parent != "ground":
        places += f", parent_point={w.value('l', 0.2, 0.6)} * {parent}.{arm}"
    if kind == "PinJoint":
        places += f", child_point=-{w.value('l', 0.2, 0.6)} * {child}.{arm}"
    w.line(f'joint{k} = me.{kind}("J{k}", {parent}, {child}{places}, joint_axis={parent}.{axis})')
    q, u = f"q_J{k}", f"u_J{k}"
    w.starts |= {q: (-1.0, 1.0), u: (-1.2, 1.2)}
    if w.chance(0.4):
        return []
    w.line(f'{q}, {u} = dynamicsymbols("{q} {u}")')
    law = expressions.restoring(w, q) + " + " + expressions.damping(w, u)
    if kind == "PinJoint":
        return [f"({child}.frame, ({law}) * {parent}.{axis})",
                f"({parent}.frame, -({law}) * {parent}.{axis})"]  # fmt: skip
    return [f"({child}.masscenter, ({law}) * {parent}.{axis})"]


def _actuator(w: Writer, bodies: list[str]) -> str:
    """A spring or damper of SymPy between a point of the ground and a body's mass centre."""
    kind = w.one_of(["LinearSpring", "LinearDamper"])
    w.note(f"actuator: {kind}")
    x, y = round(w.between(1.0, 2.0), 2), round(w.between(1.0, 2.0), 2)
    w.line(f'hook = ground.masscenter.locatenew("hook", {x} * ground.x + {y} * ground.y)')
    w.line("hook.set_vel(ground.frame, 0)")
    w.line(f"path = me.LinearPathway(hook, {bodies[-1]}.masscenter)")
    if kind == "LinearSpring":
        w.line(
            f"actuator = me.LinearSpring({w.value('k', 0.5, 3.0)}, path, {w.value('l', 0.3, 1.0)})"
        )
    else:
        w.line(f"actuator = me.LinearDamper({w.value('c', 0.05, 0.5)}, path)")
    return "actuator"
