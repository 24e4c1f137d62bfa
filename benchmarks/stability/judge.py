"""The judge of the stress suite: runs and their verdicts, limits and where they come from.

A row is one run: its case, its word, its error and limit where it has them.  Words:

``right``     finished, within the limit
``refused``   an error said before the run what is wrong
``flagged``   the run ended early with a status that says why
``unjudged``  the judge's own motion does not end; nothing is said
``WRONG``     finished, and beyond the limit: wrong without a warning
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

import mechc

from ..timing.cases import Array

Row = dict[str, Any]
Refusal = str
Outcome = mechc.Solution | Refusal
REFUSALS = (mechc.MechcError, ValueError)
WORDS = ("right", "refused", "flagged", "unjudged", "WRONG")
METHODS = ("auto", "dop853")

SHARES = 100.0  # of rtol: a run is some hundred steps, and each may err by a share of it
ROUNDING = 2.5e-10  # projection leaves an ulp of closure; beside crossings 1e6 times that in q
LARGEST = 0.3  # rad, or of the largest speed: a limit that any motion meets judges nothing
MAX_STEPS = 200_000


def limit_of(rtol: float, condition: float, rounding: float = ROUNDING) -> float:
    """The error allowed: tolerance and rounding, times the growth of errors in the motion."""
    return min((SHARES * rtol + rounding) * max(condition, 1.0), LARGEST)


def attempt(
    model: mechc.Model, t_span: float | tuple[float, float], y0: Array,
    params: Mapping[str, float] | None = None, **policy: Any,
) -> Outcome:  # fmt: skip
    """A solution, or why it was refused; anything else that is raised is a defect."""
    try:
        return model.simulate(t_span, y0, params, **{"max_steps": MAX_STEPS, **policy})
    except REFUSALS as error:
        return str(error)


def runs(
    model: mechc.Model, t_span: float | tuple[float, float], y0: Array,
    params: Mapping[str, float] | None = None, *,
    methods: Sequence[str] = METHODS, rtols: Sequence[float], **policy: Any,
) -> Iterator[tuple[str, str, float, Outcome]]:  # fmt: skip
    """A run by every method at every tolerance: both in words, both, and what became of it."""
    for method in methods:
        for rtol in rtols:
            found = attempt(model, t_span, y0, params, rtol=rtol, method=method, **policy)
            yield f"{method}, {rtol:g}", method, rtol, found


def last_state(sol: mechc.Solution) -> Array:
    return sol.y[-1]


def verdict(
    case: str, outcome: Outcome, exact: Array, limit: float, scale: Array | float = 1.0,
    observe: Callable[[mechc.Solution], Array] = last_state, **figures: Any,
) -> Row:  # fmt: skip
    """What is observed of a run against its exact value, each component in its scale."""
    if isinstance(outcome, str):
        return row(case, "refused", status=outcome, **figures)
    if not outcome.status.ok:
        return row(case, "flagged", status=outcome.status.code, **figures)
    return measured(case, observe(outcome), exact, limit, scale, **figures)


def measured(
    case: str, found: Array, exact: Array, limit: float, scale: Array | float = 1.0,
    **figures: Any,
) -> Row:  # fmt: skip
    """Whether what a finished run gave is within the limit; NaN is not."""
    return bounded(case, float((np.abs(found - exact) / scale).max()), limit, **figures)


def bounded(case: str, error: float, limit: float, **figures: Any) -> Row:
    word = "right" if error <= limit else "WRONG"
    error, limit = float(error), float(limit)
    return row(case, word, error=error, limit=limit, excess=error / limit, **figures)


def row(case: str, word: str, **figures: Any) -> Row:
    return {"case": case, "word": word, **figures}


def speeds_apart(exact: Array, size: int) -> Array:
    """Scales of a state: 1 for its coordinates, the largest of its speeds (or 1) for speeds.

    Tolerances of speeds are relative to their largest value so far, at least.
    """
    fastest = max(1.0, float(np.abs(exact[size:]).max(initial=0.0)))
    return np.where(np.arange(len(exact)) < size, 1.0, fastest)
