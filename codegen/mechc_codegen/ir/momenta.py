"""Recurrences of a motion -> those of the same motion by its momenta, with fewer products.

Input: recurrences whose mass matrix and forces are polynomials of the speeds with sines and cosines
of the coordinates and other values as factors.  Output: recurrences of (M u)' = F + M' u, in which
most of the products of speeds cancel, or none where these are not polynomials.  Invariant: products
of sines and cosines are written as those of sums and differences of their angles, so that equal
terms are seen to be equal.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from sympy import Expr, Integer, Rational, S

from mechc_codegen.ir.program import Operation, Series
from mechc_codegen.ir.recurrences import Recurrences

MOST_TERMS = 200  # of a polynomial
HALF = Rational(1, 2)


@dataclass(frozen=True)
class Monomial:
    """A product of values, by their numbers, and of at most one sine or cosine (``turn``) of an
    angle: of each coordinate so many times (``angle``)."""

    values: tuple[int, ...] = ()
    turn: str = ""
    angle: tuple[int, ...] = ()


Polynomial = dict[Monomial, Expr]
Pair = tuple[int, int]


class NotPolynomialError(Exception):
    """An error for too many terms, or for a rate that is not known here."""


def in_momenta(series: Series, coordinates: int) -> list[Series]:
    """The recurrences by momenta, if there are any, for so many ``coordinates`` with rates u."""
    if series.rates:
        return []
    try:
        return [Rewriting(series, coordinates).by_momenta()]
    except NotPolynomialError:
        return []


def fewest(forms: Sequence[Series]) -> Series:
    """The form with the fewest sums over lower orders; the first of equals."""
    return min(forms, key=lambda form: len(products_of(form)))


def products_of(series: Series) -> set[Pair]:
    """The pairs of values whose coefficients are multiplied order by order."""
    integrated, found = dict(series.integrals), set[Pair]()
    for number in series.needed_operations:
        operation = series.operations[number]
        if operation.kind in ("product", "quotient"):
            varying = [a for a in operation.args if not series.is_constant(a)]
            if len(varying) == 2 or operation.kind == "quotient":
                found.add((min(operation.args), max(operation.args)))
        elif operation.kind not in ("constant", "state", "time", "sum"):
            found |= {(number, number)} if number not in integrated else set()
    return found | {*_mass_products(series)}


def _mass_products(series: Series) -> Iterator[Pair]:
    """The products of entries of M with speeds, or with accelerations (negative numbers)."""
    speeds = round(len(series.mass) ** 0.5)
    first = len(series.forcing) if series.momenta else -speeds
    for place, number in enumerate(series.mass):
        if not series.is_constant(number):
            base = one_varying(series, number)
            other = first + place % speeds
            yield (min(base, other), max(base, other))


def one_varying(series: Series, number: int) -> int:
    """The value of which an operation is a constant multiple; else the operation itself."""
    operation = series.operations[number]
    if operation.kind != "sum":
        return number
    varying = [a for a in operation.args if not series.is_constant(a)]
    return varying[0] if len(varying) == 1 else number


@dataclass
class Rewriting:
    """The rewriting of one motion; ``values`` number its operations, ``made`` the new ones."""

    series: Series
    coordinates: int
    known: dict[int, Polynomial] = field(default_factory=dict)
    made: Recurrences = field(default_factory=lambda: Recurrences(set()))
    copied: dict[int, int] = field(default_factory=dict)
    sines: dict[tuple[int, ...], int] = field(default_factory=dict)  # each before its cosine

    def by_momenta(self) -> Series:
        """Operations of M and F + M' u."""
        series, speeds = self.series, len(self.series.forcing)
        mass = [self.polynomial(n) for n in series.mass]
        rates = [self.polynomial(n) for n in series.forcing]
        for i in range(speeds):
            for j in range(speeds):
                gained = self.rate(mass[i * speeds + j])
                rates[i] = add(rates[i], multiply(gained, self._value(self.coordinates + j)))
        return self._written(mass, rates)

    # -- reading ----------------------------------------------------------------------------

    def polynomial(self, number: int) -> Polynomial:
        """The polynomial of a value in the original recurrences."""
        if number not in self.known:
            self.known[number] = self._read(number, self.series.operations[number])
        return self.known[number]

    def _read(self, number: int, operation: Operation) -> Polynomial:
        args = operation.args
        match operation.kind:
            case "constant":
                assert operation.value is not None
                return {Monomial(): operation.value} if operation.value != 0 else {}
            case "sum":
                found: Polynomial = {}
                for factor, a in zip(operation.factors, args, strict=True):
                    found = add(found, {m: factor * x for m, x in self.polynomial(a).items()})
                return found
            case "product":
                return multiply(self.polynomial(args[0]), self.polynomial(args[1]))
            case "sine" | "cosine":
                angle = self._angle(self.polynomial(args[0]))
                if angle is not None:
                    return harmonic(operation.kind, angle)
        return self._value(number)

    def _value(self, number: int) -> Polynomial:
        return {Monomial((number,)): S.One}

    def _angle(self, argument: Polynomial) -> tuple[int, ...] | None:
        """How often an argument contains each coordinate; None if it contains anything else."""
        counts = [0] * self.coordinates
        for monomial, factor in argument.items():
            own = monomial.values[0] if len(monomial.values) == 1 else self.coordinates
            if monomial.turn or own >= self.coordinates or not factor.is_Integer:
                return None
            counts[own] = int(factor)
        return tuple(counts)

    def rate(self, polynomial: Polynomial) -> Polynomial:
        """The rate of a polynomial of functions of the coordinates."""
        found: Polynomial = {}
        for monomial, factor in polynomial.items():
            if any(n >= self.coordinates for n in monomial.values):
                raise NotPolynomialError
            for k, n in enumerate(monomial.values):
                rest = tuple(sorted((*monomial.values[:k], *monomial.values[k + 1 :],
                                     self.coordinates + n)))  # fmt: skip
                found = add(found, {Monomial(rest, monomial.turn, monomial.angle): factor})
            for i, count in enumerate(monomial.angle):
                turn = "cosine" if monomial.turn == "sine" else "sine"
                sign = count if monomial.turn == "sine" else -count
                values = tuple(sorted((*monomial.values, self.coordinates + i)))
                if count:
                    term = {Monomial(values, turn, monomial.angle): sign * factor}
                    found = add(found, term)
        return found

    # -- writing ----------------------------------------------------------------------------

    def _written(self, mass: Sequence[Polynomial], rates: Sequence[Polynomial]) -> Series:
        for number in range(self.coordinates + len(rates)):
            self._copy(number)
        terms = dict.fromkeys(monomial for each in (*mass, *rates) for monomial in each)
        for angle in sorted({term.angle for term in terms if term.turn}):
            counts = [(Integer(count), i) for i, count in enumerate(angle) if count]
            self.sines[angle] = self.made.sine(self.made.weighted_sum(counts))
        factors = {term: self._factors(term) for term in terms}
        turning = dict(self._turning())
        shared = {*self._mass_products(mass, factors)}
        hoped = shared.union(pair for pairs in turning.values() for _, pair in pairs)
        numbers = self._multiply(factors, hoped)
        masses, forcing = (tuple(self._sum(p, numbers) for p in each) for each in (mass, rates))
        made = {*shared, *(each.args for each in self.made.operations if each.kind == "product")}
        integrals = dict(self.made.integrals(self.coordinates))
        for number, pairs in turning.items():
            if len({pair for _, pair in pairs} - made) < 2:
                terms_ = [(sign, self.made.add("product", *pair)) for sign, pair in pairs]
                integrals[number] = self.made.weighted_sum(terms_)
        operations = tuple(self.made.operations)
        return Series(operations, masses, forcing, integrals=tuple(integrals.items()), momenta=True)

    def _copy(self, number: int) -> int:
        """The number in the new recurrences of a value in the original ones."""
        if number not in self.copied:
            operation = self.series.operations[number]
            args = [self._copy(a) for a in operation.args]
            if operation.kind in ("sine", "cosine"):
                self.copied[number] = self.made.sine(args[0]) + (operation.kind == "cosine")
            else:
                made = Operation(operation.kind, tuple(args), operation.value, operation.factors)
                self.copied[number] = self.made.put(made)
        return self.copied[number]

    def _factors(self, term: Monomial) -> tuple[int, ...]:
        """The numbers of the factors of a term."""
        turn = [self.sines[term.angle] + (term.turn == "cosine")] if term.turn else []
        return tuple(sorted([*(self._copy(n) for n in term.values), *turn]))

    def _turning(self) -> Iterator[tuple[int, list[tuple[Expr, Pair]]]]:
        """The terms in the rate of each sine and cosine: a speed times the other of the two."""
        for angle, sine in self.sines.items():
            counts = [(self.coordinates + i, n) for i, n in enumerate(angle) if n]
            yield sine, [(Integer(n), (speed, sine + 1)) for speed, n in counts]
            yield sine + 1, [(Integer(-n), (speed, sine)) for speed, n in counts]

    def _mass_products(
        self, mass: Sequence[Polynomial], factors: dict[Monomial, tuple[int, ...]]
    ) -> Iterator[Pair]:
        """Products of a speed and an entry of M, for entries that are a multiple of one value."""
        speeds = round(len(mass) ** 0.5)
        for place, entry in enumerate(mass):
            varying = [factors[term] for term in entry if factors[term]]
            if len(varying) == 1 and len(varying[0]) == 1:
                yield _pair(varying[0][0], self.coordinates + place % speeds)

    def _multiply(
        self, factors: dict[Monomial, tuple[int, ...]], hoped: set[Pair]
    ) -> dict[Monomial, int]:
        """The numbers of all terms; pairs of factors that most terms share are multiplied first."""
        left = dict(factors)
        while long := {term: row for term, row in left.items() if len(row) > 2}:
            counts = Counter(pair for row in long.values() for pair in {*combinations(row, 2)})
            ready = hoped.union(row for row in left.values() if len(row) == 2)
            best = max(counts, key=lambda pair: (counts[pair] + (pair in ready), pair))
            number = self.made.add("product", *best)
            for term, row in long.items():
                if best in combinations(row, 2):
                    rest = list(row)
                    rest.remove(best[0])
                    rest.remove(best[1])
                    left[term] = tuple(sorted([*rest, number]))
        return {term: self._product(row) for term, row in left.items()}

    def _product(self, row: tuple[int, ...]) -> int:
        if not row:
            return self.made.of(S.One)
        return row[0] if len(row) == 1 else self.made.add("product", *row)

    def _sum(self, polynomial: Polynomial, numbers: dict[Monomial, int]) -> int:
        constant = polynomial.get(Monomial(), S.Zero)
        terms = [(x, numbers[term]) for term, x in polynomial.items() if term != Monomial()]
        if terms and constant != 0:
            terms.append((S.One, self.made.add("constant", value=constant)))
        return self.made.weighted_sum(terms) if terms else self.made.add("constant", value=constant)


def _pair(a: int, b: int) -> Pair:
    return (min(a, b), max(a, b))


def add(one: Polynomial, other: Polynomial) -> Polynomial:
    """The sum of two polynomials, without terms that cancel."""
    found = dict(one)
    for term, factor in other.items():
        found[term] = found.get(term, S.Zero) + factor
    return {term: factor for term, factor in found.items() if factor != 0}


def multiply(one: Polynomial, other: Polynomial) -> Polynomial:
    """The product of polynomials; products of sines and cosines become sums of such functions."""
    if len(one) * len(other) > MOST_TERMS:
        raise NotPolynomialError
    found: Polynomial = {}
    for a, x in one.items():
        for b, y in other.items():
            values = tuple(sorted((*a.values, *b.values)))
            for term, factor in _turns(a, b).items():
                held = Monomial(values, term.turn, term.angle)
                found = add(found, {held: x * y * factor})
    return found


def _turns(a: Monomial, b: Monomial) -> Polynomial:
    if not (a.turn and b.turn):
        return {Monomial((), a.turn or b.turn, a.angle or b.angle): S.One}
    if a.turn == "cosine" and b.turn == "sine":
        return _turns(b, a)
    less, more = (
        tuple(m + sign * n for m, n in zip(a.angle, b.angle, strict=True)) for sign in (-1, 1)
    )
    turn = "cosine" if a.turn == b.turn else "sine"
    sign = -HALF if a.turn == b.turn == "sine" else HALF
    return add(_scale(harmonic(turn, less), HALF), _scale(harmonic(turn, more), sign))


def _scale(polynomial: Polynomial, by: Expr) -> Polynomial:
    return {term: by * factor for term, factor in polynomial.items()}


def harmonic(turn: str, angle: tuple[int, ...]) -> Polynomial:
    """The sine or cosine of an angle, written so that its first nonzero count is positive."""
    first = next((count for count in angle if count), 0)
    if first == 0:
        return {Monomial(): S.One} if turn == "cosine" else {}
    if first > 0:
        return {Monomial((), turn, angle): S.One}
    sign = S.One if turn == "cosine" else S.NegativeOne
    return {Monomial((), turn, tuple(-count for count in angle)): sign}
