"""Laws: scalar functions of coordinates, speeds and time, as users write them."""

from __future__ import annotations

from collections.abc import Sequence

from .writer import Writer

CORNERED = ("one-sided", "pieces", "Abs", "table", "quadratic", "switched")
WITHOUT_SERIES = ("tanh", "sinh", "cosh", "atan", "smooth step", *CORNERED)
NONE_OF = {"with series": WITHOUT_SERIES, "analytic": CORNERED, "cornered": ()}


def _law(w: Writer, what: str, kinds: Sequence[str]) -> str:
    """One of the kinds whose functions the scene may have."""
    none_of = NONE_OF[w.functions]
    kind = str(w.one_of([k for k in kinds if not any(word in k for word in none_of)]))
    w.note(f"{what}: {kind}")
    return kind


def restoring(w: Writer, x: str, most: float = 6.0) -> str:
    """A force or torque back to somewhere near x = 0."""
    k = w.value("k", 0.2, most)
    kind = _law(w, "spring", SPRINGS)
    if kind == "linear":
        return f"-{k} * {x}"
    if kind == "offset":
        return f"-{k} * ({x} - {w.signed('h', 0.5)})"
    if kind == "cubic":
        return f"-{k} * {x} - {w.value('k', 0.1, 1.5)} * {x}**3"
    if kind == "sine":
        return f"-{k} * sm.sin({x})"
    if kind == "tanh":
        return f"-{k} * sm.tanh({w.value('s', 0.5, 2.0)} * {x})"
    if kind == "one-sided":
        return f"-{k} * {x} - {w.value('k', 0.5, 5.0)} * sm.Max({x} - {w.signed('h', 0.4)}, 0)"
    if kind == "pieces":
        edge = w.signed("h", 0.5)
        return f"sm.Piecewise((-{k} * {x}, {x} < {edge}), (-{k} * {edge}, True)) - {k} * {x} / 4"
    if kind == "root":
        return f"-{k} * {x} / sm.sqrt({w.value('b', 0.2, 2.0)} + {x}**2)"
    if kind == "exponential":
        return f"-{k} * (sm.exp({x} / 2) - 1)"
    if kind == "table":
        return f"{k} * {_table(w)}({x})"
    if kind == "power of Abs":
        return f"-{k} * sm.sign({x}) * sm.Abs({x})**{w.one_of(['sm.Rational(3, 2)', '1.5', '2'])}"
    return f"-{k} * sm.sinh({x})"


SPRINGS = (
    "linear", "linear", "offset", "cubic", "sine", "tanh", "one-sided", "pieces", "root",
    "exponential", "power of Abs", "sinh", "table",
)  # fmt: skip


def _table(w: Writer) -> str:
    """A curve by its samples, and what SciPy makes of them."""
    name, kind = f"curve_{len(w.lines)}", w.one_of(["cubic", "cubic", "linear"])
    w.note(f"table: {kind}")
    x = [-2.0, -0.8, 0.1, 0.9, 2.0]
    y = [round(-0.8 * a + w.between(-0.3, 0.3), 2) for a in x]
    w.line(f'{name} = mechc.Table({x}, {y}, kind="{kind}")')
    w.line("from scipy.interpolate import make_interp_spline")
    if kind == "linear":
        inside = f"make_interp_spline({x}, {y}, k=1)"
    else:
        w.line("from scipy.interpolate import CubicSpline")
        inside = f"CubicSpline({x}, {y})"
    w.line(f"{name}_of_scipy = {inside}")
    return name


def damping(w: Writer, v: str) -> str:
    """A force or torque against a speed."""
    c = w.value("c", 0.02, 0.6)
    kind = _law(w, "damper", DAMPERS)
    if kind == "linear":
        return f"-{c} * {v}"
    if kind == "quadratic":
        return f"-{c} * {v} * sm.Abs({v})"
    if kind == "cubic":
        return f"-{c} * {v}**3 / 4"
    if kind == "tanh":
        return f"-{c} * sm.tanh({w.value('s', 0.5, 4.0)} * {v})"
    return f"-{c} * {v} / sm.sqrt(1 + {v}**2)"


DAMPERS = ("linear", "linear", "quadratic", "cubic", "tanh", "saturated")


def drive(w: Writer) -> str:
    """A force or torque of time."""
    a, omega = w.signed("F", 1.5), w.value("w", 0.5, 3.0)
    kind = _law(w, "of time", DRIVES)
    if kind == "sine":
        return f"{a} * sm.{w.one_of(['sin', 'cos'])}({omega} * t)"
    if kind == "decay":
        return f"{a} * sm.exp(-{omega} * t / 2)"
    if kind == "polynomial":
        return f"({a} + {w.signed('F', 0.5)} * t - t**2 / 10)"
    if kind == "switched":
        at = w.value("T", 0.4, 1.5)
        return f"sm.Piecewise(({a}, t < {at}), ({w.signed('F', 1.0)}, True))"
    return f"{a} * sm.tanh(t - {omega})"


DRIVES = ("sine", "sine", "decay", "polynomial", "switched", "smooth step")


def coupling(w: Writer, x: str, y: str) -> str:
    """Products of sines, powers and the like of two coordinates or speeds: bounded."""
    a, kind = w.signed("a", 1.0), _law(w, "coupling", COUPLINGS)
    return f"{a} * {kind.replace('X', x).replace('Y', y)}"


COUPLINGS = (
    "sm.sin(X) * sm.cos(Y)", "sm.sin(X) * sm.sin(Y)", "sm.cos(X - Y)", "sm.sin(X)**2 * sm.cos(Y)",
    "sm.cos(X)**3", "sm.sin(X) / (2 + sm.cos(Y))", "sm.exp(-X**2) * sm.sin(Y)",
    "sm.atan(X + Y)", "1 / (1 + X**2)", "sm.sqrt(1 + X**2) * sm.cos(Y)", "sm.log(2 + sm.sin(X))",
    "sm.cosh(sm.sin(X))", "sm.sin(2 * X + Y / 2)", "sm.tanh(X * Y)", "(1 + sm.sin(X)) ** 1.5",
    "sm.atan2(sm.sin(X), 2 + sm.cos(Y))", "X * sm.cos(Y) / (1 + X**2)",
)  # fmt: skip
