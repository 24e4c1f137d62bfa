"""Events: zeros of functions of time and state, as users describe them and as runs find them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array

EventFunction = Callable[[float, Array], float]
MOST_SHOWN = 8  # times in a line
Reset = Callable[[float, Array, Array], tuple[Any, Any]]


@dataclass(frozen=True)
class Event:
    """A zero of ``function(t, y)`` to be found.

    Attributes
    ----------
    function
        A function of t and y (nq + nu,), or an expression of time, coordinates, speeds and
        parameters: of SymPy, or a text of the grammar, ``"q - l/2"``; also with a direction,
        ``"q > l/2"``.
    direction
        Positive: only where the function grows; negative: only where it falls; 0: both.
    terminal
        The run ends at the first such zero, or at the n-th for a whole number n; with a reset,
        after it.
    reset
        ``f(t, q, u)`` that returns new coordinates (nq,) and speeds (nu,), with which the motion
        continues.  They are put onto the constraints: coordinates to the nearest that close the
        loops, speeds by the impulse of the constraints through the mass matrix.  A reset that
        leaves the rate of the function with its sign is a switch: the zero is not found again.
        It may return names of coordinates, speeds and parameters with their values after the event
        instead; all others stay.  Or a mapping of names to expressions of what was before,
        ``{"u": "-e*u"}``, which runs in compiled code.
    """

    function: EventFunction | Any
    direction: float = 0.0
    terminal: bool | int = False
    reset: Reset | Any = None

    @classmethod
    def of(cls, given: Any) -> Event:
        """An event from an Event, or from a function with SciPy's attributes.

        Raises
        ------
        ValueOutOfBoundsError
            If it is not callable.
        """
        if isinstance(given, cls):
            if not (given.reset is None or callable(given.reset)):
                raise ValueOutOfBoundsError(
                    "a reset is a function of t, q and u that returns q and u, or a mapping of "
                    f"coordinates and speeds to expressions, not {given.reset!r}"
                )
            return given
        if not callable(given):
            raise ValueOutOfBoundsError(
                f"an event is a function of t and y, or an expression of SymPy that is zero there, "
                f"not {given!r}"
            )
        return cls(given, getattr(given, "direction", 0.0), int(getattr(given, "terminal", False)))

    def __repr__(self) -> str:
        function = self.function
        named = "" if isinstance(function, str) else getattr(function, "title", "")
        words = [named or getattr(function, "__name__", "") or str(function)]
        words += [f"direction {self.direction:+g}"] if self.direction else []
        words += ["terminal"] if self.terminal else []
        words += ["with a reset"] if self.reset is not None else []
        return f"<mechc.Event {', '.join(words)}>"


@dataclass(frozen=True)
class EventRecord:
    """The zeros of one event: times ``t`` (k,) in s and states ``y`` (k, nq + nu)."""

    t: Array
    y: Array

    def __repr__(self) -> str:
        count = len(self.t)
        times = [f"{t:.6g}" for t in (self.t if count <= MOST_SHOWN else self.t[:MOST_SHOWN])]
        times += ["..."] if count > MOST_SHOWN else []
        at = f" at t = {', '.join(times)} s" if count else ""
        return f"<mechc.EventRecord: {count} zero{'s' * (count != 1)}{at}>"


def event_titles(events: Sequence[Any]) -> tuple[str, ...]:
    """Titles of events: the expression, the name of the function, or the number."""
    return tuple(_title(event, number) for number, event in enumerate(events))


def _title(event: Any, number: int) -> str:
    function = event.function if isinstance(event, Event) else event
    given = getattr(function, "title", "") or getattr(function, "__name__", "")
    return given if given not in ("", "<lambda>", "expression") else f"event {number}"


class FunctionFailedError(Exception):
    """The function of an event, or its reset, failed with ``__cause__``; internal."""


def value_of(event: Event, t: float, y: Array) -> float:
    """The value of an event at one state.

    Raises
    ------
    FunctionFailedError
        If its function fails, or gives no number.
    """
    try:
        value = float(event.function(t, y))
    except Exception as error:
        raise value_failed(event, t, error) from error
    if math.isnan(value):
        raise value_failed(event, t, None)
    return value


def value_failed(event: Event, t: float, error: BaseException | None) -> FunctionFailedError:
    """The error of an event function that raised ``error``, or gave NaN."""
    name = getattr(event.function, "__name__", repr(event.function))
    how = "gave NaN" if error is None else "failed"
    why = "" if error is None else f" with {type(error).__name__}: {error}"
    return FunctionFailedError(f"the event function {name} {how} at t = {t:.9g} s{why}")
