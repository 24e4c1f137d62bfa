"""The least-squares problem of a fit: residuals and their exact Jacobian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.assembly.initial_values import filled_start
from mechc.errors import AssemblyError, MechcError
from mechc.fitting.measured import Measured
from mechc.fitting.recordings import TURN, Recording
from mechc.fitting.unknowns import INPUT, PARAMETER, START, Known, Unknown
from mechc.system.kinds import Kind
from mechc.system.parameters import Array
from mechc.system.system import System


@dataclass(frozen=True)
class Setting:
    """Settings of one run: parameters, start, inputs."""

    params: dict[str, Any]
    start: dict[str, float] | Array
    inputs: dict[str, Any]


@dataclass
class Problem:
    """Residuals (model - data) / sigma of all samples, as a function of the unknowns.

    Attributes
    ----------
    model
        The :class:`mechc.Model`.
    unknowns, measured, recordings
        What is free, what was measured, and the data.
    known, guess
        What stays; coordinates near the assembly wanted.
    begin : list of float
        When each recording's motion begins, s.
    policy
        Arguments of ``simulate``.
    runs
        How many motions were computed.
    """

    model: Any
    unknowns: tuple[Unknown, ...]
    measured: tuple[Measured, ...]
    recordings: tuple[Recording, ...]
    fixed: Known
    guess: Mapping[str, float]
    begin: list[float]
    policy: dict[str, Any]
    runs: int = 0
    last_jacobian: tuple[bytes, Array] = (b"", np.zeros(0))  # where it was taken, and it

    @property
    def count(self) -> int:
        """The number of samples."""
        return sum(int(np.count_nonzero(one.valid)) for one in self.recordings)

    def setting(self, x: Sequence[float] | Array, place: int) -> Setting:
        """The run of one recording with these values of the unknowns."""
        free: dict[str, dict[str, Any]] = {PARAMETER: {}, START: {}, INPUT: {}}
        for one, value in zip(self.unknowns, x, strict=True):
            if one.holds_for(place):
                free[one.kind][one.name] = value if np.ndim(value) else float(value)
        given = self.fixed.starts[place]
        start: Any = given
        if given is None or isinstance(given, Mapping):
            start = {**(given or {}), **free[START]}
        return Setting(
            {**self.fixed.params, **free[PARAMETER]}, start,
            {**self.fixed.inputs[place], **free[INPUT]},
        )  # fmt: skip

    def named_start(
        self, start: Mapping[str, Any], place: int
    ) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """Coordinates, speeds and a guess to assemble from; the mechanism's where none is given."""
        model = self.model
        rest, speeds = model.coordinates_and_speeds(start)
        if self.fixed.starts[place] is None:
            return filled_start(model.system, rest, speeds, self.guess)
        return rest, speeds, dict(self.guess)

    def simulate(self, x: Sequence[float] | Array, place: int, names: Sequence[str] = ()) -> Any:
        """The motion of one recording, with derivatives by the names.

        Raises :class:`AssemblyError` if its loops do not close.
        """
        given, recording = self.setting(x, place), self.recordings[place]
        self.runs += 1
        model = self.model.with_inputs(given.inputs) if given.inputs else self.model
        begin, start, state = self.begin[place], given.start, given.start
        if isinstance(start, dict):
            near = self.named_start(start, place)
            start = {**near[0], **near[1]}
            state = model.assemble(*near, params=given.params, t=begin)
        span = (begin, float(recording.t[-1]))
        sol = model.simulate(span, state, given.params, t_eval=recording.t, **self.policy)
        if names:
            sol.differentiate(names, start, given.params)
        return sol

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
        recording = self.recordings[place]
        found, start = np.empty((*y.shape[:-1], len(self.measured))), self.fixed.starts[place]
        held = {u.name for u in self.unknowns} | {*(start if isinstance(start, Mapping) else ())}
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
        mine = [k for k, one in enumerate(self.unknowns) if one.holds_for(place)]
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
