"""How long a tool needs for an error: its lower envelope of time over error."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

TARGETS = (1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-11, 1e-12)


def envelope(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """The (error, seconds) that no other point beats in both, the largest error first."""
    best: list[tuple[float, float]] = []
    for error, seconds in sorted(points):
        if not best or seconds < best[-1][1]:
            best.append((error, seconds))
    return best[::-1]


def time_at(points: Iterable[tuple[float, float]], target: float) -> float | None:
    """Seconds for an error of ``target``, log-log along the envelope; None if it is not met."""
    front = envelope(points)
    if not front or front[-1][0] > target:
        return None
    if front[0][0] <= target:
        return front[0][1]
    errors, seconds = np.log(np.maximum(np.array(front[::-1]), 1e-300)).T
    return float(np.exp(np.interp(np.log(target), errors, seconds)))


def summary(rows: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, float | None]]:
    """Tool -> target error (as printed) -> seconds, from rows of ``Case.record``."""
    tools: dict[str, list[tuple[float, float]]] = {}
    for row in rows:
        points = tools.setdefault(row["tool"], [])
        if row["error"] is not None:
            points.append((row["error"], row["seconds"]))
    return {
        tool: {f"{target:.0e}": time_at(points, target) for target in TARGETS}
        for tool, points in tools.items()
    }


def ratios(
    times: Mapping[str, Mapping[str, float | None]], tool: str
) -> dict[str, dict[str, float | None]]:
    """How many times longer every other tool takes than ``tool``."""
    mine = times[tool]
    return {
        other: {
            target: None if at is None or mine[target] is None else at / mine[target]  # type: ignore[operator]
            for target, at in theirs.items()
        }
        for other, theirs in times.items()
        if other != tool
    }


def fastest(times: Mapping[str, Mapping[str, float | None]], target: str) -> str:
    """The tool that is fastest at an error; empty if none gets there."""
    met = {tool: at[target] for tool, at in times.items() if at[target] is not None}
    return min(met, key=lambda tool: met[tool] or 0.0) if met else ""
