"""The four-bar that misses its change point by 10^-k: right, or flagged?

l_3 = 4 +- 10^-k m, k = 1 ... 16, from rest at 85 degrees, 3 s, against the motion of the same
doubles in 38 digits (references/near_misses.py made data/four_bar_near_misses.json).  4 +- 1e-16 is
4.0 itself, the change point; 4 +- 1e-15 is not, as a double or as typed, however small a part of
the rounding of the closure its gap is: right there is the bend, or a status.  Right: within
(100 rtol + 2.5e-10) times a condition of 100, and what the exact motion itself changes when l_3
changes by the rounding of the closure, four times 2^-51 m either way: cosines, products and sums of
links of 1, 2 and 3 m are each off by half an ulp at most, 1.8e-15 m together, and no arithmetic of
doubles keeps the loop closed to less for certain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

import mechc

from ...problems.data import four_bar_state, reference
from ...problems.problem import Array
from ...references.near_misses import LENGTHS, START, T_END, grounds
from ...references.tangent import elbow_up
from ..judge import Row, limit_of, runs, verdict

CONDITION = 100.0
ROUNDINGS = 4  # of 2^-51 m each
RTOLS = (1e-6, 1e-9, 1e-12)
METHODS = ("auto", "dopri5", "dop853", "gauss8")


def near_misses(quick: bool) -> Iterator[Row]:
    """By all methods at all tolerances, quick or not: two seconds each."""
    for ground in grounds():
        yield from judged(ground, METHODS, RTOLS)


def start(ground: float) -> Array:
    """Elbow up at 85 degrees, at rest."""
    return np.array([*elbow_up(START, (*LENGTHS, ground)), 0.0, 0.0, 0.0], float)


def truth(ground: float) -> tuple[Array, float]:
    """The exact state at the end, and what rounding of the closure changes of it."""
    if ground == 4.0:
        return four_bar_state("change_point", T_END), 0.0
    known = reference("four_bar_near_misses")[repr(ground)]
    return np.array(known["3.0"], float), float(np.abs(np.array(known["rounded"], float)).max())


def judged(ground: float, methods: Sequence[str], rtols: Sequence[float]) -> Iterator[Row]:
    model = mechc.load("four_bar")
    exact, rounded = truth(ground)
    for told, method, rtol, found in runs(
        model, T_END, start(ground), {"l_3": ground}, methods=methods, rtols=rtols, dense=False,
        max_steps=2_000_000,
    ):  # fmt: skip
        case = f"l_3 = 4 {ground - 4:+.0e} m, {told}"
        limit = limit_of(rtol, CONDITION) + ROUNDINGS * rounded
        yield verdict(case, found, exact, limit, l_3=ground, method=method, rtol=rtol)
