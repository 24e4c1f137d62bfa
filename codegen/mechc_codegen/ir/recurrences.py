"""Expressions -> operations one by one, each with a recurrence of its Taylor coefficients.

Input: statements and expressions of an optimised program.  Output: the operations that they are
made of, each of a kind whose coefficients have a recurrence (Moore 1966; Griewank & Walther 2008,
ch. 13).  Invariant: an operation is there once, after its arguments.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from sympy import Add, Expr, Integer, Mul, Pow, Rational, S, Symbol, cos, exp, log, sin, tan

from mechc_codegen.ir.program import Assign, Operation, OperationKind, SineCosine, Statement


class NotAnalyticError(Exception):
    """An error for an operation without a recurrence here."""


@dataclass
class Recurrences:
    """The operations of a program in their order; the same operation is there once."""

    constants: set[Symbol]
    operations: list[Operation] = field(default_factory=list)
    numbers: dict[Operation, int] = field(default_factory=dict)
    known: dict[Expr, int] = field(default_factory=dict)

    def read(self, statements: Iterable[Statement]) -> None:
        """Add the operations of a body's statements, in order."""
        for statement in statements:
            if isinstance(statement, SineCosine):
                sine = self.sine(self.of(statement.value))
                self.known[statement.sine], self.known[statement.cosine] = sine, sine + 1
            else:
                assert isinstance(statement, Assign)
                self.known[statement.target] = self.of(statement.value)

    def of(self, e: Expr) -> int:
        """The number of an expression's value."""
        if e not in self.known:
            self.known[e] = self._new(e)
        return self.known[e]

    def add(self, kind: OperationKind, *args: int, **more: object) -> int:
        return self.put(Operation(kind, args, **more))  # type: ignore[arg-type]

    def put(self, operation: Operation) -> int:
        if operation not in self.numbers:
            self.numbers[operation] = len(self.operations)
            self.operations.append(operation)
        return self.numbers[operation]

    def integrals(self, coordinates: int) -> tuple[tuple[int, int], ...]:
        """Sines and cosines of sums of the time and of coordinates, whose rates are speeds; each
        with its rate."""
        found = list[tuple[int, int]]()
        for sine, operation in enumerate(list(self.operations)):
            if operation.kind != "sine":
                continue
            rate = self._rate(operation.args[0], coordinates)
            if rate is not None:
                falls = self.add("product", rate, sine)
                found.append((sine, self.add("product", rate, sine + 1)))
                found.append((sine + 1, self.add("sum", falls, factors=(S.NegativeOne,))))
        return tuple(found)

    def _rate(self, number: int, coordinates: int) -> int | None:
        """The number of a value's rate; None where it has to be derived."""
        operation = self.operations[number]
        if operation.kind == "constant":
            return self.of(S.Zero)
        if operation.kind == "time":
            return self.of(S.One)
        if operation.kind == "state":
            return coordinates + number if number < coordinates else None
        if operation.kind != "sum":
            return None
        zero, terms = self.of(S.Zero), list[tuple[Expr, int]]()
        for factor, a in zip(operation.factors, operation.args, strict=True):
            rate = self._rate(a, coordinates)
            if rate is None:
                return None
            terms += [(factor, rate)] if rate != zero else []
        return self.weighted_sum(terms)

    def weighted_sum(self, terms: Sequence[tuple[Expr, int]]) -> int:
        """The number of a sum of multiples of values."""
        if not terms:
            return self.of(S.Zero)
        if len(terms) == 1 and terms[0][0] == 1:
            return terms[0][1]
        return self.add("sum", *(n for _, n in terms), factors=tuple(f for f, _ in terms))

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
            return self.sine(self.of(e.args[0])) + isinstance(e, cos)
        if isinstance(e, tan):
            sine = self.sine(self.of(e.args[0]))
            return self.add("quotient", sine, sine + 1)
        raise NotAnalyticError(str(e)[:80])

    def sine(self, x: int) -> int:
        """The number of a sine; the number of its cosine is the next one."""
        sine = self.numbers.get(Operation("sine", (x,)))
        if sine is None:
            sine = self.add("sine", x)
            self.add("cosine", x)
        return sine

    def _sum(self, e: Add) -> int:
        constant, varying = e.as_independent(*(e.free_symbols - self.constants), as_Add=True)
        terms = [self._factor_and_rest(term) for term in Add.make_args(varying)]
        if constant != 0:
            terms.append((S.One, self.of(constant)))
        numbers = tuple(number for _, number in terms)
        return self.add("sum", *numbers, factors=tuple(factor for factor, _ in terms))

    def _factor_and_rest(self, e: Expr) -> tuple[Expr, int]:
        """The constant factor of an expression, and the number of the rest."""
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
            product = self._multiply(above)
            return product if factor == 1 else self.add("sum", product, factors=(factor,))
        if above:
            quotient = self.add("quotient", self._multiply(above), self._multiply(below))
            return quotient if factor == 1 else self.add("sum", quotient, factors=(factor,))
        return self.add("quotient", self.of(factor), self._multiply(below))

    def _multiply(self, numbers: Sequence[int]) -> int:
        """The number of a product, built as a balanced tree: early values first."""
        row = sorted(numbers)
        while len(row) > 1:
            row = sorted([self.add("product", row[0], row[1]), *row[2:]])
        return row[0]

    def _power(self, base: Expr, exponent: Expr) -> int:
        if base is S.Exp1:
            return self.add("exp", self.of(exponent))
        if exponent.is_Integer:  # products: what a power's recurrence divides by may vanish
            power = self._integer_power(self.of(base), abs(int(exponent)))
            one = self.of(Integer(1))
            return power if exponent > 0 else self.add("quotient", one, power)
        if exponent == Rational(1, 2):
            return self.add("root", self.of(base))
        if exponent == Rational(-1, 2):
            return self.add("quotient", self.of(Integer(1)), self.add("root", self.of(base)))
        if exponent.free_symbols <= self.constants:
            return self.add("power", self.of(base), value=exponent)
        raise NotAnalyticError(str(base**exponent)[:80])

    def _integer_power(self, base: int, exponent: int) -> int:
        if exponent == 1:
            return base
        half = self._integer_power(base, exponent // 2)
        square = self.add("product", half, half)
        return self.add("product", base, square) if exponent % 2 else square
