"""Definitions of functions in C.

Input: comment, name, parameters and statements.  Output: text.  Invariant: no compiler warns of a
parameter that a body leaves unused.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from textwrap import wrap

from mechc_codegen.emit.expressions import Line, texts

_ALIASES = "const real *const p = given->p, *const k = given->k;"


def definition(
    comment: str, name: str, signature: str, body: Iterable[Line],
    storage: str = "MECHC_INLINE", result: str = "void",
) -> str:  # fmt: skip
    """The definition of a function over ``real``; with ``given``, its arrays are p and k."""
    arguments = argument_names(signature)
    aliases = []
    if "given" in arguments:
        aliases, arguments = [_ALIASES], [*arguments, "p", "k"]
    unused = ", ".join(f"(void){argument}" for argument in arguments)
    lines = "\n".join(f"    {line}" for line in [*aliases, f"{unused};", *texts(body)])
    head = wrap(
        f"{storage} {result} FN({name})({signature})",
        98,
        subsequent_indent="    ",
        break_long_words=False,
    )
    return f"/* {plain_words(comment)} */\n{chr(10).join(head)}\n{{\n{lines}\n}}\n"


def argument_names(signature: str) -> list[str]:
    """Names of a C function's parameters, in order."""
    return re.findall(r"\b(\w+)(?:,|$)", signature)


def plain_words(text: str) -> str:
    """Text for a C comment, without signs that could end it or form a trigraph."""
    return re.sub(r"[^A-Za-z0-9_ .,:;()\[\]=+'^/-]", "_", text)
