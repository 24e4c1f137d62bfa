"""SymPy's LaTeX with names as mechanics writes them, and its way into either document.

Input: SymPy expressions, matrices, vectors, and names as a user typed them.  Output: a
:class:`Formula`, which :func:`latex` and :func:`mathml` finish.  Invariant: a formula has only
letters and character references of a user's text, which each document resolves with its own
escapes: for any text MathML is well-formed XML, and LaTeX has balanced braces and runs no command
of the user.
"""

from __future__ import annotations

import re
from functools import lru_cache
from html import unescape
from itertools import pairwise
from typing import Any
from unicodedata import category
from xml.etree.ElementTree import tostring

from latex2mathml.converter import convert_to_element
from sympy import Add
from sympy.physics.vector import Vector
from sympy.physics.vector.printing import VectorLatexPrinter
from sympy.printing.latex import accepted_latex_functions, translate
from sympy.printing.pretty.pretty_symbology import greek_unicode

_GREEK = {sign: translate(word) for word, sign in greek_unicode.items()}
_LETTERS = _GREEK | {word: translate(word) for word in greek_unicode}
_NAME = re.compile(r"([^\W\d_]+)(\d*)((?:_[^\W_]+)*)")
_LONG = 60  # characters of a vector's component
_TEX_TEXT = {sign: f"\\{sign}" for sign in "{}$&#%_"} | {
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "²": r"\textsuperscript{2}",
    "³": r"\textsuperscript{3}",
    "°": r"\(^\circ\)",
    "…": r"\dots{}",
    "\N{EN DASH}": "--",
    "\N{MINUS SIGN}": r"\(-\)",
    "≤": r"\(\le\)",
    "∞": r"\(\infty\)",
    "\N{DOT OPERATOR}": r"\(\cdot\)",
}  # fmt: skip


class Formula(str):
    """LaTeX in math mode; letters of user text are plain, other characters ``&#x5f;`` and so on."""

    __slots__ = ()


def latex(formula: Formula) -> str:
    """The formula as LaTeX in math mode."""
    return re.sub(r"&#x(\w+);", lambda sign: latex_text(chr(int(sign[1], 16))), formula)


def mathml(formula: Formula) -> str:
    """The formula as MathML elements (without the ``math`` element around them).

    The brackets of a matrix are left to the style sheet, which draws them for all fonts.
    """
    bare = formula.replace(r"\begin{b", r"\begin{").replace(r"\end{b", r"\end{")
    (row,) = convert_to_element(bare)
    for element in row.iter():
        element.text = element.text and unescape(element.text)
        for before, after in pairwise(element):
            if before.get("form") == "prefix" and after.tag == "mo":  # a sign after a bracket
                after.set("form", "prefix")
    return tostring(row, encoding="unicode")


def latex_text(text: str) -> str:
    """Text for LaTeX outside formulas; characters that plain LaTeX lacks are written as U+XXXX."""
    return "".join(_TEX_TEXT.get(c) or _tex_character(c) for c in visible(text))


def _tex_character(character: str) -> str:
    if character in _GREEK:
        return rf"\({_GREEK[character]}\)"
    return character if character.isascii() else rf"\texttt{{U+{ord(character):04X}}}"


def visible(text: str) -> str:
    """The text with a sign in place of each invisible or forbidden character."""
    # Control, format and surrogate characters, and every space but the plain one.
    hidden = {c for c in text if category(c)[0] in ("C", "Z") and c != " "}
    return "".join("\N{REPLACEMENT CHARACTER}" if c in hidden else c for c in text)


def name(text: str, *, bold: bool = False, accent: str = "", index: str = "") -> Formula:
    """A name: ``theta_0`` is a theta with subscript 0, any other text is unchanged."""
    parts = _NAME.fullmatch(text)
    base, *below = [parts[1], parts[2], *parts[3].split("_")] if parts else [text]
    letter = rf"\{accent}{{{_word(base, bold)}}}" if accent else _word(base, bold)
    indices = ",".join([*(_word(part) for part in below if part), *([index] if index else [])])
    return Formula(f"{letter}_{{{indices}}}" if indices else letter)


def _word(word: str, bold: bool = False) -> str:
    """A Greek letter; a single letter or a number; anything else as text."""
    if word in _LETTERS:
        return rf"\boldsymbol{{{_LETTERS[word]}}}" if bold else _LETTERS[word]
    if word.isascii() and (word.isdigit() or (len(word) == 1 and word.isalpha())):
        return rf"\mathbf{{{word}}}" if bold else word
    referred = (c if c.isascii() and c.isalpha() else f"&#x{ord(c):x};" for c in visible(word))
    return rf"\text{'bf' if bold else ''}{{{''.join(referred)}}}"


class _Printer(VectorLatexPrinter):  # type: ignore[misc]
    """SymPy's printer; a text gets into its LaTeX by these methods alone."""

    printmethod = ""  # no object prints itself, with names that are not escaped
    _print_Mul = lru_cache(50_000)(VectorLatexPrinter._print_Mul)  # recur in long equations

    def _deal_with_super_sub(self, string: str, style: str = "plain") -> str:
        return name(string)

    def _hprint_Function(self, func: str) -> str:
        return rf"\{func}" if func in accepted_latex_functions else name(func)

    def _print_NumberSymbol(self, expr: Any) -> str:
        return str(expr._latex(self))

    def _print_Vector(self, vector: Any) -> str:
        return sum_of(terms(vector))

    def emptyPrinter(self, expr: Any) -> str:
        return _word(str(expr))


_PRINTER = _Printer(
    {"mul_symbol": r" \, ", "mat_str": "bmatrix", "mat_delim": "", "long_frac_ratio": 20}
)


def formula(thing: Any) -> Formula:
    """The LaTeX of a SymPy expression, matrix or vector, or of a formula itself."""
    return thing if isinstance(thing, Formula) else Formula(_PRINTER.doprint(thing))


def terms(thing: Any) -> list[str]:
    """The terms of a sum or a vector, each with its sign; any other expression is one term."""
    if isinstance(thing, Vector):
        return _vector_terms(thing)
    parts = thing.as_ordered_terms() if isinstance(thing, Add) else [thing]
    return [term if term.startswith("-") else f"+ {term}" for term in map(formula, parts)]


def sum_of(parts: list[str]) -> Formula:
    """The sum of terms that carry their signs."""
    return Formula(" ".join(parts).removeprefix("+ "))


def _vector_terms(vector: Any) -> list[str]:
    parts = [
        term
        for components, frame in sorted(vector.args, key=lambda part: part[1].index)
        for component, axis in zip(components, "xyz", strict=True)
        if component != 0
        for term in _along(component, name(frame.name, bold=True, accent="hat", index=axis))
    ]
    return parts or [r"+ \mathbf{0}"]


def _along(component: Any, unit: str) -> list[str]:
    """A component times its unit vector; a long sum term by term, so that lines can break."""
    if component in (1, -1):
        return [f"+ {unit}" if component == 1 else f"- {unit}"]
    parts = terms(component)
    if len(parts) > 1 and width(sum_of(parts)) < _LONG:
        parts = [rf"+ \left({sum_of(parts)}\right)"]
    return [rf"{term} \, {unit}" for term in parts]


def width(formula: str) -> int:
    """A rough width in characters: layout commands count nothing, every other sign counts one."""
    shown = re.sub(r"\\(left|right|frac|mathbf|boldsymbol|text(bf)?|d?dot|hat)\b|\\,", "", formula)
    return len(re.sub(r"[{}^_ ]", "", re.sub(r"&#x\w+;|\\\w+", "x", shown)))
