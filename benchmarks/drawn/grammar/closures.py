"""Loops: trees of bodies closed by rods, pins, guides, gears and drives.

What a loop needs to be closed (a rod's length, a pin's place) follows from the start, so that every
start is one that closes.
"""

from __future__ import annotations

from . import inputs, open_mechanisms
from .open_mechanisms import Tree
from .writer import Writer


def write_kane(w: Writer) -> None:
    """A KanesMethod with dependent coordinates and speeds."""
    tree, linkage = _tree(w, 3)
    u = [w.state(f"u{k}", -1.0, 1.0) for k in range(len(tree.q))]
    open_mechanisms.write_loads(w, tree, u)
    w.line(f"rates = {{{', '.join(f'{q}.diff(t): {v}' for q, v in zip(tree.q, u, strict=True))}}}")
    dependent = _position(w, tree, linkage)
    free = [q for q in tree.q if q not in dependent]
    v = dict(zip(tree.q, u, strict=True))
    w.line(f"q, u = [{', '.join(free + dependent)}], [{', '.join(v[q] for q in free + dependent)}]")
    w.line(
        f"formed = me.KanesMethod(N, [{', '.join(free)}], [{', '.join(v[q] for q in free)}], "
        f"kd_eqs=[x - r for x, r in rates.items()], q_dependent=[{', '.join(dependent)}], "
        f"u_dependent=[{', '.join(v[q] for q in dependent)}], configuration_constraints=position, "
        "velocity_constraints=[g.diff(t).xreplace(rates) for g in position])"
    )
    w.line(f"formed.kanes_equations([{', '.join(tree.bodies)}], loads)")
    w.line("described = formed")


def write_lagrange(w: Writer) -> None:
    """A LagrangesMethod with holonomic constraints."""
    tree, linkage = _tree(w, 4)
    _position(w, tree, linkage)
    open_mechanisms.write_lagrangian(w, tree, ", hol_coneqs=position")


LINKAGES = {2: "slider-crank", 3: "four-bar", 4: "five-bar"}  # by the pins before the loop closes


def _tree(w: Writer, most: int) -> tuple[Tree, str]:
    """A linkage's chain of pins; or any tree, which is none."""
    if w.chance(0.5):
        count = w.one_of([2, 3, 3, 4][: most + most - 4])
        w.note(f"loop: {LINKAGES[count]}")
        return open_mechanisms.write_chain(w, count), LINKAGES[count]
    return open_mechanisms.write_tree(w, least=2, most=3, planar=0.7), ""


def _position(w: Writer, tree: Tree, linkage: str) -> list[str]:
    """``position`` and ``follows``; coordinates that may depend on the others."""
    if linkage:
        point, axes = tree.points[-1][0], ["x", "y"] if linkage != "slider-crank" else ["y"]
        return _at_a_place(w, point, axes, tree.way(point))
    ends = [(p, tree.way(p)) for p, _ in tree.points if p != "O" and len(tree.way(p)) > 1]
    kind = w.one_of(
        ["gear", "driven coordinate", "driven by an input"] + ["rod", "rod", "guide"] * bool(ends)
    )
    w.note(f"loop: {kind}")
    if kind not in ("rod", "guide"):
        return _between_coordinates(w, tree, kind)
    point, way = w.one_of(ends)
    if kind == "rod":
        x, y = round(w.between(1.0, 2.5), 2), round(w.between(-2.0, 2.0), 2)
        w.line(f'pivot = O.locatenew("pivot", {x} * N.x + {y} * N.y)')
        w.line("pivot.set_vel(N, 0)")
        w.line(f"across = {point}.pos_from(pivot)")
        w.line('L_f = sm.Symbol("L_f")')
        w.line("follows = {L_f: sm.sqrt(across.dot(across))}")
        w.line("position = [(across.dot(across) - L_f**2) / (2 * L_f)]")
        return [way[-1]]
    return _at_a_place(w, point, [w.one_of(["x", "y"])], way)


def _at_a_place(w: Writer, point: str, axes: list[str], way: tuple[str, ...]) -> list[str]:
    """A point that keeps some of its components."""
    for a in axes:
        w.line(f'{a}_f = sm.Symbol("{a}_f")')
    w.line(f"place = {point}.pos_from(O)")
    w.line(f"follows = {{{', '.join(f'{a}_f: place.dot(N.{a})' for a in axes)}}}")
    w.line(f"position = [{', '.join(f'place.dot(N.{a}) - {a}_f' for a in axes)}]")
    return list(way[-len(axes) :])


def _between_coordinates(w: Writer, tree: Tree, kind: str) -> list[str]:
    one = tree.q[-1]
    w.line('d_f = sm.Symbol("d_f")')
    if kind == "gear":
        law = f"{w.value('n', 0.4, 2.0)} * {tree.q[0]}"
        if w.chance(0.3):
            law = f"{w.value('n', 0.2, 0.8)} * sm.sin({tree.q[0]})"
    elif kind == "driven by an input" and not w.inputs:
        law = f"{w.value('n', 0.4, 1.5)} * {inputs.prescribed(w)}"
    else:
        omega = w.value("w", 0.4, 1.5)
        law = w.one_of([f"{omega} * t", f"{w.value('r', 0.1, 0.8)} * sm.sin({omega} * t)"])
    w.line(f"follows = {{d_f: {one} - {law}}}")
    w.line(f"position = [{one} - {law} - d_f]")
    return [one]
