"""The gradient of an objective of a finished run: covectors backwards over its steps (adjoint).

An objective is a function of the end state, an integral over the run, or both.  Covectors pass
through the transposed of every operation that columns pass through, so both ways agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import MechcError
from mechc.sensitivities.columns import Columns, columns_of, held_by
from mechc.sensitivities.events import (
    AT_ONE_INSTANT,
    GRAZING,
    Jump,
    jump_of,
    moved_time,
    through_reset,
)
from mechc.sensitivities.outputs import linear
from mechc.sensitivities.rules import rule_of
from mechc.sensitivities.run import NO_DERIVATIVE, ended_columns
from mechc.sensitivities.samples import check_steps
from mechc.sensitivities.start import start_columns, without_closure
from mechc.sensitivities.steps import NAMES, checked_run, differentiable, refuse_contact
from mechc.simulation.record import Piece
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.quantities import Quantity, outputs_in, read_quantity, values_of
from mechc.system.system import System

POINTS, WEIGHTS = (0.5 * each for each in np.polynomial.legendre.leggauss(8))
NUMBERS_AT_ONCE = 1 << 20


class Gradient(dict[str, Any]):
    """Name -> derivative of the objective; of ``"y0"`` an array (nq + nu,).

    Attributes
    ----------
    value
        The objective; an end given as an array counts as its product with the end state.
    notes
        Which derivatives do not exist, and are NaN, and why.
    """

    def __init__(self, parts: Mapping[str, Any], value: float, notes: tuple[str, ...]) -> None:
        super().__init__(parts)
        self.value, self.notes = value, notes


Weights = Mapping[Quantity, float]


@dataclass
class Objective:
    """The objective: its outputs' system, which may have parameters that the motion does not depend
    on, their values and the columns for it; and, as far as they are gathered, its derivative (k,)
    along the columns at fixed states, and its value."""

    system: System
    values: Array
    columns: Columns
    along: Array
    value: float = 0.0

    def at(self, weights: Weights, y: Array, t: Array) -> Array:
        """The weighted sum (n,) of quantities at states."""
        return values_of([*weights], self.system, y, self.values, t) @ [*weights.values()]

    def slopes(self, weights: Weights, y: Array, t: Array) -> tuple[Array, Array]:
        """Derivatives of that sum: by states (n, nx), along the columns at fixed ones (n, k)."""
        factors = np.array([*weights.values()])
        every = linear(self.system, [*weights], y, self.values, t, self.columns)
        by_state, along = (np.einsum("m,nmi->ni", factors, each) for each in every)
        return by_state, along


@dataclass
class Backwards:
    """A covector (nx,) on its way back, and what has been gathered by parameters and inputs of the
    motion: by the steps, and by integrals over states within them."""

    sol: Trajectory
    system: System
    objective: Objective
    covector: Array
    gathered: Array
    integrated: Array
    raw: Columns
    names: Sequence[str]  # that are by samples

    @cached_property
    def every(self) -> Columns:
        """The columns of propagators: the state's components, then parameters, inputs, samples."""
        width, raw = self.system.scene.width, self.raw
        size = len(raw.parameters) + len(raw.inputs)
        parameters, inputs = (
            np.hstack([np.zeros((len(part), width)), part]) for part in (raw.parameters, raw.inputs)
        )
        samples = raw.samples and raw.samples.behind(width + size)
        return Columns((), {}, parameters, inputs, samples)

    @property
    def start(self) -> Array:
        width = self.system.scene.width
        return np.hstack([np.eye(width), np.zeros((width, len(self.gathered)))])

    def through(self, columns: Array) -> None:
        """Move the covector back through an affine map [P | Q] (nx, nx + np + ni)."""
        found = self.covector @ columns
        width = self.system.scene.width
        self.covector = np.ascontiguousarray(found[:width])
        self.gathered = self.gathered + found[width:]


def gradient_of_run(
    sol: Trajectory, end: Any, integral: Any, by: Sequence[str] | None, y0: Any, params: Any
) -> Gradient:
    """The gradient of ``end`` plus ``integral``; ``y0`` and ``params`` as the user gave them.

    Raises :class:`UnavailableOutputError`, :class:`UnknownNameError`, :class:`MechcError` as
    :func:`columns_of`, :func:`start_columns` and :func:`read_quantity` say.
    """
    refuse_contact(sol)
    if sol.system.driven is not None and sol.system.driven.feeds_back:
        raise MechcError(
            "how a controller depends on the state is not known, so a run with mechc.Sampled has "
            "no gradient: give its law as an expression, mechc.compile(..., inputs=)"
        )
    asked = [] if isinstance(end, (np.ndarray, list, tuple)) else _names(end)
    wider = sol.system.differentiable(*outputs_in([*asked, *_names(integral)]))
    sol = differentiable(sol)
    system, held = sol.system, held_by(sol.system, params)
    names = list(wider.parameters) if by is None else list(by)
    values = wider.values_of(system, sol.params)
    every = columns_of(wider, names, values, held)
    objective = Objective(wider, values, every, np.zeros(every.count))
    columns = every.for_system(system, wider)
    t, y = sol.record.ends()
    start, notes = start_columns(system, columns, y0, sol.record, sol.params)
    notes += without_closure(system, columns, start, y[0], sol.params, float(t[0]))
    raw = _raw(columns)
    way = Backwards(
        sol, system, objective, np.zeros(system.scene.width), np.zeros(raw.count),
        np.zeros(raw.count), raw, columns.names if columns.samples else (),
    )  # fmt: skip
    _begin(way, end)
    weights = _weights(wider, integral)
    for number, piece in reversed([*enumerate(sol.record.pieces)]):
        _back(way, piece, weights)
        if piece.jumps:
            _back_over(way, jump_of(sol.record, number), weights)
    if not np.isfinite(way.covector).all():
        notes += (f"none, for {NO_DERIVATIVE}: sensitivities= tells where",)
    total = start.T @ way.covector + _along(columns).T @ (way.gathered + way.integrated)
    total += objective.along
    for _, bad, said in ended_columns(sol, columns):
        total[bad] = np.nan
        notes += said
    parts = {name: total[place] for name, place in columns.places.items()}
    numbers = {name: float(part) if np.ndim(part) == 0 else part for name, part in parts.items()}
    return Gradient(numbers, objective.value, notes)


def _raw(columns: Columns) -> Columns:
    """One column for each parameter, value of an input, and sample."""
    size = len(columns.parameters) + len(columns.inputs)
    count = 0 if columns.samples is None else len(columns.samples.samples)
    unit = np.eye(size, size + count)
    samples = columns.samples and columns.samples.behind(size)
    own = len(columns.parameters)
    return Columns((), {}, unit[:own], unit[own:], samples)


def _along(columns: Columns) -> Array:
    """The changes of parameters, inputs and samples along the columns asked for."""
    samples = () if columns.samples is None else columns.samples.samples
    own = np.zeros((len(samples), columns.count))
    for row, sample in zip(own, samples, strict=True):
        row[sample.column] = 1.0
    return np.vstack([columns.parameters, columns.inputs, own])


def _names(given: Any) -> list[Any]:
    """The quantities of which an objective is made, as they are written."""
    if given is None:
        return []
    return [*given] if isinstance(given, Mapping) else [given]


def _weights(system: System, given: Any) -> dict[Quantity, float]:
    """Quantities of an objective with their weights."""
    weights = given if isinstance(given, Mapping) else dict.fromkeys(_names(given), 1.0)
    return {
        read_quantity(system, name, differentiable=True): one_double(weight, "a weight")
        for name, weight in weights.items()
    }


def _begin(way: Backwards, end: Any) -> None:
    """The covector of the end state, and the objective's value there."""
    sol = way.sol
    t = sol.span[1]
    y = np.asarray(sol(t))
    if isinstance(end, (np.ndarray, list, tuple)):
        given = doubles(end, "the end's derivative")
        if given.shape != y.shape:
            raise MechcError(f"the end's derivative has the shape {given.shape}, not {y.shape}")
        way.covector, way.objective.value = given, float(given @ y)
        return
    objective, at = way.objective, (_weights(way.objective.system, end), y[None], np.array([t]))
    by_state, along = objective.slopes(*at)
    way.covector = way.covector + by_state[0]
    objective.along += along[0]
    objective.value += float(objective.at(*at)[0])


def _back(way: Backwards, piece: Piece, weights: Weights) -> None:
    """Move the covector back over one piece of the motion."""
    run: Any = piece.steps
    stop = piece.cut
    checked_run(way.system, run, way.sol.params)
    t = run.times(0)
    last = len(t) - 1
    if way.names and last > 0:
        check_steps(way.system, way.names, t)
    if stop is not None and last > 0:
        forwards = 1.0 if t[-1] >= t[0] else -1.0
        last = max(int(np.searchsorted(forwards * t, forwards * stop)) - 1, 0)
        _, columns = _within(way, run, t, last, np.array([stop]))
        added = _integral(way, run, t, last, last + 1, stop, weights)
        way.through(columns[0])
        if added is not None:
            way.covector = way.covector + added[0]
    sources = _integral(way, run, t, 0, last, t[last], weights)
    way.covector, way.gathered = run.covary(
        0, max(last, 0), way.covector, sources, way.raw.shapes, way.gathered
    )


def _back_over(way: Backwards, jump: Jump, weights: Weights) -> None:
    """Move the covector back from after the reset of an event to before it."""
    if len(jump.causes) != 1:
        raise MechcError(f"at t = {jump.t:.9g} s {AT_ONE_INSTANT}: there is no derivative")
    columns = through_reset(way.sol, jump, way.every, way.start)
    if not np.isfinite(columns).all():
        raise MechcError(
            f"there is no gradient: {GRAZING.format(jump.t)}, which sensitivities= gives"
        )
    way.through(columns)
    if weights:
        _move_jump(way, jump, weights)


def _move_jump(way: Backwards, jump: Jump, weights: Weights) -> None:
    """Add what integrals gain as the jump of their integrand moves with the event's time."""
    both, times = np.array([jump.before, jump.after]), np.full(2, jump.t)
    before, after = way.objective.at(weights, both, times)
    fall = before - after
    event = way.sol.asked_events[jump.causes[0]]
    later = moved_time(way.system, event, jump.t, jump.before, way.sol.params, way.every, way.start)
    width = way.system.scene.width
    way.covector = way.covector + fall * later[:width]
    way.gathered = way.gathered + fall * later[width:]


def _within(way: Backwards, run: Any, t: Array, step: int, points: Array) -> tuple[Array, Array]:
    """States (m, nx), and columns from the start of a step, at times within it, as the dense output
    of sensitivities has them."""
    h, y = t[step + 1] - t[step], run.interpolate(points)
    rule, s = rule_of(NAMES[int(run.methods()[step])]), (points - t[step]) / h
    every, shapes = way.every.directions, way.every.shapes
    ends, rates = run.vary(step, step + 1, every, way.start, rule.rates, shapes=shapes)
    weights = h * (rule.weights(s) - s[:, None] * rule.weights(np.ones(1))[0])
    gained = np.einsum("mj,jik->mik", weights, rates[0])
    moved = ends[0] + s[:, None, None] * (ends[1] - ends[0]) + gained
    columns = np.ascontiguousarray(moved)
    run.project_columns(points, y, every, columns, shapes)
    return y, columns


# -- integrals ------------------------------------------------------------------------------------


def _integral(
    way: Backwards, run: Any, t: Array, first: int, last: int, stop: float,
    weights: Weights,
) -> Array | None:  # fmt: skip
    """Integrate outputs over steps first ... last - 1, the last until ``stop``; return what this
    adds to the covector at the start of each step.  What is added by parameters and inputs, and
    to the objective, is gathered in ``way``, the last step first.

    By Gauss's quadrature with eight points a step, on the dense output.
    """
    if not weights or last <= first:
        return None
    sources = np.zeros((last - first, way.system.scene.width))
    for step in range(last - 1, first - 1, -1):
        end = stop if step == last - 1 else t[step + 1]
        sources[step - first], gained = _integral_step(way, run, t, step, end, weights)
        way.integrated = way.integrated + gained
    return sources


def _integral_step(
    way: Backwards, run: Any, t: Array, step: int, end: float, weights: Weights
) -> tuple[Array, Array]:
    width = way.system.scene.width
    part = end - t[step]
    points = t[step] + part * (POINTS + 0.5)
    y, columns = _within(way, run, t, step, points)
    by_state, along = way.objective.slopes(weights, y, points)
    share = part * WEIGHTS
    total = np.einsum("m,mi,mik->k", share, by_state, columns)
    way.objective.along += share @ along
    way.objective.value += float(share @ way.objective.at(weights, y, points))
    return total[:width], total[width:]
