"""The motions of the intervals, and their derivatives by the unknowns that they depend on.

Derivatives are taken at fixed shares of the interval.  A longer interval stretches its signals: in
time they change by their slope, which is a multiple of the column by the later sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechc.assembly.closed import ClosedState
from mechc.errors import AssemblyError, MechcError, ValueOutOfBoundsError
from mechc.optimal.problem import LINEAR, Choice, Indices
from mechc.sensitivities.columns import columns_of, held_by
from mechc.sensitivities.events import jump_of, moved_time
from mechc.system.parameters import Array

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Interval:
    """The motion of interval k.

    Attributes
    ----------
    start
        Its state, moved onto the loops; None of the first interval, whose start is assembled.
    shares, weights : (m,)
        Of the integral over the interval: eight points between two breaks, by Gauss.
    states : (n, nx)
        At these shares, if the integral depends on the state, and at the end.
    """

    k: int
    sol: Any
    start: ClosedState | None
    shares: Array
    weights: Array
    states: Array

    @property
    def times(self) -> Array:
        """The times (n,) of the states, s."""
        t0, t1 = self.sol.span
        shares = self.shares[: len(self.states) - 1]
        return np.append(t0 + shares * (t1 - t0), t1)


class MovingJump(NamedTuple):
    """A jump of the state within an interval: its share, how that changes with the local unknowns
    (k,), and the states before and after it."""

    share: float
    moved: Array
    before: Array
    after: Array


class IntervalSlopes(NamedTuple):
    """Derivatives by the local unknowns: these unknowns' places in x (k,), the states' derivatives
    (n, nx, k), the jumps, and the derivatives of the first interval's start by the numbers of the
    start and the parameters that are found (nx, k)."""

    places: Indices
    columns: Array
    jumps: list[MovingJump]
    of_start: Array


def follow(choice: Choice) -> list[Interval]:
    """The motions of all intervals.

    Raises :class:`AssemblyError` where one cannot begin or does not reach its end.
    """
    starts: list[ClosedState | None] = [None]
    if len(choice.nodes) > 1:
        near = choice.nodes[:-1], choice.p, choice.times[1:-1]
        closed = choice.problem.retraction.close(choice.model.system, *near)
        starts += [closed.take(k) for k in range(len(choice.nodes) - 1)]
    return [_interval(choice, k, start) for k, start in enumerate(starts)]


def _interval(choice: Choice, k: int, start: ClosedState | None) -> Interval:
    problem, span = choice.problem, (float(choice.times[k]), float(choice.times[k + 1]))
    problem.counts["motions"] += 1
    try:
        sol = choice.model.simulate(
            span, choice.y0 if start is None else start.y, choice.params, **problem.run
        )
    except ValueOutOfBoundsError as error:  # a state that the search came to, as within a stop
        raise AssemblyError(f"no motion begins at t = {span[0]:.6g} s: {error}") from None
    if not sol.status.ok or sol.span[1] != span[1]:
        raise AssemblyError(
            f"the motion from t = {span[0]:.6g} s does not reach {span[1]:.6g} s: "
            f"{sol.status.headline}"
        )
    shares, weights = _quadrature(choice, sol)
    inner = span[0] + shares * (span[1] - span[0]) if problem.of_states else np.zeros(0)
    states = np.vstack([sol(inner), sol.record.ends()[1][1]])
    return Interval(k, sol, start, shares, weights, states)


def _quadrature(choice: Choice, sol: Any) -> tuple[Array, Array]:
    """Shares (m,) and weights (m,) of the integral over the motion of an interval."""
    (t0, t1), driven = sol.span, sol.system.driven
    times = [t0] + ([part.t0 for part in sol.segments] if choice.problem.of_states else [])
    kinks = driven.breaks(t0, t1, choice.problem.run["rtol"]) if driven else []
    breaks = np.append((np.unique([*times, *kinks]) - t0) / choice.length, 1.0)
    wide = np.diff(breaks)[:, None]
    shares = breaks[:-1, None] + wide * 0.5 * (POINTS + 1.0)
    return shares.ravel(), (wide * 0.5 * WEIGHTS).ravel()


# -- derivatives ----------------------------------------------------------------------------------


def differentiate(choice: Choice, one: Interval) -> IntervalSlopes:
    """The derivatives of the motion of one interval.

    Raises :class:`MechcError` where a derivative does not exist.
    """
    problem, unknowns = choice.problem, choice.problem.unknowns
    raw, places = _raw(choice, one), _places(choice, one)
    directions = _local_directions(choice, one, raw, len(places))
    columns = raw.at(one.times, one.states) @ directions
    if not np.isfinite(columns).all():
        notes = "; ".join(raw.notes) or "they are not finite"
        raise MechcError(f"the motion has no derivatives: {notes}")
    if unknowns.free:
        shares = np.append(one.shares[: len(one.states) - 1], 1.0)
        points = choice.points(np.full(len(shares), one.k), shares, one.states)
        rates = points.system.rates(one.states, points.p, points.t)
        columns[..., -1] += shares[:, None] * rates / len(choice.nodes)
    jumps = _jumps(choice, one, raw, directions) if problem.of_states else []
    of_start = np.zeros((unknowns.width, 0))
    if one.start is None:
        kept = [*range(len(unknowns.start))]
        kept += range(raw.columns.count - len(unknowns.parameters), raw.columns.count)
        of_start = raw.at(*(each[:1] for each in one.sol.record.ends()))[0][:, kept]
    return IntervalSlopes(places, columns, jumps, of_start)


def _raw(choice: Choice, one: Interval) -> Any:
    """The derivatives of the motion by what mechc names."""
    unknowns, late = choice.problem.unknowns, 1 + (choice.problem.kind == LINEAR)
    choice.problem.counts["derivatives"] += 1
    given, names = one.sol.record.ends()[1][0], ["y0"]
    if one.start is None:
        given, names = choice.given.start, [one.name for one in unknowns.start]
    for k in range(one.k, one.k + late):
        names += [f"{name}[{k}]" for name in unknowns.controls]
    names += [parameter.name for parameter in unknowns.parameters]
    return one.sol.differentiate(names, given, choice.params)


def _places(choice: Choice, one: Interval) -> Indices:
    """The places in x of the local unknowns: the state before, samples, parameters, duration."""
    blocks, late = choice.problem.unknowns.blocks, 1 + (choice.problem.kind == LINEAR)
    before = blocks["nodes"][one.k - 1] if one.k else blocks["start"]
    samples = blocks["controls"][one.k : one.k + late].ravel()
    return np.concatenate([before, samples, blocks["parameters"], blocks["duration"]])


def _local_directions(choice: Choice, one: Interval, raw: Any, count: int) -> Array:
    """How the raw columns change with the local unknowns, at fixed times."""
    unknowns, columns = choice.problem.unknowns, raw.columns
    nx, m = unknowns.width if one.start else len(unknowns.start), len(unknowns.parameters)
    found = np.zeros((columns.count, count))
    np.fill_diagonal(found, 1.0)
    if one.start is not None:
        found[:nx, :nx] = one.start.by_state
        if m:
            own = raw.at(*(each[:1] for each in one.sol.record.ends()))[0]
            own = own[:, columns.count - m :]
            moved = one.start.by_parameters @ columns.parameters[:, columns.count - m :]
            found[:nx, columns.count - m : columns.count] = moved - own
    if unknowns.free and choice.problem.kind == LINEAR:
        rise = (choice.samples[one.k + 1] - choice.samples[one.k]) / choice.duration
        late = nx + len(rise)
        found[late : late + len(rise), -1] = -rise
    return found


def _jumps(choice: Choice, one: Interval, raw: Any, directions: Array) -> list[MovingJump]:
    """The jumps of the state, and how they move."""
    sol, found = one.sol, []
    for number, piece in enumerate(sol.record.pieces):
        if not piece.jumps:
            continue
        jump = jump_of(sol.record, number)
        event = sol.asked_events[jump.causes[0]]
        before = raw.at(np.array([jump.t]), jump.before[None], before=True)[0]
        moved = moved_time(sol.system, event, jump.t, jump.before, sol.params, raw.columns, before)
        share = (jump.t - sol.span[0]) / choice.length
        along = moved @ directions / choice.length
        if choice.problem.unknowns.free:
            along[-1] -= share / choice.duration
        found.append(MovingJump(share, along, jump.before, jump.after))
    return found


def parameter_directions(choice: Choice) -> Array:
    """How all parameters change with those that are found (np, k)."""
    system = choice.model.system
    names = [one.name for one in choice.problem.unknowns.parameters]
    held = held_by(system, choice.params)
    return columns_of(system, names, choice.p, held).parameters
