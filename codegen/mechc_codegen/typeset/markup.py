"""Boxes -> MathML and boxes -> LaTeX: the two printers, and the escaping of each place.

Input: a box or a user's text.  Output: markup.  Invariant: for any text MathML is well-formed XML,
and LaTeX has balanced braces and runs no command of the user.
"""

from __future__ import annotations

from html import escape
from unicodedata import category

from mechc_codegen.typeset.boxes import (
    GREEK,
    Accent,
    Box,
    Fence,
    Fraction,
    Root,
    Row,
    Scripts,
    Table,
    Word,
)

_MARKS = {"hat": "^", "dot": "\N{DOT ABOVE}", "ddot": "\N{DIAERESIS}"}
_TAGS = {
    "number": "<mn>{}</mn>",
    "bold": '<mi class="bold">{}</mi>',
    "function": "<mi>{}</mi>",
    "text": "<mtext>{}</mtext>",
    "symbol": "<mi>{}</mi>",
}
_COMMANDS = {sign: word.replace("lamda", "lambda") for word, sign in GREEK.items()} | {
    "∂": "partial",
    "Λ": "Lambda",
    "ε": "varepsilon",
}
_OPERATORS = {"\N{MINUS SIGN}": "-", "\N{MULTIPLICATION SIGN}": r"\times ", "⊤": r"\top "}
_KNOWN_FUNCTIONS = {"sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log"}
_TEX_TEXT = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
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
}


def html_text(text: str) -> str:
    """Text for HTML and XML, quotes included; forbidden and invisible characters are replaced."""
    return escape(visible(text))


def latex_text(text: str) -> str:
    """Text for LaTeX outside formulas; characters that plain LaTeX lacks are written as U+XXXX."""
    return "".join(_TEX_TEXT.get(c) or _tex_character(c) for c in visible(text))


def visible(text: str) -> str:
    """The text with a sign in place of each invisible or forbidden character."""
    return "".join("\N{REPLACEMENT CHARACTER}" if _hidden(c) else c for c in text)


def _tex_character(character: str) -> str:
    if character in _COMMANDS:
        return rf"\(\{_COMMANDS[character]}\)"
    return character if character.isascii() else rf"\texttt{{U+{ord(character):04X}}}"


def _hidden(character: str) -> bool:
    """Control, format and surrogate characters, and every space but the plain one."""
    return category(character)[0] in ("C", "Z") and character != " "


def mathml(box: Box) -> str:
    """The box as MathML elements (without the ``math`` element around them)."""
    match box:
        case Word():
            return _mathml_word(box)
        case Row(items):
            return f"<mrow>{''.join(map(mathml, items))}</mrow>"
        case Fraction(top, bottom):
            return f"<mfrac>{mathml(top)}{mathml(bottom)}</mfrac>"
        case Scripts():
            return _mathml_scripts(box)
        case Accent(base, mark):
            sign = f'<mo class="{mark}" accent="false" stretchy="false">{_MARKS[mark]}</mo>'
            return f"<mover>{mathml(base)}{sign}</mover>"
        case Root(body):
            return f"<msqrt>{mathml(body)}</msqrt>"
        case Fence(Table(rows), "[]"):
            return _mathml_table(rows, ' class="matrix" displaystyle="true"')
        case Fence(body, brackets):
            # That they are fences follows from their places in the row.
            return f"<mrow><mo>{brackets[0]}</mo>{mathml(body)}<mo>{brackets[1]}</mo></mrow>"
        case Table(rows):
            return _mathml_table(rows)


def _mathml_table(rows: tuple[tuple[Box, ...], ...], attributes: str = "") -> str:
    """A table; a matrix has its brackets drawn by the style sheet, for all fonts."""
    cells = ["".join(f"<mtd>{mathml(cell)}</mtd>" for cell in row) for row in rows]
    return f"<mtable{attributes}>{''.join(f'<mtr>{row}</mtr>' for row in cells)}</mtable>"


def _mathml_word(word: Word) -> str:
    if word.kind == "space":
        return '<mspace width="0.15em"/>'
    text = html_text(word.text)
    if word.kind == "operator":
        space = ' lspace="0" rspace="0.15em"' if word.text == "," else ""
        return f"<mo{space}>{text}</mo>"
    return _TAGS[word.kind].format(text)


def _mathml_scripts(box: Scripts) -> str:
    base = mathml(box.base)
    sub = mathml(box.sub) if box.sub else ""
    sup = mathml(box.sup) if box.sup else ""
    tag = "msubsup" if sub and sup else "msub" if sub else "msup"
    return f"<{tag}>{base}{sub}{sup}</{tag}>"


def latex(box: Box) -> str:
    """The box as LaTeX in math mode."""
    match box:
        case Word():
            return _latex_word(box)
        case Row(items):
            return "".join(map(latex, items))
        case Fraction(top, bottom):
            return rf"\frac{{{latex(top)}}}{{{latex(bottom)}}}"
        case Scripts(base, sub, sup):
            below = f"_{{{latex(sub)}}}" if sub else ""
            above = f"^{{{latex(sup)}}}" if sup else ""
            return f"{{{latex(base)}}}{below}{above}"
        case Accent(base, mark):
            return rf"\{mark}{{{latex(base)}}}"
        case Root(body):
            return rf"\sqrt{{{latex(body)}}}"
        case Fence(body, brackets):
            return rf"\left{brackets[0]}{latex(body)}\right{brackets[1]}"
        case Table(rows):
            lines = r" \\ ".join(" & ".join(map(latex, row)) for row in rows)
            return rf"\begin{{matrix}}{lines}\end{{matrix}}"


def _latex_word(word: Word) -> str:
    text = word.text
    if word.kind == "space":
        return r"\,"
    if word.kind == "operator":
        return _OPERATORS.get(text, text)
    if word.kind == "text":
        return rf"\text{{{latex_text(text)}}}"
    if word.kind == "function" and text in _KNOWN_FUNCTIONS:
        return rf"\{text}"
    return _latex_name(text, word.kind)


def _latex_name(text: str, kind: str) -> str:
    """A plain word; a Greek letter; anything else as text."""
    if text in _COMMANDS:
        greek = rf"\{_COMMANDS[text]} "
        return rf"\boldsymbol{{{greek}}}" if kind == "bold" else greek
    if not (text.isascii() and text.replace(".", "").isalnum()):
        return rf"\text{{{latex_text(text)}}}"
    if kind == "bold":
        return rf"\mathbf{{{text}}}"
    return text if len(text) == 1 or kind == "number" else rf"\mathrm{{{text}}}"
