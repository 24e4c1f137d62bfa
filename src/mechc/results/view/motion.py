"""A sampled run as the data of a page: tracks of points, links, marks on the time line.

Input: a Run.  Output: plain values for JSON; arrays of numbers as base64 of little-endian floats.
Invariant: every text is one printable line of bounded length; the page shows texts as texts.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from mechc.results.sampling import Run, clean_text, pretty_name
from mechc.system.parameters import Array

MOST_MARKS: Final = 400
MOST_LETTERS: Final = 60
FLAT: Final = 1e-9  # of the size: a motion that stays in a plane
UP: Final = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def encoded(values: Array) -> str:
    """An array as base64 of its values in single precision."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def points_data(run: Run, positions: Array) -> dict[str, Any]:
    """Names, paths and lines; ``positions`` (frames, points, 3) are relative to ``origin``."""
    shown = run.picture
    number = {name: k for k, name in enumerate(shown.point_names)}
    middle = _middle(positions)
    return {
        "points": [pretty_name(name) for name in shown.point_names],
        "origin": middle.tolist(),
        "tracks": encoded(positions - middle),
        "links": [
            {"label": clean_text(label), "points": [number[name] for name in line]}
            for label, line in shown.skeleton
        ],
        "ground": [number[name] for name in run.ground],
        "traced": [number[name] for name in run.traced],
        **_axes(run, positions),
    }


def _middle(positions: Array) -> Array:
    """Of the box of the motion: single precision is finest there."""
    flat = positions.reshape(-1, 3)
    return (flat.min(axis=0) + flat.max(axis=0)) / 2 if len(flat) else np.zeros(3)


# --- axes ------------------------------------------------------------------------------------


def _axes(run: Run, positions: Array) -> dict[str, Any]:
    """The directions to the right and up, and whether all stays in the plane of the two.

    Up is against the weight where it is known, else the upper axis of the picture's view.
    """
    shown, size = run.picture, float(np.abs(positions).max(initial=0.0))
    flat = bool(np.abs(positions[..., 2]).max(initial=0.0) <= FLAT * size)
    right, up = shown.view or (("x", "y") if flat else ("x", "z"))
    across, upwards = _direction(right), _direction(up)
    weight = _weight(run)
    if not flat and weight.any():
        upwards = -weight / np.linalg.norm(weight)
        across = _beside(upwards, across)
    return {"right": across.tolist(), "up": upwards.tolist(), "flat": flat}


def _weight(run: Run) -> Array:
    """The acceleration of free fall, zero where none is known."""
    weight = run.picture.weight
    found = np.zeros(3) if weight is None else weight(run.solution.params)
    return found if np.isfinite(found).all() else np.zeros(3)


def _direction(axis: str) -> Array:
    return np.array(UP[axis[-1]]) * (-1.0 if axis[0] == "-" else 1.0)


def _beside(up: Array, wanted: Array) -> Array:
    """The unit vector nearest to the wanted one that is perpendicular to ``up``."""
    choices = [wanted, *map(np.array, UP.values())]  # one of these is never along ``up``
    beside = next(c - up * (c @ up) for c in choices if np.linalg.norm(np.cross(c, up)) > 0.1)
    return np.asarray(beside / np.linalg.norm(beside))


# --- marks -----------------------------------------------------------------------------------


def marks(run: Run) -> list[dict[str, Any]]:
    """Change points and events within the run, by time."""
    found = [{"t": t, "kind": "change", "label": "change point"} for t in run.change_times]
    records = getattr(run.solution, "events", ())
    titles = getattr(run.solution, "event_titles", ())
    for title, record in zip(titles, records, strict=True):
        found += [
            {"t": float(t), "kind": "event", "label": clean_text(title, MOST_LETTERS)}
            for t in _within(record.t)
        ]
    return sorted(found[:MOST_MARKS], key=lambda mark: float(mark["t"]))


def _within(times: Iterable[float]) -> Iterable[float]:
    return (t for t in times if np.isfinite(t))
