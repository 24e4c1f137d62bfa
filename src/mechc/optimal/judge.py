"""Judges the motion that a search found: its cost, its bounds between nodes, what it misses."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.optimal.evaluate import Evaluation
from mechc.optimal.intervals import POINTS, WEIGHTS
from mechc.system.parameters import Array

EXCESS = 1e-6  # of the sizes: bounds that are exceeded by less hold
AMID = 8  # panels of the quadrature between two breaks


def cost_along(result: Any) -> float:
    """The cost along the whole motion, by quadrature at many points."""
    problem, edges, total = result.problem, _panels(result), 0.0
    if problem.integral.count:
        wide = np.diff(edges)[:, None]
        times = edges[:-1, None] + wide * 0.5 * (POINTS + 1.0)
        values = problem.integral.at(result.points(times.ravel()))
        total += float((wide * 0.5 * WEIGHTS).ravel() @ values[:, 0])
    if problem.final.count:
        total += float(problem.final.at(result.points(edges[-1:]))[0, 0])
    return total


def exceeded_bounds(result: Any) -> dict[str, tuple[float, float]]:
    """Name or expression -> by how much the whole motion exceeds its bounds, and when, s."""
    problem, unknowns, times = result.problem, result.problem.unknowns, _panels(result)
    points, m = result.points(times), problem.along.count
    values = np.hstack([points.y, problem.along.at(points)])
    nodes, gaps = unknowns.blocks["nodes"][0], unknowns.blocks["nodes"].size
    lower = np.concatenate([unknowns.lower[nodes], problem.lower[:m]])
    upper = np.concatenate([unknowns.upper[nodes], problem.upper[:m]])
    size = np.concatenate([unknowns.size[nodes], problem.row_sizes()[gaps : gaps + m]])
    if unknowns.nodes == 1:  # its bounds are those at the end
        lower[: len(nodes)], upper[: len(nodes)] = -np.inf, np.inf
    beyond = np.maximum(lower - values, values - upper)
    names = (*problem.system.coordinates, *problem.system.speeds, *problem.along.titles)
    worst = zip(names, beyond.argmax(axis=0), beyond.max(axis=0), size, strict=True)
    return {name: (float(most), float(times[k])) for name, k, most, unit in worst
            if most > EXCESS * unit}  # fmt: skip


def missed_most(at: Evaluation) -> str:
    """The condition that is missed most, in words."""
    problem = at.choice.problem
    lower, upper = problem.row_bounds()
    missed = np.maximum(lower - at.rows, at.rows - upper) / problem.row_sizes()
    row, (count, width) = int(missed.argmax()), problem.unknowns.blocks["nodes"].shape
    if row >= count * width:
        every = problem.along.titles * count + problem.end.titles
        return str(every[row - count * width])
    k, i = divmod(row, width)
    name = (*problem.system.coordinates, *problem.system.speeds)[i]
    return f"{name}, in which motions do not meet at t = {at.choice.times[k + 1]:.6g} s"


def _panels(result: Any) -> Array:
    """Times (n,) with all breaks, and many between them."""
    sol, driven = result.solution, result.solution.system.driven
    kinks = driven.breaks(*sol.span, result.problem.run["rtol"]) if driven else []
    edges = np.unique([*result.nodes[0], *(part.t0 for part in sol.segments), *kinks])
    places = np.arange((len(edges) - 1) * AMID + 1) / AMID
    return np.asarray(np.interp(places, np.arange(len(edges)), edges))
