"""One trajectory: from a state and a time span to a :class:`mechc.simulation.solution.Solution`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import ChangePointError, EventError, ValueOutOfBoundsError
from mechc.simulation.events import Event, EventFinder, EventRecord, FunctionFailedError
from mechc.simulation.initialise import begin, checked_state, leave_change_point
from mechc.simulation.segments import Chain, Piece, Until
from mechc.simulation.settings import (
    Policy,
    checked_change_point,
    checked_count,
    checked_policy,
    checked_span,
    checked_times,
)
from mechc.simulation.solution import Solution
from mechc.simulation.status import status_of
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

CHUNK = 2000  # attempted steps between looks at signals and progress
EVENT_CHUNK = 50
AT_CHANGE_POINT, STOPPED_AT_CHANGE_POINT = 9, 10
INTERRUPTED, STOPPED_BY_EVENT, EVENT_FAILED, INPUT_FAILED = 108, 109, 110, 113


def simulate(
    model: Model,
    t_span: float | tuple[float, float],
    y0: Array,
    params: Parameters = None,
    *,
    rtol: float = 1e-9,
    atol: float | Array | None = None,
    t_eval: Array | None = None,
    method: str = "auto",
    first_step: float | None = None,
    max_step: float = math.inf,
    max_steps: int = 10_000_000,
    dense: bool = True,
    events: Sequence[Any] = (),
    on_change_point: str = "continue",
    progress: Callable[[float], None] | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> Solution:
    """Integrate the motion, every stage and every accepted state on the constraints.

    Parameters
    ----------
    t_span
        ``(t0, t1)`` in s, forwards or backwards, or ``t1`` alone with t0 = 0.
    y0
        State (nq + nu,) at t0, from ``model.assemble``.  One that is off the constraints by
        rounding is projected onto them.
    params
        A mapping of some parameters or an array (np,) of all; defaults otherwise.
    rtol, atol
        Tolerated error.  ``atol=None``: rtol times each component's scale (1 rad, the model's
        length, speeds by their largest value so far); else ``atol + rtol |y|`` as in SciPy.
    t_eval
        Times to report at, within the span; the accepted steps when None.
    method
        ``"dopri5"`` or ``"dop853"`` (Dormand & Prince of order 5 and 8, explicit),
        ``"gauss8"`` (collocation of order 16, eight stages side by side in SIMD lanes),
        ``"radau5"`` (Radau IIA of order 5, for stiff scenes), or ``"auto"``: ``"gauss8"``, or
        ``"dop853"`` where the equations have kinks (``Abs``), going over to ``"radau5"`` where
        stability limits the steps.
    first_step, max_step, max_steps
        First and largest step in s, and the largest number of attempted steps.
    dense
        Keep what ``sol(t)`` needs.
    events
        Functions ``g(t, y)`` whose zeros are found on the dense output, each an
        :class:`mechc.Event` or a function with SciPy's attributes ``direction`` and
        ``terminal``; their times and states are in ``sol.events``.
    on_change_point
        At a configuration where the mechanism has more than one way on: ``"continue"`` straight
        on along the same branch, ``"stop"`` before it, or ``"raise"``
        :class:`mechc.ChangePointError`.  Passages are in ``sol.change_points``.
    progress
        Called now and then with the fraction done.
    inputs
        What each input that was left open when compiling is: a number, a
        :class:`mechc.Signal`, a function ``f(t)`` or ``f(t, q, u)``, or a tuple of functions of t
        with the derivatives of the first; see :meth:`mechc.Model.with_inputs`.  ``sol.model`` is
        then the model driven by them.

    Raises
    ------
    AssemblyError
        If y0 does not satisfy the constraints; the message has the gap.
    UnknownNameError, ValueOutOfBoundsError, ValueError
        For bad names, values and shapes.

    Notes
    -----
    What goes wrong during the run does not raise: it ends with ``sol.status``, and what was
    computed until then is kept; so does Ctrl-C.  A failing event function raises
    :class:`mechc.EventError`, a failing input :class:`mechc.InputError`, which hold the motion
    until then.
    """
    if inputs is not None:
        model = model.with_inputs(inputs)
    values = model._parameters.resolve(params)
    if values.ndim != 1:
        raise ValueOutOfBoundsError("simulate takes one set of parameters at a time")
    events = [events] if callable(events) or isinstance(events, Event) else list(events)
    span = checked_span(t_span)
    times = None if t_eval is None else checked_times(t_eval, span)
    policy = checked_policy(
        model, rtol=rtol, atol=atol, method=method, first_step=first_step, max_step=max_step,
        max_steps=max_steps, dense=bool(dense) or times is not None or len(events) > 0,
        on_change_point=on_change_point,
    )  # fmt: skip
    state = checked_state(model, y0, values, span[0])
    sol = run(model, span, state, values, policy, times, events, progress, y0)
    if on_change_point == "raise" and sol.change_points:
        raise ChangePointError(_met(sol), sol)
    return sol


def run(
    model: Model,
    span: tuple[float, float],
    state: Array,
    values: Array,
    policy: Policy,
    times: Array | None = None,
    events: Sequence[Any] = (),
    progress: Callable[[float], None] | None = None,
    typed: Array | None = None,
) -> Solution:
    """Integrate with everything checked already; ``typed`` is the state before projection."""
    started = time.perf_counter()
    compiled = begin(model, span, state, values, policy)
    if compiled.status == AT_CHANGE_POINT:
        first = state if typed is None else typed
        compiled = leave_change_point(model, span, first, values, policy) or compiled
    return _driven(model, span, compiled, values, policy, times, events, progress, started)


def _driven(
    model: Model,
    span: tuple[float, float],
    compiled: Piece,
    values: Array,
    policy: Policy,
    times: Array | None,
    events: Sequence[Any],
    progress: Callable[[float], None] | None,
    started: float,
    first: int = 0,
) -> Solution:
    """Advance a run to its end; events are looked for from its accepted state ``first`` on."""
    finder = EventFinder(events, compiled, model._scene.width, first) if events else None
    code, stop = _drive(compiled, span, finder, progress)
    driven = model._driven
    if driven is not None and driven.failed:
        code = INTERRUPTED if driven.interrupted else INPUT_FAILED
    stats = compiled.stats()
    stats["wall_s"] = time.perf_counter() - started
    stats["method"] = policy.method
    bad = stats.pop("coordinate")
    status = status_of(
        code,
        compiled.t if stop is None else stop,
        model.speeds[bad] if bad >= 0 else "",
        stats["critical_gap"],
        (
            *_warnings(compiled, code, stop),
            *(driven.notes() if driven else ()),
            *(finder.notes() if finder else ()),
        ),
    )
    found = finder.records() if finder else ()
    failure = finder.failure if finder else None
    if code == INPUT_FAILED and driven is not None:
        status = replace(status, cause=driven.failure_in_words())
    if failure is not None:
        status = replace(status, cause=str(failure))
    sol = Solution(model, values, policy, compiled, status, stats, times, found, stop)
    sol._asked = tuple(events)
    if failure is not None:
        told = f"{failure}; error.solution has the motion until there"
        raise EventError(told, sol) from failure.__cause__
    if driven is not None:
        driven.raise_failure(sol)
    return sol


def continued(
    sol: Solution,
    t_end: float,
    *,
    max_steps: int | None = None,
    on_change_point: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """A run and what follows it until ``t_end``, as one; see :meth:`Solution.continue_to`."""
    started = time.perf_counter()
    start, end = sol.span
    _, last = checked_span((end, t_end))
    if (last - end) * (end - start) < 0:
        raise ValueOutOfBoundsError(
            f"the run went from {start:g} to {end:g} s: it cannot be continued to {last:g} s"
        )
    most = sol.policy.max_steps if max_steps is None else max_steps
    policy = sol.policy._replace(
        first_step=0.0,
        max_steps=checked_count("max_steps", most),
        on_change_point=checked_change_point(on_change_point or sol.policy.on_change_point),
    )
    before: Piece = sol._run if sol._stop is None else Until(sol._run, sol._stop)
    state = before.states()[1][-1]
    chain = Chain(before, begin(sol.model, (end, last), state, sol.params, policy))
    whole = _driven(
        sol.model, (end, last), chain, sol.params, policy, None, sol._asked, progress, started,
        before.count - 1,
    )  # fmt: skip
    whole.stats = MappingProxyType(
        {**whole.stats, "wall_s": whole.stats["wall_s"] + sol.stats["wall_s"]}
    )
    whole.events = tuple(
        EventRecord(np.append(old.t, new.t), np.vstack([old.y, new.y]))
        for old, new in zip(sol.events, whole.events, strict=True)
    )
    if policy.on_change_point == "raise" and len(whole.change_points) > len(sol.change_points):
        raise ChangePointError(_met(whole), whole)
    return whole


def _drive(
    compiled: Any,
    span: tuple[float, float],
    finder: EventFinder | None,
    progress: Callable[[float], None] | None,
) -> tuple[int, float | None]:
    """Advance to the end; the final status code, and the time of a terminal event."""
    steps = CHUNK if finder is None else EVENT_CHUNK
    try:
        while True:
            code = compiled.advance(steps)
            stop = finder.look() if finder else None
            if stop is not None:
                return STOPPED_BY_EVENT, stop
            if code != 0:
                return code, None
            if progress is not None:
                progress(abs(compiled.t - span[0]) / abs(span[1] - span[0]))
    except KeyboardInterrupt:
        return INTERRUPTED, None
    except FunctionFailedError as failure:
        assert finder is not None
        finder.failure = failure
        return EVENT_FAILED, None


def _warnings(compiled: Any, code: int, stop: float | None) -> tuple[str, ...]:
    """What an engineer should know about change points passed."""
    if not compiled.passages:
        return ()
    times = compiled.change_points()[0]
    if stop is not None:
        start = compiled.states()[0][0]
        times = times[np.abs(times - start) <= abs(stop - start)]
    if not len(times) or code == STOPPED_AT_CHANGE_POINT:
        return ()
    passages = "a change point" if len(times) == 1 else f"{len(times)} change points"
    return (
        f"Passed {passages}, first at t = {times[0]:.9g} s: there the links are in line and two "
        "motions are possible. The ideal mechanism goes straight on, as computed; a real one, "
        "with any play or tolerance in its lengths, has to be guided",
    )


def _met(sol: Solution) -> str:
    point = sol.change_points[-1]
    where = ", ".join(f"{n} = {x:.9g}" for n, x in zip(sol.model.coordinates, point.q, strict=True))
    return (
        f"a change point at t = {point.t:.9g} s, {where}: the mechanism has two ways on. Pass "
        "on_change_point='continue' to go straight on; error.solution has the motion until there"
    )
