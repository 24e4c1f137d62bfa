"""Configurations that close the loops, for many members at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.assembly.positions import gaps, search_for
from mechc.assembly.sizes import is_open
from mechc.batch.spec import Recipe
from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 16  # assemblies kept of one member
BLOCK = 16
Drive = Callable[[Any], bool]


def configurations(
    system: System, recipe: Recipe, values: Array, drive: Drive
) -> tuple[Array, Any, Array, bool]:
    """The configuration of every member that ``model.assemble`` prefers.

    Returns (coordinates (n, nq), whether the loops close (n,), the norm of the gap (n,),
    whether Ctrl-C left it complete).  Every member is searched from the same starts, so what is
    found does not depend on other members.

    Raises :class:`AssemblyError` if the coordinates given leave a choice and there is no guess.
    """
    fixed = system.default_configurations(recipe.count, (*recipe.guess, *recipe.coordinates))
    for name, column in {**recipe.guess, **recipe.coordinates}.items():
        fixed[:, system.state_index(name)] = column
    t = recipe.span[0]
    search = search_for(system, tuple(recipe.coordinates), tuple(recipe.guess))
    if search is None or not recipe.count:
        opened = gaps(system, fixed, values, t)
        closed = [not is_open(system, gap, p, t) for gap, p in zip(opened, values, strict=True)]
        return fixed, np.array(closed, bool), np.linalg.norm(opened, axis=1), True
    job = search.closings(t, fixed, values, MOST, block=BLOCK)
    complete = drive(job)
    if (job.many > MOST).any():
        raise AssemblyError(f"a member has over {MOST} assemblies: give more coordinates")
    return job.found[:, 0], job.many > 0, job.miss, complete
