"""Stops at coordinates, and dry friction: what runs are given as events."""

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


def write_friction(w: Writer, q: list[str], u: list[str]) -> None:
    """Dry friction in a joint, as a force that does not depend on the motion."""
    w.note("dry friction")
    k = w.whole(0, len(q) - 1)
    mu = round(w.between(0.05, 0.4), 2)
    static = f", static={round(mu * 1.3, 3)}" if w.chance(0.4) else ""
    slip = w.one_of([u[k], f'"{u[k]}"'])
    w.line(f"events = [mechc.DryFriction({slip}, mu={mu}, normal=1{static})]")
