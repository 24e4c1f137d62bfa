"""Configurations that close the loops, for many members at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.assembly.closure_solver import even_points, wrap
from mechc.assembly.positions import STARTS_PER_UNKNOWN
from mechc.batch.spec import Recipe
from mechc.errors import AssemblyError
from mechc.native._batch import Closings
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 16  # assemblies kept of one member
BLOCK = 16
Drive = Callable[[Any], bool]


def configurations(
    system: System, unit: Any, recipe: Recipe, values: Array, length: Array, drive: Drive
) -> tuple[Array, Array, Array, bool]:
    """The configuration of every member that ``model.assemble`` prefers.

    Returns (coordinates (n, nq), whether the loops close (n,), by how much they miss in m (n,),
    whether Ctrl-C left it complete).  Every member is searched from the same starts, so what is
    found does not depend on other members.

    Raises
    ------
    AssemblyError
        If the coordinates given leave a choice and there is no guess.
    """
    fixed = np.tile(system.default_coordinates, (recipe.count, 1))
    for name, column in {**recipe.guess, **recipe.coordinates}.items():
        fixed[:, system.state_index(name)] = column
    rows = system.scene.holonomic
    kept = [system.state_index(name) for name in recipe.coordinates]
    free = system.unknowns(kept)
    if not recipe.count or not rows or not free:
        closed, miss = _as_given(system, recipe, values, length, fixed)
        return fixed, closed, miss, True
    excess = len(free) - rows
    if excess > 0 and not recipe.guess:
        names = ", ".join(system.coordinates[i] for i in free)
        raise AssemblyError(
            f"{rows} constraints do not determine {names}: give {excess} more of them, or a guess"
        )
    job = _closings(system, unit, recipe, values, length, fixed, free)
    complete = drive(job)
    if (job.many > MOST).any():
        raise AssemblyError(f"a member has over {MOST} assemblies: give more coordinates")
    chosen = _chosen(system, recipe, values, job.found)
    return chosen, job.many > 0, job.miss, complete


def _as_given(
    system: System, recipe: Recipe, values: Array, length: Array, fixed: Array
) -> tuple[Array, Array]:
    """Nothing to solve for: whether the loops are closed."""
    states = np.hstack([fixed, np.zeros((len(fixed), len(system.speeds)))])
    gap = np.abs(system.constraints(states, values, recipe.span[0])).max(axis=1, initial=0.0)
    return gap <= 1e-8 * length, gap


def _closings(
    system: System, unit: Any, recipe: Recipe, values: Array, length: Array, fixed: Array,
    free: list[int],
) -> Any:  # fmt: skip
    outputs = system.scene.outputs
    gradient = "constraint_gradient" if "constraint_gradient" in outputs else "constraint_jacobian"
    columns = len(system.coordinates if gradient == "constraint_gradient" else system.speeds)
    angular = system.angular[free]
    starts = even_points(STARTS_PER_UNKNOWN * len(free) ** 2, len(free))
    starts *= np.where(angular, np.pi, 1.0)
    return Closings(
        unit, "constraints", gradient, system.scene.holonomic, columns,
        np.array(free, np.intc), angular.astype(np.uint8), recipe.span[0],
        _near(system, recipe, starts, free), fixed, values, length, MOST, BLOCK,
    )  # fmt: skip


def _near(system: System, recipe: Recipe, starts: Array, free: list[int]) -> Array:
    """The starts, with those near the guess first."""
    if not recipe.guess:
        return starts
    near = starts.copy()
    for column, i in enumerate(free):
        if system.coordinates[i] in recipe.guess:
            near[:, column] = recipe.guess[system.coordinates[i]]
    if len(free) > system.scene.holonomic:
        return near
    return np.vstack([near, starts])


def _chosen(system: System, recipe: Recipe, values: Array, found: Array) -> Array:
    """Of each member's assemblies the preferred one, or the nearest to the guess."""
    members, most, width = found.shape
    flat = found.reshape(-1, width)
    missing = np.isnan(flat[:, 0])
    rank = _distance(system, recipe, flat) if recipe.guess else _unpreferred(system, values, found)
    member = np.repeat(np.arange(members), most)
    order = np.lexsort((*flat.T[::-1], rank, missing, member))
    first = order[::most]
    return _in_turn(system, recipe, flat[first])


def _unpreferred(system: System, values: Array, found: Array) -> Array:
    if "preference" not in system.scene.outputs:
        return np.zeros(found.shape[0] * found.shape[1])
    states = np.concatenate([found, np.zeros((*found.shape[:2], len(system.speeds)))], axis=2)
    states = np.where(np.isnan(states), 0.0, states)
    return -system.evaluate("preference", states, values[:, None, :], 0.0).reshape(-1)


def _distance(system: System, recipe: Recipe, flat: Array) -> Array:
    away = _away(system, recipe, flat)
    return np.asarray(np.linalg.norm(away, axis=1))


def _away(system: System, recipe: Recipe, q: Array) -> Array:
    index = [system.state_index(name) for name in recipe.guess]
    angular = system.angular[index]
    away = q[:, index] - np.array(list(recipe.guess.values()))
    return np.where(angular, wrap(away), away)


def _in_turn(system: System, recipe: Recipe, q: Array) -> Array:
    """Guessed angles, within half a turn of the guess."""
    for name, target in recipe.guess.items():
        i = system.state_index(name)
        if system.angular[i]:
            q[:, i] += 2 * np.pi * np.round((target - q[:, i]) / (2 * np.pi))
    return q
