"""The starts of the search, and the search: SciPy's least squares with exact Jacobian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import AssemblyError, MechcError
from mechc.fitting.losses import loss_of
from mechc.fitting.problem import Problem
from mechc.questions.unknowns import bounds_of, spread, within
from mechc.system.parameters import Array


@dataclass(frozen=True)
class Settings:
    """Settings of the search; see :meth:`mechc.Model.fit`."""

    starts: int
    refined: int
    loss: Any
    f_scale: float
    tol: float
    max_evaluations: int | None
    seed: int


def beginnings(problem: Problem, settings: Settings) -> Array:
    """The points (n, k) from which the search begins, the most promising first.

    Raises :class:`MechcError` if no motion can be computed at any of them.
    """
    first = np.array([one.first for one in problem.unknowns])
    if settings.starts == 1:
        _refuse_infeasible(problem, first)
        return first[None]
    points = np.vstack([first, _spread(problem, settings.starts - 1, settings.seed, first)])
    costs = costs_at(problem, points, settings)
    if not np.isfinite(costs).any():
        _refuse_infeasible(problem, first)
    order = np.argsort(costs, kind="stable")
    return np.asarray(points[order[np.isfinite(costs[order])][: settings.refined]])


def _spread(problem: Problem, count: int, seed: int, first: Array) -> Array:
    """Points (count, k) spread evenly between the bounds; what has none stays where it begins."""
    lower, upper = bounds_of(problem.unknowns)
    bounded = np.isfinite(lower) & np.isfinite(upper)
    if not bounded.any():
        raise MechcError("several starts are spread between bounds: give a free value both bounds")
    points = np.tile(first, (count, 1))
    points[:, bounded] = spread(lower[bounded], upper[bounded], count, seed)
    return points


def costs_at(problem: Problem, points: Array, settings: Settings) -> Array:
    """The cost at each point (n,), of all in one batch; infinite where a motion fails."""
    loss = loss_of(settings.loss, settings.f_scale)
    if _one_by_one(problem, points[0]):
        residuals = np.array([problem.residuals(x) for x in points])
    else:
        residuals = np.hstack([_batch(problem, points, k) for k in range(len(problem.recordings))])
    usable = np.isfinite(residuals).all(axis=1)
    costs = np.full(len(points), np.inf)
    costs[usable] = loss.cost(residuals[usable])
    return costs


def _one_by_one(problem: Problem, x: Array) -> bool:
    """Whether members run alone: with Python functions, and outputs that may contain inputs."""
    model = problem.model
    if not model.inputs:
        return False
    driven = model.with_inputs(problem.motions[0].arguments(x).inputs).system.driven
    alone = driven is None or driven.calls_python  # laws are compiled, one by one
    return bool(alone or not all(one.quantity.of_state for one in problem.measured))


def _batch(problem: Problem, points: Array, place: int) -> Array:
    """The residuals (n, samples) of one recording at all points."""
    function = problem.motions[place]
    recording, model = problem.recordings[place], function.model
    batch = function.batch(points, problem.span(place), t_eval=recording.t)
    problem.runs += len(points)
    values = model.system.parameter_set.resolve(function.arguments(points).params)
    values = np.broadcast_to(values, (len(points), values.shape[-1]))
    apart = problem.deviations(model.system, batch["y_eval"], values[:, None, :], place)
    apart[~batch.ok] = np.inf
    return np.asarray(apart[:, recording.valid])


def _refuse_infeasible(problem: Problem, first: Array) -> None:
    """Raise why a motion cannot be computed at the first values, if one cannot."""
    words = ", ".join(
        f"{one.label} = {value:.6g}" for one, value in zip(problem.unknowns, first, strict=True)
    )
    for place in range(len(problem.recordings)):
        told = f"the fit begins at {words}, where the motion of recording {place} "
        advice = "Give other first values (params, y0), bounds, or several starts"
        try:
            sol = problem.simulate(first, place)
        except AssemblyError as error:
            raise AssemblyError(f"{told}cannot be assembled: {error}. {advice}") from None
        if not sol.status.ok:
            raise MechcError(f"{told}does not reach its end: {sol.status.headline}. {advice}")


@dataclass(frozen=True)
class Found:
    """One end of a search: values (k,), cost, what is active at a bound (k,), how it ended.

    ``interrupt`` is the Ctrl-C that ended it; the values are then the best that were tried.
    """

    x: Array
    cost: float
    active: Array
    converged: bool
    message: str
    interrupt: KeyboardInterrupt | None = None


def refine(problem: Problem, first: Array, settings: Settings) -> Found:
    """Descend from one point; an interrupt before any motion is raised."""
    from scipy.optimize import least_squares

    lower, upper = bounds_of(problem.unknowns)
    inside = within(first, lower, upper)
    loss, best = loss_of(settings.loss, settings.f_scale), (np.inf, inside)

    def residuals(x: Array) -> Array:
        nonlocal best
        found = problem.residuals(x)
        if np.isfinite(found).all():
            best = min(best, (float(loss.cost(found)), x.copy()), key=lambda tried: tried[0])
        return found

    try:
        done = least_squares(
            residuals, inside, problem.jacobian, bounds=(lower, upper), x_scale="jac",
            loss=settings.loss, f_scale=settings.f_scale, ftol=settings.tol, xtol=settings.tol,
            gtol=settings.tol, max_nfev=settings.max_evaluations,
        )  # fmt: skip
    except KeyboardInterrupt as interrupt:
        cost, x = best
        if not np.isfinite(cost):
            raise
        return Found(x, cost, np.zeros(len(x), bool), False, "it was interrupted", interrupt)
    active = np.asarray(done.active_mask != 0)
    return Found(done.x, float(done.cost), active, done.status > 0, done.message)
