"""The least time of calls, alone or in turns."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from .processes import clocked


def least_of_rounds(rounds: int, *calls: Callable[[], object]) -> list[float]:
    """The least seconds of each, called turn by turn."""
    least = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            least[k] = min(least[k], clocked(call))
    return least


def least_of_a_call(call: Callable[[], object], budget: float = 0.4) -> float:
    """The least seconds of a call, of as many rounds as the budget (s) has; several a round where
    they are short."""
    call()
    repeats, until = max(1, int(2e-4 / max(clocked(call), 1e-7))), time.perf_counter() + budget
    least = np.inf
    while time.perf_counter() < until:
        least = min(least, clocked(lambda: [call() for _ in range(repeats)]) / repeats)
    return float(least)
