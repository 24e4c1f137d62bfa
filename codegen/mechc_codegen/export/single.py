"""C over doubles -> C over floats.

Input: C text.  Output: C text whose numbers are floats: types, literals, functions of the C
library.  Invariant: comments and strings stay; what depends on the rounding of numbers, or on the
bits of a double, is not translated but in headers of its own (:func:`headers`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Final

from mechc_codegen.errors import CodegenError

_TOKEN = re.compile(
    r"/\*.*?(?:\*/|\Z)|//[^\n]*|\"(?:\\.|[^\"\\\n])*+\"?|'(?:\\.|[^'\\\n])*+'?|#[ \t]*include[^\n]*"
    r"|[A-Za-z_]\w*|(?:\d+\.?\d*|\.\d+)(?:[eEpP][+-]?\d+|\w)*",
    re.DOTALL,
)
_FLOATING = re.compile(r"(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][+-]?\d+)?")
_FUNCTIONS: Final = (
    *("acos", "asin", "atan", "atan2", "ceil", "cos", "cosh", "exp", "fabs", "floor", "fmax"),
    *("fmin", "fmod", "log", "pow", "sin", "sinh", "sqrt", "tan", "tanh"),
    *("__builtin_fabs", "__builtin_fma", "__builtin_sqrt"),
)
_WORDS: Final[Mapping[str, str]] = {
    "double": "float",
    "DBL_MIN": "FLT_MIN",
    "HUGE_VAL": "HUGE_VALF",
    "DBL_EPSILON": "FLT_EPSILON",
    **{name: f"{name}f" for name in _FUNCTIONS},
}
FAR = 1e300  # where the first piece of a table begins, which nothing is compared with
LEAST, MOST = 1.1754943508222875e-38, 3.4028234663852886e38
_REPLACED: Final[Mapping[str, str]] = {
    "dynamics/thresholds.h": "thresholds.h.in",
    "simd/rough.h": "rough.h.in",
    "simd/sine_cosine.h": "sine_cosine.h.in",
}


def headers() -> dict[str, str]:
    """A dict from the names of headers with another text in single precision to that text."""
    folder = files("mechc_codegen.export").joinpath("templates", "single")
    return {name: folder.joinpath(file).read_text("utf-8") for name, file in _REPLACED.items()}


def single(text: str) -> str:
    """The text over floats; limits of doubles become those of floats."""
    return _TOKEN.sub(lambda found: _translate(found[0]), text)


def refuse_beyond(text: str) -> None:
    """Raise :class:`CodegenError` for a number of the text that no float is near to."""
    for token in _TOKEN.findall(text):
        if _FLOATING.fullmatch(token) and not _near_a_float(float(token)):
            raise CodegenError(
                f"{token} has no float near it: export with real='double', or in other units"
            )


def _near_a_float(value: float) -> bool:
    return value in (0.0, FAR) or LEAST <= value <= MOST


def _translate(token: str) -> str:
    if token in _WORDS:
        return _WORDS[token]
    if not _FLOATING.fullmatch(token):
        return token
    value = float(token)
    if value > MOST:
        return "FLT_MAX"
    return "FLT_MIN" if 0.0 < value < LEAST else f"{token}f"
