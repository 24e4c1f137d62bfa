"""The motion over one interval, and its derivatives by the unknowns that it depends on.

Derivatives are taken at fixed shares of the interval.  A longer interval stretches its signals: in
time they change by their slope, which is a multiple of the column by the later sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechc.assembly.closed import ClosedState
from mechc.errors import AssemblyError, MechcError, ValueOutOfBoundsError
from mechc.sensitivities.columns import columns_of, held_by
from mechc.sensitivities.events import jump_of, moved_time
from mechc.system.parameters import Array

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)


class Leap(NamedTuple):
    """A jump of the state within an interval: its share, how that changes with the local unknowns
    (k,), and the states before and after it."""

    share: float
    moved: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class Segment:
    """The motion of interval k.

    Attributes
    ----------
    choice
        The unknowns, a :class:`mechc.optimal.problem.Choice`.
    start
        Its state, moved onto the loops; None of the first interval, whose start is assembled.
    """

    choice: Any
    k: int
    sol: Any
    start: ClosedState | None

    @property
    def _length(self) -> float:
        return float(self.choice.duration / len(self.choice.nodes))

    @cached_property
    def _breaks(self) -> Array:
        """Shares at which the state jumps or given inputs have kinks, with the ends."""
        (t0, t1), driven = self.sol.span, self.sol.system.driven
        times = [t0] + ([part.t0 for part in self.sol.segments] if self._dense else [])
        kinks = driven.breaks(t0, t1, self.choice.problem.run["rtol"]) if driven else []
        return np.append((np.unique([*times, *kinks]) - t0) / self._length, 1.0)

    @property
    def _dense(self) -> bool:
        """Whether states between the ends count."""
        return bool(self.choice.problem.integral.contains("state"))

    @cached_property
    def quadrature(self) -> tuple[Array, Array]:
        """Shares (m,) and weights (m,) of the integral over the interval: eight points between two
        breaks, by Gauss."""
        wide = np.diff(self._breaks)[:, None]
        shares = self._breaks[:-1, None] + wide * 0.5 * (POINTS + 1.0)
        return shares.ravel(), (wide * 0.5 * WEIGHTS).ravel()

    @cached_property
    def shares(self) -> Array:
        """Those of the quadrature, if states count there, and the end (m + 1,)."""
        return np.append(self.quadrature[0] if self._dense else [], 1.0)

    @cached_property
    def states(self) -> Array:
        """The states (m + 1, nx) at the shares."""
        return np.vstack([self.sol(self._times[:-1]), self.sol.record.ends()[1][1]])

    @property
    def _times(self) -> Array:
        t0, t1 = self.sol.span
        return np.append(t0 + self.shares[:-1] * self._length, t1)

    # -- derivatives ------------------------------------------------------------------------------

    @cached_property
    def places(self) -> NDArray[np.intp]:
        """The places of the local unknowns in x: the state before, samples, parameters,
        duration."""
        problem = self.choice.problem
        blocks, k = problem.unknowns.blocks, self.k
        before = blocks["nodes"][k - 1] if k else blocks["start"]
        late = 1 + (problem.kind == "linear")
        samples = blocks["controls"][k : k + late].ravel()
        return np.concatenate([before, samples, blocks["parameters"], blocks["duration"]])

    @cached_property
    def columns(self) -> Array:
        """Derivatives of the states by the local unknowns (m + 1, nx, k)."""
        times, problem = self._times, self.choice.problem
        found = self._raw.at(times, self.states) @ self._local_directions
        if not np.isfinite(found).all():
            notes = "; ".join(self._raw.notes) or "they are not finite"
            raise MechcError(f"the motion has no derivatives: {notes}")
        if problem.unknowns.free:
            points = self.choice.points(np.full(len(times), self.k), self.shares, self.states)
            rates = points.system.rates(self.states, points.p, points.t)
            found[..., -1] += self.shares[:, None] * rates / len(self.choice.nodes)
        return np.asarray(found)

    @cached_property
    def start_columns(self) -> Array:
        """Derivatives of the start of the first interval by the numbers of the start and the
        parameters that are found (nx, k)."""
        unknowns, raw = self.choice.problem.unknowns, self._raw
        found = raw.at(*(each[:1] for each in self.sol.record.ends()))[0]
        kept = [*range(len(unknowns.start))]
        kept += range(raw.columns.count - len(unknowns.parameters), raw.columns.count)
        return np.asarray(found[:, kept])

    @cached_property
    def leaps(self) -> list[Leap]:
        """The jumps of the state."""
        sol, found = self.sol, []
        for number, piece in enumerate(sol.record.pieces):
            if not piece.jumps:
                continue
            jump, raw = jump_of(sol.record, number), self._raw
            at = np.array([jump.t])
            event = sol.asked_events[jump.causes[0]]
            before = raw.at(at, jump.before[None], before=True)[0]
            moved = moved_time(
                sol.system, event, jump.t, jump.before, sol.params, raw.columns, before
            )
            share = (jump.t - sol.span[0]) / self._length
            along = moved @ self._local_directions / self._length
            if self.choice.problem.unknowns.free:
                along[-1] -= share / self.choice.duration
            found.append(Leap(share, along, jump.before, jump.after))
        return found

    @cached_property
    def _raw(self) -> Any:
        """The derivatives of the motion by what mechc names."""
        problem, choice = self.choice.problem, self.choice
        problem.counts["derivatives"] += 1
        given, late = self.sol.record.ends()[1][0], 1 + (problem.kind == "linear")
        names = ["y0"]
        if self.start is None:
            given, names = choice.first[0], list(problem.unknowns.start)
        for k in range(self.k, self.k + late):
            names += [f"{name}[{k}]" for name in problem.unknowns.controls]
        names += problem.unknowns.parameters
        return self.sol.differentiate(names, given, choice.params)

    @cached_property
    def _local_directions(self) -> Array:
        """How the raw columns change with the local unknowns, at fixed times."""
        unknowns, raw = self.choice.problem.unknowns, self._raw.columns
        nx, m = unknowns.width if self.start else len(unknowns.start), len(unknowns.parameters)
        found = np.zeros((raw.count, len(self.places)))
        np.fill_diagonal(found, 1.0)
        if self.start is not None:
            found[:nx, :nx] = self.start.by_state
            if m:
                at = (each[:1] for each in self.sol.record.ends())
                own = self._raw.at(*at)[0][:, raw.count - m :]
                moved = self.start.by_parameters @ raw.parameters[:, raw.count - m :]
                found[:nx, raw.count - m : raw.count] = moved - own
        if unknowns.free and self.choice.problem.kind == "linear":
            samples = self.choice.samples
            rise = (samples[self.k + 1] - samples[self.k]) / self.choice.duration
            late = nx + len(rise)
            found[late : late + len(rise), -1] = -rise
        return found


def follow(choice: Any, k: int) -> Segment:
    """The motion of interval k.

    Raises :class:`AssemblyError` where it cannot begin, :class:`MechcError` where it does not
    reach its end.
    """
    problem, model, t = choice.problem, choice.model, choice.times
    span, start = (float(t[k]), float(t[k + 1])), None
    if k == 0:
        y = choice.first[1]
    else:
        near = model.system, choice.nodes[k - 1], choice.p, span[0]
        start = problem.retractions[k - 1].close(*near)
        y = start.y
    problem.counts["motions"] += 1
    try:
        sol = model.simulate(span, y, choice.params, **problem.run)
    except ValueOutOfBoundsError as error:  # a state that the search came to, as within a stop
        raise AssemblyError(f"no motion begins at t = {span[0]:.6g} s: {error}") from None
    if not sol.status.ok or sol.span[1] != span[1]:
        raise AssemblyError(
            f"the motion from t = {span[0]:.6g} s does not reach {span[1]:.6g} s: "
            f"{sol.status.headline}"
        )
    return Segment(choice, k, sol, start)


def parameter_directions(choice: Any) -> Array:
    """How all parameters change with those that are found (np, k)."""
    system, names = choice.model.system, choice.problem.unknowns.parameters
    held = held_by(system, choice.params)
    return columns_of(system, names, choice.p, held).parameters
