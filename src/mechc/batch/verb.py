"""The verbs of a model for many runs: batches and sweeps."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from mechc.errors import RunInterrupt, ValueOutOfBoundsError
from mechc.simulation.settings import (
    MOST_STEPS,
    checked_policy,
    checked_span,
    checked_times,
    checked_truth,
    without_series,
)
from mechc.system.names import by_name, names_of
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.assembly.initial_values import Assembly
    from mechc.batch.results import Batch
    from mechc.batch.sweeps.result import Sweep
    from mechc.batch.tolerances.result import Tolerances
    from mechc.outputs import Outputs

Method = TypeVar("Method", bound=Callable[..., Any])
CHUNK = 4096  # members of one file


def with_options_of(other: Callable[..., Any]) -> Callable[[Method], Method]:
    """A decorator that shows the keywords of another method in place of ``**options``."""

    def shown(method: Method) -> Method:
        own = signature(method)
        named = [one for one in own.parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
        more = [
            one for one in signature(other).parameters.values()
            if one.kind is Parameter.KEYWORD_ONLY and one.name not in own.parameters
        ]  # fmt: skip
        vars(method)["__signature__"] = own.replace(parameters=[*named, *more])
        return method

    return shown


def simulate_batch(
    model: Outputs,
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
    lockstep: bool | None = None,
    first_step: float | None = None,
    max_step: float = math.inf,
    max_steps: int = MOST_STEPS,
    on_change_point: str = "continue",
    threads: int | None = None,
    out: str | Path | None = None,
    chunk: int = CHUNK,
    client: Any = None,
    progress: bool = True,
) -> Batch:
    """Simulate many members, each as :meth:`mechc.Model.simulate` would.

    Outputs that the model was not compiled with are compiled first; the motions are then those
    of the wider code, which may differ from others in rounding.

    Parameters
    ----------
    t_span, rtol, atol, method, first_step, max_step, max_steps
        As in ``simulate``, the same for all members.  ``batch.method`` is what ``"auto"`` took.
    lockstep
        Run several members side by side in the SIMD lanes; by default wherever the method and
        the scene allow it.  ``"auto"`` takes the method that is the fastest there.  Members of
        a scene that the lanes do not take run alone, with ``lockstep=True`` too:
        ``batch.method`` says how they ran.
        ``simulate(..., method=batch.method)`` repeats a member of such a batch to the last bit;
        members of one with ``lockstep=False`` are those of ``simulate`` by itself.
    y0
        States (nq + nu,) or (n, nq + nu), or a :class:`mechc.Assembly`, which closes the loops
        of each member with its own parameters; so does a mapping of coordinates and speeds.
    params
        Names to numbers or arrays (n,), or an array (np,) or (n, np) of all.
    inputs
        Name -> number, one a member (n,), an expression as text, samples ``(times, values)`` or
        a :class:`mechc.Signal` that all members have; besides those of ``model.with_inputs``.
        A :class:`mechc.Sampled` controller, or a list of them (n,), one a member; they are
        called for one member after another.  With functions of Python, which all members
        share, one thread computes.
    t_eval
        Times (nt,) at which to keep states, and ``outputs`` if any are named.
    states
        False: keep only the outputs at ``t_eval``.
    reduce
        Numbers of each trajectory, computed during the run: ``"max(theta_2)"``,
        ``"mean(energy)"``, ``"first(theta_0 > 180deg)"``; the grammar is in
        :mod:`mechc.batch.reductions`.  ``("max", q)`` takes a symbol.  Extremes are those of
        the dense output, not of the steps.
    until
        A crossing at which a member's run ends, with the status ``"stopped by an event"``:
        ``"theta_0 > 360deg"``, of a quantity as in ``reduce``.
    events
        As in ``simulate``, whose motions these are to the last bit.  With functions of Python
        one thread computes.  ``batch.event_counts`` (n, k) has how many zeros each of k events
        had, ``batch.event_latest`` (n, k) the time of the last, NaN without one,
        ``batch.lowered_impacts`` (n,) how many impacts had less than the whole restitution,
        as :class:`mechc.Stop` says.
    sensitivities
        Names that derivatives of the states are by, as in ``simulate``, one number each:
        parameters, coordinates and speeds that members are assembled with, inputs, values of
        signals, components of a whole start (``"y0"`` stands for ``"y0[0]"``, ``"y0[1]"``,
        ...).  ``batch.sensitivity_final`` (n, nq + nu, k) has them at the end,
        ``batch.sensitivity_max`` their largest absolute values, ``batch.sensitivity``
        (n, nt, nq + nu, k) at t_eval; NaN where there is none.  Each member's motion is
        computed once more for them.  Not with ``until`` and ``events``.
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
        Members of one file, and the most that are computed at a time; memory beyond the
        arguments is about two chunks of results with ``out``.
    client
        A ``dask.distributed.Client``: its workers compute the chunks.
    progress
        Show rate and time left: a bar on a terminal, elsewhere a line every ten seconds.

    Returns
    -------
    Batch
        The results requested, by name; ``to_xarray()`` labels them.  A member that fails has a
        status, its results until then, and NaN for what the rest of its motion could change:
        reductions but for a first crossing that it had.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, MechcError, ValueError
        For wrong arguments; before anything is computed.
    InputError, EventError
        If a function of Python fails.
    RunInterrupt
        At Ctrl-C, a KeyboardInterrupt: ``error.batch`` has the members that are finished.
    """
    from mechc.batch.driven import checked_inputs
    from mechc.batch.events import batch_events
    from mechc.batch.sensitivities import check_names, one_number_each
    from mechc.batch.simulate import (
        checked_threads,
        checked_whole,
        compute_batch,
        reduction_texts,
    )
    from mechc.batch.spec import checked_recipe, system_for_results

    model, inputs = model._with_laws(inputs)
    span = checked_span(t_span)
    times = np.zeros(0) if t_eval is None else checked_times(t_eval, span)
    if on_change_point == "raise":
        raise ValueOutOfBoundsError(
            "a batch raises no error for one member: use on_change_point='stop' or 'continue'"
        )
    states = checked_truth("states", states)
    if lockstep is not None:
        lockstep = checked_truth("lockstep", lockstep)
    asked, reductions = names_of(outputs), reduction_texts(reduce)
    by_names = names_of(sensitivities)
    system = system_for_results(model.system, asked, reductions, until, by_names)
    given = checked_inputs(system, inputs)
    policy = checked_policy(
        system, rtol=rtol, atol=atol, first_step=first_step, max_step=max_step,
        method=without_series(system, method) if by_names and not lockstep else method,
        max_steps=max_steps, dense=True, on_change_point=on_change_point, lockstep=lockstep,
        several=not (given.controllers or by_names),  # else members run one after another
        calls_python=bool(given.functions),
    )  # fmt: skip
    recipe = checked_recipe(
        system, span, y0, params, times, states, asked, reductions,
        "" if until is None else until, policy, given,
    )  # fmt: skip
    by = one_number_each(system, by_names)
    recipe = replace(
        recipe, events=batch_events(system, span, events), sensitivities=by,
        sensitivity_error_control=bool(sensitivity_error_control and by),
    )  # fmt: skip
    own_events = recipe.events is not None and not recipe.events.key
    functions = recipe.inputs.calls_python or own_events
    if functions and (out is not None or client is not None):  # nor do they identify a batch
        raise ValueOutOfBoundsError(
            "controllers, and events and inputs that are functions of Python, exist in this "
            "process only: omit out= and client=, or give expressions and signals"
        )
    if recipe.sensitivities:
        check_names(system, recipe)
    batch = compute_batch(
        system, recipe, threads=checked_threads(threads), out=out,
        chunk=checked_whole("chunk", chunk), client=client, progress=progress,
    )  # fmt: skip
    batch.model = model
    if not batch.complete:
        raise RunInterrupt(
            "interrupted; error.batch has the members that are finished", batch=batch
        )
    return batch


@with_options_of(simulate_batch)
def sweep(
    model: Outputs,
    t_span: float | tuple[float, float],
    vary: Mapping[Any, Any] | Sequence[str],
    params: Parameters = None,
    *,
    sample: str = "grid",
    count: int | None = None,
    seed: int = 0,
    start: Mapping[Any, Any] | None = None,
    guess: Mapping[Any, Any] | None = None,
    reduce: Sequence[str] | str = (),
    **options: Any,
) -> Sweep:
    """Many runs over ranges of values, as ``mechc sweep``.

    ``model.sweep(5, {"l_3": (3.4, 4.6, 61), "theta_0": ("60deg", "120deg", 31)})``

    Parameters
    ----------
    t_span
        As in :meth:`simulate_batch`.
    vary
        Name or symbol -> ``(low, high, count)`` in a grid, else ``(low, high)``: parameters,
        coordinates and speeds of the start, in SI units or with one; or texts of the shell,
        ``"l_3=3.4:4.6:61"``.
    params, start, guess
        What is the same for all: parameters; coordinates and speeds of the start, which is
        filled up from the mechanism's; coordinates near the assembly wanted.
    sample
        ``"grid"``: every combination; ``"random"``, ``"sobol"`` (scrambled) or ``"lhs"`` (Latin
        hypercube): members drawn over the ranges.
    count, seed
        How many are drawn, 1024 by default, and the seed of the random numbers.
    reduce
        As in :meth:`simulate_batch`; by default the largest value of the last coordinate.
    **options
        Other options of :meth:`simulate_batch`.

    Returns
    -------
    Sweep
        ``sweep["max(theta_2)"]`` on the grid, ``sweep.batch``, ``sweep.plot()``; a summary by
        ``print``.

    Raises
    ------
    MechcError, UnknownNameError, ValueOutOfBoundsError
        For a name, range or count that there cannot be; what both varies and is fixed; and as
        :meth:`simulate_batch`.
    RunInterrupt
        At Ctrl-C: ``error.sweep`` has the members that are finished.
    """
    from mechc.batch.sweeps.result import Sweep
    from mechc.batch.sweeps.sweep import members, plan, read_variation, variation

    if isinstance(vary, Mapping):
        ranges = by_name(vary, "what varies", "{'l_3': (3.4, 4.6, 61)}")
        variations = [variation(model, name, given) for name, given in ranges.items()]
    else:
        variations = [read_variation(model, text) for text in vary]
    chosen = plan(variations, sample, count, seed)
    fixed = (
        by_name({} if given is None else given, what)
        for given, what in ((params, "params"), (start, "start"), (guess, "guess"))
    )
    starts, values = members(model.system, chosen, *fixed)
    reductions = reduce or [f"max({model.coordinates[-1]})"]
    began = time.perf_counter()
    try:
        batch = simulate_batch(model, t_span, starts, values, reduce=reductions, **options)
    except RunInterrupt as interrupt:
        found = Sweep(interrupt.batch, chosen, time.perf_counter() - began)
        words = "interrupted; error.sweep has the members that are finished"
        raise RunInterrupt(words, batch=found.batch, sweep=found) from None
    return Sweep(batch, chosen, time.perf_counter() - began)


def tolerances(
    model: Outputs,
    tolerances: Mapping[Any, Any],
    of: Sequence[Any] | str,
    t_span: float | tuple[float, float],
    y0: Array | Mapping[Any, float] | None = None,
    params: Parameters = None,
    *,
    guess: Mapping[Any, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    count: int = 1000,
    distribution: str = "normal",
    seed: int = 0,
    events: Sequence[Any] = (),
    rtol: float = 1e-9,
    method: str = "auto",
) -> Tolerances:
    """What tolerances of parts do to results of a motion.

    ``model.tolerances({"l_1": "0.05 mm", "l_2": "0.1 mm"}, of=["max(theta_2)"], t_span=5)``

    First-order effects by exact derivatives of the motion, and beside them a batch of motions with
    drawn parts, which shows where the first order does not hold.

    Parameters
    ----------
    tolerances
        Name or symbol -> tolerance, in SI units or with one: a part lies within +- this of its
        nominal value.  Parameters, coordinates and speeds of the start, inputs that are numbers.
        Parameters whose defaults follow one of them move with it.
    of
        The results, one or several: reductions as in :meth:`simulate_batch`, ``"max(theta_2)"``,
        ``"first(theta_0 > 180deg)"``, ``"final(points[2,0])"``.
    t_span, params, inputs, events, rtol, method
        As in :meth:`simulate`; the values are the nominal ones.
    y0
        Coordinates and speeds of the start, which every motion is assembled with; by default the
        model's own start.  A state (nq + nu,) where there are no loops.
    guess
        Coordinates near the assembly wanted, as in :meth:`assemble`.
    count, seed
        How many motions are drawn, and the seed of the random numbers.
    distribution
        How parts lie within their tolerances: ``"normal"``, a tolerance being three standard
        deviations, or ``"uniform"``.  Parts are independent of each other.

    Returns
    -------
    Tolerances
        A table by ``print``, with notes on where drawn motions and the first order differ;
        ``slopes``, ``effects``, ``shares``, ``worst_case``, ``root_sum_square``, ``drawn``,
        ``batch``, ``to_dict()``, ``to_dataframe()``, ``plot()``; see docs/how_to/tolerances.md.

    Raises
    ------
    MechcError
        If the nominal motion does not reach its end.
    UnavailableOutputError
        If the model cannot be compiled with sensitivities: its description is not at hand.
    UnknownNameError, ValueOutOfBoundsError
        For wrong names, units, tolerances, results and distributions.
    """
    from mechc.batch.tolerances.find import tolerances as find

    checked_policy(model.system, rtol=rtol, method=method)
    return find(
        model, tolerances, of, t_span, y0, params, guess=guess, inputs=inputs, count=count,
        distribution=distribution, seed=seed,
        policy={"rtol": rtol, "method": method, "events": events},
    )  # fmt: skip
