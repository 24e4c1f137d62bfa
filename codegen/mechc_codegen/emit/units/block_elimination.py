"""C for the elimination of constraint rows block by block, for `dynamics/loops/blocks.h`.

Input: the block-triangular form.  Output: their text, and the operations of one evaluation.
Invariant: entries that are zero for all states are not in the text; nothing is a loop or a branch.

With J_b the rows of a block in its own speeds, and C_b in those before, everything comes from one
matrix of each block, G_b with J_b G_b = 1:
    values v of the rows          x_b = G_b (v_b - C_b x)
    a free direction              n_b of its block, J_b n_b = 0; x_c = -G_c C_c n in those after it
    multipliers of the rows       l_b = G_b^T (r_b - sum of C_c^T l_c over the blocks after it)
G_b is the inverse of a square block.  Of one with a speed more, J_b leaves one direction n_b, in
three dimensions the cross product of its rows, and G_b v is the x with J_b x = v and m.x = 0, for
m = n_b weighted by the mass that each speed moves; no speed is chosen that could be a bad one.
A single row that leaves two directions has them with the speed that it moves most, which is chosen
in every lane.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from mechc_codegen.emit.row_blocks import Block, BlockForm

Terms = Mapping[int, str]  # name of each entry that is not zero


@dataclass
class _Text:
    """Statements of one function, with the number of their operations."""

    lines: list[str] = field(default_factory=list)
    operations: int = 0

    def let(self, name: str, value: str, operations: int) -> str:
        self.add(f"const real {name} = {value};", operations)
        return name

    def put(self, place: str, value: str, operations: int = 0) -> None:
        self.add(f"{place} = {value};", operations)

    def add(self, line: str, operations: int = 0) -> None:
        self.lines.append(line)
        self.operations += operations

    def ask(self, square: str, of: str, operations: int) -> None:
        """Add the test whether a squared sine is large enough."""
        self.add(f"safe &= R_MASK({square} > MECHC_SAFE_SINE * ({of}));", operations + 2)

    def products(self, name: str, pairs: Sequence[tuple[str, str]]) -> str:
        return self.let(name, _sum(pairs), len(pairs))

    def less(self, name: str, start: str, pairs: Sequence[tuple[str, str]]) -> str:
        """A start value minus the sum of the products; the start value may be zero."""
        if not pairs:
            return start
        value = f"{start} - ({_sum(pairs)})" if start else f"-({_sum(pairs)})"
        return self.let(name, value, len(pairs))


class BlockElimination:
    """The C functions of block elimination for one scene."""

    def __init__(self, form: BlockForm) -> None:
        self.form = form
        self.size = len(form.mass)
        self.first = list[int]()  # of each block its place among what is kept
        kept = 0
        for block in form.blocks:
            self.first.append(kept)
            kept += len(block.rows) * len(block.speeds)
        self.kept = kept

    def text(self) -> str:
        """The text of all functions."""
        return "\n".join(_function(*each) for each in self._functions())

    def operations(self) -> dict[str, int]:
        """Operation counts: factoring all rows, one solution, the condition numbers."""
        named = {name: text.operations for name, _, _, text in self._functions()}
        free = self.form.free
        weights = 2 * self.size * free
        return {
            "factors": named["factor_blocks"] + weights,
            "solution": named["solve_blocks"] + 3 * self.size * free,
            "conditioning": named["longest_answer"] + weights,
        }

    def _functions(self) -> Iterator[tuple[str, str, str, _Text]]:
        """Name, return type, parameters and statements of each function."""
        given = "const real *jacobian, "
        yield (
            "factor_blocks", "rmask",
            given + "const real *mass, const real *weight, real *kept, real *directions, "
            "real *momenta, real *own, real *lengths, rmask *clear", self._factors(),
        )  # fmt: skip
        known = given + "const real *kept, "
        yield "solve_blocks", "void", known + "const real *values, real *x", self._solution()
        yield (
            "longest_answer", "real", known + "const real *mass, const real *axes, "
            "const real *inverse", self._longest_answer(),
        )  # fmt: skip
        yield (
            "block_multipliers",
            "void",
            known + "const real *reaction, real *lambda",
            self._back(),
        )
        yield "rates_in_blocks", "void", given + "const real *x, real *rates", self._rates()
        yield "partials_in_blocks", "real", "const real *jacobian", self._partials()

    # -- entries ----------------------------------------------------------------------------

    def _entry(self, row: int, speed: int) -> str:
        return f"jacobian[{row * self.size + speed}]"

    def _row(self, row: int) -> list[int]:
        return sorted(self.form.jacobian[row])

    def _own(self, block: Block, row: int) -> list[int]:
        return [k for k in block.speeds if k in self.form.jacobian[row]]

    def _before(self, block: Block, row: int) -> list[int]:
        return [k for k in self._row(row) if k not in block.speeds]

    def _factor(self, number: int, speed: int, row: int) -> str:
        block = self.form.blocks[number]
        place = block.speeds.index(speed) * len(block.rows) + block.rows.index(row)
        return f"kept[{self.first[number] + place}]"

    # -- factors ----------------------------------------------------------------------------

    def _factors(self) -> _Text:
        text, free = _Text(), 0
        text.add("rmask safe = R_MASK(R(0.0) == R(0.0));")
        for row in range(len(self.form.jacobian)):
            each = [
                (f"{e} * {e}", f"weight[{k}]") for k in self._row(row) if (e := self._entry(row, k))
            ]
            text.put(f"lengths[{row}]", " + ".join(f"{a} * {b}" for a, b in each), 2 * len(each))
        for number, block in enumerate(self.form.blocks):
            if block.free == 2:
                self._open_row(text, number, free)
            elif block.free:
                self._free_block(text, number, free)
            else:
                self._square_block(text, number)
            free += block.free
        for number, direction in enumerate(self._directions(text)):
            self._momentum(text, number, direction)
        self._clear(text)
        text.add("return safe;")
        return text

    def _square_block(self, text: _Text, number: int) -> None:
        block = self.form.blocks[number]
        if len(block.rows) == 1:
            row, speed = block.rows[0], block.speeds[0]
            a = self._entry(row, speed)
            text.put(self._factor(number, speed, row), f"1.0 / {a}", 1)
            text.ask(f"{a} * {a} * weight[{speed}]", f"lengths[{row}]", 2)
            return
        (r, s), (i, j) = block.rows, block.speeds
        a, b, c, d = (self._entry(row, k) for row in (r, s) for k in (i, j))
        n = f"_{number}"
        det = text.let(f"det{n}", f"{a} * {d} - {b} * {c}", 2)
        text.ask(f"{det} * {det}", f"({a} * {a} + {c} * {c}) * ({b} * {b} + {d} * {d})", 6)
        inverse = text.let(f"inverse{n}", f"1.0 / {det}", 1)
        for speed, row, value in ((i, r, d), (i, s, f"-{b}"), (j, r, f"-{c}"), (j, s, a)):
            text.put(self._factor(number, speed, row), f"{value} * {inverse}", 1)

    def _free_block(self, text: _Text, number: int, free: int) -> None:
        """Add n and G of a block that has one speed more than rows."""
        block = self.form.blocks[number]
        n = f"_{number}"
        entries = [[self._entry(row, k) for k in block.speeds] for row in block.rows]
        own = [f"n{n}_{k}" for k in range(len(block.speeds))]
        for name, (value, operations) in zip(own, _complement(entries), strict=True):
            text.let(name, value, operations)
        weighted = [
            text.let(f"m{n}_{k}", f"mass[{speed * self.size + speed}] * {own[k]}", 1)
            for k, speed in enumerate(block.speeds)
        ]
        square = text.products(f"square{n}", list(zip(weighted, own, strict=True)))
        text.put(f"own[{free}]", square)
        if not block.rows:
            return
        if len(block.rows) == 2:
            r, s = block.rows
            weights = " * ".join(f"weight[{k}]" for k in block.speeds)
            area = text.let(f"area{n}", f"{square} * ({weights})", 3)
            text.ask(area, f"lengths[{r}] * lengths[{s}]", 1)
        inverse = text.let(f"inverse{n}", f"1.0 / {square}", 1)
        for row, column in zip(block.rows, _right_inverse(entries, weighted), strict=True):
            for speed, (value, operations) in zip(block.speeds, column, strict=True):
                text.put(self._factor(number, speed, row), f"({value}) * {inverse}", operations + 1)

    def _open_row(self, text: _Text, number: int, free: int) -> None:
        """Add the directions and G of one row with three speeds, by the speed that counts most."""
        (row,), speeds = self.form.blocks[number].rows, self.form.blocks[number].speeds
        a, n = [self._entry(row, speed) for speed in speeds], f"_{number}"
        moved = [text.let(f"v{n}_{k}", f"{a[k]} * weight[{s}]", 1) for k, s in enumerate(speeds)]
        part = [text.let(f"part{n}_{k}", f"{a[k]} * {moved[k]}", 1) for k in range(3)]
        most = [f"R_MASK({part[i]} >= {part[j]})" for i, j in ((0, 1), (0, 2), (1, 2))]
        first = f"const rmask first{n} = {most[0]} & {most[1]}"
        text.add(f"{first}, second{n} = ~first{n} & {most[2]};", 6)
        for which, ways in enumerate(_open_directions(a)):
            squares = list[str]()
            for k, (one, two, three) in enumerate(zip(*ways, strict=True)):
                value = f"R_SELECT(first{n}, {one}, R_SELECT(second{n}, {two}, {three}))"
                own = text.let(f"n{n}_{3 * which + k}", value, 2)
                squares.append(f"{own} * {own} * mass[{speeds[k] * (self.size + 1)}]")
            text.put(f"own[{free + which}]", " + ".join(squares), 6)
        inverse = text.let(f"inverse{n}", f"1.0 / ({' + '.join(part)})", 3)
        for speed, value in zip(speeds, moved, strict=True):
            text.put(self._factor(number, speed, row), f"{value} * {inverse}", 1)

    def _clear(self, text: _Text) -> None:
        """Add the test that every critical configuration is far: rows or columns of a block are not
        nearly parallel, and no row is nearly zero."""
        text.put("*clear", "safe")
        configuration = range(len(self.form.jacobian) - self.form.of_speeds)
        for number, block in enumerate(self.form.blocks):
            each = [f"lengths[{row}]" for row in block.rows]
            if len(block.rows) == 2:
                area = f"area_{number}" if block.free else " * ".join(each)
                square = f"({' + '.join(each)}) * ({' + '.join(each)})"
                self._ask_clear(text, f"4.0 * {area}", square)
            elif each and block.rows[0] in configuration:
                for other in (row for row in configuration if row != block.rows[0]):
                    self._ask_clear(text, each[0], f"lengths[{other}]")

    def _ask_clear(self, text: _Text, square: str, of: str) -> None:
        text.add(f"*clear &= R_MASK({square} > MECHC_CLEAR_SINE * ({of}));", 5)

    def _directions(self, text: _Text) -> Iterator[dict[int, str]]:
        """The entries of every free direction."""
        blocks = enumerate(self.form.blocks)
        free = [(number, k) for number, block in blocks for k in range(block.free)]
        for which, (number, place) in enumerate(free):
            speeds = self.form.blocks[number].speeds
            own = len(speeds) * place
            found = {speed: f"n_{number}_{own + k}" for k, speed in enumerate(speeds)}
            self._propagate(text, number + 1, f"d{which}", found, {})
            for speed in range(self.size):
                text.put(f"directions[{which * self.size + speed}]", found.get(speed, "R(0.0)"))
            yield found

    def _propagate(
        self, text: _Text, start: int, prefix: str, found: dict[int, str], values: Terms
    ) -> None:
        """Add to ``found`` the speeds in blocks from ``start`` on, for these values of the rows."""
        for number in range(start, len(self.form.blocks)):
            block = self.form.blocks[number]
            rests = {}
            for row in block.rows:
                pairs = [
                    (self._entry(row, k), found[k]) for k in self._before(block, row) if k in found
                ]
                if pairs or row in values:
                    name = f"{prefix}_r{row}"
                    rests[row] = text.less(name, values.get(row, ""), pairs)
            for speed in block.speeds if rests else ():
                pairs = [(self._factor(number, speed, row), rest) for row, rest in rests.items()]
                found[speed] = text.products(f"{prefix}_x{speed}", pairs)

    def _momentum(self, text: _Text, number: int, direction: Terms) -> None:
        for speed in range(self.size):
            place = f"momenta[{number * self.size + speed}]"
            pairs = [
                (f"mass[{speed * self.size + k}]", direction[k])
                for k in sorted(self.form.mass[speed])
                if k in direction
            ]
            text.put(place, _sum(pairs) if pairs else "R(0.0)", len(pairs))

    # -- solutions --------------------------------------------------------------------------

    def _solution(self) -> _Text:
        text, found = _Text(), dict[int, str]()
        values = {row: f"values[{row}]" for row in range(len(self.form.jacobian))}
        self._propagate(text, 0, "x", found, values)
        for speed in range(self.size):
            text.put(f"x[{speed}]", found.get(speed, "R(0.0)"))
        return text

    def _longest_answer(self) -> _Text:
        """The largest squared length among the least solutions for a unit value of one row."""
        text = _Text()
        text.add("real most = R(0.0);")
        for number, block in enumerate(self.form.blocks):
            for row in block.rows:
                found = {speed: self._factor(number, speed, row) for speed in block.speeds}
                self._propagate(text, number + 1, f"a{row}", found, {})
                self._length(text, f"size{row}", found)
        text.add("return most;")
        return text

    def _length(self, text: _Text, name: str, found: Terms) -> None:
        squares = [(f"{a} * {a}", f"mass[{k * self.size + k}]") for k, a in found.items()]
        value, operations = _sum(squares), 2 * len(squares) + 2
        for free in range(self.form.free):
            along = [(a, f"axes[{free * self.size + k}]") for k, a in found.items()]
            part = text.products(f"{name}_{free}", along)
            value += f" - {part} * {part} * inverse[{free}]"
            operations += 2
        text.let(name, value, operations)
        text.put("most", f"R_SELECT(R_MASK({name} > most), {name}, most)")

    def _back(self) -> _Text:
        """The multipliers, by the blocks in reverse order."""
        text, rests = _Text(), {k: f"reaction[{k}]" for k in range(self.size)}
        for number in reversed(range(len(self.form.blocks))):
            block = self.form.blocks[number]
            for row in block.rows:
                pairs = [(self._factor(number, k, row), rests[k]) for k in block.speeds]
                name = text.products(f"l{row}", pairs)
                text.put(f"lambda[{row}]", name)
            for speed in {k for row in block.rows for k in self._before(block, row)}:
                rows = [row for row in block.rows if speed in self.form.jacobian[row]]
                pairs = [(self._entry(row, speed), f"l{row}") for row in rows]
                rests[speed] = text.less(f"r{number}_{speed}", rests[speed], pairs)
        return text

    def _rates(self) -> _Text:
        text = _Text()
        for row in range(len(self.form.jacobian)):
            pairs = [(self._entry(row, k), f"x[{k}]") for k in self._row(row)]
            text.put(f"rates[{row}]", _sum(pairs), len(pairs))
        return text

    def _partials(self) -> _Text:
        """The largest sum of a row's entries."""
        text = _Text()
        text.add("real most = R(0.0);")
        for row in range(len(self.form.jacobian)):
            entries = [self._entry(row, k) for k in self._row(row)]
            sizes = [f"R_SELECT(R_MASK({e} < 0.0), -{e}, {e})" for e in entries]
            name = text.let(f"sum{row}", " + ".join(sizes), 2 * len(sizes))
            text.put("most", f"R_SELECT(R_MASK({name} > most), {name}, most)", 2)
        text.add("return most;")
        return text


def _sum(pairs: Iterable[tuple[str, str]]) -> str:
    return " + ".join(f"{a} * {b}" for a, b in pairs)


def _complement(rows: list[list[str]]) -> list[tuple[str, int]]:
    """The null vector of rows that are one fewer than their entries, with operation counts."""
    if not rows:
        return [("R(1.0)", 0)]
    if len(rows) == 1:
        a, b = rows[0]
        return [(f"-{b}", 0), (a, 0)]
    return _cross(rows[0], rows[1])


def _cross(a: Sequence[str], b: Sequence[str]) -> list[tuple[str, int]]:
    turns = ((1, 2), (2, 0), (0, 1))
    return [(f"{a[i]} * {b[j]} - {a[j]} * {b[i]}", 2) for i, j in turns]


def _open_directions(a: Sequence[str]) -> Iterator[list[tuple[str, str, str]]]:
    """Two directions in which a row does not change, where its first, second or third speed counts
    most: with that one each of the others in turn."""
    for which in (0, 1):
        ways = list[tuple[str, str, str]]()
        for most in range(3):
            other = [k for k in range(3) if k != most][which]
            entry = {most: f"-{a[other]}", other: a[most]}
            x, y, z = (entry.get(k, "R(0.0)") for k in range(3))
            ways.append((x, y, z))
        yield ways


def _right_inverse(rows: list[list[str]], m: list[str]) -> list[list[tuple[str, int]]]:
    """Columns of (m.n) G: for each row the x on which it is m.n, the others 0 and m.x 0."""
    if len(rows) == 1:
        return [[(m[1], 0), (f"-{m[0]}", 0)]]
    return [_cross(rows[1], m), _cross(m, rows[0])]


def _function(name: str, result: str, parameters: str, text: _Text) -> str:
    unused = " ".join(f"(void){part.split('*')[-1].strip()};" for part in parameters.split(","))
    lines = "\n".join(f"    {line}" for line in [unused, *text.lines])
    return f"MECHC_INLINE {result} FN({name})({parameters})\n{{\n{lines}\n}}\n"
