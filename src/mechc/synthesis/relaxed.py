"""Linkages that may open while they come near to their targets, many at once.

Levenberg and Marquardt's method over the unknowns and all coordinates at all positions, in which
the gaps of the loops are residuals beside the deviations.  With loops that stay closed the same
method ends in local minima far more often: of 300 four-bars drawn for nine points none reached
them, of 1600 with loops that may open seven did.  The coordinates of a position occur in its own
residuals alone, and are eliminated first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.assembly.sizes import sizes_of_members
from mechc.synthesis.problem import SynthesisProblem
from mechc.synthesis.screening import Drawn
from mechc.system.parameters import Array

STEPS = 30  # between two selections: the cost of earlier ones tells little of where they end
SHARE = 0.6  # of the members that go on after one
GAP = 2.0  # factor of the gaps, in units of what a radian or the length changes them by
DAMPING = 1e-2  # at first, of the diagonal of the normal equations
FASTER, SLOWER = 0.3, 4.0  # factors of the damping after a step that is taken, or not
BLOCK = 4096  # positions computed at a time


@dataclass
class _OpenLinkages:
    """Parameters and zeros x (n, k), configurations q (n, positions, nq), cost and damping (n,)."""

    x: Array
    q: Array
    cost: Array
    damping: Array

    def take(self, places: Any) -> _OpenLinkages:
        return _OpenLinkages(
            self.x[places], self.q[places], self.cost[places], self.damping[places]
        )


def relax(problem: SynthesisProblem, drawn: Drawn, most: int) -> Drawn:
    """The ``most`` best members after steps in which the others were left out.

    Their loops are closed again, at the nearest configurations.
    """
    x, q = drawn.z[:, : len(problem.names)].copy(), drawn.q.copy()
    at = _OpenLinkages(x, q, np.full(len(x), np.inf), np.full(len(x), DAMPING))
    while True:
        size = max(1, BLOCK // problem.targets.count)
        for first in range(0, len(at.x), size):
            block = at.take(np.arange(first, min(first + size, len(at.x))))
            _descend(problem, block)
            for name in ("x", "q", "cost", "damping"):
                getattr(at, name)[first : first + size] = getattr(block, name)
        finished = len(at.x) <= most
        at = at.take(_promising(problem, at)[: max(most, int(SHARE * len(at.x)))])
        if finished:
            return _with_closed_loops(problem, at)


def _promising(problem: SynthesisProblem, at: _OpenLinkages) -> Any:
    """The places of the members, the best first; last those that several bounds hold.

    A four-bar whose coupler and ground vanish has its crank's end wherever it should be: many
    members end at the bounds beside it.
    """
    held = ((at.x <= problem.lower) | (at.x >= problem.upper)).sum(axis=1)
    return np.lexsort((at.cost, held > 1))


def _with_closed_loops(problem: SynthesisProblem, at: _OpenLinkages) -> Drawn:
    """Members with closed loops; those that do not close are left out."""
    s = at.q[..., problem.place]
    z = at.x if problem.timed else np.hstack([at.x, s])
    p = problem.values(at.x)
    q = problem.close(problem.driven_values(z), at.q, p)
    apart = (problem.deviations(z, q, p) / problem.targets.tolerances)[:, problem.valid]
    cost = (apart**2).sum(axis=1)
    best = np.argsort(cost, kind="stable")
    best = best[np.isfinite(cost[best])]
    return Drawn(z[best], q[best], cost[best], len(z))


def _descend(problem: SynthesisProblem, at: _OpenLinkages) -> None:
    """Take steps with all members, in place."""
    residuals = _residuals(problem, at.x, at.q)
    at.cost = (residuals**2).sum(axis=(1, 2))
    for _ in range(STEPS):
        x, moved = _steps(problem, at, residuals)
        q = at.q.copy()
        q[..., _places(problem)] += moved
        if problem.timed:
            q[..., problem.place] = problem.driven_values(x)
        trial = _residuals(problem, x, q)
        cost = (trial**2).sum(axis=(1, 2))
        better = cost < at.cost
        at.damping = np.clip(at.damping * np.where(better, FASTER, SLOWER), 1e-12, 1e6)
        for mine, new in ((at.x, x), (at.q, q), (at.cost, cost), (residuals, trial)):
            mine[better] = new[better]


def _places(problem: SynthesisProblem) -> Array:
    """The coordinates that are unknown at every position."""
    free = [int(i) for i in problem.search.free]
    return np.array(free if problem.timed else [*free, problem.place])


def _residuals(problem: SynthesisProblem, x: Array, q: Array) -> Array:
    """Deviations over tolerances, and gaps over the sizes of their rows, (n, positions, r)."""
    p = problem.values(x)
    apart = np.where(problem.valid, problem.deviations(x, q, p), 0.0) / problem.targets.tolerances
    gaps = problem.system.constraints(problem.states(q), p[:, None], problem.t)
    return np.concatenate([apart, gaps / _sizes(problem, p)[:, None]], axis=2)


def _sizes(problem: SynthesisProblem, p: Array) -> Array:
    return sizes_of_members(problem.system, p, problem.t).rows / GAP


def _steps(problem: SynthesisProblem, at: _OpenLinkages, residuals: Array) -> tuple[Array, Array]:
    """Unknowns (n, k) after a damped step, and steps of the coordinates (n, positions, w).

    Unknowns at a bound that they would leave stay there.
    """
    by_x, by_q = _slopes(problem, at.x, at.q)
    damping = at.damping[:, None]
    inner = np.einsum("npra,nprb->npab", by_q, by_q)
    _damp(inner, damping[:, :, None])
    mixed = np.einsum("npra,nprk->npak", by_q, by_x)
    right = np.einsum("npra,npr->npa", by_q, residuals)
    solved = np.linalg.solve(inner, np.concatenate([mixed, right[..., None]], axis=-1))
    normal = np.einsum("nprk,nprl->nkl", by_x, by_x)
    _damp(normal, damping)
    normal -= np.einsum("npak,npal->nkl", mixed, solved[..., :-1])
    gradient = np.einsum("nprk,npr->nk", by_x, residuals)
    held = ((at.x <= problem.lower) & (gradient > 0.0)) | ((at.x >= problem.upper) & (gradient < 0))
    gradient -= np.einsum("npak,npa->nk", mixed, solved[..., -1])
    normal[held] = 0.0
    normal.transpose(0, 2, 1)[held] = 0.0
    np.einsum("nkk->nk", normal)[held] = 1.0
    step = -np.linalg.solve(normal, np.where(held, 0.0, gradient)[..., None])[..., 0]
    x = np.clip(at.x + step, problem.lower, problem.upper)
    moved = -solved[..., -1] - np.einsum("npak,nk->npa", solved[..., :-1], x - at.x)
    return x, moved


def _damp(normal: Array, damping: Array) -> None:
    """Add the damping to the diagonals, in place; of what changes nothing it is 1."""
    diagonal = np.einsum("...kk->...k", normal)
    diagonal += np.where(diagonal > 0.0, damping * diagonal, 1.0)


def _slopes(problem: SynthesisProblem, x: Array, q: Array) -> tuple[Array, Array]:
    """Derivatives of the residuals by the unknowns (n, positions, r, k) and the coordinates."""
    p = problem.values(x)
    by_x, by_q, gap_x, gap_q = problem.slopes(p, q, problem.targets.quantities)
    scale = np.where(problem.valid, 1.0 / problem.targets.tolerances, 0.0)[..., None]
    rows = _sizes(problem, p)[:, None, :, None]
    whole_x = np.concatenate([scale * by_x, gap_x / rows], axis=2)
    whole_q = np.concatenate([scale * by_q, gap_q / rows], axis=2)
    if problem.timed and problem.driven_zero is not None:
        whole_x[..., problem.driven_zero] += whole_q[..., problem.place]
    return whole_x, whole_q[..., _places(problem)]
