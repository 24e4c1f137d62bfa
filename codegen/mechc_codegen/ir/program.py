"""The intermediate form: a straight-line program over arrays.

A program computes named outputs from time, coordinates, speeds and parameters.  Statements hold
SymPy expressions.  Statements that depend on parameters alone stand in ``hoisted`` and run once
a run; the rest stand in ``body``.  Invariant (:meth:`Program.verify`): every symbol is assigned
once, before it is used, and hoisted statements use parameters only.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from sympy import Expr, Symbol

from mechc_codegen.derive.equations import Output, Symbols
from mechc_codegen.errors import InternalError
from mechc_codegen.ir.operations import count_operations

SWITCHING = "switching"  # the output of the functions at whose zeros equations change their form
FEATURE = "feature"  # the label of those that are edges of narrow features


@dataclass(frozen=True)
class Assign:
    """``target = value``."""

    target: Symbol
    value: Expr

    @property
    def targets(self) -> tuple[Symbol, ...]:
        return (self.target,)

    @cached_property
    def symbols(self) -> Set[Symbol]:
        """Every symbol in the value."""
        found: set[Symbol] = self.value.free_symbols
        return found

    def __str__(self) -> str:
        return f"{self.target} = {self.value}"


@dataclass(frozen=True)
class SineCosine:
    """``sine, cosine = sin(value), cos(value)`` with one range reduction."""

    sine: Symbol
    cosine: Symbol
    value: Expr

    @property
    def targets(self) -> tuple[Symbol, ...]:
        return (self.sine, self.cosine)

    @cached_property
    def symbols(self) -> Set[Symbol]:
        """Every symbol in the value."""
        found: set[Symbol] = self.value.free_symbols
        return found

    def __str__(self) -> str:
        return f"{self.sine}, {self.cosine} = sincos({self.value})"


Statement = Assign | SineCosine


@dataclass(frozen=True)
class InputValue:
    """Value (order 0) or derivative of one input that is given at run time."""

    symbol: Symbol
    input: int
    order: int


LINEAR = ("constant", "state", "time", "sum")  # without sums over products of lower orders
OperationKind = Literal[
    "constant", "state", "time", "sum", "product", "quotient", "root", "power",
    "sine", "cosine", "exp", "log",
]  # fmt: skip


@dataclass(frozen=True)
class Operation:
    """One value; ``args``: numbers of earlier operations.

    ``value``: of a constant the expression of parameters, of a state or the time its symbol, of a
    power its exponent.  ``factors``: of a sum those of its terms.  A sine and a cosine have their
    argument and then each other.
    """

    kind: OperationKind
    args: tuple[int, ...] = ()
    value: Expr | None = None
    factors: tuple[Expr, ...] = ()


@dataclass(frozen=True)
class Series:
    """The operations of M u' = F and q' one by one, each with a recurrence of its Taylor
    coefficients, and the numbers of their entries; no ``rates``: q' is u.

    ``integrals``: sines and cosines that are integrated as states are, each with the number of its
    rate.  ``momenta``: the entries of ``forcing`` are those of (M u)', not of M u'.
    """

    operations: tuple[Operation, ...]
    mass: tuple[int, ...]
    forcing: tuple[int, ...]
    rates: tuple[int, ...] = ()
    integrals: tuple[tuple[int, int], ...] = ()
    momenta: bool = False

    @property
    def ends(self) -> tuple[int, ...]:
        return (*self.mass, *self.forcing, *self.rates)

    @property
    def needed_operations(self) -> list[int]:
        """The operations that the entries depend on, in order."""
        rates, found, left = dict(self.integrals), set[int](), list(self.ends)
        while left:
            number = left.pop()
            if number not in found:
                found.add(number)
                left += self.operations[number].args
                left += [rates[number]] if number in rates else []
                if self.operations[number].kind in ("sine", "cosine"):  # each needs the other
                    left.append(number + (1 if self.operations[number].kind == "sine" else -1))
        return sorted(found)

    @property
    def sums(self) -> int:
        """How many sums over products of lower orders each order takes."""
        left = set(self.needed_operations) - dict(self.integrals).keys()
        return sum(self.operations[n].kind not in LINEAR for n in left)

    @property
    def couples_speeds(self) -> bool:
        """Whether M is not diagonal, so that each order takes the solution of linear equations."""
        size = len(self.forcing)
        places = (i * size + j for i in range(size) for j in range(size) if i != j)
        return not all(self.is_number(self.mass[place], 0) for place in places)

    def is_constant(self, number: int) -> bool:
        return self.operations[number].kind == "constant"

    def is_number(self, number: int, value: int) -> bool:
        return self.is_constant(number) and self.operations[number].value == value


@dataclass(frozen=True)
class Knots:
    """Values of an argument at which steps end; those of one period where there is one."""

    argument: Expr
    values: tuple[float, ...]
    period: float | None


@dataclass(frozen=True)
class Program:
    """A straight-line program; see the module's description."""

    symbols: Symbols
    outputs: tuple[Output, ...]
    hoisted: tuple[Statement, ...] = ()
    body: tuple[Statement, ...] = ()
    series: Series | None = None  # of the motion
    knots: tuple[Knots, ...] = ()  # of the switching functions that are arguments of tables

    def __str__(self) -> str:
        lines = [f"hoisted {s}" for s in self.hoisted] + [str(s) for s in self.body]
        for output in self.outputs:
            pairs = zip(output.labels, output.elements, strict=True)
            lines += [f"{output.name}: {label} = {value}" for label, value in pairs]
        return "\n".join(lines)

    def output(self, name: str) -> Output:
        return next(o for o in self.outputs if o.name == name)

    def named_values(self) -> dict[str, tuple[Expr, ...]]:
        """Name -> elements of every output that has some, and the multipliers of the motion."""
        found = {o.name: tuple(o.elements) for o in self.outputs if o.elements}
        multipliers = self.symbols.multipliers
        return found | ({"multipliers": multipliers} if multipliers else {})

    def values(self) -> Iterator[Expr]:
        """Every expression of statements and outputs."""
        yield from (s.value for s in (*self.hoisted, *self.body))
        yield from (e for o in self.outputs for e in o.elements)

    def input_values(self) -> list[InputValue]:
        """The values of inputs that a run must be given, in the order of arrays."""
        if not self.symbols.inputs:
            return []
        used = symbols_of((*self.body, *self.outputs))
        return [
            InputValue(symbol, number, order)
            for number, chain in enumerate(self.symbols.inputs)
            for order, symbol in enumerate(chain)
            if symbol in used
        ]

    def verify(self) -> Program:
        """Raise :class:`InternalError` if the invariant does not hold; return the program."""
        known = set(self.symbols.parameters)
        for statement in self.hoisted:
            _check_statement(statement, known)
        symbols = self.symbols
        known |= {symbols.time, *symbols.q, *symbols.u, *symbols.motion, *symbols.covector}
        known |= {value for chain in symbols.inputs for value in chain}
        for statement in self.body:
            _check_statement(statement, known)
        for output in self.outputs:
            _check_known(output.name, output.symbols, known)
        return self


def operations(statements: Iterable[Statement], elements: Iterable[Expr] = ()) -> int:
    """Arithmetic operations and function calls of statements and output expressions."""
    values = [s.value for s in statements] + list(elements)
    pairs = sum(isinstance(s, SineCosine) for s in statements)
    return sum(count_operations(v) for v in values) + 2 * pairs


def slice_statements(statements: Iterable[Statement], needed: set[Symbol]) -> list[Statement]:
    """The statements that the needed symbols depend on, in order."""
    kept, wanted = [], set(needed)
    for statement in reversed(list(statements)):
        if wanted.intersection(statement.targets):
            kept.append(statement)
            wanted |= statement.symbols
    return kept[::-1]


def equation_values(program: Program, own: Collection[str]) -> Iterator[Expr]:
    """Every expression of the equations, of the statements that they need first; ``own``: the
    user-defined outputs, which are none of them."""
    outputs = [o for o in program.outputs if o.name not in own]
    yield from (s.value for s in slice_statements(program.body, symbols_of(outputs)))
    yield from (element for output in outputs for element in output.elements)


def symbols_of(parts: Iterable[Statement | Output]) -> set[Symbol]:
    """Every symbol in the values of statements and in the elements of outputs."""
    return set[Symbol]().union(*(part.symbols for part in parts))


def symbols_in(expressions: Iterable[Expr]) -> set[Symbol]:
    """Every symbol in the expressions."""
    return {symbol for expression in expressions for symbol in expression.free_symbols}


def targets_of(statements: Iterable[Statement]) -> Iterator[Symbol]:
    """Every symbol that the statements assign, in order."""
    for statement in statements:
        yield from statement.targets


def in_order_of_use(statements: Sequence[Statement]) -> Iterator[Statement]:
    """The statements, each after those that it uses, otherwise in the given order."""
    by_target = {target: s for s in statements for target in s.targets}
    placed = set[Symbol]()
    for statement in statements:
        stack = [statement]
        while stack:
            used = stack[-1].symbols
            missing = [x for x in used if x in by_target and x not in placed]
            if missing:
                stack.append(by_target[min(missing, key=str)])
                continue
            ready = stack.pop()
            if not placed.issuperset(ready.targets):
                placed.update(ready.targets)
                yield ready


def _check_statement(statement: Statement, known: set[Symbol]) -> None:
    _check_known(statement.targets[0], statement.symbols, known)
    if known.intersection(statement.targets):
        raise InternalError(f"{statement.targets} is assigned twice")
    known.update(statement.targets)


def _check_known(place: Symbol | str, used: Set[Symbol], known: set[Symbol]) -> None:
    unknown = used - known
    if unknown:
        raise InternalError(f"{place} uses {sorted(map(str, unknown))} before assignment")
