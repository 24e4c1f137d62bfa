"""A run as the data that the player reads: frames of its points, links, curves, marks.

Input: a Solution or a Run.  Output: plain values for JSON, numbers of frames as base64.
Invariant: every text is one printable line of bounded length.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.player.page import base64_floats
from mechc.results.player.plots import panels
from mechc.results.sampling import (
    Run,
    SolutionLike,
    clean_text,
    pretty_name,
    sample,
    step_count,
    time_span,
)
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
    first, last = time_span(sol)
    points = len(Run(sol, sol.t, sol.y, in_space).picture.point_names)
    most = min(MOST_FRAMES, max(FEWEST_FRAMES, MOST_POSITIONS // max(1, points)))
    wished = max(abs(last - first) * fps, float(step_count(sol)))
    count = max(2, math.ceil(min(wished, most - 1.0) - 1e-6) + 1)
    return _while_finite(replace(sample(sol, count, a_step=0), in_space=in_space))


def _while_finite(run: Run) -> Run:
    """The run up to the first state that is not finite; its first frame is always kept."""
    bad = ~np.isfinite(run.y).all(axis=1)
    count = max(1, int(np.argmax(bad))) if bad.any() else len(run.t)
    return replace(run, t=run.t[:count], y=np.nan_to_num(run.y[:count]))


# --- data ------------------------------------------------------------------------------------


def motion_data(
    run: Run, names: Sequence[str], positions: Array, fps: float, *notes: str
) -> dict[str, Any]:
    """The data of a motion, without the directions in which it is seen.

    Parameters
    ----------
    names, positions
        The points that are drawn, and where they are in each frame, (frames, points, 2 or 3) m.
    fps
        Frames a second that were asked for.
    notes
        What is told beside the title, with what there is to tell of the run.
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
