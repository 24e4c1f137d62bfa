"""The recurrences of Taylor coefficients in C over ``real``.

Input: a scene's functions.  Output: the text of ``scene_series.h``; it defines nothing where the
equations have no recurrences.  A row holds the coefficients of one order: the states first, then
the other series that sums over products are made of.  Invariant: the sums of an order need rows of
lower orders alone, so that they are independent of each other; everything else is linear.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from sympy import Expr

from mechc_codegen.emit.definition import definition
from mechc_codegen.emit.expressions import (
    Line,
    Value,
    call,
    fma,
    let,
    named,
    put,
    real,
    sine_cosine,
    without_unused,
)
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.taylor.sums import Pair, are_few, arrange, sums_text
from mechc_codegen.ir.program import Operation, Series, symbols_in

Row = tuple[int, str]  # an operation's number, and "" or "j" where coefficient j is times j
_HIDING = ("exp", "log", "quotient", "root", "power")
_LEAST_ORDER = 9  # of a series, at any tolerance: see runtime/series/order.h
_ONCE = """#if R_VECTOR ? !defined MECHC_SCENE_SERIES_VECTOR : !defined MECHC_SCENE_SERIES_SCALAR
#if R_VECTOR
#define MECHC_SCENE_SERIES_VECTOR
#else
#define MECHC_SCENE_SERIES_SCALAR
#endif"""
_ROW, _ORDER, _INVERSE = named("row"), named("order"), named("inverse")


def series_text(functions: SceneFunctions) -> str:
    """The functions and their sizes, or nothing."""
    series = functions.program.series
    return "" if series is None else SeriesWriter(functions, series).text()


class SeriesWriter:
    """The text of one scene's recurrences.

    ``v5`` is the value of operation 5, ``r5`` one over what its recurrence divides by, ``d5`` its
    coefficient of the order at hand.
    """

    def __init__(self, functions: SceneFunctions, series: Series) -> None:
        self.series = series
        self.printer = RealPrinter()
        symbols = functions.program.symbols
        self.nq, self.nu = len(symbols.q), len(symbols.u)
        self.needed = series.needed_operations
        held = [series.operations[n] for n in self.needed]
        used = symbols_in(e for o in held for e in (o.value, *o.factors) if e is not None)
        arrays = ("p", symbols.parameters), ("k", functions.constants)
        places = [(s, named(a)[i]) for a, of in arrays for i, s in enumerate(of) if s in used]
        self.loads = [let(s.name, place) for s, place in places]
        self.integrals = [each for each in series.integrals if each[0] in self.needed]
        integrated = [*range(self.nq + self.nu), *(n for n, _ in self.integrals)]
        self.rows: dict[Row, int] = {(n, ""): place for place, n in enumerate(integrated)}
        self.integrated = len(integrated)
        self.kept = dict[str, int]()
        self.sums = dict[Pair, int]()
        self.solving = set[int]()  # the sums that the speeds follow from
        self.depths = dict[int, int]()
        self.bodies = dict[str, list[Line]]()  # of the functions in the text
        self.varying = self._varying()

    def _varying(self) -> set[int]:
        """The operations that change with time: not those of parameters and of speeds that nothing
        accelerates."""
        fixed = {self.nq + i for i in range(self.nu) if self._has_constant_speed(i)}
        varying = set[int]()
        for number in self.needed:
            operation = self.series.operations[number]
            own = operation.kind in ("state", "time") and number not in fixed
            if own or varying.intersection(operation.args):
                varying.add(number)
        return varying

    def _has_constant_speed(self, i: int) -> bool:
        coupled = any(self._entry(i, j) is not None for j in range(self.nu) if j != i)
        own = self.series.mass[i * self.nu + i]
        steady = not self.series.momenta or self.series.is_constant(own)
        return not coupled and steady and self.series.is_number(self.series.forcing[i], 0)

    def text(self) -> str:
        """Sizes and functions."""
        following = self._following()
        starting = self._starting()
        solving = [self._solving()] if self.series.momenta else []
        sizes = {"": len(self.rows), "_SUMS": len(self.sums), "_KEPT": len(self.kept)}
        sizes |= {"_INTEGRATED": self.integrated, "_MOMENTA": int(self.series.momenta)}
        lines = [f"#define MECHC_SERIES{name} {size}" for name, size in sizes.items()]
        lines.append(f"#define MECHC_SERIES_FEW {int(are_few(self.sums))}")
        lines.append(f"#define MECHC_SERIES_HIDES {int(self.hides)} /* changes beyond a step? */")
        lines += self._roots()
        last = self.solving if self.series.momenta else None
        summing = [*sums_text(arrange(self.sums), last), *solving]
        return "\n".join([_ONCE, *lines, "", starting, *summing, following, "#endif"])

    @property
    def hides(self) -> bool:
        """Whether the equations may change within a step that no term shows: of sums, products and
        sines of no higher degree than every series' order they cannot."""
        degrees = dict[int, int]()
        for n in self.needed:
            operation = self.series.operations[n]
            below = [degrees[a] for a in operation.args if a in degrees]
            if self.varies(n) and operation.kind in _HIDING:
                return True
            own = int(operation.kind in ("state", "time"))
            degrees[n] = sum(below) if operation.kind == "product" else max(below, default=own)
        return max(degrees.values(), default=0) > _LEAST_ORDER

    @property
    def roots(self) -> list[int]:
        """The rows of roots and powers, whose sign tells their branch."""
        kinds = {n: self.series.operations[n].kind for n in self.needed if self.varies(n)}
        return [self.row(n) for n, kind in kinds.items() if kind in ("root", "power")]

    def _roots(self) -> Iterator[str]:
        places = list(map(str, self.roots))
        yield f"#define MECHC_SERIES_ROOTS {len(places)}"
        if places:
            yield "#ifndef MECHC_ROOT_PLACES\n#define MECHC_ROOT_PLACES"
            yield f"static const int mechc_root_places[] = {{{', '.join(places)}}}; /* in a row */"
            yield "#endif"

    # -- pieces -----------------------------------------------------------------------------

    def keep(self, name: str) -> Value:
        """A number of order 0, stored for higher orders."""
        self.kept.setdefault(name, len(self.kept))
        return named(name)

    def row(self, number: int, weight: str = "") -> int:
        """The place of a series within a row of coefficients."""
        return self.rows.setdefault((number, weight), len(self.rows))

    def sum(self, left: int, right: int) -> Value:
        """The sum of products of two series' lower coefficients."""
        pair = (min(left, right), max(left, right))
        return named(f"s{self.sums.setdefault(pair, len(self.sums))}")

    def constant(self, value: Expr | None) -> Value:
        """A constant or an exponent."""
        assert value is not None
        return self.printer.real(value)

    def varies(self, number: int) -> bool:
        return number in self.varying

    def value(self, number: int) -> Value:
        """A value of order 0 that higher orders use."""
        return self.start(number) if self.series.is_constant(number) else self.keep(f"v{number}")

    def start(self, number: int) -> Value:
        """A value of order 0."""
        operation = self.series.operations[number]
        if operation.kind == "constant":
            return self.constant(operation.value)
        return named(f"v{number}")

    # -- order 0 ----------------------------------------------------------------------------

    def _starting(self) -> str:
        lines = [line for number in self.needed for line in self._value(number)]
        lines += self._factors()
        if not self.series.momenta:
            lines += self._solution("v", [self.start(n) for n in self.series.forcing])
        lines += [put(named("kept")[place], named(name)) for name, place in self.kept.items()]
        for (number, weight), place in self._rows_after(self.nq + self.nu):
            value = named(f"a{-1 - number}" if number < 0 else f"v{number}")
            lines.append(put(_ROW[place], real(0.0) if weight else value))
        lines += self._rates("v")
        signature = (
            "real t, const real *q, const real *u, const FN(given) *given, real *kept, real *row, "
            "real *rates"
        )
        return self._function("series_start", signature, "Order 0 of a motion.", lines)

    def _rows_after(self, first: int) -> list[tuple[Row, int]]:
        return [(of, place) for of, place in self.rows.items() if place >= first]

    def _value(self, n: int) -> Iterator[Line]:
        operation = self.series.operations[n]
        if operation.kind in ("constant", "cosine"):
            return
        if operation.kind == "sine":
            yield sine_cosine(self.start(operation.args[0]), (f"v{n}", f"v{n + 1}"))
        else:
            yield let(f"v{n}", self._formula(n, operation))
        if f"r{n}" in self.kept:
            last = self.start(operation.args[-1])
            yield let(f"r{n}", 0.5 / named(f"v{n}") if operation.kind == "root" else 1.0 / last)

    def _formula(self, n: int, operation: Operation) -> Value:
        v = [self.start(a) for a in operation.args]
        match operation.kind:
            case "time":
                return named("t")
            case "state":
                return named("q")[n] if n < self.nq else named("u")[n - self.nq]
            case "sum":
                return self._linear_combination(operation.factors, v)
            case "product":
                return v[0] * v[1]
            case "quotient":
                return v[0] / v[1]
            case "root":
                return call("R_SQRT", v[0])
            case "power":
                return call("R_CALL2", named("pow"), v[0], self.constant(operation.value))
        return call("R_CALL", named(operation.kind), v[0])

    def _linear_combination(self, factors: Iterable[Expr], values: Sequence[Value]) -> Value:
        """A sum of multiples; every product and its addition are one operation."""
        (first, *others), found = factors, values[0]
        if first != 1:
            found = -found if first == -1 else self.constant(first) * found
        for factor, value in zip(others, values[1:], strict=True):
            found = fma(self.constant(factor), value, found)
        return found

    # -- higher orders ----------------------------------------------------------------------

    def _following(self) -> str:
        lines = self._coefficients()
        for (number, weight), place in self._rows_after(self.integrated):
            value = named(f"b{-1 - number}" if number < 0 else f"d{number}")
            lines.append(put(_ROW[place], _ORDER * value if weight else value))
        lines += self._rates("d")
        signature = (
            "real order, real inverse, real time, const FN(given) *given, const real *kept, "
            "const real *sums, real *row, real *rates"
        )
        comment = "The row of an order from its states and the sums; rates of that order."
        lines = [*self._known(arrange(self.sums).values()), *lines]
        return self._function("series_next", signature, comment, lines)

    def _known(self, sums: Iterable[int]) -> list[Line]:
        """Lines that load what is kept of order 0, and these sums."""
        lines = [let(name, named("kept")[place]) for name, place in self.kept.items()]
        return lines + [let(f"s{n}", named("sums")[n]) for n in sums]

    def _coefficients(self) -> list[Line]:
        """Lines for the coefficients; terms of M u come first where it determines the speeds."""
        if self.series.momenta:
            lines = self._speeds()
            later = [number for number in self.needed if number not in self._first()]
            return lines + [line for number in later for line in self._coefficient(number)]
        lines = [line for number in self.needed for line in self._coefficient(number)]
        return lines + self._solution("d", list(map(self._forcing_coefficient, range(self.nu))))

    def _speeds(self) -> list[Line]:
        """Lines that solve the speeds from M u, which is integrated and stands in their places."""
        lines = [line for number in self._first() for line in self._coefficient(number)]
        lines += self._solution("d", list(map(self._momentum, range(self.nu))))
        used = frozenset[str]().union(*(line.uses for line in lines))
        self.solving = {n for n in self.sums.values() if f"s{n}" in used}
        return lines + [put(_ROW[self.nq + i], named(f"b{i}")) for i in range(self.nu)]

    def _first(self) -> list[int]:
        """The operations that M is made of, without the rates of integrals."""
        return replace(self.series, forcing=(), rates=(), integrals=()).needed_operations

    def _solving(self) -> str:
        """The last lines of the highest order, from which only the states are needed."""
        lines = self._speeds()
        signature = "const FN(given) *given, const real *kept, const real *sums, real *row"
        lines = [*self._known(sorted(self.solving)), *lines]
        return self._function("series_solve", signature, "Speeds from M u.", lines)

    def _coefficient(self, n: int) -> Iterator[Line]:
        if self.varies(n):
            known = self.rows.get((n, ""), self.integrated)
            value = _ROW[known] if known < self.integrated else self._recurrence(n)
            yield let(f"d{n}", value)

    def _recurrence(self, n: int) -> Value:
        operation = self.series.operations[n]
        args = operation.args
        of = named(f"d{args[0]}") if args else named("time")
        match operation.kind:
            case "time":
                return of
            case "sum":
                pairs = zip(operation.factors, args, strict=True)
                varying = [(factor, named(f"d{a}")) for factor, a in pairs if self.varies(a)]
                return self._linear_combination(*zip(*varying, strict=True))
            case "product":
                return self._product(*args)
            case "quotient":
                return self._quotient(n, *args)
            case "root":
                return (of - self.sum(self.row(n), self.row(n))) * self.keep(f"r{n}")
            case "sine":
                total = self.sum(self.row(args[0], "j"), self.row(n + 1))
                return fma(of, self.value(n + 1), _INVERSE * total)
            case "cosine":
                total = self.sum(self.row(args[0], "j"), self.row(n - 1))
                return fma(-of, self.value(n - 1), -(_INVERSE * total))
            case "exp":
                total = self.sum(self.row(args[0], "j"), self.row(n))
                return fma(of, self.value(n), _INVERSE * total)
            case "log":
                total = self.sum(self.row(n, "j"), self.row(args[0]))
                return fma(-_INVERSE, total, of) * self.keep(f"r{n}")
        return self._power(n, operation)

    def _product(self, a: int, b: int) -> Value:
        for one, other in ((a, b), (b, a)):
            if not self.varies(one):
                return self.value(one) * named(f"d{other}")
        total = self.sum(self.row(a), self.row(b))
        if a == b:
            return fma(self.value(a) + self.value(a), named(f"d{a}"), total)
        a, b = sorted((a, b), key=self.depth)  # what is known last is multiplied last
        return fma(self.value(a), named(f"d{b}"), fma(self.value(b), named(f"d{a}"), total))

    def depth(self, number: int) -> int:
        """The number of values on which an operation's coefficient depends one after the other."""
        if number not in self.depths:
            operation, nx = self.series.operations[number], self.nq + self.nu
            solved = self.series.momenta and self.nq <= number < nx
            known = self.rows.get((number, ""), self.integrated) < self.integrated
            found = 1 + max(map(self.depth, () if known else operation.args), default=0)
            self.depths[number] = found + self.nu * solved
        return self.depths[number]

    def _quotient(self, n: int, a: int, b: int) -> Value:
        above = named(f"d{a}")
        if not self.varies(b):
            return above * self.keep(f"r{n}")
        total = self.sum(self.row(b), self.row(n))
        above = above - total if self.varies(a) else -total
        return fma(-self.value(n), named(f"d{b}"), above) * self.keep(f"r{n}")

    def _power(self, n: int, operation: Operation) -> Value:
        (a,), exponent = operation.args, self.constant(operation.value)
        one = self.sum(self.row(a, "j"), self.row(n))
        other = self.sum(self.row(n, "j"), self.row(a))
        lower = fma(exponent, one, -other) * _INVERSE
        return fma(exponent * named(f"d{a}"), self.value(n), lower) * self.keep(f"r{n}")

    # -- the solution of M u' = F -----------------------------------------------------------

    def _entry(self, i: int, j: int) -> int | None:
        """The number of an entry of M, or None where it is zero."""
        number = self.series.mass[i * self.nu + j]
        return None if self.series.is_number(number, 0) else number

    def _varying_entries(self, i: int) -> list[tuple[int, int]]:
        """The columns and numbers of entries of a row of M that change with time."""
        entries = [(j, self._entry(i, j)) for j in range(self.nu)]
        return [(j, entry) for j, entry in entries if entry is not None and self.varies(entry)]

    def _forcing_coefficient(self, i: int) -> Value:
        """The coefficient of F_i minus the products with coefficients of M."""
        value = self._of_order("d", self.series.forcing[i])
        for j, entry in self._varying_entries(i):
            total = self.sum(self.row(entry), self.row(-1 - j))
            value = fma(-named(f"d{entry}"), self.keep(f"a{j}"), value - total)
        return value

    def _momentum(self, i: int) -> Value:
        """The coefficient of (M u)_i, which is in the row, minus the products with those of M."""
        value = _ROW[self.nq + i]
        for j, entry in self._varying_entries(i):
            value = fma(-named(f"d{entry}"), self.value(self.nq + j), value)
        for j, entry in self._varying_entries(i):
            factor, total = self._sum_with(entry, self.nq + j)
            value = fma(-factor, total, value)
        return value

    def _sum_with(self, number: int, place: int) -> tuple[Value, Value]:
        """A factor and a sum of products; a multiple of one series uses the sum of that series."""
        operation = self.series.operations[number]
        if operation.kind == "sum":
            pairs = zip(operation.factors, operation.args, strict=True)
            varying = [(factor, a) for factor, a in pairs if self.varies(a)]
            if len(varying) == 1:
                ((factor, a),) = varying
                return self.constant(factor), self.sum(self.row(a), place)
        return real(1.0), self.sum(self.row(number), place)

    def _pattern(self) -> list[list[int]]:
        """The columns in which each row of L is not zero: M = L D L^T."""
        rows = [[j for j in range(i) if self._entry(i, j) is not None] for i in range(self.nu)]
        for i, row in enumerate(rows):
            for j in range(i):
                if j not in row and set(rows[j]).intersection(k for k in row if k < j):
                    row.append(j)
            row.sort()
        return rows

    def _factors(self) -> list[Line]:
        pattern, lines = self._pattern(), list[Line]()
        for i, row in enumerate(pattern):
            for j in row:
                entry = self._entry(i, j)
                value = real(0.0) if entry is None else self.start(entry)
                for k in (k for k in row if k < j and k in pattern[j]):
                    value = fma(-named(f"w{i}_{k}"), named(f"l{j}_{k}"), value)
                lines.append(let(f"w{i}_{j}", value))
                lines.append(let(f"l{i}_{j}", named(f"w{i}_{j}") * named(f"m{j}")))
            value = self.start(self.series.mass[i * self.nu + i])
            for k in row:
                value = fma(-named(f"w{i}_{k}"), named(f"l{i}_{k}"), value)
            lines.append(let(f"m{i}", 1.0 / value))
        return lines

    def _solution(self, kind: str, forcing: list[Value]) -> list[Line]:
        """Lines that solve L D L^T a = F."""
        keep, result = (self.keep, "b") if kind == "d" else (named, "a")
        pattern, lines = self._pattern(), list[Line]()
        for i, row in enumerate(pattern):
            value = forcing[i]
            for k in row:
                value = fma(-keep(f"l{i}_{k}"), named(f"f{k}"), value)
            lines.append(let(f"f{i}", value))
        for i in reversed(range(self.nu)):
            value = named(f"f{i}") * keep(f"m{i}")
            for k in (k for k in range(i + 1, self.nu) if i in pattern[k]):
                value = fma(-keep(f"l{k}_{i}"), named(f"{result}{k}"), value)
            lines.append(let(f"{result}{i}", value))
        return lines

    def _rates(self, kind: str) -> list[Line]:
        """Lines that store q' and u'."""
        rates = [self._rate(kind, i) for i in range(self.nq)]
        if self.series.momenta:
            rates += [self._of_order(kind, number) for number in self.series.forcing]
        else:
            rates += [named(f"{'b' if kind == 'd' else 'a'}{i}") for i in range(self.nu)]
        rates += [self._of_order(kind, rate) for _, rate in self.integrals]
        return [put(named("rates")[i], rate) for i, rate in enumerate(rates)]

    def _rate(self, kind: str, i: int) -> Value:
        if not self.series.rates:
            return named("u")[i] if kind == "v" else _ROW[self.nq + i]
        return self._of_order(kind, self.series.rates[i])

    def _of_order(self, kind: str, number: int) -> Value:
        """The value of order 0 (``kind`` "v"), or the coefficient of the current order."""
        if kind == "v":
            return self.start(number)
        return named(f"d{number}") if self.varies(number) else real(0.0)

    def _function(self, name: str, signature: str, comment: str, lines: Sequence[Line]) -> str:
        self.bodies[name] = without_unused([*self.loads, *lines])
        return definition(comment, name, signature, self.bodies[name])
