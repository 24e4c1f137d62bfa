"""The least-squares problem of a fit: residuals and their exact Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import AssemblyError, MechcError
from mechc.fitting.measured import Measured
from mechc.fitting.recordings import TURN, Recording
from mechc.questions.motion import MotionFunction
from mechc.questions.unknowns import START, Unknown
from mechc.system.parameters import Array
from mechc.system.quantity import Kind
from mechc.system.system import System


@dataclass
class Problem:
    """Residuals (model - data) / sigma of all samples, as a function of the unknowns.

    Attributes
    ----------
    model
        The :class:`mechc.Model`.
    unknowns, measured, recordings
        What is free, what was measured, and the data.
    motions
        The motion of each recording as a function of the unknowns.
    begin
        When each recording's motion begins, s.
    runs
        How many motions were computed.
    """

    model: Any
    unknowns: tuple[Unknown, ...]
    measured: tuple[Measured, ...]
    recordings: tuple[Recording, ...]
    motions: tuple[MotionFunction, ...]
    begin: list[float]
    runs: int = 0
    last_jacobian: tuple[bytes, Array] = (b"", np.zeros(0))  # where it was taken, and it

    @property
    def count(self) -> int:
        """The number of samples."""
        return sum(int(np.count_nonzero(one.valid)) for one in self.recordings)

    def simulate(self, x: Array, place: int, names: Sequence[str] = ()) -> Any:
        """The motion of one recording, with derivatives by the names.

        Raises :class:`AssemblyError` if its loops do not close.
        """
        self.runs += 1
        t = self.recordings[place].t
        return self.motions[place].simulate(x, self.span(place), names, t_eval=t)

    def span(self, place: int) -> tuple[float, float]:
        """The time of a recording's motion, s."""
        return self.begin[place], float(self.recordings[place].t[-1])

    def residuals(self, x: Array) -> Array:
        """(n,); infinite where a motion cannot be assembled or does not reach its end."""
        parts = []
        for place, recording in enumerate(self.recordings):
            try:
                sol = self.simulate(x, place)
            except AssemblyError:
                sol = None
            if sol is None or not sol.status.ok:
                parts.append(np.full(int(np.count_nonzero(recording.valid)), np.inf))
            else:
                parts.append(self.deviations(sol.system, sol.y, sol.params, place)[recording.valid])
        return np.concatenate(parts)

    def deviations(self, system: System, y: Array, values: Array, place: int) -> Array:
        """(model - data) / sigma (..., nt, k) on states (..., nt, nq + nu); NaN without a sample.

        Whole turns of an angle that assembly chooses, or that was recorded within one turn, are
        left out: nobody measured them.
        """
        recording, given = self.recordings[place], self.motions[place].given
        found = np.empty((*y.shape[:-1], len(self.measured)))
        held = {one.name for one in self.unknowns} | {*given.values_of(START)}
        for k, one in enumerate(self.measured):
            found_values = one.quantity.values(system, y, values, recording.t)
            apart = found_values - recording.values[:, k]
            angle = one.quantity.kind is Kind.ANGLE
            follows = angle and one.name not in held  # from the loops' closing
            if angle and recording.is_wrapped(k):
                apart = apart - TURN * np.round(apart / TURN)
            elif follows and recording.valid[:, k].any():
                first = int(np.argmax(recording.valid[:, k]))
                apart = apart - TURN * np.round(apart[..., first, None] / TURN)
            found[..., k] = apart / one.weight
        return found

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals (n, k), exact.

        Raises :class:`MechcError` where a derivative does not exist, with the reason.
        """
        if self.last_jacobian[0] != x.tobytes():
            parts = [self._slopes(x, place) for place in range(len(self.recordings))]
            self.last_jacobian = x.tobytes(), np.concatenate(parts)
        return self.last_jacobian[1].copy()

    def _slopes(self, x: Array, place: int) -> Array:
        """The rows of the Jacobian of one recording."""
        recording = self.recordings[place]
        mine = self.motions[place].mine
        names = [self.unknowns[k].name for k in mine]
        sol = self.simulate(x, place, names)
        slopes = np.zeros((len(recording.t), len(self.measured), len(self.unknowns)))
        for j, one in enumerate(self.measured):
            slopes[:, j, mine] = sol.sensitivity_of(one.name, names) / one.weight
        part: Array = slopes[recording.valid]
        if not np.isfinite(part).all():
            notes = "; ".join(sol.sensitivity.notes) or "they are not finite"
            raise MechcError(f"the motion of recording {place} has no derivatives there: {notes}")
        return part
