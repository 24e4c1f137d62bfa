"""Random laws, each in two forms: an expression of SymPy, and Python code that knows its zeros.

The code is smooth: what a jump or a corner decides is a *cell* ``b[n]``, the number of the interval
between marks in which an argument lies.  So ``asin(sin(z))`` is ``z - pi n`` or ``pi n - z``, with
n the cell of z/pi + 1/2, and no function of the code has a corner, a jump or a feature that its
marks do not tell.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

t = dynamicsymbols._t
a = sm.Symbol("a")  # the parameter of every law
LONGEST = 60  # operations of one law
FEATURE = (-37.0, -12.0, -4.0, -1.0, 0.0, 1.0, 4.0, 12.0, 37.0)  # marks of z in tanh(z), exp(-z^2)
Rng = np.random.Generator


class Term(NamedTuple):
    """A term of a law in both forms."""

    expr: sm.Expr
    code: str


class Cell(NamedTuple):
    """An argument and the marks between its cells; no marks: the whole numbers.

    ``end``: what the law has at its marks, where it has no value there: ``"pole"``, ``"domain"``.
    """

    code: str
    marks: tuple[float, ...]
    end: str = ""


@dataclass
class Law:
    """Forces on one or two unit masses, of q0, u0, q1, u1, t and a."""

    forces: list[Term]
    cells: list[Cell]
    a: float
    y0: np.ndarray
    used: set[str] = field(default_factory=set)

    @property
    def size(self) -> int:
        """The number of masses."""
        return len(self.forces)


class Drawer:
    """Draws the terms of one law, whose cells it collects."""

    def __init__(self, rng: Rng, masses: int) -> None:
        self.rng, self.masses = rng, masses
        self.cells: list[Cell] = []
        self.used: set[str] = set()
        self.q = [Term(sm.Symbol(f"q{k}"), f"q{k}") for k in range(masses)]
        self.u = [Term(sm.Symbol(f"u{k}"), f"u{k}") for k in range(masses)]

    # -- leaves -------------------------------------------------------------------------------

    def number(self, low: float, high: float) -> Term:
        value = round(float(self.rng.uniform(low, high)), 2)
        return Term(sm.Rational(str(value)), repr(value))

    def _leaf(self) -> Term:
        kind = self.rng.random()
        if kind < 0.55:
            return self.q[self.rng.integers(self.masses)]
        if kind < 0.75:
            return self.u[self.rng.integers(self.masses)]
        return Term(t, "t") if kind < 0.9 else Term(a, "a")

    def affine(self, low: float = 0.5, high: float = 3.0) -> Term:
        """A coordinate, speed, time or a sum of them, scaled and shifted."""
        x = self._leaf()
        if self.rng.random() < 0.25:
            x = self.add(x, self.times(self.number(-1.5, 1.5), self._leaf()))
        return self.add(self.times(self.number(low, high), x), self.number(-1.0, 1.0))

    # -- algebra ------------------------------------------------------------------------------

    def add(self, x: Term, y: Term) -> Term:
        return Term(x.expr + y.expr, f"({x.code} + {y.code})")

    def times(self, x: Term, y: Term) -> Term:
        return Term(x.expr * y.expr, f"({x.code} * {y.code})")

    def apply(self, name: str, x: Term) -> Term:
        """A smooth function of SymPy and NumPy that has one name in both."""
        return Term(getattr(sm, name)(x.expr), f"{name}({x.code})")

    def cell(self, code: str, *marks: float, end: str = "") -> str:
        """The number of the cell of an argument."""
        self.cells.append(Cell(code, marks, end))
        return f"b[{len(self.cells) - 1}]"

    def side(self, code: str) -> str:
        """The sign of an argument."""
        return f"(2 * {self.cell(code, 0.0)} - 1)"

    # -- terms --------------------------------------------------------------------------------

    def term(self, depth: int) -> Term:
        """A term whose values are moderate where its arguments are."""
        if depth <= 0:
            return self.affine()
        kind = self.rng.random()
        if kind < 0.15:
            return self.add(self.term(depth - 1), self.term(depth - 1))
        if kind < 0.3:
            return self.times(self.bounded(depth - 1), self.term(depth - 1))
        return self.bounded(depth)

    def bounded(self, depth: int) -> Term:
        """One function of the list of this file, of a smaller term."""
        x = self.affine() if depth <= 1 or self.rng.random() < 0.4 else self.term(depth - 1)
        name = str(self.rng.choice(NAMES, p=SHARES))
        self.used.add(name)
        found: Term = getattr(self, f"_{name}")(x)
        return found

    def other(self) -> Term:
        return self.affine() if self.rng.random() < 0.7 else self.number(-1.0, 1.0)

    def _sin(self, x: Term) -> Term:
        return self.apply(str(self.rng.choice(["sin", "cos"])), x)

    def _tanh(self, x: Term) -> Term:
        self.cell(x.code, *FEATURE)
        return self.apply("tanh", x)

    def _exp(self, x: Term) -> Term:
        return self.apply("exp", self.apply("sin", x))

    def _log(self, x: Term) -> Term:
        return Term(sm.log(1 + x.expr**2), f"log(1 + ({x.code})**2)")

    def _atan(self, x: Term) -> Term:
        return Term(sm.atan(x.expr), f"arctan({x.code})")

    def _sinh(self, x: Term) -> Term:
        """Of a sine, so that it is bounded."""
        return self.apply(str(self.rng.choice(["sinh", "cosh"])), self.apply("sin", x))

    def _root(self, x: Term) -> Term:
        return Term(sm.sqrt(1 + x.expr**2), f"sqrt(1 + ({x.code})**2)")

    def _rational(self, x: Term) -> Term:
        self.cell(x.code, *FEATURE)
        return Term(1 / (1 + x.expr**2), f"(1 / (1 + ({x.code})**2))")

    def _power(self, x: Term) -> Term:
        """Of an absolute value, whole or not."""
        n = sm.Rational(int(self.rng.integers(3, 8)), 2)
        side = self.side(x.code)
        return Term(sm.Abs(x.expr) ** n, f"abs({side} * {x.code})**{float(n)}")

    def _weak_power(self, x: Term) -> Term:
        """Less than 1: its slope is infinite at its zero."""
        return Term(sm.sqrt(sm.Abs(x.expr)), f"sqrt(abs({self.side(x.code)} * {x.code}))")

    def _signed_power(self, x: Term) -> Term:
        side = self.side(x.code)
        value = sm.sign(x.expr) * sm.Abs(x.expr) ** sm.Rational(3, 2)
        return Term(value, f"({side} * abs({x.code})**1.5)")

    def _Abs(self, x: Term) -> Term:  # noqa: N802
        return Term(sm.Abs(x.expr), f"({self.side(x.code)} * {x.code})")

    def _sign(self, x: Term) -> Term:
        return Term(sm.sign(x.expr), self.side(x.code))

    def _Heaviside(self, x: Term) -> Term:  # noqa: N802
        return Term(sm.Heaviside(x.expr), self.cell(x.code, 0.0))

    def _floor(self, x: Term) -> Term:
        if self.rng.random() < 0.5:
            return Term(sm.floor(x.expr), self.cell(x.code))
        return Term(sm.ceiling(x.expr), f"(-{self.cell(f'(-{x.code})')})")

    def _Mod(self, x: Term) -> Term:  # noqa: N802
        m = self.number(0.3, 1.5)
        return Term(sm.Mod(x.expr, m.expr, evaluate=False),
                    f"({x.code} - {m.code} * {self.cell(f'({x.code} / {m.code})')})")  # fmt: skip

    def _frac(self, x: Term) -> Term:
        return Term(sm.frac(x.expr), f"({x.code} - {self.cell(x.code)})")

    def _Max(self, x: Term) -> Term:  # noqa: N802
        y, largest = self.other(), self.rng.random() < 0.5
        larger = self.cell(f"({x.code} - {y.code})", 0.0)
        one, two = (x, y) if largest else (y, x)
        chosen = f"({one.code} if {larger} else {two.code})"
        return Term((sm.Max if largest else sm.Min)(x.expr, y.expr), chosen)

    def _Piecewise(self, x: Term) -> Term:  # noqa: N802
        """Of two or three pieces."""
        y, z, edge = self.other(), self.other(), self.number(-0.5, 0.5)
        first = self.cell(f"({y.code} - {edge.code})", 0.0)
        if self.rng.random() < 0.5:
            chosen = f"({x.code} if {first} else {z.code})"
            return Term(sm.Piecewise((x.expr, y.expr > edge.expr), (z.expr, True)), chosen)
        second = self.cell(z.code, 0.0)
        both = sm.And(y.expr > edge.expr, z.expr >= 0)
        one_of = sm.Or(y.expr > edge.expr, z.expr >= 0)
        code = f"({x.code} if {first} and {second} else 1.0 if {first} or {second} else {z.code})"
        return Term(sm.Piecewise((x.expr, both), (1, one_of), (z.expr, True)), code)

    def _atan2(self, x: Term) -> Term:
        """Of a wave and its quarter: the angle wrapped; or of two terms, without its cut."""
        if self.rng.random() < 0.5:
            n = self.cell(f"({x.code} / (2 * pi) + 0.5)")
            return Term(sm.atan2(sm.sin(x.expr), sm.cos(x.expr)), f"({x.code} - 2 * pi * {n})")
        y = self.other()
        side = self.side(y.code)
        smooth = f"({side} * (pi / 2 - arctan2({x.code}, {side} * {y.code})))"
        return Term(sm.atan2(y.expr, x.expr), smooth)

    def _asin(self, x: Term) -> Term:
        n = self.cell(f"({x.code} / pi + 0.5)")
        return Term(sm.asin(sm.sin(x.expr)), f"((1 - 2 * ({n} % 2)) * ({x.code} - pi * {n}))")

    def _acos(self, x: Term) -> Term:
        n = self.cell(f"({x.code} / pi)")
        code = f"(({n} % 2) * pi + (1 - 2 * ({n} % 2)) * ({x.code} - pi * {n}))"
        return Term(sm.acos(sm.cos(x.expr)), code)

    def _atan_of_tan(self, x: Term) -> Term:
        n = self.cell(f"({x.code} / pi + 0.5)")
        return Term(sm.atan(sm.tan(x.expr)), f"({x.code} - pi * {n})")

    def _asin_of_rational(self, x: Term) -> Term:
        """asin(2 z / (1 + z^2)), which touches 1 and -1."""
        n = self.cell(x.code, -1.0, 1.0)
        turned = f"(arctan({x.code}) if {n} == 1 else (({n} - 1) * pi / 2 - arctan({x.code})))"
        return Term(sm.asin(2 * x.expr / (1 + x.expr**2)), f"(2 * {turned})")

    def _acos_of_square(self, x: Term) -> Term:
        """acos(1 - s^2 / 2) = 2 asin(|s| / 2), of s = sin(x)."""
        wave = f"sin({x.code})"
        side = self.side(wave)
        return Term(sm.acos(1 - sm.sin(x.expr) ** 2 / 2), f"(2 * {side} * arcsin({wave} / 2))")

    def _root_of_square(self, x: Term) -> Term:
        """A root that touches zero; written out, half of the time."""
        c = self.number(-1.0, 1.0)
        square = (x.expr - c.expr) ** 2
        if self.rng.random() < 0.5:
            square = sm.expand(square)
        side = self.side(f"({x.code} - {c.code})")
        return Term(sm.sqrt(square), f"({side} * ({x.code} - {c.code}))")

    def _root_of_wave(self, x: Term) -> Term:
        if self.rng.random() < 0.5:
            half = f"sin(({x.code}) / 2)"
            return Term(sm.sqrt(1 - sm.cos(x.expr)), f"(sqrt(2) * {self.side(half)} * {half})")
        wave = f"cos({x.code})"
        return Term(sm.sqrt(1 - sm.sin(x.expr) ** 2, evaluate=False),
                    f"({self.side(wave)} * {wave})")  # fmt: skip

    def _sign_of_tan(self, x: Term) -> Term:
        n = self.cell(f"({x.code} * 2 / pi)")
        return Term(sm.sign(sm.tan(x.expr)), f"(1 - 2 * ({n} % 2))")

    def _Heaviside_of_pole(self, x: Term) -> Term:  # noqa: N802
        return Term(sm.Heaviside(1 / x.expr), self.cell(x.code, 0.0))

    def _atan_of_pole(self, x: Term) -> Term:
        return Term(sm.atan(1 / x.expr), f"({self.side(x.code)} * pi / 2 - arctan({x.code}))")

    def _tanh_of_pole(self, x: Term) -> Term:
        side = self.side(x.code)
        marks = [1 / z for z in FEATURE if z]
        self.cell(x.code, *sorted(marks))
        return Term(sm.tanh(1 / x.expr), f"tanh(1 / ({side} * max({side} * {x.code}, 1e-300)))")

    def _narrow(self, x: Term) -> Term:
        """A step, a bump, a pulse, a logistic function: as wide as a thousandth to a tenth."""
        width = sm.Rational(str(round(float(10 ** self.rng.uniform(-3, -1)), 4)))
        z = Term(x.expr / width, f"({x.code} / {float(width)})")
        kind = self.rng.integers(6)
        if kind == 3:
            n = sm.Integer(int(self.rng.choice([40, 200, 1000])))
            wave = self.cell(f"sin({x.code})", *(s * (1 - c / float(n)) for s, c in
                             ((-1, 1), (-1, 12), (-1, 37), (1, 37), (1, 12), (1, 1))))  # fmt: skip
            del wave
            return Term(sm.sin(x.expr) ** n, f"sin({x.code})**{n}")
        self.cell(z.code, *FEATURE)
        if kind == 0:
            return self.apply("tanh", z)
        if kind == 1:
            return Term(sm.exp(-(z.expr**2)), f"exp(-({z.code})**2)")
        if kind == 2:
            return Term(1 / (1 + sm.exp(-z.expr)), f"(0.5 + 0.5 * tanh({z.code} / 2))")
        if kind == 4:
            return Term(1 / sm.cosh(z.expr), f"(1 / cosh(min(max({z.code}, -700.), 700.)))")
        return Term(1 / (1 + z.expr**2), f"(1 / (1 + ({z.code})**2))")

    def _pole(self, x: Term) -> Term:
        self.cell(x.code, 0.0, end="pole")
        return Term(1 / x.expr, f"(1 / ({x.code}))")

    def _domain(self, x: Term) -> Term:
        """A root or an arc cosine whose argument may leave its range."""
        if self.rng.random() < 0.5:
            self.cell(x.code, 0.0, end="domain")
            return Term(sm.sqrt(x.expr), f"sqrt({x.code})")
        self.cell(x.code, -1.0, 1.0, end="domain")
        return Term(sm.acos(x.expr), f"arccos({x.code})")


WEIGHTS = {
    "sin": 2, "tanh": 1, "exp": 1, "log": 1, "atan": 1, "sinh": 0.5, "root": 1, "rational": 1,
    "power": 1, "weak_power": 0.5, "signed_power": 0.5, "Abs": 2, "sign": 1.5, "Heaviside": 1.5,
    "floor": 1.5, "Mod": 1.5, "frac": 0.5, "Max": 2, "Piecewise": 2, "atan2": 2, "asin": 1,
    "acos": 1, "atan_of_tan": 0.7, "asin_of_rational": 0.7, "acos_of_square": 0.7,
    "root_of_square": 0.7, "root_of_wave": 0.7, "sign_of_tan": 0.7, "Heaviside_of_pole": 0.4,
    "atan_of_pole": 0.7, "tanh_of_pole": 0.4, "narrow": 2, "pole": 0.15, "domain": 0.15,
}  # fmt: skip
NAMES = list(WEIGHTS)
SHARES = np.array(list(WEIGHTS.values())) / sum(WEIGHTS.values())


def drawn(seed: int) -> Law:
    """The law of a seed: a spring, a damper, and one to three random terms on each mass."""
    rng = np.random.default_rng([seed, 20])
    while True:
        drawer = Drawer(rng, int(rng.choice([1, 1, 2])))
        forces = []
        for k in range(drawer.masses):
            spring = drawer.times(drawer.number(-6.0, -1.0), drawer.q[k])
            damper = drawer.times(drawer.number(-0.5, 0.0), drawer.u[k])
            force = drawer.add(spring, damper)
            for _ in range(rng.integers(1, 3)):
                share = drawer.times(drawer.number(-2.0, 2.0), drawer.term(int(rng.integers(1, 4))))
                if rng.random() < 0.5:
                    share = drawer.times(Term(a, "a"), share)
                force = drawer.add(force, share)
            forces.append(force)
        if all(sm.count_ops(f.expr) <= LONGEST for f in forces):
            y0 = np.round(rng.uniform(-1.5, 1.5, 2 * drawer.masses), 3)
            return Law(forces, drawer.cells, round(float(rng.uniform(0.3, 1.5)), 3), y0,
                       drawer.used)  # fmt: skip
