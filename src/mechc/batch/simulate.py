"""Many trajectories of one model: Monte Carlo, parameter studies, data for learning."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mechc.batch.results import Batch
from mechc.batch.run import cores, run_controlled, run_members
from mechc.batch.spec import Chunk, Compute, Recipe
from mechc.errors import ValueOutOfBoundsError, brief
from mechc.progress import CountBar
from mechc.simulation.settings import checked_count
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.system import System

KEEP_EVERY = 3.0  # s between manifests of a batch that is streamed
GO_OVER_AFTER = 0.15  # s until it is asked whether parts are compiled, each time twice as long
WRITING = 0.1  # of the time, at most, where members have so many numbers that writing takes long
THREADS_A_CORE = 16


def compute_batch(
    system: System, recipe: Recipe, *, threads: int, out: str | Path | None, chunk: int,
    client: Any, progress: bool,
) -> Batch:  # fmt: skip
    """Compute a batch in memory, or in the folder ``out``; see ``Model.simulate_batch``."""
    compute: Compute = partial(_compute_here, system, recipe, threads, out is not None)
    if client is not None:
        from mechc.batch.cluster import compute_on

        compute = partial(compute_on, client, system, recipe)  # by the workers of a cluster
    with CountBar(f"simulating {recipe.count} x {system.name}", recipe.count) as bar:
        report = bar.update_count if progress else lambda _: None
        if out is not None:
            from mechc.batch.stored.store import stream

            return stream(system, recipe, Path(out), chunk, compute, report)
        return _collect(system, recipe, chunk, compute, report)


def reduction_texts(reduce: Any) -> list[str]:
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


def checked_threads(threads: int | None) -> int:
    """The number of threads: as requested, or all cores that this process may use."""
    if threads is None:
        return cores()
    asked, most = checked_whole("threads", threads), THREADS_A_CORE * cores()
    if asked > most:
        raise ValueOutOfBoundsError(
            f"threads = {asked}: this process may use {cores()} cores, and more than {most} "
            "threads make it slower"
        )
    return asked


def checked_whole(name: str, value: int) -> int:
    """A whole number above 0."""
    number = checked_count(name, value)
    if number != value:
        raise ValueOutOfBoundsError(f"{name} = {value} must be a whole number above 0")
    return number


def _compute_here(
    system: System, recipe: Recipe, threads: int, in_pieces: bool,
    ranges: Sequence[tuple[int, int]], report: Callable[[int], None],
) -> Iterator[Chunk]:  # fmt: skip
    """Compute ranges of members, ``in_pieces`` of some seconds each, a chunk at most; in smaller
    ones until parts of the scene's own are compiled."""
    done = recipe.count - sum(last - first for first, last in ranges)
    members = run_controlled if recipe.inputs.controllers else run_members
    tried = GO_OVER_AFTER
    least = count = threads * system.scene.lanes  # what fills the lanes of all threads
    for first, end in ranges:
        while first < end:
            goes_over = system.scene.of_members.goes_over
            last = min(first + count, end) if in_pieces or goes_over else end
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
            tried *= 2.0
            least_seconds = KEEP_EVERY if in_pieces else tried
            seconds = max(least_seconds, (time.monotonic() - computed) / WRITING)
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
    return Batch(system, recipe, arrays, complete)
