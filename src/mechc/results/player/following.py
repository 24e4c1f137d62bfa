"""Times between which a straight line is the motion, closer where it bends.

Input: a sampled Run and what is followed along it.  Output: times and values of its dense output.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from mechc.results.sampling import Run
from mechc.system.parameters import Array

FEWEST_TIMES: Final = 240
SHORTEST: Final = 1e-7  # of the run: a jump is no slope


def followed(
    run: Run,
    values: Callable[[Run], Array],
    sags: Callable[[Array], Array],
    most: int,
) -> tuple[Array, Array]:
    """At most ``most`` times, among them the ends of the run's steps, and values (times, columns).

    ``values`` gives these along a run.  Between two times they are within ``sags`` (columns),
    which follow from all values so far, of the straight line, as far as the number of times allows.
    """

    def at(t: Array) -> Array:
        return values(replace(run, t=t, y=np.asarray(run.solution(t), dtype=float)))

    if len(run.t) == 1:
        return run.t, values(run)
    first, last = float(run.t[0]), float(run.t[-1])
    ends = np.clip(run.solution.t, first, last)
    t = np.unique(np.concatenate([np.linspace(first, last, FEWEST_TIMES), ends]))
    t = t[np.unique(np.linspace(0, len(t) - 1, min(len(t), most)).round().astype(int))]
    found = at(t)
    rough = np.arange(len(t) - 1)  # the rows before the intervals that are to be halved
    while len(rough) and len(t) + len(rough) <= most:
        middle = (t[rough] + t[rough + 1]) / 2
        between = at(middle)
        sag = np.abs(between - (found[rough] + found[rough + 1]) / 2)
        bent = (sag > sags(found)).any(axis=1)
        bent &= middle - t[rough] > SHORTEST * (t[-1] - t[0])
        t = np.insert(t, rough + 1, middle)
        found = np.insert(found, rough + 1, between, axis=0)
        halves = rough + np.arange(len(rough))
        rough = np.sort(np.concatenate([halves[bent], halves[bent] + 1]))
    return t, found
