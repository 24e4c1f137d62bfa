"""Runs the members of a recipe on this machine's cores."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.assembly.sizes import allowed_gaps
from mechc.assembly.speeds import consistent
from mechc.batch.assemble import configurations
from mechc.batch.driven import driven_by, evaluated, in_segments
from mechc.batch.hybrid.contact import Found, run_in_contact
from mechc.batch.reductions import read_reduction, read_stop
from mechc.batch.sensitivities import Members
from mechc.batch.spec import Recipe
from mechc.native._batch import Runs
from mechc.native._codes import CHANGE_POINT_POLICIES, COUNTERS, FINISHED, LAST, LEAST, METHODS
from mechc.system.parameters import Array
from mechc.system.system import System

LOOK = 0.1  # s between checks of the threads' progress
# Methods that run members in lockstep, a lane each.
LOCKSTEP = ("dop853", "gauss8_lockstep", "taylor")
Report = Callable[[int], None]


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "process_cpu_count"):
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):  # neither macOS nor Windows has it
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_members(
    system: System, recipe: Recipe, threads: int, report: Report | None = None
) -> tuple[dict[str, Array], bool]:
    """Run every member; the results requested, by name, and whether they are complete.

    Each is the same run as ``model.simulate``, so the states are the same to the last bit for any
    number of threads.  Ctrl-C keeps the finished members.
    """
    unit = system.scene.of_members
    system = driven_by(system, recipe.inputs)
    values = parameter_rows(system, recipe)
    length = system.parameter_set.lengths(values)
    y0, assembled, miss, complete = starts(system, recipe, values, threads)
    reductions = [read_reduction(system, text) for text in recipe.reductions]
    primitives = [p for reduction in reductions for p in reduction.primitives]
    primitives += [read_stop(system, recipe.until)] if recipe.until else []
    events = recipe.events
    in_c = None if events is None or events.one_by_one else events.compiled()
    needs_dense = in_c is not None or any(p[0] != LAST for p in primitives)
    runs = Runs(
        unit, _options(recipe, needs_dense), y0, values, length,
        system.dimensionless.astype(np.uint8), assembled, recipe.t_eval, primitives,
        allowed_gaps(system, values, recipe.span[0]),
        in_segments(system, recipe.inputs, recipe.span, recipe.policy.rtol, recipe.count),
        in_c,
    )  # fmt: skip
    complete = complete and drive(runs, threads, report)
    results = {"y0": y0, "y": runs.y, "t": runs.t, "status": runs.status.astype(np.int16)}
    results |= {name: runs.counts[:, i].astype(np.int64) for name, i in COUNTERS.items()}
    results |= {name: runs.least[:, i] for name, i in LEAST.items()}
    if miss is not None:
        results["miss"] = miss
    if events is not None:
        shape = recipe.count, len(events.directions)
        results["event_counts"] = np.zeros(shape, np.int64)
        results["event_latest"] = np.full(shape, np.nan)
        results["lowered_impacts"] = np.zeros(recipe.count, np.int64)
    if in_c is not None:
        results["event_counts"][:] = runs.event_counts
        results["event_latest"][:] = runs.event_latest
    first = 0
    for i, reduction in enumerate(reductions):
        last = first + len(reduction.primitives)
        results[f"reduction_{i}"] = reduction.combine(runs.reduced[:, first:last])
        first = last
    found = Found(results, runs.at_times, _along(values, runs.at_times, events))
    complete = complete and run_in_contact(system, recipe, values, found)
    results |= _histories(system, recipe, found.values_at, runs.at_times)
    if recipe.sensitivities:
        job = Members(system, recipe, values, y0, runs.status == FINISHED)
        complete = complete and drive(job, threads)
        results |= job.results
    return results, complete


def parameter_rows(system: System, recipe: Recipe) -> Array:
    """All parameters of every member (n, np)."""
    values = np.zeros((recipe.count, len(system.parameters)))
    for name, column in recipe.params.items():
        values[:, system.parameter_set.index[name]] = column
    given = np.array([name in recipe.params for name in system.parameters], np.uint8)
    system.parameter_set.completed(values, given)
    return values


def _options(recipe: Recipe, reduces: bool) -> dict[str, Any]:
    policy = recipe.policy
    return {
        "t0": recipe.span[0],
        "t1": recipe.span[1],
        "rtol": policy.rtol,
        "atol": policy.atol,
        "first_step": policy.first_step,
        "max_step": policy.max_step,
        "max_steps": policy.max_steps,
        "method": METHODS[policy.method],
        "dense": reduces or len(recipe.t_eval) > 0,
        "lockstep": policy.method in LOCKSTEP,
        "may_stiffen": policy.stiff_switch,
        "on_change_point": CHANGE_POINT_POLICIES[policy.on_change_point],
    }


def starts(
    system: System, recipe: Recipe, values: Array, threads: int
) -> tuple[Array, Array | None, Array | None, bool]:
    """Start states (n, nq + nu), which members have one, and the gap of the others."""
    if recipe.states is not None:
        shape = (recipe.count, recipe.states.shape[-1])
        return np.ascontiguousarray(np.broadcast_to(recipe.states, shape)), None, None, True
    q, closed, miss, complete = configurations(
        system, recipe, values, lambda job: drive(job, threads)
    )
    y0 = np.full((recipe.count, len(system.coordinates) + len(system.speeds)), np.nan)
    kept = np.zeros(recipe.count, bool)
    try:
        if complete:
            found, kept = _with_speeds(system, recipe, values, q, closed)
            y0[kept] = found[kept]
    except KeyboardInterrupt:
        complete = False
    return y0, kept.astype(np.uint8), miss, complete


def _with_speeds(
    system: System, recipe: Recipe, values: Array, q: Array, closed: Array
) -> tuple[Array, Array]:
    """States with speeds that keep the constraints, and whether there are such."""
    y = np.hstack([np.where(closed[:, None], q, 0.0), np.zeros((len(q), len(system.speeds)))])
    for name, column in recipe.speeds.items():
        y[:, system.state_index(name)] = column
    if not system.scene.rows:
        return y, closed
    kept = consistent(system, y, recipe.speeds, values, recipe.span[0])
    return kept.y, closed & kept.keep


def _along(values: Array, states: Array, events: Any) -> Array:
    """Parameters of members at t_eval (n, nt, np), or (n, 1, np) where no reset changes them."""
    if events is None or not events.one_by_one:
        return values[:, None]
    return np.repeat(values[:, None], states.shape[1], axis=1)


def _histories(system: System, recipe: Recipe, values: Array, states: Array) -> dict[str, Array]:
    """Results at t_eval: states (n, nt, nq + nu), outputs (n, nt, ...)."""
    found = {"y_eval": states} if recipe.keep_states else {}
    for i, name in enumerate(recipe.outputs):
        times = np.broadcast_to(recipe.t_eval, states.shape[:2])
        history = evaluated(system, recipe.inputs, name, states, values, times)
        history[np.isnan(states[:, :, 0])] = np.nan  # also where the state has no effect
        found[f"output_{i}"] = history
    return found


def drive(job: Any, threads: int, report: Report | None = None) -> bool:
    """Work on a job in threads; False if Ctrl-C came first."""
    failures: list[BaseException] = []

    def work() -> None:
        try:
            job.work()
        except BaseException as error:  # raised again in the main thread
            failures.append(error)

    workers = [threading.Thread(target=work, daemon=True) for _ in range(max(threads, 1))]
    try:
        for worker in workers:
            worker.start()
        while any(worker.is_alive() for worker in workers):
            next(w for w in workers if w.is_alive() or w is workers[-1]).join(LOOK)
            if report is not None:
                report(job.done)
        if report is not None:
            report(job.done)
        finished = True
    except KeyboardInterrupt:
        finished = False
        job.stop()
        for worker in workers:
            if worker.ident is not None:
                worker.join()
    if failures:
        raise failures[0]
    return finished
