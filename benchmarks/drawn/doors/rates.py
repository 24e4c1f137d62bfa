"""Rates, masses and forces at states, beside SymPy's matrices in 30 digits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...timing.cases import Array
from ..judge import Case, Difference, Run, Told

BACKWARD = 500 * float(np.finfo(float).eps)  # relative change of all numbers that rounding may be


def at(case: Case, run: Run) -> tuple[float, Array, Array]:
    """A time, y' there in 30 digits and how far rounding may move it, in the model's order."""
    t = 0.0 if case.reference.closes else float(case.rng.uniform(0.0, 2.0))
    y = case.to_reference(run.y0)
    expected = case.reference.exact(t, y, run.params)
    spread = case.reference.spread(t, y, run.params, case.rng)
    limit = BACKWARD * (spread + np.abs(expected).max() + 1.0)
    return t, expected[case.order], limit[case.order]


def worst(
    door: str, found: Array, expected: Array, limit: Array, case: Case, told: str
) -> Difference:
    """The component that uses the largest share of its limit."""
    off = np.abs(found - expected)
    k = int(np.argmax(np.where(np.isfinite(off), off / limit, np.inf)))
    name = (*case.model.coordinates, *case.model.speeds)[k]
    words = f"{name}' = {found[k]!r}, exactly {expected[k]!r} {told}"
    size = float(off[k]) if np.isfinite(off[k]) else float("inf")
    return Difference(door, size, float(limit[k]), words)


def rates(case: Case) -> Iterator[Told]:
    """``model.rhs`` at the starts, one by one."""
    for run in case.runs:
        t, expected, limit = at(case, run)
        found = case.model.rhs(t, run.y0, run.params)
        yield worst("rhs", found, expected, limit, case, f"at t = {t}, {run.numbers}")


def many(case: Case) -> Iterator[Told]:
    """``model.rhs`` of many states at once, beside those one by one."""
    states, run = np.array([run.y0 for run in case.runs]), case.runs[0]
    together = case.model.rhs(0.0, states, run.params)
    for y, found in zip(states, together, strict=True):
        alone = case.model.rhs(0.0, y, run.params)
        limit = BACKWARD * (np.abs(alone).max() + 1.0) * np.ones(len(alone))
        yield worst("rhs of many states", found, alone, limit, case, str(run.numbers))


def matrices(case: Case) -> Iterator[Told]:
    """``mass_matrix`` and ``forcing`` of open scenes: M u' - F is zero of the exact u'."""
    if case.reference.closes:
        return
    for run in case.runs:
        t, expected, limit = at(case, run)
        first = len(case.model.coordinates)
        M = case.model.mass_matrix(run.y0, run.params, t)
        F = case.model.forcing(run.y0, run.params, t)
        u = expected[first:]
        allowed = np.abs(M) @ (limit[first:] + BACKWARD * np.abs(u)) + BACKWARD * np.abs(F)
        gap = np.abs(M @ u - F)
        k = int(np.argmax(gap / allowed))
        told = f"row {k} of M u' - F at t = {t}, {run.numbers}"
        yield Difference("mass matrix and forcing", float(gap[k]), float(allowed[k]), told)
