"""Program -> recurrences of the Taylor coefficients of a motion.

Input: an optimised program.  Output: its operations one by one, each of a kind whose coefficients
have a recurrence (Moore 1966; Griewank & Walther 2008, ch. 13), or None where it has others.
Invariant: at order k every recurrence is linear in the coefficients of that order, and what is left
of it are sums over products of lower ones, ``sum_j a_j b_(k-j)`` with 0 < j < k.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from sympy import Add, Expr, Integer, Mul, Pow, Rational, S, Symbol, cos, exp, log, sin, tan

from mechc_codegen.derive.equations import Equations
from mechc_codegen.ir.program import (
    Assign,
    Operation,
    OperationKind,
    Program,
    Series,
    SineCosine,
    Statement,
    slice_statements,
    symbols_of,
    targets_of,
)

MOST_SUMMED = 128  # operations with sums over lower orders: rows of all lanes stay in the cache
LINEAR = ("constant", "state", "time", "sum")


class NotAnalyticError(Exception):
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

    def add(self, kind: OperationKind, *args: int, **more: object) -> int:
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
        raise NotAnalyticError(str(e)[:80])

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


def add_series(program: Program, equations: Equations) -> Program:
    """The program with the recurrences of its motion; without, where rows constrain it, M and F are
    not written out, values are given at run time, an operation has no recurrence here, or too many
    have sums."""
    if equations.holonomic + equations.nonholonomic or equations.tree or program.symbols.inputs:
        return program
    names = ["mass_matrix", "forcing"]
    names += [] if equations.identity_kinematics else ["coordinate_rates"]
    try:
        series = _read(program, names)
    except NotAnalyticError:
        return program
    summed = sum(series.operations[n].kind not in LINEAR for n in series.needed)
    return replace(program, series=series) if summed <= MOST_SUMMED else program


def _read(program: Program, names: Sequence[str]) -> Series:
    symbols, elements = program.symbols, [program.output(name).elements for name in names]
    made = Recurrences({*symbols.parameters, *targets_of(program.hoisted)})
    for state in (*symbols.q, *symbols.u):
        made.known[state] = made.add("state", value=state)
    made.known[symbols.time] = made.add("time", value=symbols.time)
    made.read(slice_statements(program.body, symbols_of(e for each in elements for e in each)))
    mass, forcing, *rates = (tuple(made.of(e) for e in each) for each in elements)
    return _divided(Series(tuple(made.operations), mass, forcing, *rates))


def _divided(series: Series) -> Series:
    """A product with 1/b that stands nowhere else is a quotient: one sum less."""
    operations, needed = list(series.operations), series.needed
    uses = Counter(series.ends) + Counter(a for n in needed for a in operations[n].args)
    for number in needed:
        each = operations[number]
        for a, q in (each.args, each.args[::-1]) if each.kind == "product" else ():
            inverse = operations[q]
            if inverse.kind == "quotient" and uses[q] == 1 and series.is_number(inverse.args[0], 1):
                operations[number] = Operation("quotient", (a, inverse.args[1]))
                break
    return replace(series, operations=tuple(operations))
