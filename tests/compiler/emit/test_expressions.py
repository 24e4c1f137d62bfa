"""Expressions of C have the parentheses that their trees need and no others, and nothing but the
printer puts them together."""

from __future__ import annotations

import ast
import ctypes
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mechc_codegen
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from mechc_codegen.emit.expressions import Value, fma, let, named, number, put, without_unused
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.extension.flags import RUNTIME, STRICT
from sympy import Abs, Add, Mul, Symbol, cos, symbols

from mechc.compilation import toolchain

Tree = tuple[Any, ...]  # an operator and its parts
NAMES = {"a": 1.75, "b": -0.625, "c": 3.5}
BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda x, y: x + y,
    "-": lambda x, y: x - y,
    "*": lambda x, y: x * y,
    "/": lambda x, y: x / y,
}


def trees() -> st.SearchStrategy[Tree]:
    numbers = st.sampled_from([0.5, 1.0, -1.0, -2.5, 3.0])
    leaves = st.sampled_from(sorted(NAMES)).map(lambda n: ("name", n))
    leaves |= numbers.map(lambda x: ("number", x)) | numbers.map(lambda x: ("sum", x))
    leaves |= numbers.map(lambda x: ("multiple", x))

    def composed(part: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
        binary = st.tuples(st.sampled_from(sorted(BINARY)), part, part)
        return binary | st.tuples(st.just("negative"), part) | st.tuples(st.just("fma"), part, part)

    return st.recursive(leaves, composed, max_leaves=12)


def made(tree: Tree) -> Value:
    """The tree in C; sums and multiples are SymPy's."""
    match tree:
        case ("name", n):
            return named(n)
        case ("number", x):
            return number(x)
        case ("sum", x):
            return RealPrinter().real(Symbol("a") + x)
        case ("multiple", x):
            return RealPrinter().real(x * Symbol("b"))
        case ("negative", part):
            return -made(part)
        case ("fma", one, other):
            return fma(made(one), made(other), named("c"))
        case (sign, one, other):
            return BINARY[sign](made(one), made(other))
    raise AssertionError(tree)


def value_of(tree: Tree) -> float:
    """The tree's value, as C computes it."""
    match tree:
        case ("name", n):
            return NAMES[n]
        case ("number", x):
            return x
        case ("sum", x):
            return NAMES["a"] + x
        case ("multiple", x):
            return x * NAMES["b"]
        case ("negative", part):
            return -value_of(part)
        case ("fma", one, other):
            return value_of(one) * value_of(other) + NAMES["c"]
        case (sign, one, other):
            return BINARY[sign](value_of(one), value_of(other))
    raise AssertionError(tree)


def has_value(tree: Tree) -> bool:
    try:
        return abs(value_of(tree)) < 1e30
    except ZeroDivisionError:
        return False


@settings(max_examples=150, deadline=None)
@given(trees().filter(has_value))
def test_a_tree_printed_is_the_tree(tree):
    """Python reads these operators as C does."""
    printed = made(tree)
    functions = {
        "R": lambda x: x,
        "R_FMA": lambda a, b, c: a * b + c,
        "R_FNMA": lambda a, b, c: c - a * b,
        "R_FMS": lambda a, b, c: a * b - c,
    }
    assert eval(str(printed), functions, NAMES) == value_of(tree)
    assert printed.reads >= {"a"} & set(re.findall(r"\w+", str(printed)))


@settings(max_examples=150, deadline=None)
@given(trees())
def test_every_pair_of_parentheses_is_needed(tree):
    text = str(made(tree))
    meaning = ast.dump(ast.parse(text, mode="eval"))
    for opening in re.finditer(r"(?<!\w)\(", text):
        first, depth = opening.start(), 0
        for last in range(first, len(text)):
            depth += {"(": 1, ")": -1}.get(text[last], 0)
            if not depth:
                break
        if text[first - 1 : first] == text[first + 1] == "-":
            continue  # -- is another operator in C
        without = text[:first] + text[first + 1 : last] + text[last + 1 :]
        assert ast.dump(ast.parse(without, mode="eval")) != meaning, text


@settings(max_examples=2, deadline=None, phases=[Phase.generate])
@given(st.lists(trees().filter(has_value), min_size=60, max_size=60))
def test_a_compiler_reads_the_tree(tmp_path_factory, several):
    folder = tmp_path_factory.mktemp("trees")
    names = "".join(f"const double {name} = {value!r};" for name, value in NAMES.items())
    lines = [put(named("out")[i], made(tree)).text[0] for i, tree in enumerate(several)]
    text = '#include "simd/bind_extended.h"\n#undef R\n#define R(number) (number)\n'
    text += "void values(double *out)\n{\n"
    unused = "(void)a, (void)b, (void)c;"
    (folder / "trees.c").write_text("\n".join([text, names, unused, *lines, "}"]))
    command = [*toolchain.compiler(), "-std=gnu11", "-O0", "-ffp-contract=off", *STRICT]
    command += [f"-I{RUNTIME}", "-DMECHC_LANES=1", "-shared", "-fPIC", "trees.c", "-o", "trees.so"]
    subprocess.run(command, cwd=folder, check=True)
    out = (ctypes.c_double * len(several))()
    ctypes.CDLL(str(folder / "trees.so")).values(out)
    assert list(out) == [value_of(tree) for tree in several]


def test_masks_choices_and_places():
    a, b = named("a"), named("b")
    assert str(~(a + 1).compared(">", -b)) == "~R_MASK(a + 1 > -b)"
    assert str(a.compared("==", b) & ~b) == "R_MASK(a == b) & ~b"
    assert str(a.choose(a + 3, 0)) == "a ? a + 3 : 0"
    assert str(-(a.choose(b, 1))[2]) == "-(a ? b : 1)[2]"
    assert str(a[3].address()) == "&a[3]"
    assert str(a[b + 1] - -1.0) == "a[b + 1] - -1.0"
    assert str(-number(-1.0)) == "-(-1.0)"


def test_a_product_and_its_addition_are_one_operation():
    a, b = named("a"), named("b")
    assert (a * b + a).operations == 1
    assert (a + b + a * b).operations == 2
    assert str(a + b * 2.0) == "R_FMA(b, R(2.0), a)"
    assert str(a * b - 1.0) == "R_FMS(a, b, R(1.0))"
    assert str(a / b - a * b - b * a) == "R_FNMA(b, a, R_FNMA(a, b, a / b))"
    x, y, z = symbols("x y z")
    assert str(RealPrinter().real(x**2 - 3 * y * z)) == "R_FNMA(3.0*y, z, (x*x))"
    assert str(RealPrinter().real(-(x**2) - y * z)) == "R_FNMS(y, z, (x*x))"
    assert str(RealPrinter().real(x / y + z)) == "x/y + z"
    assert fma(a * b, b, a).operations == 2
    assert (1.0 / (a + b)).operations == 2
    assert (-a * b).operations == 1


def test_what_no_later_statement_reads_is_left_out():
    lines = [let("x", named("p")[0]), let("y", named("x") * 2.0), let("z", named("x") + 1.0)]
    lines.append(put(named("out")[0], named("z")))
    assert without_unused(lines) == [lines[0], lines[2], lines[3]]


def test_a_negative_number_between_operators():
    """--0.4 would be a decrement, and cos(2) is negative though it shows no sign."""
    x, y = symbols("x y")
    value = Mul(-1, cos(2), Abs(y), evaluate=False)
    assert str(RealPrinter().real(value)) == "-(-0.4161468365471424)*R_CALL(fabs, y)"
    assert str(-RealPrinter().real(-x)) == "-(-x)"
    assert str(named("a") * RealPrinter().real(Add(x, -y))) == "a * (x - y)"


# -- nothing else composes expressions --------------------------------------------------------

COMPILER = Path(mechc_codegen.__path__[0])
PRINTERS = ("expressions.py", "printer.py")
OPERATOR = r"(?:[-+*/%<>&|~!?^]|[=!<>]=)"
HOLE = "\x00"
PASTED = re.compile(rf"{OPERATOR}[\s(]*{HOLE}|{HOLE}[\s)]*{OPERATOR}")
# Pointers in declarations, comments; paths and units, which are no C.
PLAIN = re.compile(
    rf"(?:real|double|char|void|int) \*(?=\w*{HOLE})|/\*.*?\*/|^ \* .*|^sources/{HOLE}$|^{HOLE}/s$",
    re.DOTALL,
)
PLACE = r"\$(?:\{\w+\}|\w+)"
TEMPLATE_HOLE = re.compile(rf"{OPERATOR}\s*{PLACE}(?!\w)|{PLACE}\s*{OPERATOR}")


def pasted(source: str) -> Iterator[str]:
    """The places where Python code puts an operator of C beside a text that it is given."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.JoinedStr(parts):
                text = "".join(p.value if isinstance(p, ast.Constant) else HOLE for p in parts)
                if PASTED.search(PLAIN.sub("", text)):
                    yield ast.unparse(node)
            case ast.Call(ast.Attribute(ast.Constant(str(text)), name)):
                if name == "format" or (name == "join" and re.search(OPERATOR, text)):
                    yield ast.unparse(node)
            case ast.BinOp(ast.Constant(str()), ast.Mod()):
                yield ast.unparse(node)
            case ast.BinOp(left, ast.Add(), right):
                ends = [edge(left, -1) + HOLE, HOLE + edge(right, 0)]
                if any(map(PASTED.search, ends)):
                    yield ast.unparse(node)


def edge(node: ast.expr, which: int) -> str:
    """The text of a string, or its last or first part."""
    found = node.values[which] if isinstance(node, ast.JoinedStr) else node
    return found.value if isinstance(found, ast.Constant) and isinstance(found.value, str) else ""


@pytest.mark.parametrize("path", sorted(COMPILER.rglob("*.py")), ids=lambda path: path.stem)
def test_nothing_else_pastes_an_expression(path):
    if path.name not in PRINTERS:
        emits = path.relative_to(COMPILER).parts[0] in ("emit", "export")
        found = pasted(path.read_text("utf-8"))  # where no C is emitted, also texts for people
        assert not [text for text in found if emits or re.search(r";(\\n|['\"])*$", text)]


@pytest.mark.parametrize("path", sorted(COMPILER.rglob("*.in")), ids=lambda path: path.name)
def test_no_template_has_a_place_beside_an_operator(path):
    text = re.sub(r"/\*.*?\*/", "", path.read_text("utf-8"), flags=re.DOTALL)
    assert not TEMPLATE_HOLE.search(text)


@pytest.mark.parametrize(
    "code",
    [
        'f"{number} * {name}"', 'f"-{name}"', 'f"1.0 / ({text})"', 'f"const real x = {a}+{b};"',
        '" + ".join(terms)', 'text + " - " + other', 'value += f" - {part}"', 'f"{a} > 0.0"',
        '"%s * x" % a', '"{} * x".format(a)', 'text + f"*{x}"', 'f"x ? {a} : 0"', 'f"!{a}"',
        'f"*{place} = 0.0; /* {comment} */"',
    ],
)  # fmt: skip
def test_pasted_expressions_are_found(code):
    assert list(pasted(code))


@pytest.mark.parametrize(
    "code",
    [
        'f"const real {x} = {y}; /* {comment} */"', 'f"const real *{array}, {x}"', '", ".join(x)',
        'f"#define N {n} /* of them */"', 'f"p[{i}] = {x};"', 'f"FN({name})({x}, {y});"', 'a + b',
    ],
)  # fmt: skip
def test_statements_are_none(code):
    assert not list(pasted(code))
