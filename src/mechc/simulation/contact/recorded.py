"""A part of a motion in which contacts last, kept as its steps: in files, and read from them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.native._codes import FINISHED, RUNNING
from mechc.numpy_backend.integrator import DENSE_ROWS, dense_output
from mechc.simulation.segments import Segments, Until, lasts
from mechc.system.parameters import Array
from mechc.system.system import System


def contacts_of(run: Any) -> list[Any]:
    """Of each smooth part of a run the states of its contacts and, where one lasts, its steps: as
    JSON data.  Empty where none ever did."""
    if not isinstance(run, Segments) or not any(run.contacts):
        return []
    parts: list[list[Any]] = []
    for k, words in enumerate(run.contacts):
        if run.jumps[k] or not k:
            parts.append([list(words)])
        if lasts(words):
            parts[-1].append(_steps(run.pieces[k]))
    return parts


def _steps(piece: Any) -> list[Any]:
    """The end of a piece, and its steps."""
    end = piece.t
    while isinstance(piece, Until):
        piece = piece.piece
    return [end, piece.record()]


class RecordedRun:
    """A finished run given by its steps, as :class:`mechc.simulation.segments.Segment`.

    ``t`` (nt,), ``y`` (nt, nq + nu), ``rows`` (nt - 1, 7, nq + nu): its dense output.

    Raises
    ------
    ValueError
        For arrays that do not belong together.
    """

    status, crossings = FINISHED, 0

    def __init__(self, system: System, p: Array, told: Mapping[str, Any]) -> None:
        self.system, self.p, width = system, p, system.scene.width
        self._t = np.array(told["t"], dtype=np.float64)
        self._y = np.array(told["y"], dtype=np.float64).reshape(len(self._t), width)
        self._rows = np.array(told["rows"], dtype=np.float64)
        self._rows = self._rows.reshape(len(self._t) - 1, DENSE_ROWS, width)
        sound = all(np.isfinite(x).all() for x in (self._t, self._y, self._rows))
        if not sound or not (np.diff(self._t) > 0.0).all():
            raise ValueError("steps of a motion in contact that are none")

    @property
    def t(self) -> float:
        return float(self._t[-1])

    @property
    def count(self) -> int:
        return len(self._t)

    def advance(self, steps: int) -> int:
        """Nothing is left to do."""
        return self.status

    def stats(self) -> dict[str, Any]:
        return {
            "steps": self.count - 1, "rejected": 0, "rhs_evaluations": 0, "closure_iterations": 0,
            "least_singular": np.inf, "least_singular_time": self.t, "coordinate": -1,
            "examined": 0, "critical_gap": np.inf, "critical_time": self.t, "rounding": 0.0,
        }  # fmt: skip

    def states(self) -> tuple[Array, Array]:
        return self._t, self._y

    def times(self, first: int) -> Array:
        return self._t[first:]

    def tail(self, count: int) -> tuple[Array, Array]:
        return self._t[-count:], self._y[-count:]

    def change_points(self) -> tuple[Array, Array, Array]:
        return np.zeros(0), np.zeros((0, len(self.system.coordinates))), np.zeros(0)

    def interpolate(self, t: Array) -> Array:
        """On the constraints of loops; on gaps as exactly as the dense output is."""
        if self.count == 1 or not len(t):
            return np.repeat(self._y[:1], len(t), axis=0)
        knots = self._t.tolist()
        steps = [min(max(bisect_right(knots, x) - 1, 0), self.count - 2) for x in t.tolist()]
        s = (t - self._t[steps]) / (self._t[np.array(steps) + 1] - self._t[steps])
        found = self._y[steps] + dense_output(self._rows[steps], s[:, None])
        if self.system.scene.rows:
            found = np.array([self._closed(*each) for each in zip(t, found, strict=True)])
        return np.where((s == 0.0)[:, None], self._y[steps], found)

    def _closed(self, t: float, y: Array) -> Array:
        code, closed, _, _ = self.system.scene.project(float(t), y, self.p)
        return np.asarray(closed if code == RUNNING else y)

    def record(self) -> dict[str, Any]:
        """As it was given."""
        return record_of(self._t, self._y, self._rows)


def record_of(t: Array, y: Array, rows: Any) -> dict[str, Any]:
    """Steps as JSON data."""
    return {"t": t.tolist(), "y": y.tolist(), "rows": np.array(rows).tolist()}
