"""The events of runs, as the driver takes them: tapes, or functions of Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.native._events import Events
from mechc.simulation.events.contact_laws import (
    WORDS,
    ContactLaw,
    contact_laws,
    contacts_of,
)
from mechc.simulation.events.event import Event, event_titles
from mechc.simulation.events.expressions import (
    Parse,
    ResetExpressions,
    ValueExpression,
    function_of,
    read_events,
)
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.events.resets import state_given
from mechc.simulation.events.stops import StopReset
from mechc.system.parameters import Array, one_double
from mechc.system.system import System


class Compiler(NamedTuple):
    """Functions of the compiler that events need.

    Attributes
    ----------
    parse
        As of :func:`mechc.simulation.events.expressions.read_events`.
    compile
        ``compile(events, contacts, width, parameters)``: tapes of events, of which each is a value,
        or None, and what its reset assigns, or None, and of the quantities of contacts, over plain
        symbols; None where they have none.
    """

    parse: Parse
    compile: Callable[
        [Sequence[tuple[Any, Mapping[int, Any] | None]], Sequence[Any], int, int], Any
    ]


class RunEvents(Sequence[Event]):
    """The events of runs of a system with parameters p (np,).

    Attributes
    ----------
    laws
        Those of the contacts among them.
    parameters
        Names of those of the system.
    bound
        What the driver takes: :class:`mechc.native._events.Events`.
    """

    def __init__(
        self, events: Sequence[Event], system: System, p: Array, compiler: Compiler
    ) -> None:  # fmt: skip
        self.events, self.laws = tuple(events), tuple(contact_laws(events))
        self.parameters = tuple(system.parameters)
        width, parameters = system.scene.width, len(system.parameters)
        sizes = len(system.coordinates), len(system.speeds)
        contacts = contacts_of(self.laws, len(events), *sizes)
        table = contacts.quantities
        tapes = compiler.compile([_plain(e, width) for e in events], table, width, parameters)
        self.bound = Events(
            _scene_of(system),
            np.array([one_double(event.direction, "a direction") for event in events]),
            np.array([_terminal(event.terminal) for event in events], np.int_),
            tapes,
            [_callbacks(event, system, tapes is not None) for event in events],
            contacts.numbers, contacts.has_gap, contacts.has_friction, contacts.is_linear,
            contacts.poisson,
            _table(table, len(self.laws)) if self.laws and tapes is None else None,
        )  # fmt: skip

    def __getitem__(self, number: Any) -> Any:
        return self.events[number]

    def __len__(self) -> int:
        return len(self.events)

    @cached_property
    def titles(self) -> tuple[str, ...]:
        """The titles of the events."""
        return event_titles(self.events)

    @property
    def resets(self) -> bool:
        """Whether any of them changes the state."""
        return bool(self.laws) or any(event.reset is not None for event in self.events)

    @property
    def rub(self) -> bool:
        """Whether any contact has friction."""
        return any(law.slip is not None for law in self.laws)

    def words(self, states: Sequence[int]) -> tuple[str, ...]:
        """The states of contacts in words, of each event; "" of those that are none."""
        words = [""] * len(self.events)
        for law, state in zip(self.laws, states, strict=True):
            words[law.number] = WORDS[state]
        return tuple(words) if self.laws else ()


def _terminal(given: Any) -> int:
    """The number of zeros until an event ends the run; 0 where it does not."""
    if isinstance(given, (bool, int, np.bool_, np.integer)) and 0 <= given < 2**31:
        return int(given)
    raise ValueOutOfBoundsError(f"terminal is True, False or a whole number, not {brief(given)}")


def run_events(given: Any, system: System, p: Array, compiler: Compiler) -> RunEvents:
    """Events of a run, or one by itself, as a user gives them.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError, ExpressionError
        As :func:`mechc.simulation.events.expressions.read_events`.
    """
    key = _key_of(given), p.tobytes()
    known = system.cache.get("events")
    if known is None or key[0] is None or known[0] != key:
        events = read_events(given, system, p, compiler.parse)
        known = system.cache["events"] = key, RunEvents(events, system, p, compiler)
    found: RunEvents = known[1]
    if found.bound.calls_python:  # functions of Python fail in one run, not in another
        return RunEvents(found.events, system, p, compiler)
    return found


def _key_of(given: Any) -> Any:
    """A key that tells events from others without reading them; None where there is none."""
    if isinstance(given, (tuple, list)):
        keys = tuple(map(_key_of, given))
        return None if any(key is None for key in keys) else keys
    if isinstance(given, Event) and isinstance(given.reset, Mapping):
        given = replace(given, reset=tuple(given.reset.items()))
    try:
        hash(given)
    except TypeError:
        return None
    return given


def refuse_backwards(laws: Sequence[ContactLaw], span: tuple[float, float]) -> None:
    """
    Raises
    ------
    ValueOutOfBoundsError
        For contacts backwards in time.
    """
    if laws and span[1] < span[0]:
        raise ValueOutOfBoundsError(
            "backwards in time there are no stops and no dry friction: the motion before an impact "
            "does not follow from the one after it"
        )


def _scene_of(system: System) -> Any:
    return system.scene if system.driven is None else system.driven.without_inputs


def _plain(event: Event, width: int) -> tuple[Any, Mapping[int, Any] | None]:
    """The expressions of an event that can be compiled: its value, and what its reset assigns."""
    function, reset = event.function, event.reset
    if not isinstance(function, ValueExpression):
        return None, None
    if not isinstance(reset, ResetExpressions):
        return function.expression, None
    return function.expression, {
        **reset.changes, **{width + place: value for place, value in reset.values.items()}
    }  # fmt: skip


def _callbacks(event: Event, system: System, compiled: bool) -> tuple[Any, Any] | None:
    """The functions of an event that are not compiled: its value, and its reset."""
    function, reset = event.function, event.reset
    in_c = compiled and isinstance(function, ValueExpression)
    value = None if in_c else _value(function)
    applied = reset is None or isinstance(reset, StopReset)
    applied |= in_c and isinstance(reset, ResetExpressions)
    changes = None if applied else _reset(event, system)
    return None if value is None and changes is None else (value, changes)


def _value(function: Any) -> Callable[[float, Array, Array], float] | None:
    if isinstance(function, FrictionLaw):
        return None
    if isinstance(function, ValueExpression):
        return function.at
    return lambda t, y, p: float(function(t, y))


def _reset(event: Event, system: System) -> Callable[[float, Array, Array], tuple[Array, Array]]:
    def reset(t: float, y: Array, p: Array) -> tuple[Array, Array]:
        state, values = state_given(event, t, y, system, p)
        return np.ascontiguousarray(state), np.ascontiguousarray(values)

    return reset


def _table(entries: Sequence[Any], contacts: int) -> Callable[[float, Array, Array], Array]:
    function = function_of(entries)

    def table(t: float, state: Array, p: Array) -> Array:
        with np.errstate(all="ignore"):
            found = np.array(function(t, state, p), dtype=np.float64)
        return np.ascontiguousarray(found.reshape(contacts, -1))

    return table
