"""Many trajectories of one model: Monte Carlo, parameter studies, data for learning."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mechc.batch.controlled import run_controlled
from mechc.batch.driven import checked_inputs
from mechc.batch.events import batch_events
from mechc.batch.results import Batch
from mechc.batch.run import cores, run_members
from mechc.batch.sensitivities import check_names, one_number_each
from mechc.batch.spec import Assembly, Chunk, Compute, Recipe, checked_recipe
from mechc.errors import ValueOutOfBoundsError, brief
from mechc.progress import CountBar
from mechc.simulation.settings import (
    checked_count,
    checked_policy,
    checked_span,
    checked_times,
    refuse_without_derivatives,
)
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array, Parameters
from mechc.system.system import System

CHUNK = 4096  # members computed, and stored in one file, at a time
KEEP_EVERY = 3.0  # s between manifests of a batch that is streamed
WRITING = 0.1  # of the time, at most, where members have so many numbers that writing takes long
THREADS_A_CORE = 16


def simulate_batch(
    system: System,
    t_span: float | tuple[float, float],
    y0: Array | Assembly,
    params: Parameters = None,
    *,
    inputs: Mapping[str, Any] | None = None,
    t_eval: Array | None = None,
    states: bool = True,
    outputs: Sequence[str] = (),
    reduce: Sequence[str] | str = (),
    until: str | None = None,
    events: Sequence[Any] = (),
    sensitivities: Sequence[Any] = (),
    sensitivity_error_control: bool = False,
    rtol: float = 1e-9,
    atol: float | Array | None = None,
    method: str = "auto",
    lockstep: bool = False,
    first_step: float | None = None,
    max_step: float = math.inf,
    max_steps: int = 10_000_000,
    on_change_point: str = "continue",
    threads: int | None = None,
    out: str | Path | None = None,
    chunk: int = CHUNK,
    client: Any = None,
    progress: bool = True,
) -> Batch:
    """Simulate many members, each exactly as :meth:`mechc.Model.simulate` would.

    Parameters
    ----------
    t_span, rtol, atol, method, lockstep, first_step, max_step, max_steps
        As in ``simulate``, the same for all members.
    y0
        States (nq + nu,) or (n, nq + nu), or a :class:`mechc.Assembly`, which closes the loops
        of each member with its own parameters; so does a mapping of coordinates and speeds.
    params
        Names to numbers or arrays (n,), or an array (np,) or (n, np) of all.
    inputs
        Name -> number, one a member (n,), samples ``(times, values)`` or a :class:`mechc.Signal`
        that all members have; besides those of ``model.with_inputs``.  A :class:`mechc.Sampled`
        controller, or a list of them (n,), one a member; they are called for one member after
        another.  With functions of Python, which all members share, one thread computes.
    t_eval
        Times (nt,) at which to keep states, and ``outputs`` if any are named.
    states
        False: keep only the outputs at ``t_eval``.
    reduce
        Numbers of each trajectory, computed during the run: ``"max(theta_2)"``,
        ``"mean(energy)"``, ``"first(theta_0 > 180deg)"``; the grammar is in
        :mod:`mechc.batch.reductions`.  ``("max", q)`` takes a symbol.  Extremes are those of the
        dense output, not of the steps.
    until
        A crossing at which a member's run ends, with the status ``"stopped by an event"``:
        ``"theta_0 > 360deg"``, of a quantity as in ``reduce``.
    events
        As in ``simulate``, whose motions these are to the last bit.  With functions of Python
        one thread computes.  ``batch.event_counts`` (n, k) has
        how many zeros each of k events had, ``batch.event_latest`` (n, k) the time of the last, NaN
        without one, ``batch.lowered_impacts`` (n,) how many impacts had less than the whole
        restitution, as :class:`mechc.Stop` says.
    sensitivities
        Names that derivatives of the states are by, as in ``simulate``, one number each:
        parameters, coordinates and speeds that members are assembled with, inputs, values of
        signals, components of a whole start (``"y0"`` stands for ``"y0[0]"``, ``"y0[1]"``, ...).
        ``batch.sensitivity_final`` (n, nq + nu, k) has them at the end, ``batch.sensitivity_max``
        their largest absolute values, ``batch.sensitivity`` (n, nt, nq + nu, k) at t_eval; NaN
        where there is none.  Each member's motion is computed once more for them.  Not with
        ``until`` and ``events``.
    sensitivity_error_control
        As of ``simulate``: the motions that derivatives are taken of have steps for these too.
    on_change_point
        ``"continue"`` or ``"stop"``.
    threads
        All cores this process may use when None.
    out
        A folder to stream the results into, as Zarr (``pip install zarr``).  A call that was
        killed is resumed when it is repeated: what is computed is kept every few seconds.
    chunk
        Members of one file, and the most that are computed at a time; memory beyond the arguments
        is about two chunks of results with ``out``.
    client
        A ``dask.distributed.Client``: its workers compute the chunks.
    progress
        Show a bar on a terminal, with rate and time left.

    Returns
    -------
    Batch
        The results requested, by name; ``to_xarray()`` labels them.  A member that fails has a
        status and its results until then.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, MechcError, ValueError
        For wrong arguments; before anything is computed.
    InputError, EventError
        If a function of Python fails.
    RunInterrupt
        At Ctrl-C, a KeyboardInterrupt: ``error.batch`` has the members that are finished.
    """
    span = checked_span(t_span)
    times = np.zeros(0) if t_eval is None else checked_times(t_eval, span)
    if on_change_point == "raise":
        raise ValueOutOfBoundsError(
            "a batch raises no error for one member: use on_change_point='stop' or 'continue'"
        )
    given = checked_inputs(system, inputs)
    policy = checked_policy(
        system, rtol=rtol, atol=atol, method=method, first_step=first_step, max_step=max_step,
        max_steps=max_steps, dense=True, on_change_point=on_change_point, lockstep=lockstep,
        calls_python=bool(given.functions),
    )  # fmt: skip
    recipe = checked_recipe(
        system, span, y0, params, times, states, names_of(outputs), _reductions(reduce),
        "" if until is None else until, policy, given,
    )  # fmt: skip
    by = one_number_each(system, names_of(sensitivities))
    recipe = replace(
        recipe, events=batch_events(system, span, events), sensitivities=by,
        sensitivity_error_control=bool(sensitivity_error_control and by),
    )  # fmt: skip
    functions = recipe.inputs.calls_python or (recipe.events is not None and not recipe.events.key)
    if functions and (out is not None or client is not None):  # nor do they identify a batch
        raise ValueOutOfBoundsError(
            "controllers, and events and inputs that are functions of Python, exist in this "
            "process only: omit out= and client=, or give expressions and signals"
        )
    if recipe.sensitivities:
        refuse_without_derivatives(recipe.policy.method)
        check_names(system, recipe)
    workers = _checked_threads(threads)
    size = _whole("chunk", chunk)
    compute: Compute = partial(_compute_here, system, recipe, workers, out is not None)
    if client is not None:
        from mechc.batch.cluster import compute_on

        compute = partial(compute_on, client, system, recipe)  # by the workers of a cluster
    with CountBar(f"simulating {recipe.count} x {system.name}", recipe.count) as bar:
        report = bar.update_count if progress else lambda _: None
        if out is not None:
            from mechc.batch.stored.store import stream

            return stream(system, recipe, Path(out), size, compute, report)
        return _collect(system, recipe, size, compute, report)


def _reductions(reduce: Any) -> list[str]:
    """Reductions as texts: ("max", q) is max(q), by name or symbol."""
    pair = isinstance(reduce, tuple) and len(reduce) == 2
    one = isinstance(reduce, str) or (
        pair and not (isinstance(reduce[0], str) and "(" in reduce[0])
    )
    if not one and (not isinstance(reduce, Iterable) or getattr(reduce, "ndim", 1) == 0):
        raise TypeError(f"reduce= takes texts, such as 'max(theta_2)', not {brief(reduce)}")
    several = [reduce] if one else list(reduce)
    for each in several:
        if not isinstance(each, str) and (not isinstance(each, tuple) or len(each) != 2):
            raise ValueOutOfBoundsError(
                "a reduction is a text such as 'max(theta_2)' or ('max', symbol), not "
                f"{brief(each)}"
            )
    return [x if isinstance(x, str) else f"{x[0]}({name_of(x[1])})" for x in several]


def _checked_threads(threads: int | None) -> int:
    """The number of threads: as requested, or all cores that this process may use."""
    if threads is None:
        return cores()
    asked, most = _whole("threads", threads), THREADS_A_CORE * cores()
    if asked > most:
        raise ValueOutOfBoundsError(
            f"threads = {asked}: this process may use {cores()} cores, and more than {most} "
            "threads make it slower"
        )
    return asked


def _whole(name: str, value: int) -> int:
    number = checked_count(name, value)
    if number != value:
        raise ValueOutOfBoundsError(f"{name} = {value} must be a whole number above 0")
    return number


def _compute_here(
    system: System, recipe: Recipe, threads: int, in_pieces: bool,
    ranges: Sequence[tuple[int, int]], report: Callable[[int], None],
) -> Iterator[Chunk]:  # fmt: skip
    """Compute ranges of members, ``in_pieces`` of some seconds each, a chunk at most."""
    done = recipe.count - sum(last - first for first, last in ranges)
    members = run_controlled if recipe.inputs.controllers else run_members
    least = count = threads * system.scene.lanes  # what fills the lanes of all threads
    for first, end in ranges:
        while first < end:
            last = min(first + count, end) if in_pieces else end
            started = time.monotonic()
            found, complete = members(
                system,
                recipe.cut(first, last),
                threads,
                lambda more, before=done: report(before + more),  # type: ignore[misc]
            )
            computed = time.monotonic()
            yield first, found, complete
            if not complete:
                return
            seconds = max(KEEP_EVERY, (time.monotonic() - computed) / WRITING)
            a_member = max(computed - started, 1e-9) / (last - first)
            count = max(least, int(seconds / a_member) // least * least)
            done, first = done + last - first, last


def _collect(
    system: System, recipe: Recipe, size: int, compute: Compute, report: Callable[[int], None]
) -> Batch:
    """A batch with all results in memory."""
    arrays: dict[str, Array] = {}
    complete = True
    try:
        for first, found, whole in compute(recipe.ranges(size), report):
            for name, values in found.items():
                if len(values) == recipe.count:
                    arrays[name] = np.array(values)  # a copy: y0 may be the caller's
                    continue
                if name not in arrays:
                    blank = np.nan if values.dtype.kind == "f" else 0  # where there is no result
                    shape = (recipe.count, *values.shape[1:])
                    arrays[name] = np.full(shape, blank, values.dtype)
                arrays[name][first : first + len(values)] = values
            complete = complete and whole
    except KeyboardInterrupt:
        complete = False
    if not (complete or arrays):
        raise KeyboardInterrupt
    storable = recipe.inputs._replace(functions={}, controllers={})  # and can be sent to workers
    kept = replace(recipe, inputs=storable)
    return Batch(system, kept, arrays, complete)
