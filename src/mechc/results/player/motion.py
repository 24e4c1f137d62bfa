"""A run as the data that the player reads: frames of its points, links, curves, marks.

Input: a Solution or a Run.  Output: plain values for JSON, numbers of frames as base64.
Invariant: every text is one printable line of bounded length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.results.player.page import base64_floats
from mechc.results.player.plots import panels
from mechc.results.sampling import Run, clean_text, pretty_name
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array, one_double

MOST_FRAMES: Final = 3000
FEWEST_FRAMES: Final = 240
MOST_POSITIONS: Final = 120_000  # frames times points
MOST_MARKS: Final = 400
MOST_LETTERS: Final = 60
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0)  # of the motion over the clock's


# --- frames ----------------------------------------------------------------------------------


def frames(sol: Trajectory, fps: float, *, in_space: bool = False) -> Run:
    """The run at equal steps, up to its first state that is not finite.

    There are ``fps`` frames a second, and as many as steps of the integrator; fewer of long runs
    and of many points.  The page interpolates between them.

    Raises :class:`ValueOutOfBoundsError` if ``fps`` is not a positive number.
    """
    fps = one_double(fps, "fps")
    if not 0.0 < fps < math.inf:
        raise ValueOutOfBoundsError(
            f"fps must be a positive number of frames per second, not {fps!r}"
        )
    first, last = sorted(sol.span)
    points = len(Run(sol, sol.t, sol.y, in_space).picture.point_names)
    most = min(MOST_FRAMES, max(FEWEST_FRAMES, MOST_POSITIONS // max(1, points)))
    wished = max((last - first) * fps, float(sol.stats["steps"]))
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
    # relative to the middle of the box of the motion single precision is finest
    flat = positions.reshape(-1, positions.shape[-1])
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2 if len(flat) else np.zeros(flat.shape[-1])
    span = float(run.t[-1] - run.t[0])
    step = span / (len(run.t) - 1) if len(run.t) > 1 else 0.0
    told = [*notes]
    if step * fps > 1.001:  # the limit of frames made the step longer than requested
        told.append(f"one frame every {1e3 * step:.3g} ms")
    if not getattr(run.solution.status, "ok", True):
        told.append(clean_text(str(run.solution.status), 240))
    return {
        "title": clean_text(run.system.title or run.system.name, 100),
        "notes": [note for note in told if note],
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


def speed_choices(span: float) -> dict[str, Any]:
    """The choice of speeds, with slower ones for very short runs."""
    speeds = list(SPEEDS)
    while 0.0 < span < 3.0 * speeds[0] and speeds[0] > 1e-6:
        speeds.insert(0, float(f"{speeds[0] / 10.0:.6g}"))
    slow_enough = [speed for speed in speeds if speed <= 1.0 and span >= 1.0 * speed]
    usual = slow_enough[-1] if slow_enough else speeds[0]
    return {"speeds": speeds, "speed": usual if span > 0.0 else 1.0}


# --- marks -----------------------------------------------------------------------------------


def marks(run: Run) -> list[dict[str, Any]]:
    """Change points and events within the run, by time."""
    found = [{"t": t, "kind": "change", "label": "change point"} for t in run.change_times]
    for title, record in zip(run.solution.event_titles, run.solution.events, strict=True):
        found += [
            {"t": float(t), "kind": "event", "label": clean_text(title, MOST_LETTERS)}
            for t in record.t
            if np.isfinite(t)
        ]
    return sorted(found[:MOST_MARKS], key=lambda mark: float(mark["t"]))
