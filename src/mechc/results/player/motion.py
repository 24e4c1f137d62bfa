"""A run as the data that the player reads: frames of its points, links, curves, marks.

Input: a Solution or a Run.  Output: plain values for JSON, numbers of frames as base64.
Invariant: every text is one printable line of bounded length.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.player.page import base64_floats
from mechc.results.player.plots import panels
from mechc.results.sampling import Run, SolutionLike, clean_text, pretty_name, time_span
from mechc.system.parameters import Array

MOST_FRAMES: Final = 3000
FEWEST_FRAMES: Final = 240
MOST_POSITIONS: Final = 120_000  # frames times points
MOST_MARKS: Final = 400
MOST_LETTERS: Final = 60
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)  # of the motion over the clock's


# --- frames ----------------------------------------------------------------------------------


def frames(sol: SolutionLike, fps: float, *, in_space: bool = False) -> Run:
    """The run at equal steps, up to its first state that is not finite.

    There are ``fps`` frames a second, and as many as steps of the integrator; fewer of long runs
    and of many points.  The page interpolates between them.

    Raises
    ------
    ValueOutOfBoundsError
        If ``fps`` is not a positive number.
    """
    if not (math.isfinite(fps) and fps > 0.0):
        raise ValueOutOfBoundsError(
            f"fps must be a positive number of frames per second, not {fps!r}"
        )
    first, last = sorted(time_span(sol))
    points = len(Run(sol, sol.t, sol.y, in_space).picture.point_names)
    most = min(MOST_FRAMES, max(FEWEST_FRAMES, MOST_POSITIONS // max(1, points)))
    wished = max((last - first) * fps, float(getattr(sol, "stats", {}).get("steps", 0)))
    count = max(2, math.ceil(min(wished, most - 1.0) - 1e-6) + 1)
    t = np.linspace(first, last, count if last > first else 1)
    y = np.asarray(sol(t) if last > first else sol.y[:1], dtype=float)
    bad = ~np.isfinite(y).all(axis=1)
    kept = max(1, int(np.argmax(bad))) if bad.any() else len(t)  # the first in any case
    return Run(sol, t[:kept], np.nan_to_num(y[:kept]), in_space)


# --- data ------------------------------------------------------------------------------------


def motion_data(
    run: Run, names: Sequence[str], positions: Array, fps: float, *notes: str
) -> dict[str, Any]:
    """The data of a motion, without the directions in which it is seen.

    Drawn are the points of these names, at ``positions`` (frames, points, 2 or 3) m; ``notes`` come
    before what there is to tell of the run and of its frames, when ``fps`` a second were asked for.
    """
    number = {name: k for k, name in enumerate(names)}
    positions = np.nan_to_num(positions)
    middle = _middle(positions)
    span = float(run.t[-1] - run.t[0])
    step = span / (len(run.t) - 1) if len(run.t) > 1 else 0.0
    return {
        "title": clean_text(run.model.title or run.model.name, 100),
        "notes": [note for note in (*notes, _step_note(step, fps), _status_note(run)) if note],
        "start": float(run.t[0]),
        "step": step,
        "frames": len(run.t),
        "points": [pretty_name(name) for name in names],
        "origin": middle.tolist(),
        "tracks": base64_floats(positions - middle),
        "links": [
            {"label": clean_text(label), "points": [number[name] for name in line]}
            for label, line in run.picture.skeleton
        ],
        "ground": [number[name] for name in run.ground],
        "traced": [number[name] for name in run.traced],
        "marks": marks(run),
        "panels": panels(run),
        **speed_choices(span),
    }


def _middle(positions: Array) -> Array:
    """The middle of the box of the motion, relative to which single precision is finest."""
    flat = positions.reshape(-1, positions.shape[-1])
    return (flat.min(axis=0) + flat.max(axis=0)) / 2 if len(flat) else np.zeros(flat.shape[-1])


def speed_choices(span: float) -> dict[str, Any]:
    """The choice of speeds, with slower ones for very short runs."""
    speeds = list(SPEEDS)
    while 0.0 < span < 3.0 * speeds[0] and speeds[0] > 1e-6:
        speeds.insert(0, float(f"{speeds[0] / 10.0:.6g}"))
    slow_enough = [speed for speed in speeds if speed <= 1.0 and span >= 1.0 * speed]
    usual = slow_enough[-1] if slow_enough else speeds[0]
    return {"speeds": speeds, "speed": usual if span > 0.0 else 1.0}


def _step_note(step: float, fps: float) -> str:
    """A note if the limit of frames made the step longer than requested."""
    return f"one frame every {1e3 * step:.3g} ms" if step * fps > 1.001 else ""


def _status_note(run: Run) -> str:
    failed = not getattr(run.solution.status, "ok", True)
    return clean_text(str(run.solution.status), 240) if failed else ""


# --- marks -----------------------------------------------------------------------------------


def marks(run: Run) -> list[dict[str, Any]]:
    """Change points and events within the run, by time."""
    found = [{"t": t, "kind": "change", "label": "change point"} for t in run.change_times]
    records = getattr(run.solution, "events", ())
    titles = getattr(run.solution, "event_titles", ())
    for title, record in zip(titles, records, strict=True):
        found += [
            {"t": float(t), "kind": "event", "label": clean_text(title, MOST_LETTERS)}
            for t in _finite(record.t)
        ]
    return sorted(found[:MOST_MARKS], key=lambda mark: float(mark["t"]))


def _finite(times: Iterable[float]) -> Iterable[float]:
    return (t for t in times if np.isfinite(t))
