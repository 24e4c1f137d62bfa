"""Recordings of motions, read from arrays, mappings, xarray or tables: times and values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.fitting.measured import Measured
from mechc.system.parameters import Array
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.units import SECONDS, plain_numbers

TIMES = ("time", "t")
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Recording:
    """Times (nt,) in s, rising, and values (nt, k) of what was measured, NaN where missing."""

    t: Array
    values: Array

    @property
    def valid(self) -> Any:
        """Flags (nt, k) of the values that are not missing."""
        return np.isfinite(self.values)

    def is_wrapped(self, column: int) -> bool:
        """Whether an angle (rad) was reduced to one turn: it jumps by more than half a turn.

        One that swings by more than that between two samples is taken for it, too: what agrees with
        it still agrees without whole turns.
        """
        values = self.values[self.valid[:, column], column]
        jumps = bool((np.abs(np.diff(values)) > 0.5 * TURN).any())
        return jumps and bool(np.ptp(values) < 1.5 * TURN)


def read_recordings(given: Any, measured: Sequence[Measured]) -> tuple[Recording, ...]:
    """One recording or a list of several.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError`, :class:`MechcError` for
    columns that are missing, times that do not rise or are not in seconds, wrong shapes and units.
    """
    several = given if isinstance(given, list) else [given]
    if not several:
        raise ValueOutOfBoundsError("measurements has no recording")
    alone = len(several) == 1
    words = ["the recording" if alone else f"recording {number}" for number in range(len(several))]
    return tuple(_recording(*each, measured) for each in zip(several, words, strict=True))


def column_names(given: Any) -> list[str]:
    """Names of the columns of the first recording, besides its times.

    Raises :class:`MechcError` for a recording whose columns have no names.
    """
    first = given[0] if isinstance(given, list) and given else given
    if not hasattr(first, "keys"):
        raise MechcError(
            "what was measured? Columns have no names here: give measured=['theta_0'], or "
            "measured={'theta_0': standard deviation}"
        )
    return [str(name) for name in list(first.keys()) if name not in TIMES]


def _recording(given: Any, words: str, measured: Sequence[Measured]) -> Recording:
    if isinstance(given, tuple):
        if len(given) != 2:
            raise ValueOutOfBoundsError(f"{words} is a tuple (times, values), not of {len(given)}")
        times, values = _times(given[0], words), _values(given[1], measured, words)
    elif hasattr(given, "keys"):
        times, values = _from_columns(given, measured, words)
    else:
        raise TypeError(
            f"{words} is a tuple (times, values), a mapping of columns or an xarray.Dataset with "
            f"the times as 't' or 'time', not {brief(given)}; several are given as a list"
        )
    _check_times(times, words)
    if values.shape != (len(times), len(measured)):
        raise ValueOutOfBoundsError(
            f"{words} has {len(times)} times, so its values have the shape "
            f"({len(times)}, {len(measured)}): a column for each of "
            f"{', '.join(one.name for one in measured)}; they have {values.shape}"
        )
    if np.isinf(values).any():
        raise ValueOutOfBoundsError(f"{words} has infinite values; a missing sample is NaN")
    return Recording(times, values)


def _from_columns(given: Any, measured: Sequence[Measured], words: str) -> tuple[Array, Array]:
    names = [str(key) for key in (*given.keys(), *getattr(given, "coords", ()))]
    key = next((name for name in TIMES if name in names), None)
    if key is None:
        raise MechcError(f"{words} has no times: a column 't' or 'time', in s")
    columns = []
    for one in measured:
        if one.name not in names:
            raise UnknownNameError(f"column of {words}", one.name, sorted({*names} - {key}))
        column = given[one.name]
        columns.append(
            _numbers(column, f"{one.name} of {words}", one.quantity.unit, one.quantity.kind)
        )
    times = _times(given[key], words)
    for one, column in zip(measured, columns, strict=True):
        if column.shape != times.shape:
            raise ValueOutOfBoundsError(
                f"{one.name} of {words} has the shape {column.shape}, its times {times.shape}"
            )
    return times, np.stack(columns, axis=-1)


def _times(given: Any, words: str) -> Array:
    return _numbers(given, f"the times of {words}", SECONDS.unit, SECONDS.kind)


def _values(given: Any, measured: Sequence[Measured], words: str) -> Array:
    """Values (nt, k); a quantity of pint has one unit for all of them."""
    if not hasattr(given, "magnitude"):
        values = _numbers(given, f"the values of {words}")
        return values[:, None] if values.ndim == 1 else values
    columns = [given] if np.ndim(given.magnitude) == 1 else list(given.T)
    pairs = zip(columns, measured, strict=False)
    numbers = [
        _numbers(x, f"{one.name} of {words}", one.quantity.unit, one.quantity.kind)
        for x, one in pairs
    ]
    return np.stack(numbers, axis=-1)


def _numbers(given: Any, words: str, unit: str = "", kind: Kind = Kind.OTHER) -> Array:
    given = plain_numbers(given, NamedQuantity(words, unit, "", -np.inf, np.inf, False, kind))
    try:
        plain = np.asarray(given)
        if plain.dtype.kind not in "biufO":
            raise TypeError
        return np.array(np.ma.filled(np.ma.asarray(given, dtype=np.float64), np.nan))
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(f"{words} must be numbers, not {brief(given)}") from None


def _check_times(times: Array, words: str) -> None:
    if times.ndim != 1 or len(times) < 2:
        raise ValueOutOfBoundsError(f"{words} needs at least two times, in a row")
    if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise ValueOutOfBoundsError(
            f"the times of {words} must be finite and rise from each to the next, in s"
        )
