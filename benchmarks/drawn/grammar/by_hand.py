"""Equations derived by hand: mass matrices and forcings of functions, kinematics of all kinds."""

from __future__ import annotations

from . import expressions, inputs
from .writer import Writer


def write(w: Writer) -> None:
    """``described``, and the equations as a reference has them."""
    n = int(w.rng.choice([1, 2, 3, 4], p=[0.5, 0.3, 0.12, 0.08]))
    w.note(f"coordinates: {n}")
    q = [w.state(w.one_of(["x", "q", "phi"]) + f"_{k}", -1.0, 1.0) for k in range(n)]
    own = w.chance(0.7)  # speeds of their own, not q.diff()
    u = [w.state(f"{w.one_of(['v', 'u', 'omega'])}_{k}", -1.2, 1.2) for k in range(n)]
    speeds = u if own else [f"{x}.diff(t)" for x in q]
    if not own:
        w.note("speeds are the rates")
        for old, x in zip(u, q, strict=True):
            w.starts[f"{x}_dot"] = w.starts.pop(old)
    explicit = w.chance(0.2)
    force = [_force(w, k, q, speeds) for k in range(n)]
    mass = None if explicit else _mass(w, q)
    w.note("by hand: explicit" if explicit else "by hand: implicit")
    w.line(f"q, u = [{', '.join(q)}], [{', '.join(speeds)}]")
    w.line(f"F = [{', '.join(force)}]")
    w.line("M = " + ("None" if mass is None else f"[{', '.join(mass)}]"))
    kinematics = ""
    if own and w.chance(0.25):
        w.note("by hand: kinematics")
        w.line(f"rates = [{', '.join(_rate(w, k, q, u) for k in range(n))}]")
        if w.chance(0.5):
            kinematics = ", kinematics=dict(zip(q, rates))"
        else:
            kinematics = ", kinematics=[x.diff(t) - r for x, r in zip(q, rates)]"
    else:
        w.line("rates = u")
    taken = "q, u" if own else "q, None"
    w.line(f"described = mechc.from_equations({taken}, M, F{kinematics})")


def _mass(w: Writer, q: list[str]) -> list[str]:
    """Rows of a matrix that is positive definite by its diagonal."""
    n = len(q)
    entries = [["0"] * n for _ in q]
    for k, x in enumerate(q):
        other = w.one_of(q)
        entries[k][k] = w.one_of(_DIAGONAL)(w, x, other)
        for j in range(k):
            if w.chance(0.6):
                c = w.signed("c", 0.3)
                text = w.one_of(BESIDE)
                entries[k][j] = entries[j][k] = text.format(c=c, x=x, y=q[j])
    return [f"[{', '.join(row)}]" for row in entries]


_DIAGONAL = (
    lambda w, x, y: w.value("m", 1.2, 3.0),
    *(
        lambda w, x, y: f"{w.value('A', 2.5, 4.0)} + {w.value('B', 0.2, 1.2)} * sm.sin({x})",
        lambda w, x, y: f"{w.value('A', 2.5, 4.0)} + {w.signed('B', 1.2)} * sm.cos({y})",
        lambda w, x, y: f"{w.value('A', 2.5, 4.0)} + ({w.value('B', 1.0, 2.0)} - 1) * sm.sin({x})",
    )
    * 2,
    lambda w, x, y: f"{w.value('m', 1.2, 2.0)} * {w.value('l', 1.0, 1.5)}**2 + {x}**2 / 4",
    lambda w, x, y: (
        f"{w.value('m', 1.2, 2.0)} + {w.value('J', 0.5, 2.0)} * sm.sin({x})**2"
        f" + {w.value('J', 0.5, 2.0)} * sm.cos({x})**2"
    ),
    lambda w, x, y: (
        f"{w.value('m', 1.2, 2.0)} + {w.value('J', 0.5, 2.0)} * sm.sin({x})**2"
        f" + {w.value('J', 0.5, 2.0)} * sm.cos({y})**2"
    ),
)


BESIDE = ("{c}", "{c} * sm.cos({x} - {y})", "{c} * sm.sin({x}) * sm.cos({y})", "{c} * sm.cos({x})")


def _force(w: Writer, k: int, q: list[str], u: list[str]) -> str:
    terms = [expressions.restoring(w, q[k])] if w.chance(0.5) else []
    if w.chance(0.4):
        terms.append(expressions.damping(w, u[k]))
    for _ in range(w.one_of([0, 0, 0, 1, 2])):
        x, y = w.one_of(q), w.one_of(q + u)
        terms.append(expressions.coupling(w, x, y))
    if w.chance(0.7) or not terms:
        speed = u[k] if w.chance(0.6) else w.one_of(u)
        terms.append(f"{w.signed('B', 0.8)} * sm.{w.one_of(['cos', 'sin'])}({q[k]}) * {speed}**2")
        w.note("products of speeds")
    if w.chance(0.2):
        terms.append(expressions.drive(w))
    if w.chance(0.12):
        terms.append(inputs.written(w, q))
    return " + ".join(terms)


def _rate(w: Writer, k: int, q: list[str], u: list[str]) -> str:
    x, v = q[k], u[k]
    return str(
        w.one_of([
            f"{w.value('s', 0.5, 1.5)} * {v}",
            f"{v} + {w.signed('e', 0.4)} * {w.one_of(u)}",
            f"{v} * (1 + {x}**2 / 4)",
            f"{v} / (2 + sm.cos({w.one_of(q)}))",
            f"{v} + {w.signed('d', 0.3)} * sm.sin(t)",
            f"{v} - {w.signed('d', 0.3)} * {x}",
        ])
    )  # fmt: skip


def write_closed(w: Writer) -> None:
    """Masses in a plane on rods, in Cartesian coordinates; or a blade, which does not slip."""
    if w.chance(0.3):
        _blade(w)
        return
    count, position, follows, force, mass = w.whole(1, 2), [], [], [], []
    names = [(w.state(f"x_{k}", -0.9, 0.9), w.state(f"y_{k}", -1.8 - k, -0.8 - k))
             for k in range(count)]  # fmt: skip
    q = [x for pair in names for x in pair]
    u = [w.state(f"v_{k}", -1.0, 1.0) for k in range(2 * count)]
    for k, (x, y) in enumerate(names):
        w.note("by hand: rod")
        m, g = w.value("m", 0.5, 2.0), w.value("g", 8.0, 11.0)
        mass += [m, m]
        force += [expressions.restoring(w, x), f"-{m} * {g}"]
        before = names[k - 1] if k and w.chance(0.7) else ("0", "0")
        squares = f"({x} - {before[0]})**2 + ({y} - {before[1]})**2"
        name = _follower(w, "L", f"sm.sqrt({squares})", follows)
        position.append(w.one_of([f"{squares} - {name}**2", f"({squares}) / {name} - {name}"]))
    w.line(f"q, u = [{', '.join(q)}], [{', '.join(u)}]")
    w.line("rates = u")
    w.line(f"M = sm.diag({', '.join(mass)})")
    w.line(f"F = [{', '.join(force)}]")
    w.line(f"position = [{', '.join(position)}]")
    w.line(f"follows = {{{', '.join(follows)}}}")
    w.line("described = mechc.from_equations(q, u, M, F, constraints=position)")


def _follower(w: Writer, stem: str, value: str, follows: list[str]) -> str:
    """A parameter whose value follows from the start."""
    name = f"{stem}_f{len(follows)}"
    w.line(f'{name} = sm.Symbol("{name}")')
    follows.append(f"{name}: {value}")
    return name


def _blade(w: Writer) -> None:
    w.note("by hand: blade")
    q = [w.state(name, -0.5, 0.5) for name in ("x", "y", "phi")]
    u = [w.state(name, -1.0, 1.0) for name in ("v_x", "v_y", "omega")]
    m, J = w.value("m", 0.5, 2.0), w.value("J", 0.2, 1.0)
    force = [expressions.damping(w, v) for v in u]
    force[2] += " + " + w.one_of([expressions.restoring(w, "phi"), expressions.drive(w)])
    force[0] += " + " + expressions.coupling(w, "phi", "y")
    w.line(f"q, u = [{', '.join(q)}], [{', '.join(u)}]")
    w.line("rates = u")
    w.line(f"M = sm.diag({m}, {m}, {J})")
    w.line(f"F = [{', '.join(force)}]")
    w.line("velocity = [v_x * sm.sin(phi) - v_y * sm.cos(phi)]")
    w.line("described = mechc.from_equations(q, u, M, F, velocity_constraints=velocity)")
