"""The directions in which a motion in space is seen."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from mechc.results.sampling import Run
from mechc.system.parameters import Array

FLAT: Final = 1e-9  # of the size: a motion that stays in a plane
UNIT: Final = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def axes_data(run: Run) -> dict[str, Any]:
    """The directions to the right and up, and whether all stays in the plane of the two.

    Up is against the weight where it is known, else the upper axis of the picture's view.
    """
    size = float(np.abs(run.positions).max(initial=0.0))
    flat = bool(np.abs(run.positions[..., 2]).max(initial=0.0) <= FLAT * size)
    right, up = run.picture.view or (("x", "y") if flat else ("x", "z"))
    across, upwards = _direction(right), _direction(up)
    known = run.picture.weight
    weight = np.zeros(3) if known is None else known(run.solution.params)  # of free fall
    weight = weight if np.isfinite(weight).all() else np.zeros(3)
    if not flat and weight.any():
        upwards = -weight / np.linalg.norm(weight)
        across = _beside(upwards, across)
    return {"right": across.tolist(), "up": upwards.tolist(), "flat": flat}


def _direction(axis: str) -> Array:
    return np.array(UNIT[axis[-1]]) * (-1.0 if axis[0] == "-" else 1.0)


def _beside(up: Array, wanted: Array) -> Array:
    """The unit vector nearest to the wanted one that is perpendicular to ``up``."""
    choices = [wanted, *map(np.array, UNIT.values())]  # one of these is never along ``up``
    beside = next(c - up * (c @ up) for c in choices if np.linalg.norm(np.cross(c, up)) > 0.1)
    return np.asarray(beside / np.linalg.norm(beside))
