"""Tolerances for tools whose error is far from the tolerance that they are given."""

from __future__ import annotations

from collections.abc import Sequence

FINEST = 1e-15  # below it doubles cannot tell a step's error from its rounding


def with_tighter(tolerances: Sequence[float], finest: float = FINEST) -> list[float]:
    """The tolerances, and decades on from the tightest where that is 1e-12 or less.

    What is compared is time over the error that was achieved.  The error of a multistep method
    may be thousands of times the tolerance: left at what others are given it would seem to stop
    at an error that it can well go beyond.
    """
    wanted = list(tolerances)
    while min(wanted) < 2e-12 and min(wanted) / 10 > 0.9 * finest:
        wanted.append(min(wanted) / 10)
    return wanted
