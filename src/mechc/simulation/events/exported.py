"""Events for a program that is no run of mechc, over plain symbols."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.simulation.events.contact_laws import Contacts, contact_laws, contacts_of
from mechc.simulation.events.event import Event, event_titles
from mechc.simulation.events.expressions import (
    EventReader,
    StateNames,
    changes_parameters,
    is_of_expressions,
    is_one_event,
)
from mechc.simulation.events.friction import FrictionLaw


class ExportedEvent(NamedTuple):
    """An event over the symbols t, y0, y1, ..., p0, p1, ...; ``changes`` as of its reset.

    Dry friction has no value.
    """

    title: str
    direction: float
    value: Any
    changes: Mapping[int, Any] | None


def exported_events(
    given: Any, names: StateNames, parse: Callable[..., Any]
) -> tuple[list[ExportedEvent], Contacts]:
    """Events of expressions, or one by itself, and the contacts among them.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, ExpressionError
        As :func:`mechc.simulation.events.expressions.read_events`, and for events that are no
        expressions or end a run.
    """
    if not isinstance(given, (tuple, list)) and is_one_event(given):
        given = [given]
    reader = EventReader(names, np.zeros(len(names.parameters)), parse)
    events = [_exportable_event(reader.event(each), each) for each in given]
    sizes = len(names.coordinates), len(names.speeds)
    contacts = contacts_of(contact_laws(events), len(events), *sizes)
    titles = event_titles(events)
    return [_exported_event(*each) for each in zip(events, titles, strict=True)], contacts


def _exportable_event(event: Any, given: Any) -> Event:
    if changes_parameters(event):
        raise ValueOutOfBoundsError(
            "a reset of parameters is not exported: make them states, whose rates are zero"
        )
    friction = isinstance(getattr(event, "function", None), FrictionLaw)
    if not friction and not is_of_expressions(event):
        raise ValueOutOfBoundsError(
            f"events and resets are exported as expressions, not as {brief(given)}"
        )
    if event.terminal:
        raise ValueOutOfBoundsError(
            "a terminal event is not exported: the importer decides when a simulation ends"
        )
    checked: Event = event
    return checked


def _exported_event(event: Event, title: str) -> ExportedEvent:
    value = getattr(event.function, "expression", None)
    changes = getattr(event.reset, "changes", None)
    return ExportedEvent(title, float(event.direction), value, changes)
