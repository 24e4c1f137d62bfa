"""Events of a batch: expressions that are compiled, the same for all members."""

from __future__ import annotations

from typing import Any, NamedTuple

from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.simulation.contact.laws import contact_laws
from mechc.simulation.events.compiled import directions_of
from mechc.simulation.events.expressions import (
    Compiler,
    checked_events,
    compile_all,
    is_compilable,
)
from mechc.simulation.events.stops import StopReset, refuse_stops
from mechc.system.parameters import Array
from mechc.system.system import System


class BatchEvents(NamedTuple):
    """Compiled functions of k events; directions (k,); how many zeros of each end a run (k,)."""

    functions: Any
    directions: Array
    terminal: Array


def batch_events(
    system: System, span: tuple[float, float], given: Any, until: str, elsewhere: bool
) -> BatchEvents | None:
    """The events of a batch; ``elsewhere``: it is computed or kept outside this process.

    Raises
    ------
    ValueOutOfBoundsError, MechcError
        For functions of Python, and for what a batch with events cannot have.
    """
    if isinstance(given, (tuple, list)) and not given:
        return None
    if system.reference.backend == "numpy":
        raise MechcError("events of a batch need compiled code")
    _refuse(system, until, elsewhere)
    from mechc.compilation.event_unit import COMPILER

    compiler = Compiler(*COMPILER)
    events = checked_events(given, system, system.parameter_set.defaults, compiler)
    if any(law.slip is not None for law in contact_laws(events)):
        raise ValueOutOfBoundsError(
            "a batch has no friction at stops and no mechc.DryFriction yet: simulate one motion at "
            "a time"
        )
    if not all(map(is_compilable, events)):
        raise ValueOutOfBoundsError(
            "events of a batch and their resets are expressions, of SymPy or as text, not "
            "functions of Python: mechc.Event('q', reset={'u': '-0.8*u'})"
        )
    functions = compile_all(events, system, compiler)
    if functions is None:
        raise MechcError(
            "events of a batch run in compiled code: they need a C compiler, and functions that "
            "have a form in C"
        )
    if any(isinstance(event.reset, StopReset) for event in events):
        refuse_stops(system, span, compiled=True)
    return BatchEvents(functions, *directions_of(events))


def _refuse(system: System, until: str, elsewhere: bool) -> None:
    if until:
        raise ValueOutOfBoundsError(
            f"until={until!r} and events: give the end as an event too, "
            "mechc.Event(..., terminal=True)"
        )
    if elsewhere:
        raise ValueOutOfBoundsError("a batch with events takes neither out= nor client= yet")
    if system.driven is not None:
        raise ValueOutOfBoundsError("a batch of a model with inputs takes no events yet")
