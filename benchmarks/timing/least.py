"""The least time of calls that are compared with each other."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


def least_of_rounds(rounds: int, *calls: Callable[[], object]) -> list[float]:
    """The least seconds of each, called turn by turn."""
    least = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            begun = time.perf_counter()
            call()
            least[k] = min(least[k], time.perf_counter() - begun)
    return least
