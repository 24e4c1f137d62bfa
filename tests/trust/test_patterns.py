"""Regular expressions take time in proportion to their text, whatever it is.

Every pattern in the sources is found, and measured on texts that are made from its own parts: each
of its repetitions, pairs of its characters, after what comes before them and with an end that does
not fit.  Python cannot be interrupted within a match.
"""

import ast
import importlib
import re
import time
from itertools import product
from pathlib import Path
from re import _constants, _parser

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
FOLDERS = {"mechc": ROOT / "src", "mechc_codegen": ROOT / "codegen"}
METHODS = ("match", "fullmatch", "search", "findall", "finditer", "split", "sub")
LENGTHS = (
    24,
    100,
    400,
    1500,
    4000,
    12_000,
)  # texts that take cubic time at one end at the one before
LONGEST = 0.03  # s of processor time: thirty times what most linear matches of the last take
ENDS = ("", "\0", "!x", " ", "\n")
SAMPLES = " \t\n01aZ_.,-+*/=<>()[]\"'\\^°é"


def patterns():
    """(where, pattern, how it is used) of all in the sources."""
    trees = {
        path: ast.parse(path.read_text("utf-8"))
        for folder in FOLDERS.values()
        for path in sorted(folder.rglob("*.py"))
    }
    uses = {}
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                name, own = node.value.id, node.value.id.startswith("_")
                uses.setdefault((path if own else None, name), set()).add(node.attr)
    for path, tree in trees.items():
        compiled = 0
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) == "re":
                if call.func.attr == "compile":
                    compiled += 1
                elif call.func.attr in METHODS:
                    yield f"{path.name}:{call.lineno}", literal(call.args[0]), {call.func.attr}
        if compiled:
            module = importlib.import_module(module_name(path))
            found = {n: p for n, p in vars(module).items() if isinstance(p, re.Pattern)}
            own = {name: p for name, p in found.items() if is_assigned(tree, name)}
            assert len(own) == compiled, f"{path}: patterns are compiled at the top of a module"
            for name, pattern in own.items():
                used = uses[path if name.startswith("_") else None, name]
                yield f"{path.name}:{name}", pattern, used & set(METHODS)


def literal(node):
    """The pattern of a call; what is filled in is a name."""
    if isinstance(node, ast.JoinedStr):
        parts = [part.value if isinstance(part, ast.Constant) else "name" for part in node.values]
        return re.compile("".join(parts))
    return re.compile(node.value)


def is_assigned(tree, name):
    return any(
        isinstance(target, ast.Name) and target.id == name
        for node in tree.body
        for target in getattr(node, "targets", [getattr(node, "target", None)])
    )


def module_name(path):
    folder = next(folder for folder in FOLDERS.values() if path.is_relative_to(folder))
    parts = path.relative_to(folder).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


# -- texts ------------------------------------------------------------------------------------


def sample(tree):
    """A short text that the parsed pattern matches, as far as that is easily told."""
    return "".join(sample_of(kind, value) for kind, value in tree)


def sample_of(kind, value):
    if kind is _constants.LITERAL:
        return chr(value)
    if kind is _constants.SUBPATTERN:
        return sample(value[-1])
    if kind is _constants.BRANCH:
        return sample(value[1][0])
    if kind is _constants.ATOMIC_GROUP:
        return sample(value)
    if kind in repeats():
        return sample(value[2]) * max(value[0], 1)
    if kind in (_constants.IN, _constants.ANY, _constants.NOT_LITERAL):
        one = re.compile(re_of(kind, value), re.DOTALL)
        return next((c for c in "a1 " + SAMPLES if one.fullmatch(c)), "")
    return ""


def re_of(kind, value):
    """A class of characters as a pattern, from its parsed form."""
    if kind is _constants.ANY:
        return "."
    if kind is _constants.NOT_LITERAL:
        return f"[^{re.escape(chr(value))}]"
    words = {"DIGIT": r"\d", "NOT_DIGIT": r"\D", "SPACE": r"\s", "NOT_SPACE": r"\S",
             "WORD": r"\w", "NOT_WORD": r"\W"}  # fmt: skip
    text = ""
    for part, inner in value:
        if part is _constants.NEGATE:
            text += "^"
        elif part is _constants.LITERAL:
            text += re.escape(chr(inner))
        elif part is _constants.RANGE:
            text += "-".join(re.escape(chr(c)) for c in inner)
        else:
            text += words[str(inner).removeprefix("CATEGORY_")]
    return f"[{text}]"


def repeats():
    return (_constants.MAX_REPEAT, _constants.MIN_REPEAT, _constants.POSSESSIVE_REPEAT)


def repetitions(tree, before=""):
    """(a text before, a text to repeat) of every repetition in a parsed pattern."""
    for kind, value in tree:
        if kind in repeats():
            yield before, sample(value[2])
            yield from repetitions(value[2], before)
        elif kind is _constants.SUBPATTERN:
            yield from repetitions(value[-1], before)
        elif kind is _constants.BRANCH:
            for each in value[1]:
                yield from repetitions(each, before)
        before += sample_of(kind, value)


def hostile_texts(pattern):
    """(before, repeated, after): what may make a match go back and forth."""
    found = list(repetitions(_parser.parse(pattern.pattern, pattern.flags)))
    befores = {"", "a", "1", *(before for before, _ in found)}
    characters = {one for before, again in found for one in before + again} | {" ", "1", "a"}
    own = sorted(characters)[:10]
    again = {
        *own,
        *map("".join, product(own, repeat=2)),
        *map("".join, found),
        *(more for _, more in found),
    }
    return product(sorted(befores), sorted(filter(None, again)), ENDS)


# -- measuring --------------------------------------------------------------------------------


def seconds(pattern, method, text):
    """Of processor time, the least of three where it seems much."""
    call = getattr(pattern, method)
    if isinstance(pattern.pattern, bytes):
        text = text.encode()
    least = float("inf")
    for _ in range(3):
        began = time.process_time()
        if method == "sub":
            call("", text)
        elif method == "finditer":
            list(call(text))
        else:
            call(text)
        least = min(least, time.process_time() - began)
        if least < LONGEST:
            break
    return least


def slow_text(pattern, method):
    """A text that takes more than its share, and how long it takes; None where there is none."""
    texts = list(hostile_texts(pattern))
    for length in LENGTHS:
        for before, again, after in texts:
            text = before + again * (length // len(again)) + after
            if (spent := seconds(pattern, method, text)) > LONGEST:
                return f"{before!r} + {again!r} * {length // len(again)} + {after!r}: {spent:.2f} s"
    return None


def test_every_pattern_is_linear():
    """A number of 40 kB in a URDF took 33 s, 400 spaces in the header of a CSV file 10 s."""
    found = list(patterns())
    assert len(found) > 30
    slow = {
        f"{where}.{method}": text
        for where, pattern, methods in found
        for method in sorted(methods)
        if (text := slow_text(pattern, method)) is not None
    }
    assert not slow, "\n".join(f"{where}: {text}" for where, text in slow.items())


@pytest.mark.parametrize(
    ("pattern", "method"),
    [
        (r"(a+)+b", "match"),
        (r"\s*'?(.*?)\s*(?:\[x\])?\s*", "fullmatch"),
        (r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", "fullmatch"),
        (r"\s+\Z", "search"),
        (r"/\*.*?\*/", "sub"),
    ],
)
def test_patterns_that_go_back_are_found(pattern, method):
    assert slow_text(re.compile(pattern, re.DOTALL), method) is not None
