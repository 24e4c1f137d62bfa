"""The recurrences of Taylor coefficients in C over ``real``.

Input: a scene's functions.  Output: the text of ``scene_series.h``; it defines nothing where the
equations have no recurrences.  A row holds the coefficients of one order: the states first, then
the other series that sums over products are made of.  Invariant: the sums of an order need rows of
lower orders alone, so that they are independent of each other; everything else is linear.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from sympy import Expr, Symbol

from mechc_codegen.emit.definition import definition
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.taylor.sums import Pair, are_few, arrange, sums_text
from mechc_codegen.ir.program import Operation, Series

Row = tuple[int, str]  # an operation's number, and "" or "j" where coefficient j is times j
_HIDING = ("exp", "log", "quotient", "root", "power")
_LEAST_ORDER = 9  # of a series, at any tolerance: see runtime/series/order.h
_ONCE = """#if R_VECTOR ? !defined MECHC_SCENE_SERIES_VECTOR : !defined MECHC_SCENE_SERIES_SCALAR
#if R_VECTOR
#define MECHC_SCENE_SERIES_VECTOR
#else
#define MECHC_SCENE_SERIES_SCALAR
#endif"""
_DEFINITION = re.compile(r"const real (\w+) =")
_SUM = re.compile(r"\bs(\d+)\b")
_NAME = re.compile(r"[A-Za-z_]\w*")


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
        self.places = {s: f"p[{i}]" for i, s in enumerate(symbols.parameters)}
        self.places |= {s: f"k[{i}]" for i, s in enumerate(functions.constants)}
        self.nq, self.nu = len(symbols.q), len(symbols.u)
        self.needed = series.needed_operations
        self.integrals = [each for each in series.integrals if each[0] in self.needed]
        integrated = [*range(self.nq + self.nu), *(n for n, _ in self.integrals)]
        self.rows: dict[Row, int] = {(n, ""): place for place, n in enumerate(integrated)}
        self.integrated = len(integrated)
        self.kept = dict[str, int]()
        self.sums = dict[Pair, int]()
        self.solving = set[int]()  # the sums that the speeds follow from
        self.used = set[Symbol]()
        self.depths = dict[int, int]()
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
        sizes = {"": len(self.rows), "_SUMS": len(self.sums), "_KEPT": len(self.kept)}
        sizes |= {"_INTEGRATED": self.integrated, "_MOMENTA": int(self.series.momenta)}
        lines = [f"#define MECHC_SERIES{name} {size}" for name, size in sizes.items()]
        lines.append(f"#define MECHC_SERIES_FEW {int(are_few(self.sums))}")
        lines.append(f"#define MECHC_SERIES_HIDES {int(self.hides)} /* changes beyond a step? */")
        lines += self._roots()
        summing = sums_text(self.sums, self.solving if self.series.momenta else None)
        summing += [self._solving()] if self.series.momenta else []
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

    def _roots(self) -> Iterator[str]:
        """The rows of roots and powers, whose sign tells their branch."""
        kinds = {n: self.series.operations[n].kind for n in self.needed if self.varies(n)}
        places = [str(self.row(n)) for n, kind in kinds.items() if kind in ("root", "power")]
        yield f"#define MECHC_SERIES_ROOTS {len(places)}"
        if places:
            yield f"#define MECHC_SERIES_ROOT_PLACES {', '.join(places)} /* in a row */"

    # -- pieces -----------------------------------------------------------------------------

    def keep(self, name: str) -> str:
        """Store a number of order 0 for higher orders, and return its name."""
        self.kept.setdefault(name, len(self.kept))
        return name

    def row(self, number: int, weight: str = "") -> int:
        """The place of a series within a row of coefficients."""
        return self.rows.setdefault((number, weight), len(self.rows))

    def sum(self, left: int, right: int) -> str:
        """The name of the sum of products of two series' lower coefficients."""
        pair = (min(left, right), max(left, right))
        return f"s{self.sums.setdefault(pair, len(self.sums))}"

    def constant(self, value: Expr | None) -> str:
        """The C text of a constant or an exponent, as a factor."""
        assert value is not None
        self.used |= value.free_symbols
        text = self.printer.real(value)
        return f"({text})" if value.is_Add else text

    def varies(self, number: int) -> bool:
        return number in self.varying

    def value(self, number: int) -> str:
        """The name of a value of order 0 that higher orders use."""
        name = self.start(number)
        return name if self.series.is_constant(number) else self.keep(name)

    def start(self, number: int) -> str:
        """The name or number of a value of order 0."""
        operation = self.series.operations[number]
        return self.constant(operation.value) if operation.kind == "constant" else f"v{number}"

    # -- order 0 ----------------------------------------------------------------------------

    def _starting(self) -> str:
        self.used = set()
        body = [line for number in self.needed for line in self._value(number)]
        body += self._factors()
        if not self.series.momenta:
            body += self._solution("v", [self.start(n) for n in self.series.forcing])
        body += [f"kept[{place}] = {name};" for name, place in self.kept.items()]
        own = self._rows_after(self.nq + self.nu)
        for (number, weight), place in own:
            value = f"a{-1 - number}" if number < 0 else f"v{number}"
            body.append(f"row[{place}] = {'R(0.0)' if weight else value};")
        body += self._rates("v")
        signature = (
            "real t, const real *q, const real *u, const FN(given) *given, real *kept, real *row, "
            "real *rates"
        )
        return self._function("series_start", signature, "Order 0 of a motion.", body)

    def _rows_after(self, first: int) -> list[tuple[Row, int]]:
        return [(of, place) for of, place in self.rows.items() if place >= first]

    def _value(self, n: int) -> Iterator[str]:
        operation = self.series.operations[n]
        if operation.kind in ("constant", "cosine"):
            return
        if operation.kind == "sine":
            yield f"real v{n}, v{n + 1};"
            yield f"FN(sincos)({self.start(operation.args[0])}, &v{n}, &v{n + 1});"
        else:
            yield f"const real v{n} = {self._formula(n, operation)};"
        yield from self._inverses(n, operation)

    def _formula(self, n: int, operation: Operation) -> str:
        v = [self.start(a) for a in operation.args]
        match operation.kind:
            case "time":
                return "t"
            case "state":
                return f"q[{n}]" if n < self.nq else f"u[{n - self.nq}]"
            case "sum":
                return self._linear_combination(operation.factors, v)
            case "product":
                return f"{v[0]} * {v[1]}"
            case "quotient":
                return f"{v[0]} / {v[1]}"
            case "root":
                return f"R_SQRT({v[0]})"
            case "power":
                return f"R_CALL2(pow, {v[0]}, {self.constant(operation.value)})"
        return f"R_CALL({operation.kind}, {v[0]})"

    def _inverses(self, n: int, operation: Operation) -> Iterator[str]:
        if f"r{n}" not in self.kept:
            return
        if operation.kind == "root":
            yield f"const real r{n} = 0.5 / v{n};"
        else:
            yield f"const real r{n} = 1.0 / {self.start(operation.args[-1])};"

    def _linear_combination(self, factors: Iterable[Expr], names: Iterable[str]) -> str:
        """A sum of multiples; every product and its addition are one operation."""
        text = ""
        for factor, name in zip(factors, names, strict=True):
            number = self.constant(factor)
            if not text:
                text = {1: name, -1: f"-{name}"}.get(factor, f"{number} * {name}")
            else:
                text = f"R_FMA({number}, {name}, {text})"
        return text

    # -- higher orders ----------------------------------------------------------------------

    def _following(self) -> str:
        self.used = set()
        body = self._coefficients()
        own = self._rows_after(self.integrated)
        for (number, weight), place in own:
            value = f"b{-1 - number}" if number < 0 else f"d{number}"
            body.append(f"row[{place}] = {'order * ' if weight else ''}{value};")
        body += self._rates("d")
        self.sums = arrange(self.sums)
        loads = [f"const real {name} = kept[{place}];" for name, place in self.kept.items()]
        loads += [f"const real s{place} = sums[{place}];" for place in self.sums.values()]
        signature = (
            "real order, real inverse, real time, const FN(given) *given, const real *kept, "
            "const real *sums, real *row, real *rates"
        )
        comment = "The row of an order from its states and the sums; rates of that order."
        return self._function("series_next", signature, comment, loads + body)

    def _coefficients(self) -> list[str]:
        """Lines for the coefficients; terms of M u come first where it determines the speeds."""
        if self.series.momenta:
            lines = self._speeds()
            later = [number for number in self.needed if number not in self._first()]
            return lines + [line for number in later for line in self._coefficient(number)]
        lines = [line for number in self.needed for line in self._coefficient(number)]
        return lines + self._solution("d", list(map(self._forcing_coefficient, range(self.nu))))

    def _speeds(self) -> list[str]:
        """Lines that solve the speeds from M u, which is integrated and stands in their places."""
        lines = [line for number in self._first() for line in self._coefficient(number)]
        lines += self._solution("d", list(map(self._momentum, range(self.nu))))
        self.solving = {int(n) for line in lines for n in _SUM.findall(line)}
        return lines + [f"row[{self.nq + i}] = b{i};" for i in range(self.nu)]

    def _first(self) -> list[int]:
        """The operations that M is made of, without the rates of integrals."""
        return replace(self.series, forcing=(), rates=(), integrals=()).needed_operations

    def _solving(self) -> str:
        """The last lines of the highest order, from which only the states are needed."""
        lines = self._speeds()
        loads = [f"const real {name} = kept[{place}];" for name, place in self.kept.items()]
        loads += [f"const real s{place} = sums[{place}];" for place in sorted(self.solving)]
        signature = "const FN(given) *given, const real *kept, const real *sums, real *row"
        return self._function("series_solve", signature, "Speeds from M u.", loads + lines)

    def _coefficient(self, n: int) -> Iterator[str]:
        operation = self.series.operations[n]
        if not self.varies(n):
            return
        if (n, "") in self.rows and self.rows[n, ""] < self.integrated:
            yield f"const real d{n} = row[{self.rows[n, '']}];"
            return
        yield f"const real d{n} = {self._recurrence(n, operation)};"

    def _recurrence(self, n: int, operation: Operation) -> str:
        args = operation.args
        match operation.kind:
            case "time":
                return "time"
            case "sum":
                pairs = zip(operation.factors, args, strict=True)
                varying = [(factor, f"d{a}") for factor, a in pairs if self.varies(a)]
                return self._linear_combination(*zip(*varying, strict=True))
            case "product":
                return self._product(*args)
            case "quotient":
                return self._quotient(n, *args)
            case "root":
                inner = f"d{args[0]} - {self.sum(self.row(n), self.row(n))}"
                return f"({inner}) * {self.keep(f'r{n}')}"
            case "sine":
                total = self.sum(self.row(args[0], "j"), self.row(n + 1))
                return f"R_FMA(d{args[0]}, {self.value(n + 1)}, inverse * {total})"
            case "cosine":
                total = self.sum(self.row(args[0], "j"), self.row(n - 1))
                return f"R_FMA(-d{args[0]}, {self.value(n - 1)}, -(inverse * {total}))"
            case "exp":
                total = self.sum(self.row(args[0], "j"), self.row(n))
                return f"R_FMA(d{args[0]}, {self.value(n)}, inverse * {total})"
            case "log":
                total = self.sum(self.row(n, "j"), self.row(args[0]))
                return f"R_FMA(-inverse, {total}, d{args[0]}) * {self.keep(f'r{n}')}"
        return self._power(n, operation)

    def _product(self, a: int, b: int) -> str:
        for one, other in ((a, b), (b, a)):
            if not self.varies(one):
                return f"{self.value(one)} * d{other}"
        total = self.sum(self.row(a), self.row(b))
        if a == b:
            return f"R_FMA({self.value(a)} + {self.value(a)}, d{a}, {total})"
        a, b = sorted((a, b), key=self.depth)  # what is known last is multiplied last
        return f"R_FMA({self.value(a)}, d{b}, R_FMA({self.value(b)}, d{a}, {total}))"

    def depth(self, number: int) -> int:
        """The number of values on which an operation's coefficient depends one after the other."""
        if number not in self.depths:
            operation, nx = self.series.operations[number], self.nq + self.nu
            solved = self.series.momenta and self.nq <= number < nx
            known = self.rows.get((number, ""), self.integrated) < self.integrated
            found = 1 + max(map(self.depth, () if known else operation.args), default=0)
            self.depths[number] = found + self.nu * solved
        return self.depths[number]

    def _quotient(self, n: int, a: int, b: int) -> str:
        if not self.varies(b):
            return f"d{a} * {self.keep(f'r{n}')}"
        total = self.sum(self.row(b), self.row(n))
        above = f"d{a} - {total}" if self.varies(a) else f"-{total}"
        return f"R_FMA(-{self.value(n)}, d{b}, {above}) * {self.keep(f'r{n}')}"

    def _power(self, n: int, operation: Operation) -> str:
        (a,), exponent = operation.args, operation.value
        number = self.constant(exponent)
        one = self.sum(self.row(a, "j"), self.row(n))
        other = self.sum(self.row(n, "j"), self.row(a))
        lower = f"R_FMA({number}, {one}, -{other}) * inverse"
        return f"R_FMA({number} * d{a}, {self.value(n)}, {lower}) * {self.keep(f'r{n}')}"

    # -- the solution of M u' = F -----------------------------------------------------------

    def _entry(self, i: int, j: int) -> int | None:
        """The number of an entry of M, or None where it is zero."""
        number = self.series.mass[i * self.nu + j]
        return None if self.series.is_number(number, 0) else number

    def _forcing_coefficient(self, i: int) -> str:
        """The coefficient of F_i minus the products with coefficients of M."""
        text = f"d{self.series.forcing[i]}" if self.varies(self.series.forcing[i]) else "R(0.0)"
        for j in range(self.nu):
            entry = self._entry(i, j)
            if entry is not None and self.varies(entry):
                total = self.sum(self.row(entry), self.row(-1 - j))
                text = f"R_FMA(-d{entry}, {self.keep(f'a{j}')}, {text} - {total})"
        return text

    def _momentum(self, i: int) -> str:
        """The coefficient of (M u)_i, which is in the row, minus the products with those of M."""
        text = f"row[{self.nq + i}]"
        for j in range(self.nu):
            entry = self._entry(i, j)
            if entry is not None and self.varies(entry):
                text = f"R_FMA(-d{entry}, {self.value(self.nq + j)}, {text})"
        for j in range(self.nu):
            entry = self._entry(i, j)
            if entry is not None and self.varies(entry):
                factor, total = self._sum_with(entry, self.nq + j)
                text = f"R_FMA(-{factor}, {total}, {text})"
        return text

    def _sum_with(self, number: int, place: int) -> tuple[str, str]:
        """A factor and a sum of products; a multiple of one series uses the sum of that series."""
        operation = self.series.operations[number]
        if operation.kind == "sum":
            pairs = zip(operation.factors, operation.args, strict=True)
            varying = [(factor, a) for factor, a in pairs if self.varies(a)]
            if len(varying) == 1:
                ((factor, a),) = varying
                return f"({self.constant(factor)})", self.sum(self.row(a), place)
        return "R(1.0)", self.sum(self.row(number), place)

    def _pattern(self) -> list[list[int]]:
        """The columns in which each row of L is not zero: M = L D L^T."""
        rows = [[j for j in range(i) if self._entry(i, j) is not None] for i in range(self.nu)]
        for i, row in enumerate(rows):
            for j in range(i):
                if j not in row and set(rows[j]).intersection(k for k in row if k < j):
                    row.append(j)
            row.sort()
        return rows

    def _factors(self) -> list[str]:
        pattern, lines = self._pattern(), list[str]()
        for i, row in enumerate(pattern):
            for j in row:
                entry = self._entry(i, j)
                text = "R(0.0)" if entry is None else self.start(entry)
                for k in (k for k in row if k < j and k in pattern[j]):
                    text = f"R_FMA(-w{i}_{k}, l{j}_{k}, {text})"
                lines.append(f"const real w{i}_{j} = {text};")
                lines.append(f"const real l{i}_{j} = w{i}_{j} * m{j};")
            text = self.start(self.series.mass[i * self.nu + i])
            for k in row:
                text = f"R_FMA(-w{i}_{k}, l{i}_{k}, {text})"
            lines.append(f"const real m{i} = 1.0 / ({text});")
        return lines

    def _solution(self, kind: str, forcing: list[str]) -> list[str]:
        """Lines that solve L D L^T a = F."""
        keep, result = (self.keep, "b") if kind == "d" else (str, "a")
        pattern, lines = self._pattern(), list[str]()
        for i, row in enumerate(pattern):
            text = forcing[i]
            for k in row:
                text = f"R_FMA(-{keep(f'l{i}_{k}')}, f{k}, {text})"
            lines.append(f"const real f{i} = {text};")
        for i in reversed(range(self.nu)):
            text = f"f{i} * {keep(f'm{i}')}"
            for k in (k for k in range(i + 1, self.nu) if i in pattern[k]):
                text = f"R_FMA(-{keep(f'l{k}_{i}')}, {result}{k}, {text})"
            lines.append(f"const real {result}{i} = {text};")
        return lines

    def _rates(self, kind: str) -> list[str]:
        """Lines that store q' and u'."""
        rates = [self._rate(kind, i) for i in range(self.nq)]
        if self.series.momenta:
            rates += [self._of_order(kind, number) for number in self.series.forcing]
        else:
            rates += [f"{'b' if kind == 'd' else 'a'}{i}" for i in range(self.nu)]
        rates += [self._of_order(kind, rate) for _, rate in self.integrals]
        return [f"rates[{i}] = {rate};" for i, rate in enumerate(rates)]

    def _rate(self, kind: str, i: int) -> str:
        if not self.series.rates:
            return f"u[{i}]" if kind == "v" else f"row[{self.nq + i}]"
        return self._of_order(kind, self.series.rates[i])

    def _of_order(self, kind: str, number: int) -> str:
        """The value of order 0 (``kind`` "v"), or the coefficient of the current order."""
        if kind == "v":
            return self.start(number)
        return f"d{number}" if self.varies(number) else "R(0.0)"

    def _function(self, name: str, signature: str, comment: str, body: list[str]) -> str:
        loads = list[str]()
        if "given" in signature:
            used = [(s, place) for s, place in self.places.items() if s in self.used]
            loads = [f"const real {s.name} = {place};" for s, place in used]
        return definition(comment, name, signature, _used([*loads, *body]), "MECHC_INLINE")


def _used(body: list[str]) -> list[str]:
    """The lines without values that no later line reads, such as unused cosines."""
    kept, read = list[str](), set[str]()
    for line in reversed(body):
        name = _DEFINITION.match(line)
        if name is None or name[1] in read:
            kept.append(line)
            read.update(_NAME.findall(line[name.end() if name else 0 :]))
    return kept[::-1]
