"""Members of a batch that no compiled code runs: each is run as by ``simulate``.

Those in which contacts last or slide, and those whose resets change parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.batch.hybrid.reduced import reduced
from mechc.batch.reductions import read_reduction
from mechc.batch.spec import Recipe
from mechc.errors import MechcError
from mechc.inputs.driven_scene import with_inputs
from mechc.native._codes import (
    COUNTERS,
    LEAST,
    NOT_ASSEMBLED,
    NOT_RUN,
    OPEN_AT_START,
    RESETS_ACCUMULATE,
)
from mechc.simulation.contact.drive import NEAR_START
from mechc.simulation.contact.laws import contact_laws
from mechc.simulation.events.expressions import function_of
from mechc.simulation.initialise import checked_state
from mechc.simulation.simulate import run
from mechc.simulation.status import CODES
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.system import System

NUMBERS = {name: code for code, (name, *_) in CODES.items()}
WITHOUT_MOTION = (NOT_ASSEMBLED, OPEN_AT_START, NOT_RUN)


@dataclass(frozen=True)
class Found:
    """What compiled code found of n members, which is replaced for those in contact.

    ``results``: by name, members first; ``at_times`` (n, nt, nq + nu); ``values_at``: parameters
    there (n, nt, np), or (n, 1, np) where these do not change.
    """

    results: dict[str, Array]
    at_times: Array
    values_at: Array


def run_in_contact(system: System, recipe: Recipe, values: Array, found: Found) -> bool:
    """Replace the results of members with contact; False if Ctrl-C came first."""
    members = _in_contact(system, recipe, values, found)
    for place, member in enumerate(members):
        if not _replaced(system, recipe, values[member], found, member):
            found.results["status"][members[place:]] = NOT_RUN
            return False
    return True


def _in_contact(system: System, recipe: Recipe, values: Array, found: Found) -> list[int]:
    """All members of such events, else those whose contacts last, and that begin near contact."""
    events = recipe.events
    if events is None or not events.given:
        return []
    status, y0 = found.results["status"], found.results["y0"]
    moves = ~np.isin(status, WITHOUT_MOTION)
    if not events.one_by_one:
        moves &= _near(system, recipe, values, y0) | (status == RESETS_ACCUMULATE)
    return [int(k) for k in np.flatnonzero(moves)]


def _near(system: System, recipe: Recipe, values: Array, y0: Array) -> Any:
    """Whether any gap of a start (n, nq + nu) is nearly closed, or not open."""
    assert recipe.events is not None
    laws = contact_laws(recipe.events.read(system, values[0]))
    gaps = function_of([law.gap for law in laws])
    least = [NEAR_START * system.scale(p).max(initial=0.0) for p in values]
    found = [gaps(recipe.span[0], y, p) for y, p in zip(y0, values, strict=True)]
    return (np.array(found, dtype=float) <= np.array(least)[:, None]).any(axis=1)


def _replaced(system: System, recipe: Recipe, p: Array, found: Found, member: int) -> bool:
    """Run a member; False if that was interrupted."""
    assert recipe.events is not None
    if system.driven is not None:
        system = with_inputs(system, recipe.inputs.of(member))
    events, start = recipe.events.read(system, p), found.results["y0"][member]
    sol: Any
    try:
        state = checked_state(system, start, p, recipe.span[0])
        sol = run(
            Trajectory, system, recipe.span, state, p, recipe.policy, None, events, typed=start
        )
    except MechcError as error:
        sol = getattr(error, "solution", None)
    if sol is None:
        found.results["status"][member] = OPEN_AT_START
        for k in range(len(recipe.reductions)):
            found.results[f"reduction_{k}"][member] = np.nan
        return True
    if sol.status.code == "interrupted":
        return False
    _keep(sol, recipe, found, member)
    return True


def _keep(sol: Any, recipe: Recipe, found: Found, member: int) -> None:
    results, times = found.results, recipe.t_eval
    results["y"][member], results["t"][member] = sol.y[-1], sol.t[-1]
    results["status"][member] = NUMBERS[sol.status.code]
    told = {**sol.stats, "change_points": len(sol.change_points)}
    for name in (*COUNTERS, *LEAST):
        results[name][member] = told[name]
    latest = [record.t[-1] if len(record.t) else np.nan for record in sol.events]
    results["event_counts"][member] = [len(record.t) for record in sol.events]
    results["event_latest"][member] = latest
    results["lowered_impacts"][member] = sol.stats["lowered_impacts"]
    for k, text in enumerate(recipe.reductions):
        reduction = read_reduction(sol.system, text)
        parts = np.array([[reduced(sol, one) for one in reduction.primitives]])
        results[f"reduction_{k}"][member] = reduction.combine(parts)[0]
    reached = times <= sol.t[-1]
    found.at_times[member, ~reached] = np.nan
    found.at_times[member, reached] = sol(times[reached])
    if recipe.events is not None and recipe.events.one_by_one:
        found.values_at[member, reached] = sol.params_at(times[reached])
