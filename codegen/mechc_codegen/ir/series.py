"""Program -> recurrences of the Taylor coefficients of a motion.

Input: an optimised program.  Output: its operations one by one, each of a kind whose coefficients
have a recurrence (Moore 1966; Griewank & Walther 2008, ch. 13), or None where it has others.
Invariant: at order k every recurrence is linear in the coefficients of that order, and what is left
of it are sums over products of lower ones, ``sum_j a_j b_(k-j)`` with 0 < j < k.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from sympy import Add, Expr, Integer, Mul, Pow, Rational, S, Symbol, cos, exp, log, sin, tan

from mechc_codegen.derive.equations import Equations
from mechc_codegen.ir.program import (
    Assign,
    Program,
    SineCosine,
    Statement,
    slice_statements,
    symbols_of,
    targets_of,
)

MOST_FACTORS = 8  # integer powers up to here are products

Kind = Literal[
    "constant", "state", "time", "sum", "product", "quotient", "root", "power",
    "sine", "cosine", "exp", "log",
]  # fmt: skip


@dataclass(frozen=True)
class Operation:
    """One value; ``args``: numbers of earlier ones.

    ``value``: of a constant the expression of parameters, of a state or the time its symbol, of a
    power its exponent.  ``factors``: of a sum those of its terms.  A sine and a cosine have their
    argument and then each other.
    """

    kind: Kind
    args: tuple[int, ...] = ()
    value: Expr | None = None
    factors: tuple[Expr, ...] = ()


class NotAnalytic(Exception):
    """An operation without a recurrence here."""


@dataclass
class Recurrences:
    """The operations of a program in their order; the same operation is there once."""

    constants: set[Symbol]
    operations: list[Operation] = field(default_factory=list)
    numbers: dict[Operation, int] = field(default_factory=dict)
    known: dict[Expr, int] = field(default_factory=dict)

    def read(self, statements: Iterable[Statement]) -> None:
        """Statements of a body, in order."""
        for statement in statements:
            if isinstance(statement, SineCosine):
                sine = self._sine(self.of(statement.value))
                self.known[statement.sine], self.known[statement.cosine] = sine, sine + 1
            else:
                assert isinstance(statement, Assign)
                self.known[statement.target] = self.of(statement.value)

    def of(self, e: Expr) -> int:
        """The number of an expression's value."""
        if e not in self.known:
            self.known[e] = self._new(e)
        return self.known[e]

    def is_constant(self, number: int) -> bool:
        return self.operations[number].kind == "constant"

    def value_of(self, number: int) -> Expr:
        """Of a constant."""
        value = self.operations[number].value
        assert value is not None
        return value

    def needed(self, wanted: Iterable[int]) -> list[int]:
        """The operations that these values are made of, in order."""
        found = set(wanted)
        for number in reversed(range(len(self.operations))):
            operation = self.operations[number]
            if number in found:
                found.update(operation.args)
                if operation.kind in ("sine", "cosine"):  # each needs the other
                    found.add(number + (1 if operation.kind == "sine" else -1))
        return sorted(found)

    def divide(self, wanted: Sequence[int]) -> None:
        """A product with 1/b that stands nowhere else is a quotient: one sum less."""
        needed = self.needed(wanted)
        uses = Counter(wanted) + Counter(a for n in needed for a in self.operations[n].args)
        for number in needed:
            operation = self.operations[number]
            for a, q in (operation.args, operation.args[::-1]) if operation.kind == "product" else ():
                inverse = self.operations[q]
                if inverse.kind == "quotient" and uses[q] == 1 and self._is_one(inverse.args[0]):
                    self.operations[number] = Operation("quotient", (a, inverse.args[1]))
                    break

    def _is_one(self, number: int) -> bool:
        return self.is_constant(number) and self.value_of(number) == 1

    def add(self, kind: Kind, *args: int, **more: object) -> int:
        operation = Operation(kind, args, **more)  # type: ignore[arg-type]
        if operation not in self.numbers:
            self.numbers[operation] = len(self.operations)
            self.operations.append(operation)
        return self.numbers[operation]

    def _new(self, e: Expr) -> int:
        if e.free_symbols <= self.constants:
            return self.add("constant", value=e)
        if isinstance(e, Add):
            return self._sum(e)
        if isinstance(e, Mul):
            return self._product(e)
        if isinstance(e, exp):
            return self.add("exp", self.of(e.args[0]))
        if isinstance(e, Pow):
            return self._power(e.base, e.exp)
        if isinstance(e, log) and len(e.args) == 1:
            return self.add("log", self.of(e.args[0]))
        if isinstance(e, (sin, cos)):
            return self._sine(self.of(e.args[0])) + isinstance(e, cos)
        if isinstance(e, tan):
            sine = self._sine(self.of(e.args[0]))
            return self.add("quotient", sine, sine + 1)
        raise NotAnalytic(str(e)[:80])

    def _sine(self, x: int) -> int:
        """The number of the sine; that of the cosine follows."""
        sine = self.numbers.get(Operation("sine", (x,)))
        if sine is None:
            sine = self.add("sine", x)
            self.add("cosine", x)
        return sine

    def _sum(self, e: Add) -> int:
        constant, varying = e.as_independent(*(e.free_symbols - self.constants), as_Add=True)
        terms = [self._scaled(term) for term in Add.make_args(varying)]
        if constant != 0:
            terms.append((S.One, self.of(constant)))
        numbers = tuple(number for _, number in terms)
        return self.add("sum", *numbers, factors=tuple(factor for factor, _ in terms))

    def _scaled(self, e: Expr) -> tuple[Expr, int]:
        """A constant factor, and the rest."""
        factor, varying = e.as_independent(*(e.free_symbols - self.constants), as_Add=False)
        return (S.One, self.of(e)) if varying == 1 else (factor, self.of(varying))

    def _product(self, e: Mul) -> int:
        factor, rest = e.as_independent(*(e.free_symbols - self.constants), as_Add=False)
        above, below = list[int](), list[int]()
        for each in Mul.make_args(rest):
            base, exponent = each.as_base_exp()
            inverse = exponent.is_Integer and exponent < 0
            (below if inverse else above).append(self.of(base**-exponent if inverse else each))
        if not below:
            product = self._multiplied(above)
            return product if factor == 1 else self.add("sum", product, factors=(factor,))
        if above:
            quotient = self.add("quotient", self._multiplied(above), self._multiplied(below))
            return quotient if factor == 1 else self.add("sum", quotient, factors=(factor,))
        return self.add("quotient", self.of(factor), self._multiplied(below))

    def _multiplied(self, numbers: Sequence[int]) -> int:
        """Balanced: what is known early is multiplied first."""
        row = sorted(numbers)
        while len(row) > 1:
            row = sorted([self.add("product", row[0], row[1]), *row[2:]])
        return row[0]

    def _power(self, base: Expr, exponent: Expr) -> int:
        if base is S.Exp1:
            return self.add("exp", self.of(exponent))
        if exponent.is_Integer and abs(int(exponent)) <= MOST_FACTORS:
            power = self._integer_power(self.of(base), abs(int(exponent)))
            one = self.of(Integer(1))
            return power if exponent > 0 else self.add("quotient", one, power)
        if exponent == Rational(1, 2):
            return self.add("root", self.of(base))
        if exponent == Rational(-1, 2):
            return self.add("quotient", self.of(Integer(1)), self.add("root", self.of(base)))
        if exponent.free_symbols <= self.constants:
            return self.add("power", self.of(base), value=exponent)
        raise NotAnalytic(str(base**exponent)[:80])

    def _integer_power(self, base: int, exponent: int) -> int:
        if exponent == 1:
            return base
        half = self._integer_power(base, exponent // 2)
        square = self.add("product", half, half)
        return self.add("product", base, square) if exponent % 2 else square


@dataclass(frozen=True)
class Motion:
    """The recurrences of M u' = F and q', and the numbers of their entries; no ``rates``: q' is u."""

    made: Recurrences
    mass: list[int]
    forcing: list[int]
    rates: list[int]


def motion_series(program: Program, equations: Equations) -> Motion | None:
    """The recurrences of a motion; None where rows constrain it, M and F are not written out, values
    are given at run time, or an operation has no recurrence here."""
    if equations.holonomic + equations.nonholonomic or equations.tree or program.symbols.inputs:
        return None
    names = ["mass_matrix", "forcing"]
    names += [] if equations.identity_kinematics else ["coordinate_rates"]
    try:
        return _read(program, [program.output(name).elements for name in names])
    except NotAnalytic:
        return None


def _read(program: Program, elements: Sequence[Sequence[Expr]]) -> Motion:
    symbols = program.symbols
    made = Recurrences({*symbols.parameters, *targets_of(program.hoisted)})
    for state in (*symbols.q, *symbols.u):
        made.known[state] = made.add("state", value=state)
    made.known[symbols.time] = made.add("time", value=symbols.time)
    made.read(slice_statements(program.body, symbols_of(e for each in elements for e in each)))
    mass, forcing, *rates = ([made.of(e) for e in each] for each in elements)
    made.divide([*mass, *forcing, *(rates[0] if rates else [])])
    return Motion(made, mass, forcing, rates[0] if rates else [])
