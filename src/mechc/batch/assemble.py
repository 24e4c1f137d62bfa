"""Configurations that close the loops, for many members at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.assembly.positions import distance, in_turn, preference, refuse_choice, starts
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
    refuse_choice(system, free, recipe.guess)
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
    near = starts(system, free, recipe.guess, np.where(angular, np.pi, 1.0))
    return Closings(
        unit, "constraints", gradient, system.scene.holonomic, columns,
        np.array(free, np.intc), angular.astype(np.uint8), recipe.span[0],
        near, fixed, values, length, MOST, BLOCK,
    )  # fmt: skip


def _chosen(system: System, recipe: Recipe, values: Array, found: Array) -> Array:
    """Of each member's assemblies the preferred one, or the nearest to the guess."""
    members, most, width = found.shape
    flat = found.reshape(-1, width)
    missing = np.isnan(flat[:, 0])
    guess = recipe.guess
    rank = distance(system, flat, guess) if guess else _unpreferred(system, values, found)
    member = np.repeat(np.arange(members), most)
    order = np.lexsort((*flat.T[::-1], rank, missing, member))
    return in_turn(system, flat[order[::most]], guess) if guess else flat[order[::most]]


def _unpreferred(system: System, values: Array, found: Array) -> Array:
    known = np.where(np.isnan(found), 0.0, found)
    return -preference(system, known, values[:, None, :]).reshape(-1)
