"""Events of a batch: expressions that are compiled, the same for all members."""

from __future__ import annotations

import hashlib
from typing import Any, NamedTuple

import numpy as np

from mechc.compilation.event_unit import COMPILER, loaded
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.simulation.contact.laws import contact_laws
from mechc.simulation.events.compiled import directions_of
from mechc.simulation.events.event import Event
from mechc.simulation.events.expressions import (
    COMPILED_RESETS,
    Compiler,
    ValueExpression,
    changes_parameters,
    checked_events,
    compile_all,
)
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.events.stops import refuse_stops
from mechc.system.parameters import Array
from mechc.system.system import System


class BatchEvents(NamedTuple):
    """Events as data: directions (k,), how many zeros of each end a run (k,), and the C of their
    functions with its sha256; "" of a batch that was read from a folder, which computes nothing.

    ``given``: as they were given, where members are run by ``simulate``; ``one_by_one``: whether
    friction, or resets of parameters, have all of them run so.
    """

    directions: Array
    terminal: Any
    key: str
    source: str
    given: Any = ()
    one_by_one: bool = False

    def read(self, system: System, p: Array) -> list[Any]:
        """The events of a run with parameters p (np,)."""
        return checked_events(self.given, system, p, Compiler(*COMPILER))

    def compiled(self) -> tuple[Any, Array, Array]:
        """What :class:`mechc.native._batch.Runs` takes."""
        return loaded(self.source), self.directions, self.terminal

    def told(self) -> dict[str, Any]:
        """As JSON data, for :func:`events_told`."""
        ends = [int(count) for count in self.terminal]
        return {"key": self.key, "directions": self.directions.tolist(), "terminal": ends}


def events_told(told: Any) -> BatchEvents | None:
    """What :meth:`BatchEvents.told` gave, without functions.

    Raises
    ------
    KeyError, TypeError, ValueError
        For anything else.
    """
    if told is None:
        return None
    directions = np.array(told["directions"], np.float64)
    terminal: Any = np.array(told["terminal"], np.int_)
    known = type(told["key"]) is str and directions.ndim == 1 and len(directions)
    if not known or terminal.shape != directions.shape or not np.isfinite(directions).all():
        raise ValueError("these are no events")
    return BatchEvents(directions, terminal, told["key"], "")


def batch_events(
    system: System, span: tuple[float, float], given: Any, until: str, controlled: bool
) -> BatchEvents | None:
    """The events of a batch; ``controlled``: it has sampled controllers.

    Raises
    ------
    ValueOutOfBoundsError, MechcError
        For functions of Python, and for what a batch with events cannot have.
    """
    if isinstance(given, (tuple, list)) and not given:
        return None
    if system.reference.backend == "numpy":
        raise MechcError("events of a batch need compiled code")
    _refuse(until)
    compiler = Compiler(*COMPILER)
    events = checked_events(given, system, system.parameter_set.defaults, compiler)
    laws = contact_laws(events)
    alone = any(law.slip is not None for law in laws) or any(map(changes_parameters, events))
    if not all(_is_expression(event) for event in events):
        raise ValueOutOfBoundsError(
            "events of a batch and their resets are expressions, of SymPy or as text, not "
            "functions of Python: mechc.Event('q', reset={'u': '-0.8*u'})"
        )
    functions = compile_all(events, system, compiler)
    if functions is None and not alone:
        raise MechcError(
            "events of a batch run in compiled code: they need a C compiler, and functions that "
            "have a form in C"
        )
    if laws:
        refuse_stops(system, span, compiled=True)
    source = "" if functions is None else functions.source
    words = [source, *(str(law) for law in laws if alone), *(map(_words, events) if alone else ())]
    key = hashlib.sha256("".join(words).encode()).hexdigest()
    kept = given if laws or alone or controlled else ()
    return BatchEvents(*directions_of(events), key, source, kept, alone)


def _words(event: Event) -> str:
    """An event that is an expression, with its reset, as a text."""
    value, reset = getattr(event.function, "expression", ""), event.reset
    changes = [getattr(reset, name, None) for name in ("changes", "values")]
    return f"{value} {event.direction} {changes}"


def _is_expression(event: Any) -> bool:
    if not isinstance(event, Event):
        return False
    reads = isinstance(event.function, (FrictionLaw, ValueExpression))
    return reads and (event.reset is None or isinstance(event.reset, COMPILED_RESETS))


def _refuse(until: str) -> None:
    if until:
        raise ValueOutOfBoundsError(
            f"until={until!r} and events: give the end as an event too, "
            "mechc.Event(..., terminal=True)"
        )
