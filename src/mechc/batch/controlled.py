"""Members that are run one after another, since controllers are called for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechc.batch.run import run_members
from mechc.batch.spec import Recipe
from mechc.system.parameters import Array
from mechc.system.system import System


def run_controlled(
    system: System, recipe: Recipe, threads: int, report: Callable[[int], None]
) -> tuple[dict[str, Array], bool]:
    """Run members as :func:`mechc.batch.run.run_members`; Ctrl-C keeps the finished ones.

    Raises :class:`InputError` if a controller fails.
    """
    found: list[dict[str, Array]] = []
    complete = True
    try:
        for member in range(recipe.count):
            one = recipe.cut(member, member + 1)
            one = replace(one, inputs=one.inputs.with_signals(one.span))
            results, complete = run_members(system, one, threads)
            if not complete:
                break
            found.append(results)
            report(len(found))
    except KeyboardInterrupt:
        complete = False
    if not found:
        return {}, False
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}, complete
