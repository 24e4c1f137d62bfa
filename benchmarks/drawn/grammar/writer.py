"""The text of a scene while it is written: its lines, names, numbers and constructs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

Interval = tuple[float, float]
STYLES = ("symbols",) * 4 + ("numbers", "mixed", "mixed")
FUNCTIONS = ("with series", "with series", "with series", "analytic", "cornered")
ASSUMPTIONS = ("", "", ", positive=True", ", real=True")


class Writer:
    """Collects lines; draws names and values, each a symbol, a number or a small expression."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.lines: list[str] = []
        self.ranges: dict[str, Interval] = {}  # of parameters
        self.starts: dict[str, Interval] = {}  # of coordinates and speeds
        self.inputs: list[str] = []
        self.given: dict[str, str] = {}  # keywords of mechc.compile, as text
        self.used: set[str] = set()
        self.style = self.one_of(STYLES)
        self.assumed = self.one_of(ASSUMPTIONS)
        self.functions = self.one_of(FUNCTIONS)
        self.note(f"values as {self.style}")
        self.note(f"functions: {self.functions}")

    # -- draws ----------------------------------------------------------------------------------

    def chance(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def one_of(self, choices: Sequence[Any]) -> Any:
        return choices[int(self.rng.integers(len(choices)))]

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def whole(self, low: int, high: int) -> int:
        """From low to high, both included."""
        return int(self.rng.integers(low, high + 1))

    # -- text -----------------------------------------------------------------------------------

    def note(self, construct: str) -> None:
        """Counts a construct of this scene."""
        self.used.add(construct)

    def line(self, text: str) -> None:
        self.lines.append(text)

    def number(self, low: float, high: float) -> str:
        """A number as users write them: a decimal, a fraction or a whole number."""
        kind = self.rng.random()
        if kind < 0.15 and np.floor(high) >= np.ceil(low):
            return str(self.whole(int(np.ceil(low)), int(np.floor(high))))
        if kind < 0.3:
            n = self.whole(2, 8)
            return f"sm.Rational({round(self.between(low, high) * n) or 1}, {n})"
        return repr(round(self.between(low, high), 3) or 0.5)

    def symbol(self, stem: str, low: float, high: float) -> str:
        """A new parameter."""
        name = f"{stem}_{len(self.ranges)}" if self.chance(0.8) else f"{stem}{len(self.ranges)}"
        self.line(f'{name} = sm.Symbol("{name}"{self.assumed if low >= 0 else ""})')
        self.ranges[name] = (low, high)
        return name

    def value(self, stem: str, low: float, high: float) -> str:
        """A positive quantity within an interval, as a factor: safe beside any operator."""
        plain = self.style == "numbers" or (self.style == "mixed" and self.chance(0.5))
        if plain:
            return self.number(low, high)
        again = [n for n in self.ranges if n.startswith(stem) and self.ranges[n] == (low, high)]
        if again and self.chance(0.3):
            return str(self.one_of(again))
        kind = self.rng.random()
        if kind < 0.4:
            return self.symbol(stem, low, high)
        self.note("sums and products of parameters")
        if kind < 0.62:
            return f"({self.symbol(stem, 1 + low, 1 + high)} - 1)"
        if kind < 0.72:
            shift = round(high + self.between(0.1, 1.0), 2)
            return f"({shift!r} - {self.symbol(stem, shift - high, shift - low)})"
        if kind < 0.82:
            half = (low / 2, high / 2)
            return f"({self.symbol(stem, *half)} + {self.symbol(stem, *half)})"
        if kind < 0.89:
            root = (low**0.5, high**0.5)
            return f"({self.symbol(stem, *root)} * {self.symbol(stem, *root)})"
        if kind < 0.93:
            return f"({self.symbol(stem, low**0.5, high**0.5)}**2)"
        if kind < 0.96:
            return f"({self.symbol(stem, 2 * low, 2 * high)} / 2)"
        return f"(1 / {self.symbol(stem, 1 / high, 1 / low)})"

    def signed(self, stem: str, most: float) -> str:
        """A quantity of either sign, as a factor."""
        if self.style == "numbers" or (self.style == "mixed" and self.chance(0.5)):
            return f"({'-' * self.whole(0, 1)}{self.number(most / 10, most)})"
        if self.chance(0.5):
            return self.symbol(stem, -most, most)
        self.note("sums and products of parameters")
        a, b = self.symbol(stem, 0.0, most), self.symbol(stem, 0.0, most)
        return self.one_of([f"({a} - {b})", f"({a} - {b}) / 2", f"(-({a} - {b}))"])

    def drop_unused(self) -> None:
        """Drops parameters that were drawn for nothing: their names stand in their lines alone."""
        text = "\n".join([*self.lines, *self.given.values()])
        for name in list(self.ranges):
            if len(re.findall(rf"\b{name}\b", text)) == 2:
                self.lines = [line for line in self.lines if not line.startswith(f"{name} = ")]
                del self.ranges[name]

    def finished(self) -> None:
        """Adds what is the same of every kind: parameters that are fixed, and defaults."""
        names = list(self.ranges)
        if len(names) > 2 and self.chance(0.15):
            self.note("fix=")
            name = str(self.one_of(names))
            value = round(self.between(*self.ranges.pop(name)), 3)
            self.line(f"fixed = {{{name}: {value}}}")
            self.given["fix"] = "fixed"
        if self.ranges and self.chance(0.3):
            self.note("defaults=")
            some = [n for n in self.ranges if self.chance(0.5)]
            values = {n: round(self.between(*self.ranges[n]), 3) for n in some}
            inside = ", ".join(f"{n}: {x}" for n, x in values.items())
            self.line(f"defaulted = {{{inside}}}")
            self.given["defaults"] = "defaulted"

    def state(self, name: str, low: float, high: float) -> str:
        """A function of time whose start is drawn."""
        self.line(f'{name} = dynamicsymbols("{name}")')
        self.starts[name] = (low, high)
        return name
