"""The search for linkages: many are drawn, the best refined by least squares, and judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.assembly.closer import wrap
from mechc.questions.unknowns import within
from mechc.synthesis.conditions import MET, WEIGHT, transmission_angle
from mechc.synthesis.problem import SWEEP, SynthesisProblem
from mechc.synthesis.relaxed import relax
from mechc.synthesis.screening import Drawn, screen
from mechc.system.parameters import Array

CURVE = 180  # steps of the sweep of a design
EVALUATIONS = 200  # of one search
ROUNDS, HEAVIER = 3, 30.0  # searches with ever heavier conditions while these are not met
ALIKE = 1e-4  # of the ranges: designs that differ by less are one
SAME_PLACE = 1e-6  # rad, or of the extent: configurations that are one


@dataclass(frozen=True)
class Effort:
    """How many linkages are drawn, refined and kept; when a refinement ends; the seed."""

    samples: int
    refined: int
    most: int
    tol: float
    seed: int
    span: tuple[float, float]


@dataclass(frozen=True)
class Candidate:
    """One linkage: unknowns, configurations at the positions, cost, and which conditions it misses.

    ``broken``: in words; ``sweep``: its assembly, from the first position on; ``values``: of the
    driven coordinate at the positions, as they are passed.
    """

    z: Array
    q: Array
    cost: float
    broken: tuple[str, ...]
    sweep: Any
    values: Array


def search(
    problem: SynthesisProblem, settings: Effort, report: Callable[[float, str], None]
) -> tuple[Drawn, list[Candidate]]:
    """All members that close, and the designs, the best first.

    Designs that meet all conditions come first; then the others, by cost.
    """
    report(0.0, "closing linkages")
    drawn = screen(problem, settings.samples, settings.seed, settings.span)
    report(0.2, f"{len(drawn.z)} of {drawn.tried} close")
    begin = _beginnings(problem, drawn, settings.refined)
    ends: list[Candidate] = []
    for k, (z, q) in enumerate(begin):
        ends.append(refine(problem, z, q, settings.tol))
        report(0.5 + 0.5 * (k + 1) / len(begin), f"cost {min(end.cost for end in ends):.6g}")
    return drawn, _distinct(problem, ends)[: settings.most]


def _beginnings(problem: SynthesisProblem, drawn: Drawn, count: int) -> list[tuple[Array, Array]]:
    """Unknowns and configurations to refine: half from members that were relaxed, then others."""
    near = relax(problem, drawn, 2 * count) if len(drawn.z) else drawn
    ends = [Candidate(z, q, *judge(problem, z, q)) for z, q in zip(near.z, near.q, strict=True)]
    found = [(end.z, end.q) for end in _distinct(problem, ends)[: count - count // 2]]
    return [*found, *zip(drawn.z[: count - len(found)], drawn.q, strict=False)]


def _distinct(problem: SynthesisProblem, ends: list[Candidate]) -> list[Candidate]:
    """The designs that differ, those that meet all conditions first, then by cost."""
    kept: list[Candidate] = []
    width, size = problem.upper - problem.lower, len(problem.names)
    for end in sorted(ends, key=lambda end: (bool(end.broken), end.cost)):
        apart = [np.abs((end.z - one.z)[:size] / width).max() for one in kept]
        if np.isfinite(end.cost) and (not kept or min(apart) > ALIKE):
            kept.append(end)
    return kept


class _Descent:
    """Residuals and their Jacobian for SciPy: one linkage, whose configurations go on from those
    of the last unknowns that were accepted."""

    def __init__(self, problem: SynthesisProblem, z: Array, q: Array, weight: float) -> None:
        self.problem, self.weight, self.near = problem, weight, q[None]
        self.grid, self.anchor = np.zeros(0), q[:1]
        if problem.conditions.swept:
            s = problem.driven_values(z[None])[0]
            way = _passage(problem, s)
            self.grid = s[way.first] + way.side * np.linspace(0.0, way.reach, SWEEP + 1)
            self.anchor = q[[way.first]]
        self.residuals(z)

    def residuals(self, z: Array) -> Array:
        given = z[None].copy(), self.near, self.grid, self.anchor, self.weight
        self.at = self.problem.residuals(*given)
        return np.asarray(self.at.values[0])

    def jacobian(self, z: Array) -> Array:
        if not np.array_equal(z, self.at.z[0]):
            self.residuals(z)
        self.near = self.at.q
        if len(self.grid):
            self.anchor = self.at.swept[:, 0]
        return np.asarray(self.problem.jacobian(self.at, self.weight)[0])


def refine(problem: SynthesisProblem, z: Array, q: Array, tol: float) -> Candidate:
    """Descend from one linkage, with conditions made heavier until they are met."""
    from scipy.optimize import least_squares

    lower, upper = problem.bounds
    weight, found = WEIGHT, Candidate(z, q, *judge(problem, z, q))
    for _ in range(ROUNDS):
        z = within(z, lower, upper)
        descent = _Descent(problem, z, q, weight)
        if not np.isfinite(descent.at.values).all():
            break
        done = least_squares(
            descent.residuals, z, descent.jacobian, bounds=(lower, upper), x_scale="jac",
            ftol=tol, xtol=tol, gtol=tol, max_nfev=EVALUATIONS,
        )  # fmt: skip
        if not np.isfinite(descent.residuals(done.x)).all():
            break
        z, q, weight = done.x, descent.at.q[0], HEAVIER * weight
        found = Candidate(z, q, *judge(problem, z, q))
        if _worst(problem, found.sweep) <= MET:
            break
    return found


def _worst(problem: SynthesisProblem, sweep: Any) -> float:
    """The largest shortfall of conditions with a measure along a sweep."""
    return float(problem.conditions.shortfalls(sweep.points).max(initial=0.0))


def judge(
    problem: SynthesisProblem, z: Array, q: Array
) -> tuple[float, tuple[str, ...], Any, Array]:
    """The cost of a linkage, the conditions that it misses in words, its sweep, driven values."""
    conditions, p = problem.conditions, problem.values(z[None])
    s = problem.driven_values(z[None])[0]
    apart = problem.deviations(z[None], q[None], p)[0] / problem.targets.tolerances
    cost = 0.5 * float((apart[problem.valid] ** 2).sum())
    way = _passage(problem, s)
    even = np.linspace(0.0, way.reach, CURVE + 1)
    steps, place = np.unique(np.append(way.ahead, even), return_inverse=True)
    sweep = _one(problem.sweep(s[way.first] + way.side * steps, q[[way.first]], p))
    broken = []
    stops = bool(conditions.stops(sweep))
    together = not stops and _same(problem, sweep.q[place[: len(s)]], q)
    if conditions.turns and stops:
        broken.append(f"{problem.driven} does not turn fully")
    if conditions.one_assembly and not together:
        broken.append("the positions are not on one assembly without a change point")
    if conditions.ordered and not way.in_order:
        broken.append("the positions are not passed in their order")
    points = sweep.points
    if stops and not broken and (conditions.joints or conditions.box is not None):
        broken.append("the linkage stops on its way, so conditions are not judged all along it")
    for joint, least in () if stops else conditions.joints:
        found = float(transmission_angle(points, joint)[0].min())
        if found < least - MET:
            at = problem.system.point_names[joint[1]]
            broken.append(f"the transmission angle at {at} is {np.degrees(found):.4g} deg")
    if conditions.box is not None and conditions.beyond(points) > MET:
        broken.append("a point leaves the box")
    return cost, tuple(broken), sweep, s[way.first] + way.side * way.ahead


@dataclass(frozen=True)
class _Passage:
    """The way from the position ``first``, up or down by ``side``, on which positions are passed.

    ``ahead`` (n,): how far each position is; ``reach``: how far conditions are judged.
    """

    first: int
    side: float
    ahead: Array
    in_order: bool
    reach: float


def _passage(problem: SynthesisProblem, s: Array) -> _Passage:
    """The way past the driven values (n,) in their order, by whole turns of an angle, if any."""
    turn, full = 2 * np.pi, problem.conditions.turns
    wraps = problem.system.angular[problem.place] and not (problem.timed and np.ptp(s) > turn)
    ways = list[_Passage]()
    for side in (1.0, -1.0):
        steps = side * np.diff(s)
        if wraps:
            steps = np.where(steps % turn > turn - SAME_PLACE, 0.0, steps % turn)
        ahead = np.append(0.0, np.cumsum(steps))
        if (steps >= 0.0).all() and (not wraps or ahead[-1] <= turn + SAME_PLACE):
            reach = float(ahead[-1])
            ways.append(_Passage(0, side, ahead, True, max(turn, reach) if full else reach))
    if ways:
        return min(ways, key=lambda way: way.ahead[-1])
    first = 0 if full else int(np.argmin(s))
    ahead = (s - s[first]) % turn if full else s - s[first]
    return _Passage(first, 1.0, ahead, False, turn if full else float(ahead.max()))


def _same(problem: SynthesisProblem, first: Array, second: Array) -> bool:
    """Whether configurations are the same, but for whole turns of angles."""
    apart = first - second
    angular = problem.system.angular[: apart.shape[1]]
    apart[:, angular] = wrap(apart[:, angular])
    return bool((np.abs(apart) < SAME_PLACE * max(1.0, problem.conditions.size)).all())


def _one(sweep: Any) -> Any:
    """A sweep of one member as that of one set of parameters."""
    shaped = {
        name: getattr(sweep, name)[0] for name in ("q", "ratios", "change_points", "end", "p")
    }
    return replace(sweep, **shaped)
