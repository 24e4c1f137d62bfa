"""Parts of a motion in which contacts last, kept as their steps in files, and read from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.native._steps import Steps
from mechc.simulation.record import Record
from mechc.system.parameters import Array
from mechc.system.system import System

DENSE_ROWS = 7  # those of the pair of order 8


def contacts_of(record: Record) -> list[Any]:
    """JSON data of each smooth part of a motion: the states of its contacts and, where one lasts,
    its steps.  Empty where none ever did."""
    if not any(piece.lasts for piece in record.pieces):
        return []
    parts: list[list[Any]] = []
    for piece in record.pieces:
        if piece.jumps or not parts:
            parts.append([list(piece.contacts)])
        if piece.lasts:
            steps: Any = piece.steps
            t, y = steps.states()
            rows = steps.rows()[:, :DENSE_ROWS]  # room for another method's may follow
            data = {"t": t.tolist(), "y": y.tolist(), "rows": rows.tolist()}
            parts[-1].append([piece.span[1], data])
    return parts


def steps_of(system: System, p: Array, given: Mapping[str, Any]) -> Steps:
    """Steps from JSON data: t (nt,), y (nt, nq + nu) and rows (nt - 1, 7, nq + nu).

    Raises
    ------
    ValueError
        For arrays that do not belong together.
    """
    width = system.scene.width
    t = np.array(given["t"], dtype=np.float64)
    y = np.array(given["y"], dtype=np.float64).reshape(len(t), width)
    rows = np.array(given["rows"], dtype=np.float64).reshape(len(t) - 1, DENSE_ROWS, width)
    sound = all(np.isfinite(x).all() for x in (t, y, rows))
    if not sound or not (np.diff(t) > 0.0).all():
        raise ValueError("steps of a motion in contact that are none")
    scene, driven = system.scene, system.driven
    inputs = None if driven is None else driven.native_inputs()
    return Steps(scene if driven is None else driven.without_inputs, p, inputs, t, y, rows)
