"""How near a run comes to dependent rows of J, where a change point may be."""

from __future__ import annotations

import numpy as np

from mechc.native._codes import AT_CHANGE_POINT, NEARLY_DEPENDENT, RUNNING
from mechc.numpy_backend.linear import Rows
from mechc.numpy_backend.projection import Manifold
from mechc.system.parameters import Array

DEPENDENT = 1e-7  # of the largest singular value
POOR = 1e-3  # of the conditioning at ordinary configurations: below it doubles lose too many digits
FADING = 0.03
HIDING = 0.5  # of the change over a step: a smaller value may have been zero between the stages
BESIDE = 0.1  # rad, or units of the speeds: distance of the ordinary configurations


class Conditioning:
    """The least singular value along a run, over the largest near its start.

    Not over the largest of the same configuration: all rows may vanish together.  Rows that are
    redundant at every configuration do not count.  ``status`` is 0 unless the start itself is at or
    near a change point.
    """

    def __init__(self, manifold: Manifold, t: float, y: Array) -> None:
        self.status, self.rank, self.usual, self.ordinary = RUNNING, 0, 0.0, 0.0
        self.least_met, self.least_time = np.inf, t
        self.first = self.last = self.end = 1.0
        self.met: list[float] = []
        self.leaving = False
        if manifold.listing.rows:
            self._begin(manifold, t, y)

    def _begin(self, manifold: Manifold, t: float, y: Array) -> None:
        q = y[: manifold.listing.coordinates]
        changes = BESIDE * np.eye(manifold.listing.speeds)
        beside = manifold.moved(t, q, np.vstack([changes, -changes, 0.0 * changes[:1]]))
        assert beside.rows is not None
        closed = beside.status == RUNNING
        if not closed[-1]:
            return  # the first stage reports the error
        self.ordinary = float(np.median(beside.rows.singular[closed, 0]))
        found = self._values(beside.rows)[closed]
        self.rank = int((found > DEPENDENT * found[:, :1]).sum(axis=1).max())
        if not self.rank:
            return
        self.usual = float(np.median(found[:, self.rank - 1]))
        self.first = self.last = float(found[-1, self.rank - 1])
        if self.first <= DEPENDENT:
            self.status = AT_CHANGE_POINT
        elif self.first < POOR * self.usual:
            self.status = NEARLY_DEPENDENT

    def _values(self, rows: Rows) -> Array:
        values: Array = rows.singular / (self.ordinary or 1.0)
        return values

    def meet(self, t: float, rows: Rows | None) -> None:
        """Record a stage."""
        if rows is None or not self.rank:
            return
        self.last = float(self._values(rows)[0, self.rank - 1])
        self.met.append(self.last)
        if self.last < self.least_met:
            self.least_met, self.least_time = self.last, t

    def begin_step(self) -> None:
        self.met = [self.first]

    def end_step(self) -> None:
        """The last stage recorded was the step's end."""
        self.end = self.last

    def may_hide_a_zero(self) -> bool:
        """Whether the values could be on both sides of a zero.

        Not if the step begins at the last value and is far from zero.
        """
        least, most = min(self.met), max(self.met)
        if self.leaving and least == self.first:
            return False
        return least < HIDING * (most - least)

    def poor(self) -> bool:
        """Whether the rows are too nearly dependent to continue."""
        return bool(self.rank) and min(self.met) < POOR * self.usual

    def fading(self) -> bool:
        return bool(self.rank) and min(self.met, default=1.0) < FADING * self.usual

    def accept(self) -> None:
        """The step is accepted."""
        if not self.rank:
            return
        self.leaving = self.end > self.first
        self.first = self.end
        self.usual = max(self.usual, self.end)
