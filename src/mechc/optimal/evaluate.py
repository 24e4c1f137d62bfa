"""Cost and conditions of a choice of the unknowns, and their derivatives."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from mechc.optimal.problem import LINEAR, Indices, OptimalProblem
from mechc.optimal.segments import parameter_directions
from mechc.optimal.terms import Points, Slopes, Terms
from mechc.system.parameters import Array


class Evaluation:
    """Cost and rows of conditions at unknowns x (n,), and their derivatives."""

    def __init__(self, problem: OptimalProblem, x: Array) -> None:
        self.problem, self.x = problem, x.copy()
        self.choice = problem.read(self.x)

    @cached_property
    def cost(self) -> float:
        """The integral over the motions of the intervals, and the cost at the end."""
        total, choice = 0.0, self.choice
        if self.problem.integral.count:
            values = self.problem.integral.at(self._inner)[:, 0]
            total += float(self._weights @ values) * choice.duration / len(choice.nodes)
        if self.problem.final.count:
            total += float(self.problem.final.at(self._last)[0, 0])
        return total

    @cached_property
    def rows(self) -> Array:
        """Gaps between the intervals over the sizes, then the expressions bounded along the motion,
        and those at its end."""
        choice, problem = self.choice, self.problem
        gaps = (choice.ends - choice.nodes) / self._sizes
        parts = [gaps.ravel(), problem.along.at(self._nodes).ravel()]
        return np.concatenate([*parts, problem.end.at(self._last).ravel()])

    @cached_property
    def gradient(self) -> Array:
        """The derivative of the cost (n,)."""
        found, choice, problem = np.zeros(len(self.x)), self.choice, self.problem
        if problem.integral.count:
            self._add_integral(found)
        if problem.final.count:
            last = len(choice.nodes) - 1
            _, columns, values = self._entries(problem.final, self._last, last)
            np.add.at(found, columns, values)
        return found

    @cached_property
    def jacobian(self) -> csr_matrix:
        """The derivative of the rows (rows, n)."""
        problem, nodes = self.problem, self.problem.unknowns.blocks["nodes"]
        count, nx = nodes.shape
        parts = [(np.arange(count * nx), nodes.ravel(), np.tile(-1.0 / self._sizes, count))]
        for k, one in enumerate(self.choice.segments):
            local = one.columns[-1] / self._sizes[:, None]
            rows = np.repeat(k * nx + np.arange(nx), local.shape[1])
            parts.append((rows, np.tile(one.places, nx), local.ravel()))
        first = count * nx
        for k in range(count if problem.along.count else 0):
            rows, columns, values = self._entries(problem.along, self._node(k), k)
            parts.append((rows + first, columns, values))
            first += problem.along.count
        rows, columns, values = self._entries(problem.end, self._last, count - 1)
        parts.append((rows + first, columns, values))
        rows, columns, values = (np.concatenate(each) for each in zip(*parts, strict=True))
        shape = first + problem.end.count, len(self.x)
        return csr_matrix((values, (rows, columns)), shape=shape)

    # -- points of expressions --------------------------------------------------------------------

    @property
    def _sizes(self) -> Array:
        return self.problem.unknowns.sizes_of_state

    @cached_property
    def _nodes(self) -> Points:
        """The ends of all intervals."""
        count = len(self.choice.nodes)
        return self.choice.points(np.arange(count), np.ones(count), self.choice.nodes)

    def _node(self, k: int) -> Points:
        return self.choice.points(np.array([k]), np.ones(1), self.choice.nodes[k : k + 1])

    @cached_property
    def _last(self) -> Points:
        return self._node(len(self.choice.nodes) - 1)

    @cached_property
    def _places(self) -> tuple[Indices, Array]:
        """Interval and share of every point of the quadrature."""
        each = self.choice.segments
        which = [np.full(len(one.quadrature[0]), k) for k, one in enumerate(each)]
        return np.concatenate(which), np.concatenate([one.quadrature[0] for one in each])

    @cached_property
    def _weights(self) -> Array:
        return np.concatenate([one.quadrature[1] for one in self.choice.segments])

    @cached_property
    def _inner(self) -> Points:
        """The points of the quadrature."""
        if self.problem.integral.contains("state"):
            y = np.concatenate([one.states[:-1] for one in self.choice.segments])
        else:
            y = np.tile(self.choice.first[1], (len(self._places[0]), 1))
        return self.choice.points(*self._places, y)

    # -- derivatives ------------------------------------------------------------------------------

    @cached_property
    def _directions(self) -> Array:
        return parameter_directions(self.choice)

    @cached_property
    def _start(self) -> tuple[Indices, Array]:
        """Places in x of what the start depends on, and its derivatives by these (nx, k)."""
        unknowns, first = self.problem.unknowns, self.choice.segments[0]
        places = np.concatenate([unknowns.blocks["start"], unknowns.blocks["parameters"]])
        return places, first.start_columns

    def _beside_state(self, slopes: Slopes, k: Indices, share: Array) -> Array:
        """Derivatives (points, m, samples + parameters + duration) at fixed states and shares."""
        choice, problem = self.choice, self.problem
        inputs = [choice.model.system.inputs.index(n) for n in problem.unknowns.controls]
        by_inputs, weights = slopes.by_inputs[..., inputs], choice.input_values(k, share)[0]
        late = 1 + (problem.kind == LINEAR)
        parts = [by_inputs * weights[:, None, j, None] for j in range(late)]
        parts.append(slopes.by_parameters @ self._directions)
        if problem.unknowns.free:
            later = ((k + share) / len(choice.nodes))[:, None]
            parts.append((slopes.by_time * later + slopes.by_duration)[..., None])
        return np.concatenate(parts, axis=-1)

    def _entries(self, terms: Terms, points: Points, k: int) -> tuple[Any, Any, Any]:
        """Rows, columns and values of the derivatives of expressions at the end of interval k."""
        slopes, blocks = terms.linear(points), self.problem.unknowns.blocks
        beside = self._beside_state(slopes, np.array([k]), np.ones(1))
        local = np.concatenate([slopes.by_state, beside], axis=-1)[0]
        own = self.choice.segments[k].places
        rest = own[len(own) - beside.shape[-1] :]
        places, of_start = self._start
        places = np.concatenate([blocks["nodes"][k], rest, places])
        local = np.hstack([local, slopes.by_start[0] @ of_start])
        rows = np.repeat(np.arange(len(local)), local.shape[1])
        return rows, np.tile(places, len(local)), local.ravel()

    def _add_integral(self, found: Array) -> None:
        """Add the derivative of the integral of the running cost."""
        choice, problem = self.choice, self.problem
        slopes = problem.integral.linear(self._inner)
        k, share = self._places
        beside = self._beside_state(slopes, k, share)[:, 0]
        length, first = choice.duration / len(choice.nodes), 0
        for one in choice.segments:
            here = slice(first, first + len(one.quadrature[0]))
            weights = self._weights[here] * length
            local = np.zeros(len(one.places))
            local[len(local) - beside.shape[1] :] = weights @ beside[here]
            if one.states.shape[0] > 1:
                local += np.einsum("n,ni,nik->k", weights, slopes.by_state[here, 0],
                                   one.columns[:-1])  # fmt: skip
                local += length * self._of_leaps(one)
            if problem.unknowns.free:
                local[-1] += self._weights[here] @ slopes.values[here, 0] / len(choice.nodes)
            np.add.at(found, one.places, local)
            places, of_start = self._start
            np.add.at(found, places, weights @ slopes.by_start[here, 0] @ of_start)
            first = here.stop

    def _of_leaps(self, one: Any) -> Array:
        """The change of the integral as jumps of the state move."""
        total = np.zeros(len(one.places))
        for leap in one.leaps:
            both = np.array([leap.before, leap.after])
            at = self.choice.points(np.full(2, one.k), np.full(2, leap.share), both)
            before, after = self.problem.integral.at(at)[:, 0]
            total += (before - after) * leap.moved
        return total
