"""The motion of a drawn law by SciPy, piece by piece: each with one cell of every argument.

A piece ends where an argument leaves its cell; the next one has the cell beyond.  Words of an end
that is no end of the time: ``pole`` and ``domain``, where the law has no value beyond;
``sticks``, where the motion beyond leads back at once; ``grazes``, where a mark is met without
speed; ``grows``, where the motion leaves all bounds; ``restless``, with more pieces than MOST.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from ...timing.cases import Array
from .draw import Law

MOST = 400  # pieces
BEYOND = 1e-9  # s: how far the motion is looked at beyond a mark
SLOW = 1e-5  # of a mark's argument, 1/s
ROUNDING = 1e-14  # 1/cosh of 40 is no step's argument: in doubles it is zero somewhere
BESIDE = 1e-9  # of a mark's argument: which of two marks comes first is rounding
LARGEST = 60.0
LONGEST = 200_000  # evaluations: it takes ever shorter steps towards a pole
OF_MATH = {"arctan": "atan", "arctan2": "atan2", "arcsin": "asin", "arccos": "acos"}
NAMES = ("sin", "cos", "tanh", "exp", "log", "sqrt", "cosh", "sinh", "pi")


class Followed(NamedTuple):
    """States at the times asked for, the number of pieces, and the word of an early end."""

    y: Array
    pieces: int
    word: str = ""
    signature: tuple[int, ...] = ()  # the cells that were left, in order


class Code:
    """The Python functions of a law: rates (of t, y, a, b), and an argument of each cell."""

    def __init__(self, law: Law) -> None:
        self.law = law
        state = [f"q{k}" for k in range(law.size)] + [f"u{k}" for k in range(law.size)]
        head = f"def {{}}(t, y, a, b):\n    {', '.join(state)}{',' * (len(state) == 1)} = y\n"
        speeds = ", ".join(f"u{k}" for k in range(law.size))
        forces = ", ".join(f.code for f in law.forces)
        text = head.format("rates") + f"    return [{speeds}, {forces}]\n"
        for n, cell in enumerate(law.cells):
            text += head.format(f"argument{n}") + f"    return {cell.code}\n"
        space: dict[str, Any] = {name: getattr(math, name) for name in NAMES}
        space |= {name: getattr(math, of) for name, of in OF_MATH.items()}
        exec(compile(text, "<law>", "exec"), space)
        self.rates: Callable[..., list[float]] = space["rates"]
        self.arguments = [space[f"argument{n}"] for n in range(len(law.cells))]


def _margin(
    argument: Callable[..., float], low: float, high: float, a: float, b: list[int]
) -> Callable[[float, Array], float]:
    """How far an argument is within its cell: an event of SciPy where it leaves."""

    def margin(t: float, y: Array) -> float:
        x = argument(t, y, a, b)
        left = float(min(x - low, high - x))
        return 0.0 if abs(left) < ROUNDING * max(1.0, abs(x)) else left

    margin.terminal, margin.direction = True, -1.0  # type: ignore[attr-defined]
    return margin


def _bounded(t: float, y: Array) -> float:
    return LARGEST - float(np.abs(y).max())


_bounded.terminal = True  # type: ignore[attr-defined]


class Reference:
    """The motions of one law."""

    def __init__(self, law: Law, max_step: float = 0.02) -> None:
        self.law, self.max_step = law, max_step

    @cached_property
    def code(self) -> Code:
        return Code(self.law)

    def follow(self, times: Sequence[float], y: Array, a: float, rtol: float = 1e-12) -> Followed:
        """States at ``times``, which grow, from the state ``y`` at 0."""
        try:
            return self._follow(times, np.array(y, float), a, rtol)
        except OverflowError:
            return Followed(np.empty((0, len(y))), 0, "grows")
        except (ArithmeticError, ValueError):
            return Followed(np.empty((0, len(y))), 0, "domain")

    def _follow(self, times: Sequence[float], y: Array, a: float, rtol: float) -> Followed:
        cells, found, left = self.law.cells, [], []
        time, b = 0.0, self._cells(0.0, y, a, None)
        arguments, calls = self.code.arguments, count()

        def rates(t: float, y: Array, a: float, b: list[int]) -> list[float]:
            if next(calls) > LONGEST:
                raise OverflowError("ever shorter steps")
            return self.code.rates(t, y, a, b)

        for _ in range(MOST):
            wanted = times[len(found) :]
            leaves = [
                _margin(argument, *self._limits(n, b), a, b) for n, argument in enumerate(arguments)
            ]
            piece = solve_ivp(
                lambda t, y, b=b: rates(t, y, a, b), (time, times[-1]), y, method="DOP853",
                rtol=rtol, atol=rtol, max_step=self.max_step, t_eval=wanted,
                events=[*leaves, _bounded],
            )  # fmt: skip
            if piece.status < 0:
                return Followed(np.array(found), len(left), "grows", tuple(left))
            found += list(np.transpose(piece.y))
            if piece.status == 0:
                return Followed(np.array(found), len(left), "", tuple(left))
            hit = [n for n, at in enumerate(piece.t_events) if at.size]
            time, y = float(piece.t_events[hit[0]][-1]), piece.y_events[hit[0]][-1]
            beside = (leave(time, y) for n, leave in enumerate(leaves) if n not in hit)
            if min(beside, default=1.0) < BESIDE:
                return Followed(np.array(found), len(left), "grazes", tuple(left))
            if hit[-1] == len(cells):
                return Followed(np.array(found), len(left), "grows", tuple(left))
            if ends := [cells[n].end for n in hit if cells[n].end]:
                return Followed(np.array(found), len(left), ends[0], tuple(left))
            before = list(b)
            b, word = self._beyond(time, y, a, before, hit)
            if word:
                return Followed(np.array(found), len(left), word, tuple(left))
            left += [n for n in range(len(cells)) if b[n] != before[n] and len(cells[n].marks) < 2]
        return Followed(np.array(found), len(left), "restless", tuple(left))

    def _limits(self, n: int, b: list[int]) -> tuple[float, float]:
        marks = self.law.cells[n].marks
        if not marks:
            return float(b[n]), float(b[n] + 1)
        return (
            marks[b[n] - 1] if b[n] else -np.inf,
            marks[b[n]] if b[n] < len(marks) else np.inf,
        )

    def _cells(self, t: float, y: Array, a: float, known: dict[int, int] | None) -> list[int]:
        """The cells at a state, but for those that are known."""
        b: list[int] = [0] * len(self.law.cells)
        for n, cell in enumerate(self.law.cells):
            x = self.code.arguments[n](t, y, a, b)
            b[n] = bisect(cell.marks, x) if cell.marks else int(np.floor(x))
            if known and n in known:
                b[n] = known[n]
        return b

    def _beyond(
        self, t: float, y: Array, a: float, before: list[int], hit: list[int]
    ) -> tuple[list[int], str]:
        """The cells beyond a mark, and a word where the motion cannot go there."""
        arguments, rates = self.code.arguments, self.code.rates
        ahead = t + BEYOND, y + BEYOND * np.array(rates(t, y, a, before))
        known: dict[int, int] = {}
        for n in hit:
            here, there = (arguments[n](*at, a, before) for at in ((t, y), ahead))
            if abs(there - here) < SLOW * BEYOND:
                return before, "grazes"
            known[n] = before[n] + (1 if there > here else -1)
            marks = self.law.cells[n].marks
            if marks and not 0 <= known[n] <= len(marks):  # it turns within rounding
                return before, "grazes"
        after = self._cells(*ahead, a, known)
        onward = t + BEYOND, y + BEYOND * np.array(rates(t, y, a, after))
        for n in hit:
            here, there = (arguments[n](*at, a, after) for at in ((t, y), onward))
            if (there - here) * (known[n] - before[n]) < SLOW * BEYOND:
                return after, "sticks"
        return after, ""
