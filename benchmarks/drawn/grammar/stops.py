"""Stops at coordinates: impacts by Newton's law."""

from __future__ import annotations

from .writer import Writer


def write(w: Writer, q: list[str]) -> None:
    """A stop below or above a coordinate, which no start touches; ``stop`` tells SciPy of it."""
    w.note("stop")
    k = w.whole(0, len(q) - 1)
    low, high = w.starts[q[k]]
    e = round(w.between(0.3, 0.9), 2)
    if w.chance(0.5):
        gap = f"{q[k]} + {round(0.15 - low, 2)}"
    else:
        gap = f"{round(high + 0.15, 2)} - {q[k]}"
    w.line(f"stop = ({gap}, {e})")
    given = w.one_of(["stop[0]", "str(stop[0]).replace('(t)', '')"])
    w.line(f"events = [mechc.Stop({given}, {e})]")
