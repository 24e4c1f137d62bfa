"""Events of a finished motion: their zeros, warnings, and why one failed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechc.simulation.events.event import EventRecord, FunctionFailedError, value_failed
from mechc.simulation.events.run_events import RunEvents

MOST_SAMPLES = 4096  # a step


def event_records(events: RunEvents | None, motion: Any, width: int) -> tuple[EventRecord, ...]:
    """The zeros found, for each event."""
    if events is None:
        return ()
    if motion is None:
        return tuple(EventRecord(np.zeros(0), np.zeros((0, width))) for _ in events)
    numbers, t, y = motion.zeros()
    return tuple(EventRecord(t[numbers == k], y[numbers == k]) for k in range(len(events)))


def event_notes(motion: Any) -> tuple[str, ...]:
    """Warnings about events whose zeros could not all be resolved, and about impacts."""
    of_events, (lowered, first, part) = motion.notes()
    times = "an impact" if lowered == 1 else f"{lowered} impacts"
    notes = [
        f"At {times}, first at t = {first:.9g} s, Newton's law of restitution with friction would "
        f"have given energy: {part:.3g} of the restitution was taken there, which gives none. "
        "mechc.Stop(..., law='poisson') gives none by itself",
    ][: int(lowered > 0)]
    notes += [
        f"Event {number} only touches its zero at t = {t:.9g} s, to within what is tolerated: "
        "whether it is crossed, and a reset applied, depends on less (grazing)"
        for number, (t, _) in enumerate(of_events)
        if not math.isnan(t)
    ]
    notes += [
        f"Event {number} changes so fast from t = {t:.9g} s on that {MOST_SAMPLES} samples "
        "a step do not follow it: zeros may be missing. Shorten the steps with max_step"
        for number, (_, t) in enumerate(of_events)
        if not math.isnan(t)
    ]
    return tuple(notes)


def overlap_of(events: RunEvents | None, motion: Any) -> str:
    """The error for parts that overlap at the start."""
    return (
        f"{_overlap(events, motion)} at the start, so the parts overlap: a gap is positive where "
        "they are apart"
    )


def _overlap(events: Any, motion: Any) -> str:
    contact, gap = motion.overlap
    number = events.laws[contact].number
    return f"event {number}: the gap {events.titles[number]} is {gap:.6g}"


def failure_of(events: Any, motion: Any) -> FunctionFailedError:
    """The error of an event or a contact that failed; raises what is none, as Ctrl-C."""
    t = motion.stopped_at
    if events.bound.failure is not None:
        return function_failed(events)
    if motion.overlap is not None:
        number = motion.last_causes[0]
        return FunctionFailedError(
            f"after the reset of event {number} at t = {t:.9g} s {_overlap(events, motion)}, so "
            "the parts overlap"
        )
    why, contact = motion.contact_failure
    if why:
        number = events.laws[contact].number if contact >= 0 else -1
        return FunctionFailedError(CONTACT_FAILURES[why].format(number=number, t=motion.t))
    if motion.failed_event is not None:
        return value_failed(events[motion.failed_event], motion.t, None)
    reset = f"the reset of event {motion.last_causes[-1]} at t = {t:.9g} s"
    if beyond := [events.parameters[i] for i in motion.beyond_bounds]:
        return FunctionFailedError(f"{reset} gives {', '.join(beyond)} beyond its bounds")
    return FunctionFailedError(
        f"{reset} gives a state that is not finite, or does not close the loops"
    )


CONTACT_FAILURES = {
    "no law": "the contact of event {number} has no rate, slip or friction at t = {t:.9g} s: its "
    "expressions are not finite there",
    "restitution": "the restitution of event {number} at t = {t:.9g} s is not 0 to 1",
    "negative": "the friction of event {number} is negative from t = {t:.9g} s on, and would push: "
    "write the force that presses as one that is not negative, Abs(N), or Max(N, 0) of SymPy",
    "no mass": "at t = {t:.9g} s the mass matrix is not positive definite: contacts need that",
}


def function_failed(events: RunEvents) -> FunctionFailedError:
    """The error of a function of Python that failed, once; raises what is none, as Ctrl-C."""
    (number, what, t, error), events.bound.failure = events.bound.failure, None
    if error is not None and not isinstance(error, Exception):
        raise error
    if isinstance(error, FunctionFailedError):
        return error
    if what == "value":
        failed = value_failed(events[number], t, error)
    else:
        name = "a contact" if number < 0 else f"the reset of event {number}"
        failed = FunctionFailedError(f"{name} failed at t = {t:.9g} s: {error}")
    failed.__cause__ = error
    return failed
