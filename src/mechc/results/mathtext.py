"""Names as matplotlib typesets them: theta_0 with its index below, theta_dot with its dot above.

Input: names of users.  Output: text for matplotlib.
Invariant: only letters and digits of a name that is wholly of such parts get into mathematics;
every other name is plain text.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any, Final

from mechc.results.sampling import GREEK, pretty_name

LONGEST: Final = 32  # letters, as of all names in pictures
_PARTS: Final = re.compile(r"([A-Za-z]+?)([0-9]*)((?:_[A-Za-z0-9]+)*)")
_CAPITALS: Final = (
    *("Gamma", "Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma", "Phi", "Psi", "Omega"),
)
_ACCENTS: Final = {"dot": r"\dot", "ddot": r"\ddot", "hat": r"\hat"}  # a bar is a link here


def typeset(name: str) -> str:
    """A name in mathematics where it is a letter or a word with indices, else as it is.

    ``theta_0``, ``omega12``, ``q_slew``, ``theta_0_dot``: the words of SymPy's own printing,
    but for ``bar``.
    """
    parts = _PARTS.fullmatch(name)
    if parts is None or len(name) > LONGEST:
        return plain(pretty_name(name))
    base, number, rest = parts.groups()
    indices = [number] * bool(number) + rest.split("_")[1:]
    symbol = _word(base)
    for accent in [index for index in indices if index in _ACCENTS]:
        symbol = f"{_ACCENTS[accent]}{{{symbol}}}"
    below = ",".join(_word(index) for index in indices if index not in _ACCENTS)
    return f"${symbol}_{{{below}}}$" if below else f"${symbol}$"


def plain(text: str) -> str:
    """Text for matplotlib: no mathematics in it, and no glyph that the font lacks."""
    shown = "".join(c if _font().get_char_index(ord(c)) else f"U+{ord(c):04X}" for c in text)
    return shown.replace("$", r"\$")


def _word(word: str) -> str:
    """A number or a letter as it is, a Greek one by its command, a word upright."""
    if word in GREEK or word in _CAPITALS:
        return "\\" + {"lamda": "lambda"}.get(word, word)
    return word if len(word) == 1 or word.isdigit() else rf"\mathrm{{{word}}}"


@cache
def _font() -> Any:
    from matplotlib.font_manager import findfont, get_font

    return get_font(findfont("DejaVu Sans"))
