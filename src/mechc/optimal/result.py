"""The answer of a search for a motion, with its report and its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mechc.inputs.signals import Signal
from mechc.optimal.judge import cost_along, exceeded_bounds, missed_most
from mechc.optimal.report import draw_optimum, in_words
from mechc.optimal.solvers import SearchEnd
from mechc.optimal.terms import Points, read_terms
from mechc.results.answer import Answer, finite
from mechc.system.parameters import Array

AT_BOUND = 1e-4  # of the sizes: nearer to a bound a value lies at it


class Optimum(Answer):
    """The motion with the least cost that was found.

    Attributes
    ----------
    cost
        As the search has it, of the motions of the intervals.
    converged, message, violation
        Whether a minimum was found, how the search ended, and by how much the worst condition is
        missed, over the sizes.
    solver, iterations, seconds, motions, derivatives
        What searched, and what it took: motions of one interval, and those with derivatives.
    ends
        The cost that each of the ``starts`` led to, and whether it converged; the best first.
    """

    def __init__(self, ended: SearchEnd, solver: str, ends: Sequence[SearchEnd]) -> None:
        self.evaluation, self.choice, self.solver = (
            ended.evaluation,
            ended.evaluation.choice,
            solver,
        )
        self.problem, self.x, self.cost = self.choice.problem, ended.x, ended.cost
        self.model = self.problem.model
        self.violation, self.converged, self.message = ended[2:5]
        self.iterations, self.seconds = ended[5:]
        self.motions, self.derivatives = self.problem.counts.values()
        self.ends = tuple((one.cost, one.converged) for one in ends)

    @property
    def duration(self) -> float:
        """Duration of the motion, s."""
        return self.choice.duration

    @property
    def values(self) -> dict[str, float]:
        """The duration, parameters, and coordinates and speeds of the start, that were found."""
        unknowns, given = self.problem.unknowns, self.choice.given
        found = {"duration": self.duration} if unknowns.free else {}
        every = (*unknowns.parameters, *unknowns.start)
        return found | {one.name: given.values_of(one.kind)[one.name] for one in every}

    @property
    def signals(self) -> Mapping[str, Signal]:
        """The inputs that were found."""
        return self.choice.signals

    @property
    def inputs(self) -> dict[str, Any]:
        """All inputs, as ``simulate`` takes them."""
        return dict(self.choice.given.inputs)

    @property
    def params(self) -> dict[str, Any]:
        """The parameters, as ``simulate`` takes them."""
        return dict(self.choice.params)

    @property
    def y0(self) -> Array:
        """The start (nq + nu,)."""
        return self.choice.y0

    @property
    def nodes(self) -> tuple[Array, Array]:
        """Times (n + 1,) and states (n + 1, nq + nu) at the ends of the intervals."""
        return self.choice.times, np.vstack([self.y0, self.evaluation.ends])

    @cached_property
    def solution(self) -> Any:
        """The whole motion with what was found, as ``simulate`` gives it."""
        return self.simulate()

    @property
    def run(self) -> dict[str, Any]:
        """See :attr:`Answer.run`."""
        span = float(self.choice.times[0]), float(self.choice.times[-1])
        return {"t_span": span, "inputs": self.inputs or None, **self.problem.run}

    def to_json(self) -> Mapping[str, Any]:
        """Numbers and words as JSON data."""
        signals = {n: {"t": s.times.tolist(), "values": s.values.tolist()}
                   for n, s in self.signals.items()}  # fmt: skip
        found: Mapping[str, Any] = finite({
            "cost": self.cost, "duration": self.duration, "values": self.values,
            "signals": signals, "y0": self.y0.tolist(), "violation": self.violation,
            "converged": self.converged, "message": self.message, "iterations": self.iterations,
        })  # fmt: skip
        return found

    def along(self, *expressions: Any, t: Any = None) -> Array:
        """Expressions as of a cost along ``solution``, at times (nt,) in s: (nt, n).

        ``found.along("F", "F*v", t=np.linspace(0, found.duration))``; by default at the steps.

        Raises as :meth:`mechc.Model.optimise` for expressions that there cannot be.
        """
        terms = read_terms(self.problem.system, expressions)[1]
        times = self.solution.t if t is None else np.atleast_1d(np.asarray(t, dtype=np.float64))
        return terms.at(self.points(times))

    def points(self, times: Array) -> Points:
        """Points (nt,) of ``solution`` where expressions are evaluated, at times (nt,) in s."""
        choice = self.choice
        passed = (times - choice.times[0]) * (len(choice.nodes) / choice.duration)
        k = np.clip(passed.astype(np.intp), 0, len(choice.nodes) - 1)
        return choice.points(k, np.clip(passed - k, 0.0, 1.0), self.solution(times))

    @cached_property
    def cost_of_solution(self) -> float:
        """The cost along ``solution``, by quadrature at eight times as many points."""
        return cost_along(self)

    @cached_property
    def excess(self) -> dict[str, tuple[float, float]]:
        """The bounds along the motion that ``solution`` exceeds, which are held at the ends of
        intervals alone: name or expression -> by how much, and when, s."""
        return exceeded_bounds(self)

    @property
    def worst(self) -> str:
        """The condition that is missed most, in words."""
        return missed_most(self.evaluation)

    @property
    def deviation(self) -> float:
        """The largest difference of ``solution`` from the motions of the intervals, over the
        sizes: what the gaps between them grow to over the whole motion."""
        sol, (times, states) = self.solution, self.nodes
        if sol.span[1] < times[-1]:
            return np.inf
        whole = np.vstack([sol(times[1:-1]), sol.record.ends()[1][1]])
        return float(np.abs((whole - states[1:]) / self.problem.unknowns.sizes_of_state).max())

    @property
    def active(self) -> dict[str, str]:
        """The conditions that hold a value at its bound: name -> which bound, and how often."""
        unknowns, blocks = self.problem.unknowns, self.problem.unknowns.blocks
        model, m = self.problem.model, self.problem.along.count
        rows, (lower, upper) = self.evaluation.rows, self.problem.row_bounds()
        first = blocks["nodes"].size
        groups = [(n, blocks["controls"][:, k]) for k, n in enumerate(unknowns.controls)]
        for block in ("parameters", "start"):
            ones = zip(getattr(unknowns, block), blocks[block], strict=True)
            groups += [(one.name, place[None]) for one, place in ones]
        groups += [("duration", blocks["duration"])] * unknowns.free
        names = (*model.coordinates, *model.speeds)
        groups += [(n, blocks["nodes"][:-1, i]) for i, n in enumerate(names)]
        found = {}
        for name, places in groups:
            each = self.x[places], unknowns.lower[places], unknowns.upper[places]
            found[name] = _at_bounds(*each, unknowns.size[places])
        for j, title in enumerate(self.problem.along.titles):
            here = slice(first + j, first + m * unknowns.nodes, m)
            each = rows[here], lower[here], upper[here]
            found[title] = _at_bounds(*each, self.problem.row_sizes()[here])
        return {name: told for name, told in found.items() if told}

    def plot(self, *names: Any) -> Any:
        """Inputs that were found over the time, with their bounds, and coordinates or other
        expressions, in one matplotlib figure."""
        return draw_optimum(self, names)

    def __str__(self) -> str:
        return in_words(self)

    def __repr__(self) -> str:
        return f"<mechc.Optimum of {self.problem.model.name}: cost {self.cost:.6g}>"


def _at_bounds(values: Array, lower: Array, upper: Array, size: Array) -> str:
    """Which bounds values lie at, and how many; empty where there is none."""
    told = []
    for which, bound in (("lower", lower), ("upper", upper)):
        at = np.isfinite(bound) & (np.abs(values - bound) < AT_BOUND * size)
        if at.any():
            often = "" if len(values) == 1 else f", {at.sum()} of {len(values)}"
            told.append(f"at its {which} bound {bound[at][0]:.6g}{often}")
    return "; ".join(told)
