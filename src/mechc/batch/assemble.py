"""States that close the loops, for many members at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.assembly import sheets, tangent_branches
from mechc.assembly.positions import (
    are_closed,
    assemble,
    gaps,
    rank_elsewhere,
    search_for,
    with_attitudes,
    with_lengths_one,
)
from mechc.assembly.speeds import consistent
from mechc.batch.driven import Columns
from mechc.batch.spec import Recipe
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 16  # assemblies kept of one member
BLOCK = 16
Drive = Callable[[Any], bool]


def states(
    system: System, recipe: Recipe, values: Array, drive: Drive
) -> tuple[Array, Any, Array, bool]:
    """The state of every member that ``model.assemble`` gives.

    Returns (states (n, nq + nu), NaN where there is none, whether there is one (n,), the norm of
    the gap (n,), whether Ctrl-C left it complete).  Every member is searched from the same starts,
    so what is found does not depend on other members.

    Raises :class:`AssemblyError` if the coordinates given leave a choice and there is no guess.
    """
    q, many, miss, complete = _configurations(system, recipe, values, drive)
    y = np.full((recipe.count, q.shape[1] + len(system.speeds)), np.nan)
    kept = np.zeros(recipe.count, bool)
    if not complete:
        return y, kept, miss, False
    closes = many > 0
    if closes.any():
        given = [system.state_index(name) for name in recipe.coordinates]
        q[closes] = with_lengths_one(system, q[closes], given, values[closes], recipe.span[0])
        system.attitudes.check(q[closes])
    try:
        found, closed, dependent = _with_speeds(system, recipe, values, q, closes)
        for i in np.flatnonzero((many > MOST) | dependent):
            found[i] = _member(system, recipe, values, int(i))
            closed[i] = not np.isnan(found[i, 0])
    except KeyboardInterrupt:
        return y, kept, miss, False
    y[closed] = found[closed]
    return y, closed, miss, True


def _configurations(
    system: System, recipe: Recipe, values: Array, drive: Drive
) -> tuple[Array, Any, Array, bool]:
    """Configurations (n, nq), of how many that close the loops (n,), gaps, whether complete."""
    guess = with_attitudes(system, recipe.coordinates, recipe.guess)
    fixed = system.default_configurations(recipe.count, (*guess, *recipe.coordinates))
    for name, column in {**guess, **recipe.coordinates}.items():
        fixed[:, system.state_index(name)] = column
    t = recipe.span[0]
    search = search_for(system, tuple(recipe.coordinates), tuple(guess))
    if search is None or not recipe.count:
        opened, closed = gaps(system, fixed, values, t), are_closed(system, fixed, values, t)
        return fixed, closed.astype(int), np.linalg.norm(opened, axis=1), True
    job = search.closings(t, fixed, values, MOST, block=BLOCK)
    complete = drive(job)
    kept = [system.state_index(name) for name in recipe.coordinates]
    return system.attitudes.scale(job.found[:, 0], kept), job.many, job.miss, complete


def _with_speeds(
    system: System, recipe: Recipe, values: Array, q: Array, closed: Any
) -> tuple[Array, Any, Any]:
    """States with speeds that keep the constraints, whether there are such, and whether rows depend
    on each other that are independent elsewhere with the same parameters."""
    y = np.hstack([np.where(closed[:, None], q, 0.0), np.zeros((len(q), len(system.speeds)))])
    for name, column in recipe.speeds.items():
        y[:, system.state_index(name)] = column
    dependent = np.zeros(len(q), bool)
    if not system.scene.rows or not len(q):
        return y, closed, dependent
    t = recipe.span[0]
    kept = consistent(system, y, recipe.speeds, values, t)
    near = np.flatnonzero(closed & ~(kept.conditioning > tangent_branches.NEAR))
    ranks = sheets.ranks_at(system, q[near], values[near], t, tangent_branches.NEAR)
    for i, rank in zip(near, ranks, strict=True):
        dependent[i] = not 0 < rank_elsewhere(system, values[i], t) <= rank  # 0: not known
    return kept.y, closed & kept.keep, dependent


def _member(system: System, recipe: Recipe, values: Array, i: int) -> Array | float:
    """The state (nq + nu,) of one member, by itself; NaN where there is none."""

    def own(columns: Columns) -> dict[str, float]:
        return {n: float(np.broadcast_to(each, recipe.count)[i]) for n, each in columns.items()}

    given = own(recipe.coordinates), own(recipe.speeds), dict(recipe.guess)
    try:
        return assemble(system, *given, values[i], recipe.span[0])
    except AssemblyError:
        return np.nan
