"""Motions through change points of the four-bar and past them by a little."""

from __future__ import annotations

from collections.abc import Iterator

import failure_rate
import near_misses
from _stress_judge import METHODS, Row


def random_starts(quick: bool) -> Iterator[Row]:
    """A thousand starts, three quarters of them of the reference linkage."""
    given = failure_rate.trials(*(40, 8, 20.0) if quick else (750, 50, 100.0))
    for method in METHODS:
        for rtol in failure_rate.RTOLS:
            yield from failure_rate.judged(given, method, rtol)


def random_starts_note(rows: list[Row]) -> str:
    """Which method failed how often at which tolerance."""
    told = []
    for method in METHODS:
        for rtol in failure_rate.RTOLS:
            some = [r for r in rows if r.get("method") == method and r.get("rtol") == rtol]
            failed = sum(r["word"] in ("flagged", "WRONG") for r in some)
            wrong = sum(r["word"] == "WRONG" for r in some)
            if failed:
                told.append(f"{method} at {rtol:g}: {failed} of {len(some)}, {wrong} silently")
    return "; ".join(told) or "no start failed at any tolerance"


def misses(quick: bool) -> Iterator[Row]:
    for ground in near_misses.grounds():
        rtols = (1e-9,) if quick else near_misses.RTOLS
        yield from near_misses.judged(ground, METHODS, rtols)
