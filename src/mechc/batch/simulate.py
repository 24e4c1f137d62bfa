"""Many trajectories of one model: Monte Carlo, parameter studies, data for learning."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.batch.run import cores, run_members
from mechc.batch.spec import Assembly, Recipe, checked_recipe
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.progress import CountBar
from mechc.simulation.settings import (
    checked_count,
    checked_policy,
    checked_span,
    checked_times,
)
from mechc.simulation.status import CODES, Status, status_of
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

CHUNK = 4096  # members computed, and stored, at a time
THREADS_A_CORE = 16
ENDED = ("finished", "stopped by an event")
REACHED = (1, 109)  # the end, or the crossing asked for
Chunk = tuple[int, dict[str, Array], bool]  # first member, arrays, whether complete
__all__ = ["Assembly", "Batch", "simulate_batch"]


def simulate_batch(
    model: Model,
    t_span: float | tuple[float, float],
    y0: Array | Assembly,
    params: Parameters = None,
    *,
    t_eval: Array | None = None,
    states: bool = True,
    outputs: Sequence[str] = (),
    reduce: Sequence[str] | str = (),
    until: str | None = None,
    rtol: float = 1e-9,
    atol: float | Array | None = None,
    method: str = "auto",
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
    """Simulate many members, each exactly as :func:`mechc.simulation.simulate.simulate` would.

    Parameters
    ----------
    t_span, rtol, atol, method, first_step, max_step, max_steps
        As in ``simulate``, the same for all members.
    y0
        States (nq + nu,) or (n, nq + nu), or a :class:`mechc.Assembly`, which closes the loops
        of each member with its own parameters.
    params
        Names to numbers or arrays (n,), or an array (np,) or (n, np) of all.
    t_eval
        Times (nt,) at which to keep states, and ``outputs`` if any are named.
    states
        False: keep only the outputs at ``t_eval``.
    reduce
        Numbers that stand for a whole trajectory, computed as it goes: ``"max(theta_2)"``,
        ``"mean(energy)"``, ``"first(theta_0 > 180deg)"``; the grammar is in
        :mod:`mechc.batch.reductions`.  Extremes are those of the dense output, not of the steps.
    until
        A crossing at which a member's run ends, with the status ``"stopped by an event"``:
        ``"theta_0 > 360deg"``, of a quantity as in ``reduce``.
    on_change_point
        ``"continue"`` or ``"stop"``.
    threads
        All cores this process may use when None.
    out
        A folder to stream the results into, as Zarr (``pip install zarr``).  A call that was
        killed goes on where it stopped when it is made again.
    chunk
        Members computed and written at a time; memory beyond the arguments is about two
        chunks of results with ``out``.
    client
        A ``dask.distributed.Client``: its workers compute the chunks.
    progress
        Show a bar on a terminal, with rate and time left.

    Returns
    -------
    Batch
        What was asked for, by name; ``to_xarray()`` labels it.  A member that fails has a status
        and keeps what it reached; Ctrl-C keeps the members that are done.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, MechcError, ValueError
        For arguments that cannot be; before anything is computed.
    """
    recipe = _recipe(
        model, t_span, y0, params, t_eval, states, outputs, reduce, until, rtol, atol, method,
        first_step, max_step, max_steps, on_change_point,
    )  # fmt: skip
    workers = _checked_threads(threads)
    size = _whole("chunk", chunk)
    compute = _source(model, recipe, workers, client)
    with CountBar(f"simulating {recipe.count} x {model.name}", recipe.count) as bar:
        report = bar.update_count if progress else _silent
        if out is not None:
            from mechc.batch.store import stream

            return stream(model, recipe, Path(out), size, compute, report)
        return _collect(model, recipe, size, compute, report)


def _recipe(
    model: Model, t_span: Any, y0: Any, params: Parameters, t_eval: Any, states: bool,
    outputs: Sequence[str], reduce: Sequence[str] | str, until: str | None, rtol: float,
    atol: Any, method: str, first_step: float | None, max_step: float, max_steps: int,
    on_change_point: str,
) -> Recipe:  # fmt: skip
    """Everything checked that can be before anything is computed."""
    span = checked_span(t_span)
    times = np.zeros(0) if t_eval is None else checked_times(t_eval, span)
    if on_change_point == "raise":
        raise ValueOutOfBoundsError(
            "a batch does not raise for one member: take on_change_point='stop' or 'continue'"
        )
    policy = checked_policy(
        model, rtol=rtol, atol=atol, method=method, first_step=first_step, max_step=max_step,
        max_steps=max_steps, dense=True, on_change_point=on_change_point,
    )  # fmt: skip
    reductions = (reduce,) if isinstance(reduce, str) else tuple(reduce)
    named = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    return checked_recipe(
        model, span, y0, params, times, states, named, reductions, until or "", policy
    )


def _checked_threads(threads: int | None) -> int:
    """As many as this process may use cores, or as are asked for."""
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


def _silent(_: int) -> None:
    pass


Compute = Callable[[Sequence[tuple[int, int]], Callable[[int], None]], Iterator[Chunk]]


def _source(model: Model, recipe: Recipe, threads: int, client: Any) -> Compute:
    """What turns ranges of members into results: this process, or a cluster's workers."""
    if client is not None:
        from mechc.batch.cluster import compute_on

        return lambda ranges, report: compute_on(client, model, recipe, ranges, report)
    return lambda ranges, report: _compute_here(model, recipe, threads, ranges, report)


def _compute_here(
    model: Model, recipe: Recipe, threads: int, ranges: Sequence[tuple[int, int]],
    report: Callable[[int], None],
) -> Iterator[Chunk]:  # fmt: skip
    done = recipe.count - sum(last - first for first, last in ranges)
    for first, last in ranges:
        found, complete = run_members(
            model, recipe.cut(first, last), threads, partial(_report_more, report, done)
        )
        done += last - first
        yield first, found, complete
        if not complete:
            return


def _report_more(report: Callable[[int], None], before: int, more: int) -> None:
    report(before + more)


def ranges_of(count: int, size: int) -> list[tuple[int, int]]:
    """First and last + 1 member of every chunk."""
    return [(first, min(first + size, count)) for first in range(0, count, size)]


def _collect(
    model: Model, recipe: Recipe, size: int, compute: Compute, report: Callable[[int], None]
) -> Batch:
    """All results in memory."""
    arrays: dict[str, Array] = {}
    complete = True
    try:
        for first, found, whole in compute(ranges_of(recipe.count, size), report):
            for name, values in found.items():
                if name not in arrays:
                    arrays[name] = _empty(values, recipe.count)
                arrays[name][first : first + len(values)] = values
            complete = complete and whole
    except KeyboardInterrupt:
        complete = False
    return Batch(model, recipe, arrays, complete)


def _empty(values: Array, count: int) -> Array:
    """Room for all members; NaN, or 0, where nothing comes."""
    blank = np.nan if values.dtype.kind == "f" else 0
    return np.full((count, *values.shape[1:]), blank, values.dtype)


class Batch:
    """The results of many members.

    Attributes
    ----------
    model, recipe
        What was simulated.
    complete
        False where Ctrl-C came first: the members left have the status ``"not run"``.
    arrays
        Name -> array with the members first: ``y`` (n, nq + nu) final states, ``t`` (n,) times
        reached, ``y0`` (n, nq + nu) starts, ``status`` (n,), counters, ``y_eval``
        (n, nt, nq + nu); a Zarr array where the batch was streamed to a file.
    """

    def __init__(
        self, model: Model, recipe: Recipe, arrays: Mapping[str, Any], complete: bool = True
    ) -> None:
        self.model, self.recipe = model, recipe
        self.arrays, self.complete = arrays, complete

    def __len__(self) -> int:
        return self.recipe.count

    def __getitem__(self, name: str) -> Array:
        """An array of ``arrays``, a reduction, or an output, by name."""
        return np.asarray(self.arrays[self._key(name)])

    def _key(self, name: str) -> str:
        keys = {key: key for key in self.arrays}
        keys |= {text: f"output_{i}" for i, text in enumerate(self.recipe.outputs)}
        keys |= {
            "".join(text.split()): f"reduction_{i}" for i, text in enumerate(self.recipe.reductions)
        }
        short = name if name in keys else "".join(name.split())
        if short not in keys:
            raise UnknownNameError("result", name, keys)
        return keys[short]

    @property
    def y(self) -> Array:
        """States at the end of each member's run (n, nq + nu)."""
        return self["y"]

    @property
    def t(self) -> Array:
        """Times reached (n,), s."""
        return self["t"]

    @property
    def t_eval(self) -> Array:
        """The times (nt,) of ``y_eval`` and of outputs, s."""
        return self.recipe.t_eval

    @cached_property
    def ok(self) -> Array:
        """Whether each member reached the end, or the crossing that ends it."""
        return np.asarray(np.isin(self["status"], REACHED))

    def status(self, member: int) -> Status:
        """How one member ended, in words by ``str``."""
        code, t = int(self["status"][member]), float(self["t"][member])
        return status_of(code, t, "some speed", float(self["critical_gap"][member]))

    @cached_property
    def counts(self) -> dict[str, int]:
        """Outcome in words -> how many members ended so."""
        codes, counts = np.unique(self["status"], return_counts=True)
        return {CODES[int(c)][0]: int(n) for c, n in zip(codes, counts, strict=True)}

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a careful reader should know of the whole batch."""
        told = []
        met = int(np.count_nonzero(self["change_points"]))
        if met:
            told.append(
                f"{met} members passed change points, where the links are in line and two motions "
                "are possible: the ideal mechanism goes straight on, as computed"
            )
        failed = {what: n for what, n in self.counts.items() if what not in ENDED}
        if failed:
            words = ", ".join(f"{n} {what}" for what, n in failed.items())
            told.append(f"not all members reached the end: {words}")
        return tuple(told)

    def to_xarray(self) -> Any:
        """Everything as an ``xarray.Dataset`` over ``member``, ``state`` and ``time``.

        Parameters, coordinates and speeds that differ between members are coordinates along
        ``member``; reductions and outputs are called as they were asked for, with what files do
        not take replaced by ``_``.
        """
        from mechc.batch.store import to_dataset

        return to_dataset(self)

    def __repr__(self) -> str:
        words = ", ".join(f"{n} {what}" for what, n in self.counts.items())
        return f"<mechc.Batch of {self.model.name}: {len(self)} members, {words or 'none'}>"
