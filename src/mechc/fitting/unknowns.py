"""Unknowns of a fit: parameters, starts, constant inputs; and the vector they make up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.fitting.measured import Measured
from mechc.fitting.recordings import Recording
from mechc.system.names import by_name, names_of
from mechc.system.parameters import Array
from mechc.system.system import System
from mechc.system.units import in_si

PARAMETER, START, INPUT = "parameter", "start", "input"
Bounds = tuple[float, float]


@dataclass(frozen=True)
class Unknown:
    """One free number.

    Attributes
    ----------
    name, kind
        A parameter, a coordinate or speed of the start, or an input.
    recording
        Of which recording it is a start; None where it is the same for all.
    lower, upper, guess
        Its bounds, infinite where there are none, and where the search begins.
    """

    name: str
    kind: str
    recording: int | None
    lower: float
    upper: float
    guess: float

    @property
    def label(self) -> str:
        """``theta_0``; ``theta_0[1]`` of recording 1 where each has its own."""
        return self.name if self.recording is None else f"{self.name}[{self.recording}]"

    def holds_for(self, recording: int) -> bool:
        """Whether the unknown changes this recording."""
        return self.recording in (None, recording)


@dataclass(frozen=True)
class Known:
    """Values that a fit does not change: parameters, and each recording's start and inputs."""

    params: Mapping[str, Any]
    starts: Sequence[Mapping[str, float] | Array | None]
    inputs: Sequence[Mapping[str, Any]]


def checked_unknowns(
    system: System, free: Any, shared: Any, known: Known, measured: Sequence[Measured],
    recordings: Sequence[Recording],
) -> tuple[Unknown, ...]:  # fmt: skip
    """The free numbers with their bounds and first values.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for a name that the model does
    not have, and bounds that are reversed, are not numbers or exceed those of the parameter.
    """
    named = isinstance(free, (tuple, list)) and not any(np.ndim(each) for each in free)
    given = by_name(dict.fromkeys(free) if named else free, "free", "{'m_1': (0.1, 5.0)}")
    if not given:
        raise ValueOutOfBoundsError("nothing is free: give free={'m_1': (0.1, 5.0)}")
    together = {*names_of(shared)}
    for name in together - {*given}:
        raise UnknownNameError("free start", name, given)
    kinds = dict.fromkeys(system.inputs, INPUT)
    kinds |= dict.fromkeys((*system.coordinates, *system.speeds), START)
    kinds |= dict.fromkeys(system.parameters, PARAMETER)
    found = []
    for name, bounds in given.items():
        if name not in kinds:
            every = (*system.parameters, *system.coordinates, *system.speeds, *system.inputs)
            raise UnknownNameError("parameter, coordinate, speed or input", name, every)
        kind = kinds[name]
        low, high = checked_bounds(system, name, bounds)
        alone = kind != START or name in together or len(recordings) == 1
        for recording in (None,) if alone else range(len(recordings)):
            place = recording or 0
            guess = _given_value(name, kind, known, place, low, high)
            if guess is None:
                default = _default_value(system, name, kind, measured, recordings[place])
                guess = default if low <= default <= high else middle_of(low, high)
            found.append(Unknown(name, kind, recording, low, high, guess))
    return tuple(found)


def _given_value(
    name: str, kind: str, known: Known, place: int, low: float, high: float
) -> float | None:
    """The user's start of an unknown, within its bounds; None where there is none."""
    start = known.starts[place]
    given: Mapping[str, Any] = start if isinstance(start, Mapping) else {}
    if kind != START:
        given = known.params if kind == PARAMETER else known.inputs[place]
    if name not in given:
        return None
    try:
        value = float(given[name])
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"{name} is free: it begins at a number, not at {brief(given[name])}"
        ) from None
    if not low <= value <= high:
        raise ValueOutOfBoundsError(
            f"{name} begins at {value:g}, outside its bounds {low:g} ... {high:g}"
        )
    return value


def _default_value(
    system: System, name: str, kind: str, measured: Sequence[Measured], recording: Recording
) -> float:
    """The first sample of a start, else the model's default; NaN without any."""
    columns = [k for k, one in enumerate(measured) if one.name == name]
    for value in recording.values[:, columns[0]] if columns and kind == START else ():
        if np.isfinite(value):
            return float(value)
    own = system.start if kind == START else system.defaults
    return float(own.get(name, np.nan))


def middle_of(lower: float, upper: float) -> float:
    """A value between bounds of which some may be infinite."""
    if np.isfinite(lower) and np.isfinite(upper):
        return 0.5 * (lower + upper)
    if np.isfinite(lower):
        return lower + max(1.0, abs(lower))
    return upper - max(1.0, abs(upper)) if np.isfinite(upper) else 0.0


def checked_bounds(system: System, name: str, given: Any) -> Bounds:
    quantity = system.quantities.get(name)
    own = (-np.inf, np.inf) if quantity is None else (quantity.lower, quantity.upper)
    if given is None or given is ...:
        return own
    try:
        given = given if quantity is None else in_si(given, quantity)
        low, high = (own[k] if each is None else float(each) for k, each in enumerate(given))
    except ValueOutOfBoundsError:
        raise
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"{name}: its bounds are (lower, upper) or None, not {brief(given)}"
        ) from None
    if not low < high:
        raise ValueOutOfBoundsError(f"{name}: the lower bound {low:g} must be below {high:g}")
    if quantity is not None and (low < own[0] or high > own[1]):
        raise ValueOutOfBoundsError(
            f"{name}: the bounds {low:g} ... {high:g} exceed its own: it must be "
            f"{quantity.bounds_in_words}"
        )
    return low, high
