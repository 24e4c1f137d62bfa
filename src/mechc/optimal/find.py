"""Motions for a cost: searches from one or several first values, the best of their ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechc.assembly.closed import Retraction
from mechc.errors import AssemblyError, MechcError
from mechc.optimal.problem import Choice, OptimalProblem
from mechc.optimal.question import Question, read_problem
from mechc.optimal.result import Optimum
from mechc.optimal.solvers import SearchEnd, SearchSettings, minimise
from mechc.questions.unknowns import spread
from mechc.system.parameters import Array


def optimise(model: Any, asked: Question, begin: str, search: SearchSettings) -> Optimum:
    """See :meth:`mechc.Model.optimise`."""
    problem, first = read_problem(model, asked)
    ends: list[SearchEnd] = []
    failure: AssemblyError | None = None
    for number, x in enumerate(_beginnings(problem, first, search)):
        try:
            begun, x = _with_nodes(problem, x, begin)
            ends.append(minimise(begun, x, search))
        except AssemblyError as error:
            failure = failure or error
        except MechcError:  # no derivative where it begins: other starts may have them
            if not number:
                raise
    if not ends:
        raise AssemblyError(
            f"there is no motion to begin with: {failure}. Give other first values (y0, params, "
            "inputs), guess=, begin='line' or begin='motion', or several starts"
        )
    ends.sort(key=lambda end: end.rank)
    return Optimum(ends[0], search.solver, ends)


def _beginnings(problem: OptimalProblem, first: Array, search: SearchSettings) -> list[Array]:
    """First values, and others spread between finite bounds; each input has one level."""
    unknowns, blocks = problem.unknowns, problem.unknowns.blocks
    single = [blocks[name][:, None] for name in ("parameters", "start", "duration")]
    groups = [*blocks["controls"].T, *np.concatenate(single)]
    finite = np.isfinite(unknowns.upper - unknowns.lower)
    groups = [group for group in groups if finite[group].all()]
    found, places = [first], [group[0] for group in groups]
    if search.starts > 1 and groups:
        ends = unknowns.lower[places], unknowns.upper[places]
        for levels in spread(*ends, search.starts - 1, search.seed):
            found.append(first.copy())
            for group, level in zip(groups, levels, strict=True):
                found[-1][group] = level
    return found


def _with_nodes(problem: OptimalProblem, x: Array, begin: str) -> tuple[OptimalProblem, Array]:
    """The problem with its retractions, and x with states on the first motion, or on a line.

    Raises :class:`AssemblyError` where there are no such states.
    """
    choice, nodes, unknowns = problem.read(x), problem.unknowns.blocks["nodes"], problem.unknowns
    known = {i: float(x[place]) for i, place in enumerate(nodes[-1])
             if unknowns.upper[place] == unknowns.lower[place]}  # fmt: skip
    straight = begin == "line" or (begin == "auto" and known and not problem.run["events"])
    states = _line(choice, known) if straight else _motion(choice)
    x = x.copy()
    x[nodes] = states
    counts = dict.fromkeys(problem.counts, 0)
    at = choice.model.system, states[:-1], choice.p, choice.times[1:-1]
    retraction = Retraction.at(*at) if len(states) > 1 else problem.retraction
    problem = replace(problem, retraction=retraction, counts=counts)
    return problem, np.clip(x, unknowns.lower, unknowns.upper)


def _motion(choice: Choice) -> Array:
    """States at the ends of the intervals, on the motion with the first values."""
    span = float(choice.times[0]), float(choice.times[-1])
    sol = choice.model.simulate(span, choice.y0, choice.params, **choice.problem.run)
    if not sol.status.ok or sol.span[1] != span[1]:
        raise AssemblyError(f"it does not reach its end: {sol.status.headline}")
    return np.vstack([sol(choice.times[1:-1]), sol.record.ends()[1][1]])


def _line(choice: Choice, last: Mapping[int, float]) -> Array:
    """States (intervals, nx) on a line from the first one to those components that are known at
    the end, with closed loops."""
    first, places, count = choice.y0, list(last), choice.problem.unknowns.nodes
    share = np.arange(1, count + 1)[:, None] / count
    states = np.tile(first, (count, 1))
    states[:, places] += share * (np.array([*last.values()]) - first[places])
    model, before = choice.model, first
    names, nq = (*model.coordinates, *model.speeds), len(model.coordinates)
    for k, y in enumerate(states if model.system.scene.rows else ()):
        rest, speeds = model.coordinates_and_speeds({names[i]: float(y[i]) for i in places})
        near = {n: float(before[i]) for i, n in enumerate(names[:nq]) if n not in rest}
        t = float(choice.times[k + 1])
        before = states[k] = model.assemble(rest, speeds, near, choice.params, t)
    return states
