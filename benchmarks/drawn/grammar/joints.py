"""Mechanisms by their joints: a ``System`` of SymPy, and the same by ``mechc.from_joints``.

Loops are closed by a ``mechc.Cut``, at a place that follows from the start.
"""

from __future__ import annotations

from . import expressions
from .writer import Interval, Writer

AXES = ("x", "y", "z")
TURNED = "q0 q1 q2 q3"
STATES = {  # the stems of coordinates and speeds
    "me.PinJoint": ("q", "u"),
    "me.PrismaticJoint": ("q", "u"),
    "mechc.UniversalJoint": ("q0 q1", "u0 u1"),
    "me.SphericalJoint": ("q0 q1 q2", "u0 u1 u2"),
    "mechc.BallJoint": (TURNED, "wx wy wz"),
    "mechc.FreeJoint": (f"x y z {TURNED}", "vx vy vz wx wy wz"),
}
SIMPLE = ("me.PinJoint", "me.PrismaticJoint")
MOST = 4  # speeds, after which joints are simple


def write(w: Writer) -> None:
    """A chain of one to three joints, with actuators and gravity."""
    count, planar = int(w.rng.choice([1, 2, 3], p=[0.3, 0.5, 0.2])), w.chance(0.4)
    loads, bodies, before = _ground(w), ["ground"], "ground"
    for k in range(count):
        kinds = ["me.PinJoint", "me.PinJoint", "me.PrismaticJoint"]
        if not planar and sum(name[0] in "uvw" for name in w.starts) < MOST - 1:
            kinds += list(STATES)[2:] if k == 0 else list(STATES)[2:-1]
        loads += _link(w, before, w.one_of(kinds), planar)
        bodies.append(f"link{k}")
        before = bodies[-1] if w.chance(0.8) else before
    w.note(f"coordinates: {sum(name[0] in 'qxyz' for name in w.starts)}")
    if w.chance(0.35):
        loads.append(_actuator(w, bodies))
    _form(w, loads, count)
    if w.chance(0.5):
        w.note("as a System")
        w.line("described = formed")
    else:
        w.note("as mechc.from_joints")
        w.line('described = mechc.from_joints("drawn", joints, gravity=gravity, loads=loads)')


LOOPS = {  # joints of the chain from the ground, and of the other body if there is one
    "pin": ([SIMPLE[:1]] * 3, ()),
    "pin of two chains": ([SIMPLE[:1]] * 2, SIMPLE),
    "spherical": ([SIMPLE[:1], ("me.SphericalJoint", "mechc.BallJoint")], (*SIMPLE, "")),
    "spherical after a universal joint": ([SIMPLE[:1], ("mechc.UniversalJoint",)], SIMPLE),
    "universal": ([SIMPLE[:1], ("me.SphericalJoint", "mechc.BallJoint")], SIMPLE),
}


def write_closed(w: Writer) -> None:
    """A chain whose last body is cut from the ground, or from a body on a joint of its own."""
    kind = str(w.rng.choice(list(LOOPS), p=[0.25, 0.3, 0.15, 0.2, 0.1]))
    w.note(f"cut: {kind}")
    chain, others = LOOPS[kind]
    planar, loads, before = kind.startswith("pin"), _ground(w), "ground"
    for k, kinds in enumerate(chain):
        loads += _link(w, before, w.one_of(kinds), planar)
        before = f"link{k}"
    other, count = w.one_of(others) if others else "", len(chain)
    if other:
        loads += _link(w, "ground", other, planar)
    base = f"link{count}" if other else "ground"
    w.note(f"coordinates: {sum(name[0] in 'qxyz' for name in w.starts)}")
    _form(w, loads, count + bool(other))
    axes = AXES[: 2 if planar else 3]
    w.line(f"tip = {w.value('l', 0.2, 0.6)} * {before}.x")
    w.line(f'end = {before}.masscenter.locatenew("end", tip)')
    w.line(f"place = end.pos_from({base}.masscenter)")
    w.line(
        f'{", ".join(f"{a}_f" for a in axes)} = sm.symbols("{" ".join(f"{a}_f" for a in axes)}")'
    )
    w.line(f"held = {' + '.join(f'{a}_f * {base}.{a}' for a in axes)}")
    w.line(f"follows = {{{', '.join(f'{a}_f: place.dot({base}.{a})' for a in axes)}}}")
    w.line(f"position = [(place - held).dot(a) for a in "
           f"({', '.join(f'ground.{a}' for a in axes)})]")  # fmt: skip
    more = f", joint_axis={base}.z" if planar else ""
    if kind == "universal":
        w.line('a_f = sm.Symbol("a_f")')
        w.line(f'turned = {base}.frame.orientnew("turned", "Axis", [a_f, {base}.z])')
        w.line(f"position.append(turned.x.dot({before}.y))")
        w.line(f"follows[a_f] = sm.atan2(-{before}.y.dot({base}.x), {before}.y.dot({base}.y))")
        more = ", parent_interframe=turned"
    w.line(f'cut = mechc.Cut.{kind.split()[0]}("C", {base}, {before}, parent_point=held, '
           f"child_point=tip{more})")  # fmt: skip
    w.line('described = mechc.from_joints("drawn", [*joints, cut], gravity=gravity, loads=loads)')


def _ground(w: Writer) -> list[str]:
    """No loads yet."""
    w.line('ground = me.RigidBody("ground")')
    w.line("ground.masscenter.set_vel(ground.frame, 0)")
    return []


def _form(w: Writer, loads: list[str], count: int) -> None:
    """``formed``: the open tree as a System."""
    w.line(f"joints = [{', '.join(f'joint{k}' for k in range(count))}]")
    w.line(f"loads = [{', '.join(loads)}]")
    down = w.one_of(["-{g} * ground.y", "{g} * ground.x"]).format(g=w.value("g", 8.0, 11.0))
    w.line(f"gravity = {down}")
    w.line("formed = me.System.from_newtonian(ground)")
    w.line("formed.add_joints(*joints)")
    w.line("formed.apply_uniform_gravity(gravity)")
    w.line("formed.add_loads(*(x for load in loads for x in (load.to_loads() if isinstance(load, "
           "me.ActuatorBase) else [load])))")  # fmt: skip
    w.line("formed.form_eoms()")
    w.line("q, u = [*formed.q], [*formed.u]")


def _link(w: Writer, parent: str, kind: str, planar: bool) -> list[str]:
    """A body and its joint; what acts in the joint."""
    k = sum(line.startswith("joint") for line in w.lines)
    child = f"link{k}"
    w.note(f"joint: {kind}")
    moments = [w.value("J", 0.3, 0.5) for _ in range(3)]
    w.line(f'{child} = me.RigidBody("{child}", mass={w.value("m", 0.5, 2.0)})')
    w.line(f"{child}.central_inertia = me.inertia({child}.frame, {', '.join(moments)})")
    axis = "z" if planar and kind == "me.PinJoint" else w.one_of(AXES[: 2 if planar else 3])
    arm = w.one_of([a for a in AXES[: 2 if planar else 3] if a != axis])
    places = ""
    if parent != "ground":
        places += f", parent_point={w.value('l', 0.2, 0.6)} * {parent}.{arm}"
    if kind != "me.PrismaticJoint":
        places += f", child_point=-{w.value('l', 0.2, 0.6)} * {child}.{arm}"
    if kind in SIMPLE:
        places += f", joint_axis={parent}.{axis}"
    w.line(f'joint{k} = {kind}("J{k}", {parent}, {child}{places})')
    coordinates, speeds = (stems.split() for stems in STATES[kind])
    w.starts |= {f"{q}_J{k}": _interval(q, coordinates) for q in coordinates}
    w.starts |= {f"{u}_J{k}": (-1.2, 1.2) for u in speeds}
    if w.chance(0.4):
        return []
    if kind not in SIMPLE:
        spin = f"{w.value('c', 0.02, 0.6)} * {child}.frame.ang_vel_in({parent}.frame)"
        return [f"({child}.frame, -{spin})", f"({parent}.frame, {spin})"]
    q, u = f"q_J{k}", f"u_J{k}"
    w.line(f'{q}, {u} = dynamicsymbols("{q} {u}")')
    law = expressions.restoring(w, q) + " + " + expressions.damping(w, u)
    if kind == "me.PinJoint":
        return [f"({child}.frame, ({law}) * {parent}.{axis})",
                f"({parent}.frame, -({law}) * {parent}.{axis})"]  # fmt: skip
    return [f"({child}.masscenter, ({law}) * {parent}.{axis})"]


def _interval(stem: str, among: list[str]) -> Interval:
    """Of a start: quaternions of any length, not zero."""
    if len(among) == 2:
        return (0.3, 0.9)  # a loop of parallel pins has a change point where both are 0
    return (0.7, 1.3) if stem == "q0" and "q3" in among else (-0.7, 0.7)


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
