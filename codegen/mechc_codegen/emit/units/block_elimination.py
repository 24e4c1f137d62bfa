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
from functools import reduce
from itertools import accumulate
from operator import mul

from mechc_codegen.emit.definition import definition
from mechc_codegen.emit.expressions import Line, Value, let, named, put, real, select, total
from mechc_codegen.emit.row_blocks import Block, BlockForm

Terms = Mapping[int, Value]  # each entry that is not zero
_JACOBIAN, _MASS, _WEIGHT, _LENGTHS = map(named, ("jacobian", "mass", "weight", "lengths"))
_KEPT, _OWN, _MOST, _NONE = named("kept"), named("own"), named("most"), real(0.0)
_SAFE, _SAFE_SINE = named("safe"), named("MECHC_SAFE_SINE")
_CLEAR, _CLEAR_SINE = named("clear")[0], named("MECHC_CLEAR_SINE")


@dataclass
class _Body:
    """Statements of one function."""

    lines: list[Line] = field(default_factory=list)

    def let(self, target: str, value: Value, kind: str = "const real") -> Value:
        self.lines.append(let(target, value, kind))
        return named(target)

    def put(self, place: Value, value: Value, sign: str = "=") -> None:
        self.lines.append(put(place, value, sign))

    def ask(self, answer: Value, square: Value, limit: Value) -> None:
        """Add the test whether a squared sine is large enough."""
        self.put(answer, square.compared(">", limit), "&=")

    def raise_most(self, value: Value) -> None:
        self.put(_MOST, select(value.compared(">", _MOST), value, _MOST))


class BlockElimination:
    """The C functions of block elimination for one scene."""

    def __init__(self, form: BlockForm) -> None:
        self.form = form
        self.size = len(form.mass)
        sizes = (len(block.rows) * len(block.speeds) for block in form.blocks)
        *self.first, self.kept = accumulate(sizes, initial=0)  # places among what is kept

    def text(self) -> str:
        """The text of all functions."""
        given, known = "const real *jacobian, ", "const real *jacobian, const real *kept, "
        bodies = self.bodies()
        functions = [
            ("The lanes in which blocks serve, and their factors.", "factor_blocks",
             given + "const real *mass, const real *weight, real *kept, real *directions, "
             "real *momenta, real *own, real *lengths, rmask *clear", "rmask"),
            ("Speeds for these values of the rows.", "solve_blocks",
             known + "const real *values, real *x", "void"),
            ("The largest squared length among the least solutions for a unit value of one row.",
             "longest_answer", known + "const real *moved, const real *axes, const real *inverse",
             "real"),
            ("The multipliers, by the blocks in reverse order.", "block_multipliers",
             known + "const real *reaction, real *lambda", "void"),
            ("The rates of the rows.", "rates_in_blocks", given + "const real *x, real *rates",
             "void"),
            ("The largest sum of sizes in a row of configuration.", "partials_in_blocks",
             "const real *jacobian", "real"),
        ]  # fmt: skip
        return "\n".join(
            definition(comment, name, signature, bodies[name], result=result)
            for comment, name, signature, result in functions
        )

    def bodies(self) -> dict[str, list[Line]]:
        """The statements of each function."""
        return {
            "factor_blocks": self._factors(),
            "solve_blocks": self._solution(),
            "longest_answer": self._longest_answer(),
            "block_multipliers": self._back(),
            "rates_in_blocks": self._rates(),
            "partials_in_blocks": self._partials(),
        }

    def operations(self) -> dict[str, int]:
        """Operation counts: factoring all rows, one solution, the condition numbers."""
        functions = self._factors(), self._solution(), self._longest_answer()
        factors, solution, answer = (sum(x.operations for x in lines) for lines in functions)
        weights = 2 * self.size * self.form.free
        return {
            "factors": factors + weights,
            "solution": solution + 3 * self.size * self.form.free,
            "conditioning": answer + weights,
        }

    # -- entries ----------------------------------------------------------------------------

    def _entry(self, row: int, speed: int) -> Value:
        return _JACOBIAN[row * self.size + speed]

    def _row(self, row: int) -> list[int]:
        return sorted(self.form.jacobian[row])

    def _before(self, block: Block, row: int) -> list[int]:
        return [k for k in self._row(row) if k not in block.speeds]

    def _factor(self, number: int, speed: int, row: int) -> Value:
        block = self.form.blocks[number]
        place = block.speeds.index(speed) * len(block.rows) + block.rows.index(row)
        return _KEPT[self.first[number] + place]

    # -- factors ----------------------------------------------------------------------------

    def _factors(self) -> list[Line]:
        body, free = _Body(), 0
        body.let("safe", _NONE.compared("==", _NONE), "rmask")
        for row in range(len(self.form.jacobian)):
            squares = [(e := self._entry(row, k)) * e * _WEIGHT[k] for k in self._row(row)]
            body.put(_LENGTHS[row], total(squares))
        for number, block in enumerate(self.form.blocks):
            if block.free == 2:
                self._open_row(body, number, free)
            elif block.free:
                self._free_block(body, number, free)
            else:
                self._square_block(body, number)
            free += block.free
        for number, direction in enumerate(self._directions(body)):
            self._momentum(body, number, direction)
        self._clear(body)
        return [*body.lines, Line(("return safe;",))]

    def _square_block(self, body: _Body, number: int) -> None:
        block = self.form.blocks[number]
        if len(block.rows) == 1:
            row, speed = block.rows[0], block.speeds[0]
            a = self._entry(row, speed)
            body.put(self._factor(number, speed, row), 1.0 / a)
            body.ask(_SAFE, a * a * _WEIGHT[speed], _SAFE_SINE * _LENGTHS[row])
            return
        (r, s), (i, j) = block.rows, block.speeds
        a, b, c, d = (self._entry(row, k) for row in (r, s) for k in (i, j))
        det = body.let(f"det_{number}", a * d - b * c)
        body.ask(_SAFE, det * det, _SAFE_SINE * ((a * a + c * c) * (b * b + d * d)))
        inverse = body.let(f"inverse_{number}", 1.0 / det)
        for speed, row, value in ((i, r, d), (i, s, -b), (j, r, -c), (j, s, a)):
            body.put(self._factor(number, speed, row), value * inverse)

    def _free_block(self, body: _Body, number: int, free: int) -> None:
        """Add n and G of a block that has one speed more than rows."""
        block = self.form.blocks[number]
        entries = [[self._entry(row, k) for k in block.speeds] for row in block.rows]
        complement = enumerate(_complement(entries))
        own = [body.let(f"n_{number}_{k}", value) for k, value in complement]
        weighted = [
            body.let(f"m_{number}_{k}", _MASS[speed * self.size + speed] * own[k])
            for k, speed in enumerate(block.speeds)
        ]
        square = body.let(f"square_{number}", _dot(zip(weighted, own, strict=True)))
        body.put(_OWN[free], square)
        if not block.rows:
            return
        if len(block.rows) == 2:
            r, s = block.rows
            i, j, k = (_WEIGHT[speed] for speed in block.speeds)
            area = body.let(f"area_{number}", square * (i * j * k))
            body.ask(_SAFE, area, _SAFE_SINE * (_LENGTHS[r] * _LENGTHS[s]))
        inverse = body.let(f"inverse_{number}", 1.0 / square)
        for row, column in zip(block.rows, _right_inverse(entries, weighted), strict=True):
            for speed, value in zip(block.speeds, column, strict=True):
                body.put(self._factor(number, speed, row), value * inverse)

    def _open_row(self, body: _Body, number: int, free: int) -> None:
        """Add the directions and G of one row with three speeds, by the speed that counts most."""
        (row,), speeds = self.form.blocks[number].rows, self.form.blocks[number].speeds
        a = [self._entry(row, speed) for speed in speeds]
        moved = [body.let(f"v_{number}_{k}", a[k] * _WEIGHT[s]) for k, s in enumerate(speeds)]
        part = [body.let(f"part_{number}_{k}", a[k] * moved[k]) for k in range(3)]
        most = [part[i].compared(">=", part[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
        first = body.let(f"first_{number}", most[0] & most[1], "const rmask")
        second = body.let(f"second_{number}", ~first & most[2], "const rmask")
        for which, ways in enumerate(_open_directions(a)):
            squares = list[Value]()
            for k, (one, two, three) in enumerate(zip(*ways, strict=True)):
                value = select(first, one, select(second, two, three))
                own = body.let(f"n_{number}_{3 * which + k}", value)
                squares.append(own * own * _MASS[speeds[k] * (self.size + 1)])
            body.put(_OWN[free + which], total(squares))
        inverse = body.let(f"inverse_{number}", 1.0 / total(part))
        for speed, value in zip(speeds, moved, strict=True):
            body.put(self._factor(number, speed, row), value * inverse)

    def _clear(self, body: _Body) -> None:
        """Add the test that every critical configuration is far: rows or columns of a block are not
        nearly parallel, and no row is nearly zero."""
        body.put(_CLEAR, _SAFE)
        configuration = range(len(self.form.jacobian) - self.form.of_speeds)
        for which, block in enumerate(self.form.blocks):
            each = [_LENGTHS[row] for row in block.rows]
            if len(block.rows) == 2:
                area = [named(f"area_{which}")] if block.free else each
                square = reduce(mul, area[1:], 4.0 * area[0])
                body.ask(_CLEAR, square, _CLEAR_SINE * (total(each) * total(each)))
            elif each and block.rows[0] in configuration:
                for other in (row for row in configuration if row != block.rows[0]):
                    body.ask(_CLEAR, each[0], _CLEAR_SINE * _LENGTHS[other])

    def _directions(self, body: _Body) -> Iterator[dict[int, Value]]:
        """The entries of every free direction."""
        blocks = enumerate(self.form.blocks)
        free = [(number, k) for number, block in blocks for k in range(block.free)]
        for which, (number, place) in enumerate(free):
            speeds = self.form.blocks[number].speeds
            own = len(speeds) * place
            found = {speed: named(f"n_{number}_{own + k}") for k, speed in enumerate(speeds)}
            self._propagate(body, number + 1, f"d{which}", found, {})
            for speed in range(self.size):
                at = named("directions")[which * self.size + speed]
                body.put(at, found.get(speed, _NONE))
            yield found

    def _propagate(
        self, body: _Body, start: int, prefix: str, found: dict[int, Value], values: Terms
    ) -> None:
        """Add to ``found`` the speeds in blocks from ``start`` on, for these values of the rows."""
        for number in range(start, len(self.form.blocks)):
            block = self.form.blocks[number]
            rests = dict[int, Value]()
            for row in block.rows:
                before = [k for k in self._before(block, row) if k in found]
                taken = _dot((self._entry(row, k), found[k]) for k in before) if before else None
                if taken is not None:
                    rest = values[row] - taken if row in values else -taken
                    rests[row] = body.let(f"{prefix}_r{row}", rest)
                elif row in values:
                    rests[row] = values[row]
            for speed in block.speeds if rests else ():
                pairs = ((self._factor(number, speed, row), rest) for row, rest in rests.items())
                found[speed] = body.let(f"{prefix}_x{speed}", _dot(pairs))

    def _momentum(self, body: _Body, number: int, direction: Terms) -> None:
        for speed in range(self.size):
            moved = [k for k in sorted(self.form.mass[speed]) if k in direction]
            pairs = ((_MASS[speed * self.size + k], direction[k]) for k in moved)
            place = named("momenta")[number * self.size + speed]
            body.put(place, _dot(pairs) if moved else _NONE)

    # -- solutions --------------------------------------------------------------------------

    def _solution(self) -> list[Line]:
        body, found = _Body(), dict[int, Value]()
        values = {row: named("values")[row] for row in range(len(self.form.jacobian))}
        self._propagate(body, 0, "x", found, values)
        for speed in range(self.size):
            body.put(named("x")[speed], found.get(speed, _NONE))
        return body.lines

    def _longest_answer(self) -> list[Line]:
        body = _Body([let("most", _NONE, "real")])
        for number, block in enumerate(self.form.blocks):
            for row in block.rows:
                found = {speed: self._factor(number, speed, row) for speed in block.speeds}
                self._propagate(body, number + 1, f"a{row}", found, {})
                self._length(body, f"size{row}", found)
        return [*body.lines, Line(("return most;",))]

    def _length(self, body: _Body, name: str, found: Terms) -> None:
        square = total(a * a * named("moved")[k] for k, a in found.items())
        for free in range(self.form.free):
            axis = ((a, named("axes")[free * self.size + k]) for k, a in found.items())
            part = body.let(f"{name}_{free}", _dot(axis))
            square = square - part * part * named("inverse")[free]
        body.raise_most(body.let(name, square))

    def _back(self) -> list[Line]:
        body, rests = _Body(), {k: named("reaction")[k] for k in range(self.size)}
        for number in reversed(range(len(self.form.blocks))):
            block = self.form.blocks[number]
            for row in block.rows:
                pairs = ((self._factor(number, k, row), rests[k]) for k in block.speeds)
                body.put(named("lambda")[row], body.let(f"l{row}", _dot(pairs)))
            for speed in {k for row in block.rows for k in self._before(block, row)}:
                rows = [row for row in block.rows if speed in self.form.jacobian[row]]
                taken = _dot((self._entry(row, speed), named(f"l{row}")) for row in rows)
                rests[speed] = body.let(f"r{number}_{speed}", rests[speed] - taken)
        return body.lines

    def _rates(self) -> list[Line]:
        body = _Body()
        for row in range(len(self.form.jacobian)):
            pairs = ((self._entry(row, k), named("x")[k]) for k in self._row(row))
            body.put(named("rates")[row], _dot(pairs))
        return body.lines

    def _partials(self) -> list[Line]:
        body = _Body([let("most", _NONE, "real")])
        for row in range(len(self.form.jacobian) - self.form.of_speeds):
            entries = [self._entry(row, k) for k in self._row(row)]
            sizes = (select(e.compared("<", 0.0), -e, e) for e in entries)
            body.raise_most(body.let(f"sum{row}", total(sizes)))
        return [*body.lines, Line(("return most;",))]


def _dot(pairs: Iterable[tuple[Value, Value]]) -> Value:
    return total(a * b for a, b in pairs)


def _complement(rows: list[list[Value]]) -> list[Value]:
    """The null vector of rows that are one fewer than their entries."""
    if not rows:
        return [real(1.0)]
    if len(rows) == 1:
        a, b = rows[0]
        return [-b, a]
    return _cross(rows[0], rows[1])


def _cross(a: Sequence[Value], b: Sequence[Value]) -> list[Value]:
    return [a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))]


def _open_directions(a: Sequence[Value]) -> Iterator[list[list[Value]]]:
    """Two directions in which a row does not change, where its first, second or third speed counts
    most: with that one each of the others in turn."""
    for which in (0, 1):
        ways = list[list[Value]]()
        for most in range(3):
            other = [k for k in range(3) if k != most][which]
            entry = {most: -a[other], other: a[most]}
            ways.append([entry.get(k, _NONE) for k in range(3)])
        yield ways


def _right_inverse(rows: list[list[Value]], m: list[Value]) -> list[list[Value]]:
    """Columns of (m.n) G: for each row the x on which it is m.n, the others 0 and m.x 0."""
    if len(rows) == 1:
        return [[m[1], -m[0]]]
    return [_cross(rows[1], m), _cross(m, rows[0])]
