"""Runs the members of a recipe on this machine's cores."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.assembly.directions import are_turned
from mechc.assembly.sizes import allowed_gaps
from mechc.batch import assemble
from mechc.batch.driven import driven_by, evaluate_output, own_numbers
from mechc.batch.events import changes_any_parameter
from mechc.batch.reductions import Reduction, read_reduction, read_stop
from mechc.batch.sensitivities import Members
from mechc.batch.spec import Recipe
from mechc.errors import EventError
from mechc.native._batch import Runs
from mechc.native._codes import (
    COUNTERS,
    END_OF_REACH,
    EVENT_FAILED,
    FINISHED,
    INPUT_FAILED,
    LAST,
    LEAST,
    NOT_ASSEMBLED,
    NOT_RUN,
    OPEN_AT_START,
    STOPPED_AT_CHANGE_POINT,
    STOPPED_BY_EVENT,
)
from mechc.simulation.end_of_reach import SHRUNK_AWAY, rows_beyond_reach
from mechc.simulation.events.outcome import function_failed
from mechc.simulation.events.run_events import RunEvents
from mechc.simulation.initialise import checked_state, request_of
from mechc.simulation.settings import refuse_derivatives_in_contact
from mechc.simulation.simulate import run
from mechc.system.parameters import Array
from mechc.system.system import System

if TYPE_CHECKING:
    from mechc.results.solution import Solution

WHOLE = (FINISHED, STOPPED_BY_EVENT, STOPPED_AT_CHANGE_POINT)  # as far as was asked
LOOK = 0.1  # s between checks of the threads' progress
Report = Callable[[int], None]


def cores() -> int:
    """The number of cores that this process may use."""
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
    scene = system.scene.of_members
    system = driven_by(system, recipe.inputs)
    values = parameter_rows(system, recipe)
    y0, assembled, miss, complete = starts(system, recipe, values, threads)
    reductions = [read_reduction(system, text) for text in recipe.reductions]
    events = None if recipe.events is None else recipe.events.read(system, _first(system, values))
    changes = changes_any_parameter(events)
    job = _runs(system, scene, recipe, values, y0, assembled, reductions, events, changes)
    one_thread = recipe.inputs.calls_python or (events is not None and events.bound.calls_python)
    complete = complete and drive(job, 1 if one_thread else threads, report)
    try:  # a function of Python that failed
        if system.driven is not None:
            system.driven.raise_failure()
        if events is not None and events.bound.failure is not None:
            failed = function_failed(events)
            raise EventError(str(failed), None) from failed.__cause__
    except KeyboardInterrupt:
        complete = False
        job.status[np.isin(job.status, (INPUT_FAILED, EVENT_FAILED))] = NOT_RUN
    if recipe.states is not None:  # given, and turned
        job.status[job.status == NOT_ASSEMBLED] = OPEN_AT_START
    shrunk = np.flatnonzero(np.isin(job.status, SHRUNK_AWAY))
    beyond = rows_beyond_reach(system, job.t[shrunk], job.y[shrunk], values[shrunk]) >= 0
    job.status[shrunk[beyond]] = END_OF_REACH
    whole = np.isin(job.status, WHOLE)
    results = {"y0": y0, "y": job.y, "t": job.t, "status": job.status.astype(np.int16)}
    results |= {name: job.counts[:, i].astype(np.int64) for name, i in COUNTERS.items()}
    results |= {name: job.least[:, i] for name, i in LEAST.items()}
    if events is not None:
        results["event_counts"] = job.event_counts.astype(np.int64)
        results["event_latest"] = job.event_latest
        results["lowered_impacts"] = job.lowered.astype(np.int64)
    if miss is not None:
        results["miss"] = miss
    first = 0
    for i, reduction in enumerate(reductions):
        last = first + len(reduction.primitives)
        results[f"reduction_{i}"] = reduction.combine(job.reduced[:, first:last], whole)
        first = last
    along = job.p_at_times if changes else values[:, None]
    results |= _histories(system, recipe, along, job)
    if recipe.sensitivities:
        derivatives = Members(system, recipe, values, y0, job.status == FINISHED)
        complete = complete and drive(derivatives, threads)
        results |= derivatives.results
    return results, complete


def run_controlled(
    system: System, recipe: Recipe, threads: int, report: Callable[[int], None]
) -> tuple[dict[str, Array], bool]:
    """Run members one after another, since controllers are called for each, as
    :func:`run_members`; Ctrl-C keeps the finished ones.

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


def run_alone(model: Any, recipe: Recipe, member: int, start: Array, until: float) -> Solution:
    """One member as a run of its own, from its start (nq + nu,) to a time."""
    from mechc.results.solution import Solution

    one = recipe.cut(member, member + 1)
    span = (one.span[0], until)
    one = replace(one, inputs=one.inputs.with_signals(span))
    system = driven_by(model.system, one.inputs)
    values = parameter_rows(system, one)[0]
    events = None if one.events is None else one.events.read(system, values)
    state = checked_state(system, start, values, span[0])
    times = one.t_eval[one.t_eval <= until] if len(one.t_eval) else None
    made = model if system is model.system else type(model).of_system(system)
    return run(partial(Solution, made), system, span, state, values, one.policy, times, events)


def _runs(
    system: System, scene: Any, recipe: Recipe, values: Array, y0: Array, assembled: Array | None,
    reductions: Sequence[Reduction], events: RunEvents | None, keeps_params: bool,
) -> Runs:  # fmt: skip
    """The compiled loop over the members."""
    policy = recipe.policy
    quantities = [primitive for reduction in reductions for primitive in reduction.primitives]
    until = read_stop(system, recipe.until) if recipe.until else None
    in_steps = len(recipe.t_eval) > 0 or any(each[0] != LAST for each in quantities)
    dense = in_steps or events is not None or until is not None
    driven: Any = system.driven
    if driven is not None:
        driven.restart(recipe.span[0])
    numbers, places = own_numbers(system, recipe.inputs, recipe.count)
    in_contact = events is not None and bool(events.laws)
    if in_contact:
        names = list(system.scene.outputs)
        asked = (*quantities, *filter(None, [until]))
        reduced = [names[each.output] for each in asked if each.output >= 0]
        refuse_derivatives_in_contact([*recipe.outputs, *reduced])
    request = request_of(
        system, recipe.span, _first(system, values), policy._replace(dense=dense), events, scene
    )
    return Runs(
        request, policy.takes_lanes, *recipe.span, y0, values, assembled, recipe.t_eval,
        quantities, until, allowed_gaps(system, values, recipe.span[0]), numbers, places,
        keeps_params, in_contact and bool(recipe.outputs),
    )  # fmt: skip


def _first(system: System, values: Array) -> Array:
    """The parameters of the first member, where there is one."""
    return values[0] if len(values) else system.parameter_set.defaults


def parameter_rows(system: System, recipe: Recipe) -> Array:
    """The parameters of every member (n, np)."""
    values = np.zeros((recipe.count, len(system.parameters)))
    for name, column in recipe.params.items():
        values[:, system.parameter_set.index[name]] = column
    given = np.array([name in recipe.params for name in system.parameters], np.uint8)
    system.parameter_set.fill_defaults(values, given)
    return values


def starts(
    system: System, recipe: Recipe, values: Array, threads: int
) -> tuple[Array, Array | None, Array | None, bool]:
    """Start states (n, nq + nu), which members have one (None: all), the gap of the others, and
    whether they are complete."""
    if recipe.states is not None:
        shape = (recipe.count, recipe.states.shape[-1])
        y0 = np.ascontiguousarray(np.broadcast_to(recipe.states, shape))
        turned = are_turned(system, y0, values, recipe.span[0])
        return y0, (~turned).astype(np.uint8) if turned.any() else None, None, True
    y0, kept, miss, complete = assemble.states(
        system, recipe, values, lambda job: drive(job, threads)
    )
    return y0, kept.astype(np.uint8), miss, complete


def _histories(system: System, recipe: Recipe, values: Array, job: Runs) -> dict[str, Array]:
    """Results at t_eval: states (n, nt, nq + nu), outputs (n, nt, ...)."""
    states, forces = job.at_times, job.forces_at_times if job.forces_at_times.size else None
    found = {"y_eval": states} if recipe.keep_states else {}
    for i, name in enumerate(recipe.outputs):
        times = np.broadcast_to(recipe.t_eval, states.shape[:2])
        history = evaluate_output(system, recipe.inputs, name, states, values, times, forces)
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
