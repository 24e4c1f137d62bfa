"""Open mechanisms: trees of bodies on pins, sliders and moved pivots, in a plane or in space."""

from __future__ import annotations

from dataclasses import dataclass, field

from . import expressions, inputs, stops
from .writer import Writer

AXES = ("x", "y", "z")


@dataclass
class Tree:
    """What is written of a tree so far: names in the text."""

    q: list[str] = field(default_factory=list)
    frames: list[str] = field(default_factory=lambda: ["N"])
    points: list[tuple[str, str]] = field(default_factory=lambda: [("O", "N")])  # and its frame
    bodies: list[str] = field(default_factory=list)
    centres: list[tuple[str, str, str]] = field(default_factory=list)  # body, point, mass
    turns: list[tuple[str, str, str, str]] = field(default_factory=list)  # q, frame, parent, axis
    slides: list[tuple[str, str, str]] = field(default_factory=list)  # q, point, direction
    planar: bool = True
    ways: dict[str, tuple[str, ...]] = field(default_factory=dict)  # point or frame: coordinates

    def way(self, *places: str) -> tuple[str, ...]:
        """The coordinates on the way from the ground to points and frames."""
        return tuple(dict.fromkeys(q for place in places for q in self.ways.get(place, ())))


def write_tree(w: Writer, least: int = 1, most: int = 4, planar: float = 0.4) -> Tree:
    """Frames, points and bodies of some freedoms; velocities are derived by SymPy."""
    tree = _ground(w, w.chance(planar))
    freedoms = min(most, max(least, int(w.rng.choice([1, 2, 3, 4], p=[0.25, 0.45, 0.2, 0.1]))))
    while len(tree.q) < freedoms:
        left = freedoms - len(tree.q)
        if not tree.planar and left >= 2 and w.chance(0.7):
            _spinning(w, tree)
        elif not tree.planar and left >= 3 and w.chance(0.7):
            _in_space(w, tree)
        elif w.chance(0.72):
            _pin(w, tree)
        else:
            _slider(w, tree)
        if w.chance(0.12):
            _moved(w, tree)
    w.note(f"coordinates: {len(tree.q)}")
    return tree


def _ground(w: Writer, planar: bool) -> Tree:
    w.note("planar" if planar else "spatial")
    w.line('N, O = ReferenceFrame("N"), Point("O")')
    w.line("O.set_vel(N, 0)")
    return Tree(planar=planar)


def write_chain(w: Writer, count: int) -> Tree:
    """Bodies one after the other on pins in a plane."""
    tree = _ground(w, planar=True)
    for _ in range(count):
        _pin(w, tree, tree.points[-1])
    w.note(f"coordinates: {count}")
    return tree


def _parent(w: Writer, tree: Tree) -> tuple[str, str]:
    return tree.points[-1] if w.chance(0.7) else w.one_of(tree.points)  # type: ignore[no-any-return]


def _axis(w: Writer, tree: Tree, frame: str) -> str:
    if tree.planar:
        return f"{frame}.z"
    if w.chance(0.85):
        return f"{frame}.{w.one_of(AXES)}"
    w.note("slanted axis")
    return f"(2 * {frame}.x + {frame}.y + 2 * {frame}.z) / 3"


def _arm(w: Writer, tree: Tree, frame: str, axis: str = "") -> str:
    """A vector along a body; not along the axis that the body turns about."""
    l = w.value("l", 0.4, 1.2)
    along = [a for a in AXES[: 2 if tree.planar else 3] if not axis.endswith(f".{a}")]
    if w.chance(0.75) and len(along) < 3:
        return f"{w.one_of(['', '-'])}{l} * {frame}.{w.one_of(along)}"
    if axis.endswith(".x"):
        return f"{l} * {frame}.z + {w.signed('h', 0.6)} * {frame}.y"
    w.note("arm with two components")
    return f"{l} * {frame}.x + {w.signed('h', 0.6)} * {frame}.y"


def _pin(w: Writer, tree: Tree, on: tuple[str, str] | None = None) -> None:
    w.note("pin")
    k, (point, frame) = len(tree.q), on or _parent(w, tree)
    q = w.state(f"{w.one_of(['q', 'theta', 'alpha'])}{k}", -1.2, 1.2)
    axis, new = _axis(w, tree, frame), f"R{len(tree.frames)}"
    angle = q
    if w.chance(0.12):
        w.note("angle with an offset or a factor")
        angle = w.one_of([f"{q} + {w.signed('d', 0.5)}", f"2 * {q}", f"-{q}"])
    w.line(f'{new} = {frame}.orientnew("{new}", "Axis", [{angle}, {axis}])')
    tree.ways[new] = (*tree.way(point, frame), q)
    tree.q.append(q)
    tree.frames.append(new)
    tree.turns.append((q, new, frame, axis))
    _body(w, tree, point, new, axis)


def _slider(w: Writer, tree: Tree) -> None:
    w.note("slider")
    k, (point, frame) = len(tree.q), _parent(w, tree)
    q = w.state(f"{w.one_of(['x', 's'])}{k}", -0.8, 0.8)
    along, new = f"{frame}.{w.one_of(AXES[: 2 if tree.planar else 3])}", f"P{len(tree.points)}"
    w.line(f'{new} = {point}.locatenew("{new}", {q} * {along})')
    w.line(f"{new}.set_vel(N, {new}.pos_from(O).dt(N))")
    tree.ways[new] = (*tree.way(point, frame), q)
    tree.q.append(q)
    tree.points.append((new, frame))
    tree.slides.append((q, new, along))
    _particle(w, tree, new)


def _moved(w: Writer, tree: Tree) -> None:
    """A pivot or a frame whose motion is given."""
    w.note("driven pivot or frame")
    point, frame = _parent(w, tree)
    omega, k = w.value("w", 0.5, 2.5), len(tree.points)
    if w.chance(0.5):
        moved = f"{w.value('r', 0.05, 0.4)} * sm.{w.one_of(['sin', 'cos'])}({omega} * t)"
        w.line(f'P{k} = {point}.locatenew("P{k}", {moved} * {frame}.{w.one_of(AXES[:2])})')
        w.line(f"P{k}.set_vel(N, P{k}.pos_from(O).dt(N))")
        tree.points.append((f"P{k}", frame))
        tree.ways[f"P{k}"] = tree.way(point, frame)
        return
    new = f"R{len(tree.frames)}"
    turned = w.one_of([f"{omega} * t", f"{w.value('r', 0.1, 0.8)} * sm.sin({omega} * t)"])
    w.line(f'{new} = {frame}.orientnew("{new}", "Axis", [{turned}, {_axis(w, tree, frame)}])')
    w.line(f'P{k} = {point}.locatenew("P{k}", {_arm(w, tree, new)})')
    w.line(f"P{k}.set_vel(N, P{k}.pos_from(O).dt(N))")
    tree.frames.append(new)
    tree.points.append((f"P{k}", new))
    tree.ways[new] = tree.ways[f"P{k}"] = tree.way(point, frame)


def _in_space(w: Writer, tree: Tree) -> None:
    """A body that turns about a point by three angles."""
    w.note("three angles")
    k, (point, frame) = len(tree.q), _parent(w, tree)
    names = [w.state(f"{w.one_of(['phi', 'psi', 'q'])}{k + j}", -0.7, 0.7) for j in range(3)]
    order, new = w.one_of(["XYZ", "ZYX", "ZXY", "YXZ"]), f"R{len(tree.frames)}"
    w.line(f'{new} = {frame}.orientnew("{new}", "Body", [{", ".join(names)}], "{order}")')
    tree.ways[new] = (*tree.way(point, frame), *names)
    tree.q += names
    tree.frames.append(new)
    _rigid(w, tree, point, new, symmetric=w.chance(0.3))


def _spinning(w: Writer, tree: Tree) -> None:
    """A body that swings about one axis and spins about one of its own."""
    w.note("swings and spins")
    k, j, (point, frame) = len(tree.q), len(tree.frames), _parent(w, tree)
    swing, spin = (w.state(f"{w.one_of(['theta', 'phi'])}{k + i}", -1.0, 1.0) for i in range(2))
    about, own = w.one_of(["xz", "xy", "yx", "zx", "zy"])
    w.line(f'R{j} = {frame}.orientnew("R{j}", "Axis", [{swing}, {frame}.{about}])')
    w.line(f'R{j + 1} = R{j}.orientnew("R{j + 1}", "Axis", [{spin}, R{j}.{own}])')
    tree.q += [swing, spin]
    tree.frames += [f"R{j}", f"R{j + 1}"]
    tree.ways[f"R{j}"] = (*tree.way(point, frame), swing)
    tree.ways[f"R{j + 1}"] = (*tree.ways[f"R{j}"], spin)
    centre = f"{w.value('l', 0.4, 1.2)} * R{j}.{own}" if w.chance(0.7) else "0 * N.x"
    mass, name, end = w.value("m", 0.5, 2.0), f"body{len(tree.bodies)}", f"P{len(tree.points)}"
    w.line(f'{end} = {point}.locatenew("{end}", {centre})')
    w.line(f"{end}.set_vel(N, {end}.pos_from(O).dt(N))")
    about = "".join(f", {entry}" for entry in _moments(w, False, w.chance(0.2)))
    w.line(
        f'{name} = me.RigidBody("{name}", {end}, R{j + 1}, {mass}, '
        f"(me.inertia(R{j + 1}{about}), {end}))"
    )
    tree.points.append((end, f"R{j + 1}"))
    tree.ways[end] = tree.ways[f"R{j + 1}"]
    tree.bodies.append(name)
    tree.centres.append((name, end, mass))


def _body(w: Writer, tree: Tree, point: str, frame: str, axis: str) -> None:
    if w.chance(0.5):
        k = len(tree.points)
        w.line(f'P{k} = {point}.locatenew("P{k}", {_arm(w, tree, frame, axis)})')
        w.line(_velocity(w, f"P{k}", point, frame))
        tree.points.append((f"P{k}", frame))
        tree.ways[f"P{k}"] = tree.way(point, frame)
        _particle(w, tree, f"P{k}")
    else:
        _rigid(w, tree, point, frame, symmetric=False)


def _velocity(w: Writer, point: str, base: str, frame: str) -> str:
    if w.chance(0.5):
        return f"{point}.v2pt_theory({base}, N, {frame})"
    return f"{point}.set_vel(N, {point}.pos_from(O).dt(N))"


def _particle(w: Writer, tree: Tree, point: str) -> None:
    w.note("particle")
    name, mass = f"body{len(tree.bodies)}", w.value("m", 0.5, 2.0)
    w.line(f'{name} = me.Particle("{name}", {point}, {mass})')
    tree.bodies.append(name)
    tree.centres.append((name, point, mass))


def _rigid(w: Writer, tree: Tree, point: str, frame: str, symmetric: bool) -> None:
    """A body with its centre beside the pivot, and a point at its end."""
    w.note("rigid body")
    k, j, mass = len(tree.points), len(tree.bodies), w.value("m", 0.5, 2.0)
    w.line(f'P{k} = {point}.locatenew("P{k}", {_arm(w, tree, frame)})')
    w.line(_velocity(w, f"P{k}", point, frame))
    about = "".join(f", {entry}" for entry in _moments(w, tree.planar, symmetric))
    w.line(
        f'body{j} = me.RigidBody("body{j}", P{k}, {frame}, {mass}, '
        f"(me.inertia({frame}{about}), P{k}))"
    )
    tree.points.append((f"P{k}", frame))
    tree.ways[f"P{k}"] = tree.way(point, frame)
    tree.bodies.append(f"body{j}")
    tree.centres.append((f"body{j}", f"P{k}", mass))


def _moments(w: Writer, planar: bool, symmetric: bool) -> list[str]:
    """Three moments, which keep the triangle inequality, and seldom products."""
    if planar:
        return ["0", "0", w.value("J", 0.1, 0.5)]
    one = w.value("J", 0.3, 0.5)
    moments = [one, one if symmetric else w.value("J", 0.3, 0.5), w.value("J", 0.3, 0.55)]
    if symmetric:
        w.note("symmetric body")
    if w.chance(0.15):
        w.note("products of inertia")
        moments += [w.signed("J", 0.05) for _ in range(3)]
    return moments


# -- loads ----------------------------------------------------------------------------------------


def write_loads(w: Writer, tree: Tree, u: list[str]) -> None:
    """``loads``: gravity, springs, dampers, forces of time and others, on points and frames."""
    loads: list[str] = []
    if w.chance(0.2):
        w.note("no loads")
        w.line("loads = []")
        return
    if w.chance(0.85):
        w.note("gravity")
        g, down = w.value("g", 8.0, 11.0), w.one_of(["-N.y", "-N.y", "N.x", "-N.z"])
        if tree.planar and down == "-N.z":
            down = "-(3 * N.x + 4 * N.y) / 5"
        loads += [f"({point}, {m} * {g} * ({down}))" for _, point, m in tree.centres]
    for q, frame, parent, axis in tree.turns:
        if w.chance(0.4):
            torque = _joint_law(w, q, f"{q}.diff(t)")
            loads.append(f"({frame}, ({torque}) * ({axis}))")
            if parent != "N" and w.chance(0.6):
                w.note("torque and its reaction")
                loads.append(f"({parent}, -({torque}) * ({axis}))")
    for q, point, along in tree.slides:
        if w.chance(0.7):
            loads.append(f"({point}, ({_joint_law(w, q, f'{q}.diff(t)')}) * {along})")
    if w.chance(0.3):
        loads.append(_between_points(w, tree))
    if w.chance(0.25):
        w.note("drag of a point")
        _, point, _ = w.one_of(tree.centres)
        loads.append(f"({point}, -{w.value('c', 0.02, 0.4)} * {point}.vel(N))")
    if w.chance(0.3):
        _, point, _ = w.one_of(tree.centres)
        loads.append(f"({point}, ({expressions.drive(w)}) * N.{w.one_of(AXES[:2])})")
    if w.chance(0.15):
        _, point, _ = w.one_of(tree.centres)
        loads.append(f"({point}, {inputs.written(w, tree.q)} * N.{w.one_of(AXES[:2])})")
    w.line(f"loads = [{', '.join(loads)}]")


def _joint_law(w: Writer, q: str, v: str) -> str:
    terms = [expressions.restoring(w, q)]
    if w.chance(0.5):
        terms.append(expressions.damping(w, v))
    if w.chance(0.2):
        terms.append(expressions.drive(w))
    if w.chance(0.15):
        terms.append(expressions.coupling(w, q, q))
    return " + ".join(terms)


def _between_points(w: Writer, tree: Tree) -> str:
    """A spring from a fixed anchor to a point, whose length is a root."""
    w.note("spring between points")
    _, point, _ = w.one_of(tree.centres)
    k, rest = w.value("k", 0.5, 5.0), w.value("l", 0.4, 1.2)
    x, y = w.number(2.5, 4.0), w.number(2.0, 3.0)
    w.line(f'anchor = O.locatenew("anchor", {x} * N.x + {y} * N.y)')
    w.line("anchor.set_vel(N, 0)")
    w.line(f"apart = {point}.pos_from(anchor)")
    w.line("length = sm.sqrt(apart.dot(apart))")
    return f"({point}, -{k} * (length - {rest}) * apart / length)"


# -- as objects of SymPy --------------------------------------------------------------------------


def write_kane(w: Writer) -> None:
    """An open mechanism as a KanesMethod."""
    _write_kane(w, write_tree(w))


def write_rotor(w: Writer) -> None:
    """One body that swings and spins, as a KanesMethod."""
    tree = _ground(w, planar=False)
    _spinning(w, tree)
    w.note("coordinates: 2")
    _write_kane(w, tree)


def _write_kane(w: Writer, tree: Tree) -> None:
    u = [w.state(f"{w.one_of(['u', 'omega'])}{k}", -1.2, 1.2) for k in range(len(tree.q))]
    write_loads(w, tree, u)
    rates = [f"{q}.diff(t) - {v}" for q, v in zip(tree.q, u, strict=True)]
    if w.chance(0.25):
        w.note("speeds that are no rates")
        k = w.whole(0, len(u) - 1)
        other = w.one_of(tree.q)
        rates[k] = w.one_of([
            f"{u[k]} - {w.value('s', 0.5, 1.5)} * {tree.q[k]}.diff(t)",
            f"{u[k]} - {tree.q[k]}.diff(t) - {w.signed('d', 0.4)} * sm.sin({other})",
            f"{u[k]} - (2 + sm.cos({tree.q[k]})) * {tree.q[k]}.diff(t)",
        ])  # fmt: skip
        if len(u) > 1 and w.chance(0.5):
            other = tree.q[(k + 1) % len(u)]
            rates[k] = f"{u[k]} - {tree.q[k]}.diff(t) - {other}.diff(t) / 2"
    w.line(f"q, u = [{', '.join(tree.q)}], [{', '.join(u)}]")
    w.line(f"formed = me.KanesMethod(N, q, u, kd_eqs=[{', '.join(rates)}])")
    w.line(f"formed.kanes_equations([{', '.join(tree.bodies)}], loads)")
    w.line("described = formed")
    if "speeds that are no rates" not in w.used and w.chance(0.15):
        if w.chance(0.7):
            stops.write(w, tree.q)
        else:
            stops.write_friction(w, tree.q, u)


def write_lagrange(w: Writer) -> None:
    """An open mechanism as a LagrangesMethod."""
    tree = write_tree(w, most=3)
    write_lagrangian(w, tree, "")


def write_lagrangian(w: Writer, tree: Tree, constraints: str) -> None:
    """The object of a tree, with the keywords of its constraints."""
    w.starts |= {f"{name}_dot": (-1.2, 1.2) for name in tree.q}
    write_loads(w, tree, [f"{q}.diff(t)" for q in tree.q])
    w.line(f"q = [{', '.join(tree.q)}]")
    w.line("u = [x.diff(t) for x in q]")
    w.line(f"L = me.Lagrangian(N, {', '.join(tree.bodies)})")
    w.line(f"formed = me.LagrangesMethod(L, q, forcelist=loads, "
           f"bodies=[{', '.join(tree.bodies)}], frame=N{constraints})")  # fmt: skip
    w.line("formed.form_lagranges_equations()")
    w.line("described = formed")
