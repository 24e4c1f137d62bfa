"""One run: from a state and a time span to a :class:`mechc.simulation.trajectory.Trajectory`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from mechc.errors import (
    ChangePointError,
    EventError,
    MechcError,
    RunInterrupt,
    ValueOutOfBoundsError,
    brief,
)
from mechc.native._codes import (
    EVENT_FAILED,
    FINISHED,
    INPUT_FAILED,
    INTERRUPTED,
    OPEN_AT_START,
    RUNNING,
    STOPPED_AT_CHANGE_POINT,
    STOPPED_BY_EVENT,
)
from mechc.native._steps import Steps
from mechc.simulation.balance import energy_note
from mechc.simulation.checkpoints import CheckpointedRun
from mechc.simulation.events.event import EventRecord
from mechc.simulation.events.outcome import event_notes, event_records, failure_of, overlap_of
from mechc.simulation.events.run_events import RunEvents
from mechc.simulation.gimbal_lock import gimbal_note, with_gimbal_lock
from mechc.simulation.initialise import begin
from mechc.simulation.limits import LIMITED, with_limit
from mechc.simulation.record import Piece, Record, added_stats
from mechc.simulation.settings import (
    Policy,
    checked_change_point,
    checked_count,
    checked_span,
)
from mechc.simulation.status import Status, status_of
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.system import System

ENDED = (FINISHED, STOPPED_BY_EVENT)
CHUNK = 2000  # attempted steps between checks of signals and progress
COARSE = 0.01  # of rtol: a warning if the spacing of an angle's doubles is larger
FINEST = 1e-12  # below it, of this rtol
Made = TypeVar("Made", bound=Trajectory)
Progress = Callable[[float], None] | None


def run(
    make: Callable[..., Made],
    system: System,
    span: tuple[float, float],
    state: Array,
    values: Array,
    policy: Policy,
    times: Array | None = None,
    events: RunEvents | None = None,
    progress: Progress = None,
) -> Made:
    """Integrate a motion, with every stage and every accepted state on the constraints.

    Arguments were checked before: ``state`` (nq + nu,) is on the constraints, ``values`` (np,)
    are all parameters, ``times`` are within the span.
    ``make``: :class:`Trajectory`, or a class with the same arguments.

    Raises
    ------
    ChangePointError, EventError, InputError, RunInterrupt
        Each contains the trajectory until then.
    """
    if system.driven is not None:
        system.driven.restart(span[0])
    motion: Any = begin(system, span, state, values, policy, events)
    if policy.checkpoints is not None:
        motion = CheckpointedRun(motion, policy.checkpoints)
    sol = _run_to_end(make, system, span, None, motion, values, policy, times, events, progress)
    if policy.on_change_point == "raise" and sol.change_points:
        raise ChangePointError(_change_point_message(sol), sol)
    return sol


def _run_to_end(
    make: Callable[..., Made],
    system: System,
    span: tuple[float, float],
    before: Trajectory | None,
    motion: Any,
    values: Array,
    policy: Policy,
    times: Array | None,
    events: RunEvents | None,
    progress: Progress,
) -> Made:
    """Advance a motion to its end; ``before``: the run that it continues."""
    started = time.perf_counter()
    code = _advance(motion, span, progress)
    driven = system.driven
    record = record_of(None if before is None else before.record, motion, events)
    wall = time.perf_counter() - started + (0.0 if before is None else before.stats["wall_s"])
    if code == FINISHED and driven is None and events is None:  # nearly always, and fast
        outcome = partial(_outcome, code, system, span, record, None, policy, None, None, wall)
        sol = make(system, record.pieces[0].params, policy, record, outcome, times)
        sol.joined = before is not None and before.joined
        return sol
    failure = None
    if code == OPEN_AT_START:
        raise ValueOutOfBoundsError(overlap_of(events, motion))
    if code == EVENT_FAILED:
        try:
            failure = failure_of(events, motion)
        except KeyboardInterrupt:
            code = INTERRUPTED
    if driven is not None and driven.has_failed:
        code, failure = INTERRUPTED if driven.was_interrupted else INPUT_FAILED, None
    status, stats = _outcome(code, system, span, record, motion, policy, events, failure, wall)
    found = () if events is None else event_records(events, motion, system.scene.width)
    sol = make(
        system, record.pieces[0].params, policy, record, lambda: (status, stats), times, found
    )
    sol._run_events = events
    if before is not None:
        sol.joined = before.joined
        sol.events = tuple(
            EventRecord(np.append(old.t, new.t), np.vstack([old.y, new.y]))
            for old, new in zip(before.events, sol.events, strict=True)
        )
    if code == INTERRUPTED:
        raise RunInterrupt(f"{status.headline}; error.solution is the motion until then",
                           solution=sol)  # fmt: skip
    if failure is not None:
        words = f"{failure}; error.solution is the motion until then"
        raise EventError(words, sol) from failure.__cause__
    if driven is not None:
        driven.raise_failure(sol)
    return sol


def _advance(motion: Any, span: tuple[float, float], progress: Progress) -> int:
    """Advance to the end and return the final status code."""
    if not (progress is None or callable(progress)):
        raise TypeError(f"progress is a function of the share done, not {brief(progress)}")
    try:
        while motion.status == RUNNING:
            motion.advance(CHUNK)
            if progress is not None:
                progress(abs(motion.t - span[0]) / abs(span[1] - span[0]))
    except KeyboardInterrupt:
        return INTERRUPTED
    return int(motion.status)


def record_of(before: Record | None, motion: Any, events: RunEvents | None) -> Record:
    """The record of a motion, which may go on from another."""
    pieces = [
        Piece(steps, p, jumps, causes, () if events is None else events.words(contacts), cut)
        for steps, p, jumps, causes, contacts, cut in motion.pieces
    ]
    if before is None:
        return Record(pieces, motion.stats())
    record = Record([*before.pieces, *pieces], added_stats(before.stats, motion.stats()))
    record.share_params()
    return record


def _outcome(
    code: int, system: System, span: tuple[float, float], record: Record, motion: Any,
    policy: Policy, events: RunEvents | None, failure: Exception | None, wall: float,
) -> tuple[Status, dict[str, Any]]:  # fmt: skip
    """The status of a run that ended, and its counters; ``wall``: the seconds that it took."""
    status = _status(code, system, span, record, motion, policy, events)
    if failure is not None:
        status = replace(status, cause=str(failure))
    stats = {**record.stats, "wall_s": wall, "method": policy.method_of_users}
    del stats["coordinate"]
    if stats.pop("left_series"):
        stats["method"] = "gauss8"
    if events is not None:
        stats["lowered_impacts"] = motion.notes()[1][0]
    return status, stats


def _status(
    code: int, system: System, span: tuple[float, float], record: Record, motion: Any,
    policy: Policy, events: RunEvents | None,
) -> Status:  # fmt: skip
    """The status of a run that ended, with its warnings."""
    bad, driven = record.stats["coordinate"], system.driven
    crossed = any(piece.steps.crossings for piece in record.pieces)
    status = status_of(
        code,
        record.pieces[-1].span[1],
        system.speeds[bad] if bad >= 0 else "",
        record.stats["critical_gap"],
        (
            *(_warnings(record, code) if crossed else ()),
            *_coarse_angles(system, record, policy.rtol),
            *(energy_note(system, record, policy) if code in ENDED else ()),
            *(gimbal_note(system, record, policy) if code in ENDED else ()),
            *(driven.notes(policy.method) if driven else ()),
            *(event_notes(motion) if events is not None else ()),
        ),
    )
    last, locked = record.last.steps, status
    if code not in ENDED and last.count:
        locked = with_gimbal_lock(status, code, system, last.tail(1)[1], policy.rtol)
    if locked is not status:
        status = locked
    elif code in LIMITED:
        status = with_limit(status, code, system, record, policy, span)
    if code == INPUT_FAILED and driven is not None:
        status = replace(status, cause=driven.failure_in_words())
    return status


def continue_run(
    sol: Made,
    t_end: float,
    make: Callable[..., Made],
    *,
    max_steps: int | None = None,
    on_change_point: str | None = None,
    progress: Progress = None,
) -> Made:
    """A run and what follows it until ``t_end``, as one; see :meth:`mechc.Solution.continue_to`."""
    if sol.events and sol._run_events is None:
        raise MechcError(
            "a file has the times of events, not the events themselves: simulate on from the last "
            "state, with events=..."
        )
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
        on_change_point=checked_change_point(
            sol.policy.on_change_point if on_change_point is None else on_change_point
        ),
    )
    state, values = sol.record.ends()[1][1], sol.record.last.params
    system = sol.system
    if system.driven is not None:
        driven = system.driven.controlled_until(start, last)
        system = system if driven is system.driven else system.replaced_scene(driven)
    motion = begin(system, (end, last), state, values, policy, sol._run_events)
    whole = _run_to_end(make, system, (end, last), sol, motion, values, policy, None,
                    sol._run_events, progress)  # fmt: skip
    if policy.on_change_point == "raise" and len(whole.change_points) > len(sol.change_points):
        raise ChangePointError(_change_point_message(whole), whole)
    return whole


def _warnings(record: Record, code: int) -> tuple[str, ...]:
    """Warnings of a run that crossed change points."""
    times = record.change_points()[0]
    if not len(times) or code == STOPPED_AT_CHANGE_POINT:
        return ()
    passages = "a change point" if len(times) == 1 else f"{len(times)} change points"
    return (
        f"Crossed {passages}, first at t = {times[0]:.9g} s: there the links are in line and two "
        "motions are possible. The ideal mechanism goes straight on, as computed; a real one, "
        "with any play or tolerance in its lengths, has to be guided. Forces in joints may "
        "grow without bound there",
    )


def _coarse_angles(system: System, record: Record, rtol: float) -> tuple[str, ...]:
    """Warnings of angles so large that their last digit, not the tolerance, limits accuracy."""
    finest = COARSE * max(rtol, FINEST)
    steps: Any = record.pieces[-1].steps if len(record.pieces) == 1 else None
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


def _change_point_message(sol: Trajectory) -> str:
    point = sol.change_points[-1]
    where = ", ".join(
        f"{n} = {x:.9g}" for n, x in zip(sol.system.coordinates, point.q, strict=True)
    )
    return (
        f"a change point at t = {point.t:.9g} s, {where}: two branches of the motion cross. Pass "
        "on_change_point='continue' to go straight on; error.solution is the motion until then"
    )
