"""Straight-line programs of SymPy expressions, evaluated in any arithmetic.

One program serves floats, NumPy, heyoka and CasADi: ``function`` gives it the sine, cosine and
square root of the arithmetic.  Everything that is used twice has a name, also in the elimination
of [M J^T; J 0], so that no expression grows and tools without a linear solver can use it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import sympy
from sympy import Expr, S, Symbol

Rows = list[list[Expr]]
FUNCTIONS = ("sin", "cos", "tan", "sqrt")


@dataclass(frozen=True)
class Program:
    """``outputs`` of ``arguments`` by way of ``assignments``, in their order."""

    arguments: tuple[Symbol, ...]
    assignments: tuple[tuple[Symbol, Expr], ...]
    outputs: tuple[Expr, ...]

    def function(
        self, modules: str | ModuleType | Mapping[str, Any] = "math"
    ) -> Callable[..., list[Any]]:
        """A function of the arguments, one by one, that gives a list of the outputs.

        Parameters
        ----------
        modules
            ``"math"`` for floats, ``"numpy"`` for arrays, or the functions of another arithmetic:
            by name, or a module that has them, as heyoka and casadi.
        """
        if isinstance(modules, ModuleType):
            modules = {name: getattr(modules, name) for name in FUNCTIONS}
        given = modules if isinstance(modules, str) else [dict(modules), "math"]
        return sympy.lambdify(  # type: ignore[no-any-return]
            self.arguments,
            list(self.outputs),
            modules=given,
            cse=lambda _: (self.assignments, list(self.outputs)),
        )


def program(arguments: Sequence[Symbol], outputs: Sequence[Expr]) -> Program:
    """The program of expressions, their common subexpressions named."""
    tape = Tape()
    return Program(tuple(arguments), *tape.finished(tape.shared(outputs)))


class Tape:
    """Assignments in the order in which they are made."""

    def __init__(self) -> None:
        self.assignments: list[tuple[Symbol, Expr]] = []

    def named(self, value: Expr) -> Expr:
        """A symbol for the value; symbols and numbers unchanged."""
        if value.is_Atom:
            return value
        self.assignments.append((Symbol(f"z{len(self.assignments)}"), value))
        return self.assignments[-1][0]

    def shared(self, values: Sequence[Expr]) -> list[Expr]:
        """The values, with names for them and for their common subexpressions."""
        fresh = (Symbol(f"z{k}") for k in range(len(self.assignments), 10**9))
        replaced, rest = sympy.cse(list(values), symbols=fresh, order="none")
        self.assignments += replaced
        return [self.named(value) for value in rest]

    def finished(
        self, outputs: Iterable[Expr]
    ) -> tuple[tuple[tuple[Symbol, Expr], ...], tuple[Expr, ...]]:
        return tuple(self.assignments), tuple(outputs)

    # -- elimination ------------------------------------------------------------------------------

    def factored(self, A: Rows) -> tuple[Rows, list[Expr]]:
        """A = L D L^T with unit lower triangular L; gives L and the reciprocals of D."""
        size = len(A)
        L = [[S.Zero] * size for _ in range(size)]
        D: list[Expr] = []
        reciprocals: list[Expr] = []
        for j in range(size):
            scaled = [self.named(L[j][k] * D[k]) for k in range(j)]
            D.append(self.named(A[j][j] - _dot(L[j][:j], scaled)))
            reciprocals.append(self.named(1 / D[j]))
            for i in range(j + 1, size):
                L[i][j] = self.named((A[i][j] - _dot(L[i][:j], scaled)) * reciprocals[j])
        return L, reciprocals

    def forward(self, L: Rows, b: Sequence[Expr]) -> list[Expr]:
        """L^-1 b."""
        x: list[Expr] = []
        for i, value in enumerate(b):
            x.append(self.named(value - _dot(L[i][:i], x)))
        return x

    def backward(self, L: Rows, b: Sequence[Expr]) -> list[Expr]:
        """L^-T b."""
        x = list(b)
        for i in reversed(range(len(x))):
            below = range(i + 1, len(x))
            x[i] = self.named(x[i] - _dot([L[k][i] for k in below], [x[k] for k in below]))
        return x

    def accelerations(
        self, M: Rows, F: Sequence[Expr], J: Rows, gamma: Sequence[Expr]
    ) -> list[Expr]:
        """u' of M u' + J^T lambda = F, J u' = gamma, by the Schur complement J M^-1 J^T."""
        L, reciprocals = self.factored(M)
        f = self.forward(L, F)
        if J:
            rows = [self.forward(L, row) for row in J]
            scaled = [[self.named(x * r) for x, r in zip(row, reciprocals, strict=True)]
                      for row in rows]  # fmt: skip
            S_L, S_reciprocals = self.factored([[_dot(a, b) for b in scaled] for a in rows])
            gap = [_dot(a, f) - g for a, g in zip(scaled, gamma, strict=True)]
            middle = self.forward(S_L, gap)
            middle = [self.named(x * r) for x, r in zip(middle, S_reciprocals, strict=True)]
            multipliers = self.backward(S_L, middle)
            f = [self.named(f[i] - _dot([row[i] for row in rows], multipliers))
                 for i in range(len(f))]  # fmt: skip
        return self.backward(L, [self.named(x * r) for x, r in zip(f, reciprocals, strict=True)])


def _dot(a: Iterable[Expr], b: Iterable[Expr]) -> Expr:
    return sympy.Add(*(x * y for x, y in zip(a, b, strict=True)))
