"""Cost and conditions of a choice of the unknowns, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from mechc.optimal.intervals import (
    Interval,
    IntervalSlopes,
    differentiate,
    follow,
    parameter_directions,
)
from mechc.optimal.problem import LINEAR, Choice, Indices, OptimalProblem
from mechc.optimal.terms import Points, Slopes, Terms
from mechc.system.parameters import Array


@dataclass(frozen=True)
class Evaluation:
    """The motions of the intervals, and what follows from them.

    Attributes
    ----------
    cost
        The integral over the motions, and the cost at the end.
    rows
        Gaps between the intervals over the sizes, then the expressions bounded along the motion,
        and those at its end.
    """

    choice: Choice
    intervals: list[Interval]
    cost: float
    rows: Array

    @property
    def ends(self) -> Array:
        """The states at which the motions end (intervals, nx)."""
        return np.array([one.states[-1] for one in self.intervals], dtype=np.float64)


def evaluate(problem: OptimalProblem, x: Array) -> Evaluation:
    """Cost and rows at unknowns x (n,).

    Raises :class:`AssemblyError` where a motion does not exist.
    """
    choice = problem.read(x)
    intervals = follow(choice)
    ends = np.array([one.states[-1] for one in intervals])
    nodes, cost = choice.points_of_nodes(), 0.0
    last = nodes.take(slice(-1, None))
    if problem.integral.count:
        values = problem.integral.at(_inner(choice, intervals))[:, 0]
        weights = np.concatenate([one.weights for one in intervals])
        cost += float(weights @ values) * choice.length
    if problem.final.count:
        cost += float(problem.final.at(last)[0, 0])
    gaps = (ends - choice.nodes) / problem.unknowns.sizes_of_state
    parts = [gaps, problem.along.at(nodes), problem.end.at(last)]
    return Evaluation(choice, intervals, cost, np.concatenate([part.ravel() for part in parts]))


def _inner(choice: Choice, intervals: list[Interval]) -> Points:
    """The points of the quadrature."""
    k = np.repeat([one.k for one in intervals], [len(one.shares) for one in intervals])
    shares = np.concatenate([one.shares for one in intervals])
    y = np.tile(choice.y0, (len(shares), 1))
    if choice.problem.of_states:
        y = np.concatenate([one.states[:-1] for one in intervals])
    return choice.points(k, shares, y)


# -- derivatives ----------------------------------------------------------------------------------


class Entries(NamedTuple):
    """Rows, columns and values of a sparse matrix."""

    rows: Indices
    columns: Indices
    values: Array

    @classmethod
    def of(cls, first: int, columns: Indices, values: Array) -> Entries:
        """A full block (m, k) whose rows begin at ``first``."""
        rows = np.repeat(first + np.arange(len(values)), len(columns))
        return cls(rows, np.tile(columns, len(values)), values.ravel())


def slopes_of_evaluation(one: Evaluation) -> tuple[Array, csr_matrix]:
    """The derivatives of the cost (n,) and of the rows (rows, n).

    Raises :class:`MechcError` where a derivative does not exist.
    """
    choice, problem = one.choice, one.choice.problem
    each = [differentiate(choice, interval) for interval in one.intervals]
    along = _Along(choice, each)
    gradient = np.zeros(problem.unknowns.count)
    if problem.integral.count:
        _add_integral(gradient, one, along)
    nodes, count, nx = choice.points_of_nodes(), *choice.nodes.shape
    last = nodes.take(slice(-1, None))
    if problem.final.count:
        entries = along.entries(problem.final, last, count - 1, 0)
        np.add.at(gradient, entries.columns, entries.values)
    sizes, places = problem.unknowns.sizes_of_state, problem.unknowns.blocks["nodes"].ravel()
    parts = [Entries(np.arange(count * nx), places, np.tile(-1.0 / sizes, count))]
    for k, own in enumerate(each):
        parts.append(Entries.of(k * nx, own.places, own.columns[-1] / sizes[:, None]))
    first = count * nx
    for k in range(count if problem.along.count else 0):
        parts.append(along.entries(problem.along, nodes.take(slice(k, k + 1)), k, first))
        first += problem.along.count
    parts.append(along.entries(problem.end, last, count - 1, first))
    rows, columns, values = (np.concatenate(every) for every in zip(*parts, strict=True))
    shape = first + problem.end.count, len(gradient)
    return gradient, csr_matrix((values, (rows, columns)), shape=shape)


class _Along:
    """The chain rule of expressions: through states, and beside them through inputs, parameters,
    the start and the duration."""

    def __init__(self, choice: Choice, each: list[IntervalSlopes]) -> None:
        unknowns = choice.problem.unknowns
        self.choice, self.each, self.of_start = choice, each, each[0].of_start
        self.start = np.concatenate([unknowns.blocks["start"], unknowns.blocks["parameters"]])
        self.directions = parameter_directions(choice)

    def beside_state(self, slopes: Slopes, k: Indices, share: Array) -> Array:
        """Derivatives (points, m, samples + parameters + duration) at fixed states and shares."""
        choice, problem = self.choice, self.choice.problem
        inputs = [choice.model.system.inputs.index(n) for n in problem.unknowns.controls]
        by_inputs, weights = slopes.by_inputs[..., inputs], choice.input_values(k, share)[0]
        late = 1 + (problem.kind == LINEAR)
        parts = [by_inputs * weights[:, None, j, None] for j in range(late)]
        parts.append(slopes.by_parameters @ self.directions)
        if problem.unknowns.free:
            later = ((k + share) / len(choice.nodes))[:, None]
            parts.append((slopes.by_time * later + slopes.by_duration)[..., None])
        return np.concatenate(parts, axis=-1)

    def entries(self, terms: Terms, points: Points, k: int, first: int) -> Entries:
        """The derivatives of expressions at the end of interval k, in rows from ``first`` on."""
        slopes, blocks = terms.linear(points), self.choice.problem.unknowns.blocks
        beside = self.beside_state(slopes, np.array([k]), np.ones(1))
        own = self.each[k].places
        rest = own[len(own) - beside.shape[-1] :]
        local = [slopes.by_state[0], beside[0], slopes.by_start[0] @ self.of_start]
        places = np.concatenate([blocks["nodes"][k], rest, self.start])
        return Entries.of(first, places, np.hstack(local))


def _add_integral(gradient: Array, one: Evaluation, along: _Along) -> None:
    """Add the derivative of the integral of the running cost."""
    choice, integral = one.choice, one.choice.problem.integral
    slopes = integral.linear(_inner(choice, one.intervals))
    first = 0
    for interval, own in zip(one.intervals, along.each, strict=True):
        here = slice(first, first + len(interval.shares))
        k, weights = np.full(len(interval.shares), interval.k), interval.weights * choice.length
        part = Slopes(*(values[here] for values in slopes))
        beside = along.beside_state(part, k, interval.shares)[:, 0]
        local = np.zeros(len(own.places))
        local[len(local) - beside.shape[1] :] = weights @ beside
        if choice.problem.of_states:
            by_state = part.by_state[:, 0]
            local += np.einsum("n,ni,nik->k", weights, by_state, own.columns[:-1])
            local += choice.length * _of_jumps(choice, interval.k, own)
        if choice.problem.unknowns.free:
            local[-1] += interval.weights @ part.values[:, 0] / len(choice.nodes)
        np.add.at(gradient, own.places, local)
        np.add.at(gradient, along.start, weights @ part.by_start[:, 0] @ along.of_start)
        first = here.stop


def _of_jumps(choice: Choice, k: int, own: IntervalSlopes) -> Array:
    """The change of the integral as jumps of the state move."""
    total = np.zeros(len(own.places))
    for jump in own.jumps:
        both = np.array([jump.before, jump.after])
        at = choice.points(np.full(2, k), np.full(2, jump.share), both)
        before, after = choice.problem.integral.at(at)[:, 0]
        total += (before - after) * jump.moved
    return total
