"""Linkages drawn over the ranges of the unknowns, closed and followed, and what they come near to.

Input: a problem.  Output: the unknowns and configurations that a search begins with, the best
first.  All members are followed together by compiled code; none depends on another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import wrap
from mechc.synthesis.conditions import WEIGHT
from mechc.synthesis.problem import SWEEP, SynthesisProblem
from mechc.system.parameters import Array
from mechc.system.quantities import values_of

BLOCK = 512  # members followed at a time
KEPT = 8  # assemblies of one member among which one is taken
STARTS = 4  # driven values at which members that need not turn fully are assembled


@dataclass(frozen=True)
class Drawn:
    """Members that close: unknowns z (n, size), configurations q (n, positions, nq), cost (n,).

    ``tried``: how many were drawn.
    """

    z: Array
    q: Array
    cost: Array
    tried: int


def screen(problem: SynthesisProblem, count: int, seed: int, span: tuple[float, float]) -> Drawn:
    """The members of ``count`` drawn at random that close at all positions, best first.

    ``span``: the range of the driven coordinate within which positions are looked for.
    """
    share = np.random.default_rng(seed).random((count, len(problem.names)))
    x = problem.lower + share * (problem.upper - problem.lower)
    parts, block = [], min(BLOCK, -(-count // STARTS))
    for number, first in enumerate(range(0, count, block)):
        inside = 0.0 if problem.conditions.turns else (number % STARTS + 0.5) / STARTS
        start = span[0] + inside * (span[1] - span[0])
        members = x[first : first + block]
        parts.append(_near_targets(problem, members, *_curves(problem, members, start, span)))
    z, q, cost = (np.concatenate(each) for each in zip(*parts, strict=True))
    best = np.argsort(cost, kind="stable")
    best = best[np.isfinite(cost[best])]
    return Drawn(z[best], q[best], cost[best], count)


def _curves(
    problem: SynthesisProblem, x: Array, start: float, span: tuple[float, float]
) -> tuple[Array, Array, Array]:
    """Driven values (m,), the members' configurations (n, m, nq) and their cost of conditions (n,).

    NaN where a member does not close; one assembly of each, of several one after the other.
    """
    system, p = problem.system, problem.values(x)
    fixed = system.default_configurations(len(x), (*problem.kept, problem.driven))
    for name, value in {**problem.kept, problem.driven: start}.items():
        fixed[:, system.state_index(name)] = value
    done = problem.search.solve(problem.t, fixed, p, KEPT, tells_miss=False)
    member = np.arange(len(x))
    first = done.found[member, member % np.maximum(done.many, 1)]
    cost = np.zeros(len(x))
    steps = max(1, round(SWEEP * (span[1] - start) / (span[1] - span[0])))
    ahead = problem.sweep(np.linspace(start, span[1], steps + 1), first, p)
    if problem.conditions.turns:
        short = WEIGHT * problem.conditions.shortfalls(ahead.points)
        cost = np.where(problem.conditions.stops(ahead), np.inf, (short**2).sum(axis=(-1, -2)))
    if start == span[0]:
        return ahead.values, ahead.q, cost
    behind = problem.sweep(np.linspace(start, span[0], SWEEP - steps + 1), first, p)
    values = np.concatenate([behind.values[:0:-1], ahead.values])
    return values, np.concatenate([behind.q[:, :0:-1], ahead.q], axis=1), cost


def _near_targets(
    problem: SynthesisProblem, x: Array, values: Array, q: Array, cost: Array
) -> tuple[Array, Array, Array]:
    """Unknowns, configurations at the positions, and cost, infinite where one does not close."""
    p = problem.values(x)
    if problem.targets.driven is None:
        place = np.array([*_nearest(problem, x, q, p)])
        s = values[place]
        z, taken = np.hstack([x, s]), np.take_along_axis(q, place[:, :, None], axis=1)
    else:
        turns = s = problem.driven_values(x)
        if problem.system.angular[problem.place]:
            turns = values[0] + (s - values[0]) % (2 * np.pi)
        place = np.argmin(np.abs(turns[:, :, None] - values), axis=2)
        near = np.take_along_axis(q, place[:, :, None], axis=1)
        taken = problem.close(s, near, p)
        z = _with_zeros(problem, x.copy(), taken, p)
    apart = problem.deviations(z, taken, p) / problem.targets.tolerances
    total = (apart[:, problem.valid] ** 2).sum(axis=1) + cost
    return z, taken, np.where(np.isnan(total), np.inf, total)


def _nearest(problem: SynthesisProblem, x: Array, q: Array, p: Array) -> Iterator[Array]:
    """The places (n,) along its curve at which a member is nearest to each target."""
    targets = problem.targets
    at = problem.system, problem.states(q), p[:, None], problem.t
    found = values_of(targets.quantities, *at)
    for member, numbers in enumerate(found):
        apart = numbers[:, None, :] - targets.values
        for column, zero in enumerate(problem.zeros):
            if zero is not None:
                apart[..., column] -= x[member, zero]
        apart[..., targets.angular] = wrap(apart[..., targets.angular])
        far = np.where(problem.valid, apart / targets.tolerances, 0.0)
        square = (far**2).sum(axis=-1)
        yield np.argmin(np.where(np.isnan(square), np.inf, square), axis=0)


def _with_zeros(problem: SynthesisProblem, x: Array, q: Array, p: Array) -> Array:
    """Unknowns (n, k) with the zeros at which the deviations of their targets are least."""
    apart = problem.deviations(x, q, p)
    for column, zero in enumerate(problem.zeros):
        if zero is not None:
            numbers = apart[..., column]
            mean = numbers[:, problem.valid[:, column]].mean(axis=1)
            if problem.targets.angular[column]:
                mean = np.angle(np.nansum(np.exp(1j * numbers), axis=1))
            x[:, zero] = np.clip(x[:, zero] + mean, problem.lower[zero], problem.upper[zero])
    return x
