"""One run: from a state and a time span to a :class:`mechc.simulation.trajectory.Trajectory`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from mechc.errors import ChangePointError, EventError, ValueOutOfBoundsError
from mechc.native._codes import (
    AT_CHANGE_POINT,
    EVENT_FAILED,
    FINISHED,
    INPUT_FAILED,
    INTERRUPTED,
    NO_STEP_FITS,
    RUNNING,
    STOPPED_AT_CHANGE_POINT,
    STOPPED_BY_EVENT,
)
from mechc.native._steps import Steps
from mechc.simulation.balance import energy_note
from mechc.simulation.chain import Chain
from mechc.simulation.checkpoints import with_checkpoints
from mechc.simulation.contact.drive import ContactResets
from mechc.simulation.contact.laws import contact_laws
from mechc.simulation.events.compiled import (
    CompiledFinder,
    CompiledResets,
    compiled_finder,
    may_compile,
)
from mechc.simulation.events.event import Event, EventFinder, EventRecord, FunctionFailedError
from mechc.simulation.events.resets import Resets, resets_of
from mechc.simulation.events.stops import refuse_stops
from mechc.simulation.initialise import begin, leave_change_point, reach_end
from mechc.simulation.limits import LIMITED, explained
from mechc.simulation.record import Record
from mechc.simulation.settings import (
    Policy,
    checked_change_point,
    checked_count,
    checked_span,
)
from mechc.simulation.status import status_of
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.system import System

ENDED = (FINISHED, STOPPED_BY_EVENT)
CHUNK = 2000  # attempted steps between checks of signals and progress
COARSE = 0.01  # of rtol: a warning if the spacing of an angle's doubles is larger
FINEST = 1e-12  # below it, of this rtol
Made = TypeVar("Made", bound=Trajectory)


def run(
    made: Callable[..., Made],
    system: System,
    span: tuple[float, float],
    state: Array,
    values: Array,
    policy: Policy,
    times: Array | None = None,
    events: Sequence[Any] = (),
    progress: Callable[[float], None] | None = None,
    typed: Array | None = None,
) -> Made:
    """Integrate; every stage and every accepted state is on the constraints.

    Arguments were checked before: ``state`` (nq + nu,) is on the constraints, ``values`` (np,)
    are all parameters, ``times`` are within the span.  ``typed`` is the state before projection.
    ``made``: :class:`Trajectory`, or a class with the same arguments.

    Raises
    ------
    ChangePointError, EventError, InputError
        Each contains the trajectory until then.
    """
    started = time.perf_counter()
    if system.driven is not None:
        system.driven.restart()
    compiled = begin(system, span, state, values, policy)
    beside = getattr(compiled, "met_critical", False) and policy.on_change_point != "stop"
    if compiled.status == AT_CHANGE_POINT or (beside and compiled.status == RUNNING):
        first = state if typed is None else np.asarray(typed, float)
        runs = leave_change_point(system, span, first, values, policy) or (compiled,)
    else:
        runs = (compiled,)
    if policy.checkpoints is not None:
        runs = (with_checkpoints(runs[-1], policy.checkpoints),)
    chain = Chain(runs, values)
    sol = _driven(made, system, span, chain, policy, times, events, progress, started)
    if policy.on_change_point == "raise" and sol.change_points:
        raise ChangePointError(_met(sol), sol)
    return sol


def _driven(
    made: Callable[..., Made],
    system: System,
    span: tuple[float, float],
    chain: Chain,
    policy: Policy,
    times: Array | None,
    events: Sequence[Any],
    progress: Callable[[float], None] | None,
    started: float,
) -> Made:
    """Advance a run to its end."""
    values, start = chain.record.last.params, chain.record.pieces[0].params
    finder = _finder(events, system, chain, span, values, policy) if events else None
    resets = None
    if finder is not None and resets_of(events) and chain.status == RUNNING:
        kind = _kind_of_resets(system, events, finder)
        resets = partial(kind, system, values, policy, span[1], chain, finder)
    code, stop, finder = _drive(chain, span, finder, progress, resets)
    if code == NO_STEP_FITS and finder is None:
        ended = reach_end(system, chain.record.last, span, policy)
        if ended is not None:
            chain.record.pieces[-1], motion = ended
            chain.add(motion, values)
            code = FINISHED
    driven = system.driven
    if driven is not None and driven.failed:
        code = INTERRUPTED if driven.interrupted else INPUT_FAILED
    if stop is not None:
        chain.record.end_at(stop)
    record = chain.recorded()
    stats = dict(record.stats)
    stats["wall_s"] = time.perf_counter() - started
    stats["method"] = policy.method
    if events:
        stats["lowered_impacts"] = len(finder.lowered) if finder else 0
    bad = stats.pop("coordinate")
    status = status_of(
        code,
        chain.t if stop is None else stop,
        system.speeds[bad] if bad >= 0 else "",
        stats["critical_gap"],
        (
            *_warnings(record, code),
            *_coarse_angles(system, record, policy.rtol),
            *(energy_note(system, record, policy) if code in ENDED else ()),
            *(driven.notes() if driven else ()),
            *(finder.notes() if finder else ()),
        ),
    )
    if code in LIMITED:
        status = explained(status, code, system, record, policy, span)
    found = finder.records() if finder else ()
    failure = finder.failure if finder and code != INPUT_FAILED else None
    if code == INPUT_FAILED and driven is not None:
        status = replace(status, cause=driven.failure_in_words())
    if failure is not None:
        status = replace(status, cause=str(failure))
    sol = made(system, start, policy, record, status, stats, times, found)
    sol._asked = tuple(events)
    if failure is not None:
        told = f"{failure}; error.solution is the motion until then"
        raise EventError(told, sol) from failure.__cause__
    if driven is not None:
        driven.raise_failure(sol)
    return sol


def _finder(
    events: Sequence[Any], system: System, chain: Chain, span: tuple[float, float], values: Array,
    policy: Policy,
) -> EventFinder | None:  # fmt: skip
    """What looks for the events; in compiled code where they are compiled."""
    compiled = compiled_finder(events, system, chain, span, values, policy)
    laws = contact_laws(events)
    slides = any(law.slip is not None for law in laws)
    if laws:
        refuse_stops(system, span, may_compile(chain))
    if compiled is None or slides:
        whole = chain.record if len(chain.runs) > 1 else chain.last
        return EventFinder(events, whole, system.scene.width, policy.rtol)
    return compiled


def _kind_of_resets(system: System, events: Sequence[Any], finder: EventFinder) -> Any:
    if contact_laws(events):
        return ContactResets
    return CompiledResets if isinstance(finder, CompiledFinder) else Resets


def continued(
    sol: Made,
    t_end: float,
    made: Callable[..., Made],
    *,
    max_steps: int | None = None,
    on_change_point: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Made:
    """A run and what follows it until ``t_end``, as one; see :meth:`mechc.Solution.continue_to`."""
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
    state, values = sol.record.ends()[1][1], sol.record.last.params
    run = begin(sol.system, (end, last), state, values, policy)
    chain = Chain((run,), values, before=sol.record)
    events = [event.with_values(values) if isinstance(event, Event) else event
              for event in sol._asked]  # fmt: skip
    whole = _driven(made, sol.system, (end, last), chain, policy, None, events, progress, started)
    whole._asked = sol._asked
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
    chain: Chain,
    span: tuple[float, float],
    finder: EventFinder | None,
    progress: Callable[[float], None] | None,
    begun: Callable[[], Resets] | None = None,
) -> tuple[int, float | None, EventFinder | None]:
    """Advance to the end; the final status code, the time of a terminal event, and what has looked
    for events last."""
    steps = CHUNK if finder is None else finder.steps
    resets = None
    try:
        resets = begun() if begun else None
        code = resets.begin() if resets else RUNNING
        while True:
            finder = resets.finder if resets else finder
            if code != RUNNING:
                return code, None, finder
            code = chain.advance(steps)
            stop = finder.look() if finder else None
            if finder is not None and stop is not None:
                number = finder.stopped_by
                if resets is None or not resets.takes(number):
                    return STOPPED_BY_EVENT, stop, finder
                code = resets.after(stop, number)
            elif code == FINISHED and resets is not None:
                code = resets.finished()
            if progress is not None:
                progress(abs(chain.t - span[0]) / abs(span[1] - span[0]))
    except KeyboardInterrupt:
        return INTERRUPTED, None, resets.finder if resets else finder
    except FunctionFailedError as failure:
        finder = resets.finder if resets else finder
        assert finder is not None
        finder.failure = failure
        return EVENT_FAILED, None, finder


def _warnings(record: Record, code: int) -> tuple[str, ...]:
    """Of a run that crossed change points."""
    if not any(piece.steps.crossings for piece in record.pieces):
        return ()  # nearly always, and fast
    times = record.change_points()[0]
    if not len(times) or code == STOPPED_AT_CHANGE_POINT:
        return ()
    passages = "a change point" if len(times) == 1 else f"{len(times)} change points"
    return (
        f"Crossed {passages}, first at t = {times[0]:.9g} s: there the links are in line and two "
        "motions are possible. The ideal mechanism goes straight on, as computed; a real one, "
        "with any play or tolerance in its lengths, has to be guided",
    )


def _coarse_angles(system: System, record: Record, rtol: float) -> tuple[str, ...]:
    """Of angles so large that their last digit, not the tolerance, decides about the accuracy."""
    finest = COARSE * max(rtol, FINEST)
    steps: Any = record.last.steps if len(record.pieces) == 1 else None
    if type(steps) is Steps and math.ulp(steps.largest(system.angles)) <= finest:
        return ()  # nearly always, and fast
    size = np.abs(record.ends()[1]).max(axis=0)[: len(system.coordinates)]
    angles = np.where(system.angular[: len(size)] & np.isfinite(size), size, 0.0)
    largest = int(np.argmax(angles)) if len(angles) else 0
    if not len(angles) or not np.spacing(angles[largest]) > finest:
        return ()
    return (
        f"{system.coordinates[largest]} comes to {angles[largest]:.3g} rad, where doubles lie "
        f"{np.spacing(angles[largest]):.1g} rad apart: what is computed from the states, closure "
        "and energy too, is no more accurate, at any rtol. Subtract whole turns from the start, "
        "or divide the run into shorter ones",
    )


def _met(sol: Trajectory) -> str:
    point = sol.change_points[-1]
    where = ", ".join(
        f"{n} = {x:.9g}" for n, x in zip(sol.system.coordinates, point.q, strict=True)
    )
    return (
        f"a change point at t = {point.t:.9g} s, {where}: two branches of the motion cross. Pass "
        "on_change_point='continue' to go straight on; error.solution is the motion until then"
    )
