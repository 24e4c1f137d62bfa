"""The time of a tool for an error: its lower envelope of time over error."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

TARGETS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
Row = Mapping[str, Any]
Times = Mapping[str, Mapping[str, float | None]]


def printed(target: float) -> str:
    """A target as a key of the JSON."""
    return f"{target:.0e}"


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


def points_of(rows: Iterable[Row]) -> list[tuple[float, float]]:
    """(error, seconds) of the rows that are right."""
    return [(row["error"], row["seconds"]) for row in rows if row["label"] == "right"]


def times_of(rows: Sequence[Row]) -> dict[str, dict[str, float | None]]:
    """Tool -> target error -> seconds of its fastest method, each along its own envelope.

    Between points of two methods there is no run that anyone could make.
    """
    return {
        tool: {
            printed(target): min(of_methods(rows, tool, target).values(), default=None)
            for target in TARGETS
        }
        for tool in dict.fromkeys(row["tool"] for row in rows)
    }


def of_methods(rows: Iterable[Row], tool: str, target: float) -> dict[str, float]:
    """Method -> seconds for an error, of those methods of a tool that meet it."""
    own = [row for row in rows if row["tool"] == tool]
    methods = dict.fromkeys(row["method"] for row in own)
    reached = {m: time_at(points_of(r for r in own if r["method"] == m), target) for m in methods}
    return {method: seconds for method, seconds in reached.items() if seconds is not None}


def is_batch(tool: str) -> bool:
    """Whether it reports the time of one trajectory among many."""
    return tool.endswith("batch")


def fastest(times: Times, target: str, *, batch: bool = False) -> tuple[str, float] | None:
    """The fastest of the other tools at an error, and its seconds.

    Tools that integrate many trajectories in lockstep report the time of one, which no tool could
    reach with a single trajectory: they are compared with mechc's batches.
    """
    met = {
        tool: seconds for tool, at in times.items()
        if not tool.startswith("mechc") and (seconds := at.get(target))
        and (batch or not is_batch(tool))
    }  # fmt: skip
    return min(met.items(), key=lambda item: item[1]) if met else None


def method_of(rows: Sequence[Row], tool: str, target: float) -> str:
    """The method that gives a tool its time at an error."""
    met = of_methods(rows, tool, target)
    return min(met, key=lambda method: met[method], default="")


def wrong_when_tighter(rows: Iterable[Row], tool: str, method: str, target: float) -> bool:
    """Whether a tool meets an error at one tolerance, and is wrong without a word at a tighter one.

    Who runs it cannot know then that its looser run, which takes less time, is the right one.
    """
    own = [row for row in rows if (row["tool"], row["method"]) == (tool, method)]
    met = [row["tol"] for row in own if row["label"] == "right" and row["error"] <= target]
    return any(row["label"] == "wrong" and row["tol"] < max(met, default=0.0) for row in own)
