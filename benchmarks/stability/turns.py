"""The reference linkage, started whole turns on: does it move as it does without them?

All angles 1e3, 1e5 and 1e6 turns on, 20 s through change points, against the exact motion; by unit
vectors of the links and speeds.  The start is known to half an ulp of its angles, the end told to
another: both are in the limit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import mechc

from ..problems.data import four_bar_state
from .exact_motion import GROWTH, limit
from .judge import Row, attempt, bounded, verdict
from .random_starts import error_of

T_END = 20.0
TURNS = (1e3, 1e5, 1e6)
METHODS = ("auto", "dop853", "radau5")
RTOLS = (1e-6, 1e-9)


def turns(quick: bool) -> Iterator[Row]:
    """Radau's method only where every case is run."""
    model, exact = mechc.load("four_bar"), four_bar_state("change_point", T_END)
    for count in TURNS:
        start = four_bar_state("change_point", 0.0)
        start[:3] += 2 * np.pi * count
        digit = float(np.spacing(start[:3]).max())
        for method in METHODS[: 2 if quick else 3]:
            for rtol in RTOLS:
                case = f"{count:g} turns, {method}, {rtol:g}"
                found = attempt(model, T_END, start, rtol=rtol, method=method, dense=False)
                if isinstance(found, str) or not found.status.ok:
                    yield verdict(case, found, exact, 0.0)
                    continue
                allowed = limit(rtol, T_END) + GROWTH[T_END] * digit
                yield bounded(case, error_of(found.y[-1], exact), allowed, rtol=rtol)
