"""The motion of the four-bar near its change point, in 38 digits.

Along the tangent of its closure (tangent.py), by extrapolation: however narrow a bend is, its step
is halved until two orders agree.  The tangent's form vanishes at a change point itself: lengths
must miss it.  "rounded" is what the state at the end changes by when l_3 goes from 2^-51 m less to
2^-51 m more, half a spacing of doubles above 4 either way: arithmetic in doubles closes the loop to
no less.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mpmath
from mpmath import mpf

from .extrapolation import Vector, by_extrapolation
from .tangent import TangentBar, elbow_up

LENGTHS, MASSES, START = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 1.48352986419518014
T_END, TIMES = 3.0, tuple(k / 2 for k in range(1, 7))
ROUNDING = mpf(2) ** -51
LONGEST = "0.05"  # s


def grounds(least: int = 1, most: int = 16) -> list[float]:
    """Lengths l_3 = 4 +- 10^-k m for k between two, from the shortest on."""
    return sorted({4.0 + sign * 10.0**-k for k in range(least, most + 1) for sign in (-1, 1)})


def near_misses(wanted: Iterable[float] = (3.5, *grounds())) -> dict[str, Any]:
    """By length of the ground link: states at the times as text, and what rounding changes."""
    found: dict[str, Any] = {}
    for ground in wanted:
        if ground != 4.0:
            states = motion(ground, TIMES)
            texts = [[mpmath.nstr(x, 20) for x in state] for state in states]
            found[repr(ground)] = dict(zip(map(str, TIMES), texts, strict=True))
            found[repr(ground)]["rounded"] = [mpmath.nstr(x, 8) for x in rounded(ground)]
            print(f"l_3 = {ground!r} m", flush=True)
    return found


def rounded(ground: float) -> Vector:
    """The change of the state at the end over one rounding of the closure."""
    less, more = (motion(mpf(ground) + side * ROUNDING, (T_END,))[0] for side in (-1, 1))
    return [b - a for a, b in zip(less, more, strict=True)]


def motion(ground: Any, times: Sequence[float]) -> list[Vector]:
    """States [theta, omega] at the times, from rest at 85 degrees."""
    arithmetic = {"number": mpf, "sin": mpmath.sin, "cos": mpmath.cos}
    bar = TangentBar(LENGTHS, MASSES, **arithmetic)
    rows = by_extrapolation(
        bar.rates, [*elbow_up(mpf(START), (*LENGTHS, ground)), mpf(0)], times, LONGEST
    )
    return [bar.state(row) for row in rows]
