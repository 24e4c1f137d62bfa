"""The floating constants that the C runtime's headers define, and those that have no name.

Input: the headers.  Output: name, C expression and reason of each; of a trait without a comment of
its own the reason is that of the field.  Tableaus are left
out.  What has more than six digits is a number of mathematics, pi or an eigenvalue, and no
threshold.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mechc_codegen.extension.flags import RUNTIME

FOLDERS = (
    "abi", "dynamics", "singularities", "run", "series", "stepping", "lockstep", "methods",
    "closing", "variational", "adjoint", "hybrid", "fmu",
)  # fmt: skip
NUMBER = r"(?<![\w.])(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?|(?<![\w.])\d+[eE][+-]?\d+"
_FLOATING = re.compile(rf"{NUMBER}|\b(?:DBL|MECHC)_EPSILON\b")
_DEFINE = re.compile(r"#[ \t]*define[ \t]+(MECHC_\w+)[ \t]+([^\\]*?)[ \t]*(?:/\*(.*))?$")
_TRAITS = re.compile(r"#[ \t]*define[ \t]+MECHC_(\w+)_TRAITS\b(?! [.\d])")
_FIELD = re.compile(r"[ \t]*\.(\w+) = ([^,\\]*?),?[ \t]*(?:/\*(.*?)\*/)?[ \t]*\\?$")
_MOST_DIGITS = 6
_FIELD_OF_METHOD = re.compile(r"\bdouble (\w+);[ \t]*/\*(.*?)\*/", re.S)
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.S)
# Numbers of formulas: halves, quarters and small integers.
PLAIN = frozenset(("0.0", "0.25", "0.5", "1.0", "2.0", "3.0", "4.0"))


@dataclass(frozen=True)
class Constant:
    """``header:line`` of the runtime defines ``name`` as the C expression ``value``.

    A number of a method's traits is called ``METHOD.field``.
    """

    name: str
    value: str
    reason: str
    header: str
    line: int

    @property
    def is_trait(self) -> bool:
        return "." in self.name


def constants(root: Path = RUNTIME) -> list[Constant]:
    """All of them, in the order of the folders."""
    fields = _FIELD_OF_METHOD.findall((root / "run" / "method.h").read_text("utf-8"))
    reasons = {name: " ".join(text.split()) for name, text in fields}
    return [each for header in headers(root) for each in _constants_of(header, root, reasons)]


def headers(root: Path = RUNTIME) -> list[Path]:
    """The headers that may have thresholds."""
    return [path for folder in FOLDERS for path in sorted((root / folder).rglob("*.h"))]


def code(header: Path) -> str:
    """A header without its comments."""
    return _COMMENT.sub(lambda found: " " + "\n" * found[0].count("\n"), header.read_text("utf-8"))


def bare_literals(root: Path = RUNTIME) -> list[str]:
    """``header:line: number`` of each floating constant in code that has no name."""
    return [
        f"{header.relative_to(root).as_posix()}:{i}: {number}"
        for header in headers(root)
        if not re.search("tableau|quadrature|traits", header.name)
        for i, line in enumerate(code(header).splitlines(), 1)
        if not line.lstrip().startswith("#")
        for number in re.findall(NUMBER, line)
        if number not in PLAIN
    ]


def _constants_of(header: Path, root: Path, reasons: dict[str, str]) -> Iterator[Constant]:
    place, traits, above = header.relative_to(root).as_posix(), "", ""
    lines = header.read_text("utf-8").splitlines()
    for i, line in enumerate(lines):
        if line.startswith("/*"):
            above = _comment(lines, i, 2)
        elif not line:
            above = ""
        if opened := _TRAITS.match(line):
            traits = opened[1]
        defined, field = _DEFINE.match(line), _FIELD.match(line) if traits else None
        if field is not None and _is_threshold(field[2]):
            yield Constant(
                f"{traits}.{field[1]}", field[2], field[3] or reasons[field[1]], place, i + 1
            )
        elif defined is not None and _is_threshold(defined[2]):
            own = _comment(lines, i, line.index("/*") + 2) if defined[3] is not None else above
            yield Constant(defined[1], defined[2], own, place, i + 1)
        traits = traits if line.endswith("\\") or opened else ""


def _is_threshold(value: str) -> bool:
    if value == "1.0":  # of a trait: none
        return False
    digits = [re.sub(r"[eE].*|\D", "", each).strip("0") for each in re.findall(NUMBER, value)]
    return bool(_FLOATING.search(value)) and all(len(each) <= _MOST_DIGITS for each in digits)


def _comment(lines: list[str], first: int, column: int) -> str:
    text = "\n".join([lines[first][column:], *lines[first + 1 :]]).partition("*/")[0]
    return " ".join(re.sub(r"\n[ \t]*\*?", " ", text).split())
