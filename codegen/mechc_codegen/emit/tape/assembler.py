"""A function of a scene as a tape: operations on numbered values.

Input: the statements in C of one function, as they are printed for the compiler.  Output: its
operations.  Invariant: they are those of the text, in its order, so that a value has the same bits
whether the text is compiled or the tape is run.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files

from mechc_codegen.emit.expressions import Line, texts

_LISTS = (files("mechc_codegen") / "runtime" / "tape" / "operations.h").read_text("utf-8")


def _listed(name: str) -> str:
    """The entries of a list of the header."""
    return _LISTS.partition(f"#define {name}(X)")[2].partition("\n\n")[0].partition("#define")[0]


def _names(name: str) -> list[str]:
    return re.findall(r"X\((\w+)", _listed(name))


OPERATIONS = {name: code for code, name in enumerate(_names("MECHC_TAPE_OPERATIONS"))}
CALLS = _names("MECHC_TAPE_CALLS"), _names("MECHC_TAPE_CALLS_OF_TWO")
FUNCTIONS = {
    name: re.findall(r"[AW]\((?:series_|tree_)?(\w+)\)", arrays)
    for name, arrays in re.findall(r"X\((\w+), ([^X]+)\)", _listed("MECHC_TAPE_FUNCTIONS"))
}
NAMED = _names("MECHC_TAPE_NAMED")
MOST_REGISTERS, MOST_OUTPUTS, WIDEST = (
    int(value)
    for value in re.findall(r"MECHC_TAPE_(?:MOST_REGISTERS|MOST_OUTPUTS|WIDEST) (\d+)", _LISTS)
)
MOST = 2**16  # of anything that an operation names
_SIGNS = {
    ast.Add: "ADD", ast.Sub: "SUBTRACT", ast.Mult: "MULTIPLY", ast.Div: "DIVIDE", ast.BitAnd: "AND",
}  # fmt: skip
_COMPARED = {ast.Lt: "LESS", ast.LtE: "LESS_EQUAL", ast.Eq: "EQUAL", ast.NotEq: "NOT_EQUAL"}
_TURNED = {ast.Gt: "LESS", ast.GtE: "LESS_EQUAL"}  # with the sides exchanged
_FOLDED: dict[type, Callable[[float, float], float]] = {
    ast.Add: float.__add__, ast.Sub: float.__sub__,
    ast.Mult: float.__mul__, ast.Div: float.__truediv__,
}  # fmt: skip
_ALIKE = {
    "R_FMA": "FMA", "R_FNMA": "FNMA", "R_FMS": "FMS", "R_FNMS": "FNMS",
    "R_SQRT": "SQRT", "R_SELECT": "SELECT",
}  # fmt: skip
_COMMENT = re.compile(r"/\*[^*]*+\*/")
_DEFINITION = re.compile(r"(?:(?:const )?(?:real|rmask) )?(\w+) (&?)= ([^;]+);")
_STORE = re.compile(r"(\w+)\[(\d+)\] (&?)= ([^;]+);")
_RETURN = re.compile(r"return ([^;]+);")
_ANGLE = re.compile(
    r"FN\((?:sincos|turn)\)\(([^?&]+?), (?:turns \? turns \+ (\d+) : 0, near, )?&(\w+), &(\w+)\);"
)
_INPUTS = re.compile(r"FN\(read_inputs\)\(t, q, (u|0), given, (\d+), (\d+), inputs\);")
_CLEARED = re.compile(r"for \(int i = 0; i < (\d+); i\+\+\) \{ (\w+)\[i\] = R\(0\.0\); \}")
_DECLARED = re.compile(r"real (?:\w+, \w+|inputs\[\d+\]);")


class NoTapeError(Exception):
    """A function that no tape holds; the text says what it has."""


@dataclass
class Instruction:
    """One operation: its code, the value that it defines, or -1, and three numbers.

    ``reads`` says which of these are values; ``more`` is a second value that it defines.
    """

    name: str
    to: int
    numbers: tuple[int, int, int]
    reads: tuple[int, ...] = ()
    more: int | None = None


@dataclass
class Assembler:
    """The operations of one function, with the constants that they use.

    ``numbers``: the constants of all functions, by their hexadecimal form; ``arrays``: those that
    this one is given; ``macros``: names of numbers in the text; ``scalars``: arguments by name;
    ``tables``: functions of lookup tables.
    """

    numbers: dict[str, int]
    arrays: Sequence[str]
    macros: Mapping[str, float] = field(default_factory=dict)
    scalars: Sequence[str] = ("t",)
    tables: Sequence[str] = ()
    operations: list[Instruction] = field(default_factory=list)
    count: int = 0
    names: dict[str, int] = field(default_factory=dict)
    _constants: dict[str, int] = field(default_factory=dict)
    _stored: dict[str, int] = field(default_factory=dict)

    def take(self, lines: Iterable[Line]) -> Assembler:
        """Append statements."""
        text = " ".join(" ".join(texts(lines)).split())
        for statement in _statements(_COMMENT.sub("", text)):
            self._statement(statement)
        return self

    def rows(self) -> tuple[int, list[tuple[int, int, int, int, int]]]:
        """How many registers the values need, and the operations with these in place of values."""
        constants = [each for each in self.operations if each.name == "NUMBER"]
        others = [each for each in self.operations if each.name != "NUMBER"]
        return _in_registers([*constants, *others, Instruction("END", -1, (0, 0, 0))])

    def _statement(self, text: str) -> None:
        if found := _DEFINITION.fullmatch(text):
            self.names[found[1]] = self._joined(found[1], found[2], found[3])
        elif found := _STORE.fullmatch(text):
            place, own = f"{found[1]}[{found[2]}]", (_place(found[1], self.arrays), int(found[2]))
            value = self._stored[place] = self._joined(place, found[3], found[4])
            self._add("STORE", (*own, value), (2,), defines=False)
        elif found := _ANGLE.fullmatch(text):
            self._angle(found, turn="(turn)" in text)
        elif found := _INPUTS.fullmatch(text):
            first, last, speeds = int(found[2]), int(found[3]), int(found[1] == "u")
            self._add("INPUTS_READ", (first, last, speeds), defines=False)
        elif found := _CLEARED.fullmatch(text):
            self._add("CLEAR", (_place(found[2], self.arrays), int(found[1]), 0), defines=False)
        elif found := _RETURN.fullmatch(text):
            self._add("RETURN", (self._expression(found[1]), 0, 0), (0,), defines=False)
        elif not _DECLARED.fullmatch(text):
            raise NoTapeError(text)

    def _joined(self, target: str, sign: str, text: str) -> int:
        """The value of an expression, with ``&=`` that of the target and it."""
        value = self._expression(text)
        if not sign:
            return value
        before = self._stored[target] if target in self._stored else self.names[target]
        return self._add("AND", (before, value, 0), (0, 1))

    def _angle(self, found: re.Match[str], turn: bool) -> None:
        value, place, sine, cosine = found.groups()
        angle, more = self._expression(value), self.count + 1
        number = int(place or 0) // 3
        self.names[sine] = self._add(
            "TURN" if turn else "SINE_COSINE", (angle, more, number), (0,), more=more
        )
        self.names[cosine] = more
        self.count += 1

    def _expression(self, text: str) -> int:
        try:
            return self._value(ast.parse(text.strip(), mode="eval").body)
        except SyntaxError:
            raise NoTapeError(text) from None

    def _value(self, node: ast.expr) -> int:
        if (number := self._folded(node)) is not None:
            return self._constant(number)
        if isinstance(node, ast.Name):
            if node.id in self.names:
                return self.names[node.id]
            return self._add("SCALAR", (_place(node.id, self.scalars), 0, 0))
        if isinstance(node, ast.Subscript):
            array, place = _name(node.value), _whole(node.slice)
            if array == "inputs":
                return self._add("INPUT", (place, 0, 0))
            return self._add("LOAD", (_place(array, self.arrays), place, 0))
        if isinstance(node, ast.UnaryOp):
            name = "NEGATE" if isinstance(node.op, ast.USub) else "NOT"
            return self._operation(name, [node.operand])
        if isinstance(node, ast.BinOp) and type(node.op) in _SIGNS:
            return self._operation(_SIGNS[type(node.op)], [node.left, node.right])
        if isinstance(node, ast.Compare):
            (sign,), left, (right,) = node.ops, node.left, node.comparators
            if type(sign) in _TURNED:
                return self._operation(_TURNED[type(sign)], [right, left])
            return self._operation(_COMPARED[type(sign)], [left, right])
        if isinstance(node, ast.Call):
            return self._call(_name(node.func), node.args)
        raise NoTapeError(ast.unparse(node))

    def _call(self, function: str, arguments: Sequence[ast.expr]) -> int:
        if function == "R_MASK":
            return self._value(arguments[0])
        if function in _ALIKE:
            return self._operation(_ALIKE[function], arguments)
        if function not in ("R_CALL", "R_CALL2"):
            raise NoTapeError(function)
        known, name = CALLS[function == "R_CALL2"], _name(arguments[0])
        values = [self._value(each) for each in arguments[1:]]
        if name in self.tables:
            return self._add("LOOKUP", (values[0], values[-1], self.tables.index(name)), (0, 1))
        if name not in known:
            raise NoTapeError(name)
        numbers = [*values, known.index(name), 0][:3]
        return self._add(
            function.removeprefix("R_"), (numbers[0], numbers[1], numbers[2]), (0, 1)[: len(values)]
        )

    def _folded(self, node: ast.expr) -> float | None:
        """The value of an expression of numbers alone, as C has it in doubles."""
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return float(node.value)
        if isinstance(node, ast.Name):
            return self.macros.get(node.id)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inner = self._folded(node.operand)
            return None if inner is None else -inner
        if isinstance(node, ast.BinOp) and type(node.op) in _FOLDED:
            one, other = self._folded(node.left), self._folded(node.right)
            return None if one is None or other is None else _FOLDED[type(node.op)](one, other)
        if isinstance(node, ast.Call) and _name(node.func) == "R":
            return self._folded(node.args[0])
        return None

    def _operation(self, name: str, arguments: Sequence[ast.expr]) -> int:
        values = [self._value(each) for each in arguments]
        a, b, c = [*values, 0, 0][:3]
        return self._add(name, (a, b, c), (0, 1, 2)[: len(values)])

    def _constant(self, value: float) -> int:
        key = value.hex()
        if key not in self._constants:
            number = self.numbers.setdefault(key, len(self.numbers))
            self._constants[key] = self._add("NUMBER", (number, 0, 0))
        return self._constants[key]

    def _add(
        self, name: str, numbers: tuple[int, int, int], reads: tuple[int, ...] = (),
        *, defines: bool = True, more: int | None = None,
    ) -> int:  # fmt: skip
        to = self.count if defines else -1
        self.count += defines
        self.operations.append(Instruction(name, to, numbers, reads, more))
        return to


def _statements(text: str) -> list[str]:
    """The statements of a text in one line, a loop as one."""
    found, rest = list[str](), text.strip()
    while rest:
        loop = _CLEARED.match(rest)
        end = loop.end() if loop else rest.find(";") + 1
        if not end:
            raise NoTapeError(rest)
        found.append(rest[:end])
        rest = rest[end:].strip()
    return found


def _place(name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise NoTapeError(name)
    return names.index(name)


def _name(node: ast.expr) -> str:
    if not isinstance(node, ast.Name):
        raise NoTapeError(ast.unparse(node))
    return node.id


def _whole(node: ast.expr) -> int:
    assert isinstance(node, ast.Constant)
    assert isinstance(node.value, int)
    return node.value


def _in_registers(
    operations: Sequence[Instruction],
) -> tuple[int, list[tuple[int, int, int, int, int]]]:
    """Registers for values; one is free again after the last use of its value."""
    last = {value: i for i, each in enumerate(operations) for value in _used(each)}
    place, free, size = dict[int, int](), list[int](), 0
    rows = list[tuple[int, int, int, int, int]]()
    for i, each in enumerate(operations):
        read = [place[n] if k in each.reads else n for k, n in enumerate(each.numbers)]
        for value in {*_used(each)}:
            if last[value] == i:
                free.append(place[value])
        for defined in _defined(each):
            if not free:
                free.append(size)
                size += 1
            place[defined] = free.pop()
        if each.more is not None:
            read[1] = place[each.more]
        free += [place[defined] for defined in _defined(each) if defined not in last]
        to = place[each.to] if each.to >= 0 else 0
        rows.append((OPERATIONS[each.name], to, read[0], read[1], read[2]))
    return size, rows


def _defined(operation: Instruction) -> list[int]:
    return [v for v in (operation.to, operation.more) if v is not None and v >= 0]


def _used(operation: Instruction) -> list[int]:
    return [operation.numbers[k] for k in operation.reads]
