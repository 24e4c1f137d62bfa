"""Batches with controllers in discrete time.

Controllers are Python functions, called for one member after another.  What they apply in a member
is found by a run as of ``simulate``, and is then a signal like any other, with which compiled code
computes the member's results.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from mechc.batch.driven import BatchInputs, driven_by
from mechc.batch.run import parameter_rows, run_members, starts
from mechc.batch.spec import Recipe
from mechc.errors import EventError, ValueOutOfBoundsError
from mechc.inputs.sampled import with_held
from mechc.simulation.initialise import checked_state
from mechc.simulation.simulate import run
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.system import System


def run_controlled(
    system: System, recipe: Recipe, threads: int, report: Callable[[int], None]
) -> tuple[dict[str, Array], bool]:
    """As :func:`mechc.batch.run.run_members`; Ctrl-C keeps the finished members.

    Raises
    ------
    InputError
        If a controller fails; it contains the member's motion until then.
    """
    found: list[dict[str, Array]] = []
    complete = True
    try:
        for member in range(recipe.count):
            one = _recorded(system, recipe.cut(member, member + 1), threads)
            results, complete = run_members(system, one, 1)
            if not complete:
                break
            found.append(results)
            report(len(found))
    except KeyboardInterrupt:
        complete = False
    if not found:
        return {}, False
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}, complete


def _recorded(system: System, one: Recipe, threads: int) -> Recipe:
    """A member with signals in place of its controllers: what these have applied in its run."""
    given = {names: several[0] for names, several in one.inputs.controllers.items()}
    held, _ = with_held(given, one.span)
    signals = {**one.inputs.signals, **held}
    recipe = replace(one, inputs=BatchInputs(one.inputs.numbers, signals))
    driven = driven_by(system, recipe.inputs)
    values = parameter_rows(driven, recipe)
    y0, kept, _, _ = starts(driven, recipe, values, threads)
    if kept is None or kept.all():
        _run(driven, one, y0[0], values[0])
    assert driven.driven is not None
    driven.driven.repeat()
    return recipe


def _run(system: System, one: Recipe, y0: Array, p: Array) -> None:
    """The run in which the controllers are called; what ends it early is told by the one after."""
    state: Any = checked_state(system, y0, p, one.span[0])
    events = () if one.events is None else one.events.read(system, p)
    with suppress(EventError, ValueOutOfBoundsError):
        run(Trajectory, system, one.span, state, p, one.policy, events=events, typed=y0)
