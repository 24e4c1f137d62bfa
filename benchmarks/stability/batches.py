"""The same starts in a batch: every member ends as its own simulation does, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import mechc

from ..problems.problem import Array
from . import random_starts
from .judge import METHODS, Row, attempt, bounded, row
from .misses import near_misses

SMALL = 1e-300  # below, doubles lose digits


def batches(quick: bool) -> Iterator[Row]:
    model = mechc.load("four_bar")
    rtols = (1e-8,) if quick else random_starts.RTOLS
    for method in METHODS:
        for rtol in rtols:
            yield from _random(model, method, rtol, quick)
            yield from _misses(model, method, rtol)
    yield from _bad(model)


def _random(model: mechc.Model, method: str, rtol: float, quick: bool) -> Iterator[Row]:
    given = random_starts.trials(*(8, 8, 5.0) if quick else (40, 12, 20.0), seed=3)
    params = {f"l_{k}": given.geometry.lengths[:, k] for k in range(4)}
    cases = [f"{name}, start {i}" for i, name in enumerate(given.names)]
    yield from _compared(model, cases, given.t_end, given.first, params, rtol, method)


def _misses(model: mechc.Model, method: str, rtol: float) -> Iterator[Row]:
    grounds = near_misses.grounds()
    y0 = np.stack([near_misses.start(ground) for ground in grounds])
    cases = [f"l_3 = 4 {ground - 4:+.0e} m" for ground in grounds]
    yield from _compared(model, cases, 3.0, y0, {"l_3": np.array(grounds)}, rtol, method)


def _compared(
    model: mechc.Model, cases: list[str], t_end: float, y0: Array, params: dict[str, Array],
    rtol: float, method: str,
) -> Iterator[Row]:  # fmt: skip
    """Status and state of every member against those of its own run; by ``auto`` a member may go
    on by Newton's iteration, and its own run is that of the batch."""
    batch = model.simulate_batch(
        t_end, y0, params, rtol=rtol, method=method, max_steps=200_000, progress=False
    )
    for i, case in enumerate(cases):
        own = {name: float(values[i]) for name, values in params.items()}
        alone = (
            batch[i]
            if method == "auto"
            else attempt(model, t_end, y0[i], own, rtol=rtol, method=method, dense=False)
        )
        told = f"{case}, {method}, {rtol:g}"
        yield same(told, alone, batch.status(i).code, batch.y[i])


def same(case: str, alone: mechc.Solution | str, code: str, state: Array) -> Row:
    """Right where both end alike; what both flag is flagged."""
    if isinstance(alone, str):
        return row(case, "WRONG", status=f"refused alone ({alone}), in the batch {code}")
    if alone.status.code != code:
        return row(case, "WRONG", status=f"alone {alone.status.code}, in the batch {code}")
    if not alone.status.ok:
        return row(case, "flagged", status=code)
    apart = np.abs(state - alone.y[-1]) / np.spacing(np.maximum(np.abs(state), SMALL))
    return bounded(case, float(apart.max()), 0.5)


def _bad(model: mechc.Model) -> Iterator[Row]:
    """One member that cannot be started has a status; the others are what they are without it."""
    y0 = np.stack([model.assemble({"theta_0": 1.0}, params={"l_3": 3.5})] * 4)
    good = model.simulate_batch(1.0, y0, {"l_3": 3.5}, progress=False)
    y0[1, 1] += 0.1
    y0[2, 4] = np.nan
    found = model.simulate_batch(1.0, y0, {"l_3": 3.5}, progress=False)
    for i, name in enumerate(("sound", "open", "NaN", "sound")):
        case, code = f"{name} member {i} of a batch", found.status(i).code
        if name == "sound":
            alike = found.ok[i] and np.array_equal(found.y[i], good.y[i])
            yield row(case, "right" if alike else "WRONG", status=code)
        else:
            yield row(case, "WRONG" if found.ok[i] else "flagged", status=code)
