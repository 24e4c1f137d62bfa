"""Events of a batch: the same for all members."""

from __future__ import annotations

import hashlib
from typing import Any, NamedTuple

import numpy as np

from mechc.compilation.event_tapes import COMPILER
from mechc.errors import MechcError
from mechc.simulation.events.event import Event
from mechc.simulation.events.expressions import changes_parameters, is_of_expressions
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.events.own_contacts import with_own_contacts
from mechc.simulation.events.run_events import (
    Compiler,
    RunEvents,
    refuse_backwards,
    run_events,
)
from mechc.system.parameters import Array
from mechc.system.system import System


class BatchEvents(NamedTuple):
    """Events as data: directions (k,), how many zeros of each end a run (k,), and what identifies
    their expressions, "" with functions of Python.

    ``given``: as they were given; none of a batch that was read from a folder, which computes
    nothing.
    """

    directions: Array
    terminal: Any
    key: str
    given: Any = ()

    def read(self, system: System, p: Array) -> RunEvents:
        """The events of runs with parameters p (np,).

        Raises :class:`MechcError` for those of a batch that was read from a folder.
        """
        given = self.given
        if isinstance(given, tuple) and not given:
            own = batch_events(system, (0.0, 1.0), ())  # contacts of the mechanism
            if own is None or own.key != self.key:
                raise MechcError(
                    "the events of a batch that was read from a folder are not known: simulate the "
                    "member with model.simulate(..., events=...)"
                )
            given = own.given
        return run_events(given, system, p, Compiler(*COMPILER))

    def as_json(self) -> dict[str, Any]:
        """The events as JSON data, which :func:`events_from_json` reads."""
        ends = [int(count) for count in self.terminal]
        return {"key": self.key, "directions": self.directions.tolist(), "terminal": ends}


def events_from_json(told: Any) -> BatchEvents | None:
    """Events from the JSON data of :meth:`BatchEvents.as_json`, without functions.

    Raises ``KeyError``, ``TypeError``, ``ValueError`` for anything else.
    """
    if told is None:
        return None
    directions = np.array(told["directions"], np.float64)
    terminal: Any = np.array(told["terminal"], np.int_)
    known = type(told["key"]) is str and directions.ndim == 1 and len(directions)
    if not known or terminal.shape != directions.shape or not np.isfinite(directions).all():
        raise ValueError("these are no events")
    return BatchEvents(directions, terminal, told["key"])


def batch_events(system: System, span: tuple[float, float], given: Any) -> BatchEvents | None:
    """The events of a batch and the contacts of the system; None without any.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError`, :class:`ExpressionError` as
    :func:`mechc.simulation.events.run_events.run_events`.
    """
    given = with_own_contacts(given, system.data, system.cache)
    if isinstance(given, (tuple, list)) and not given:
        return None
    events = run_events(given, system, system.parameter_set.defaults, Compiler(*COMPILER))
    refuse_backwards(events.laws, span)
    words = [*map(_words, events), *map(str, events.laws)]
    key = hashlib.sha256("\n".join(words).encode()).hexdigest() if all(words) else ""
    return BatchEvents(
        np.array([float(event.direction) for event in events]),
        np.array([int(event.terminal) for event in events], np.int_),
        key,
        given,
    )


def changes_any_parameter(events: RunEvents | None) -> bool:
    """Whether a reset changes parameters, or may."""
    return events is not None and any(
        changes_parameters(event) or (event.reset is not None and not is_of_expressions(event))
        for event in events
    )


def _words(event: Event) -> str:
    """An event that is an expression, with its reset, as a text; "" of others."""
    if isinstance(event.function, FrictionLaw):
        return "friction"
    if not is_of_expressions(event):
        return ""
    value, reset = getattr(event.function, "expression", ""), event.reset
    changes = [getattr(reset, name, None) for name in ("changes", "values")]
    return f"{value} {event.direction} {changes}"
