"""Parameter values: from names to an array, defaults that follow others, bounds."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mechc.errors import (
    MissingParameterError,
    UnknownNameError,
    ValueOutOfBoundsError,
    brief,
)
from mechc.native._arrays import largest_of, strictly_within
from mechc.system.names import without_unused
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.units import DATES, in_si, of_unknown_unit, plain_numbers

if TYPE_CHECKING:
    from numpy.typing import NDArray  # takes a tenth of the time of `import mechc`

Array: TypeAlias = "NDArray[np.float64]"
Parameters: TypeAlias = "Mapping[str, Any] | Array | None"


OWN = (float, int, list, tuple)  # of these an array is made anew


class ParameterSet:
    """The parameters of one scene.

    ``preset``: defaults that are not compiled in; a given value replaces them.  ``optional``: those
    that an array of parameters may lack.
    """

    def __init__(
        self,
        quantities: Sequence[NamedQuantity],
        scene: Any,
        preset: Mapping[str, float] | None = None,
        optional: Collection[str] = (),
    ) -> None:
        self.quantities = tuple(quantities)
        self.names = tuple(q.name for q in quantities)
        self.index = {name: i for i, name in enumerate(self.names)}
        self._scene = scene
        self._lower = np.array([q.lower for q in quantities], dtype=np.float64)
        self._upper = np.array([q.upper for q in quantities], dtype=np.float64)
        self._open = [(q.lower, q.upper) for q in quantities]
        lengths = [i for i, q in enumerate(quantities) if q.kind is Kind.LENGTH]
        self.length_places = np.array(lengths, dtype=np.intp)
        self.missing: tuple[str, ...] = ()
        self._needed = [i for i, name in enumerate(self.names) if name not in optional]
        self._preset = {self.index[name]: value for name, value in (preset or {}).items()}
        nothing = np.zeros(len(self.names), np.uint8)
        self.defaults = self.fill_defaults(np.zeros(len(self.names)), nothing)
        self.defaults.flags.writeable = False
        self._default_length = largest_of(self.defaults, self.length_places) or 1.0
        self.missing = tuple(n for n, x in zip(self.names, self.defaults, strict=True) if x != x)

    def resolve(self, params: Parameters) -> Array:
        """The values of all parameters, (..., np): those given, and defaults.

        A default that follows others (an inertia that follows mass and length) follows those
        given.
        """
        if params is None or (isinstance(params, dict) and not params):
            if self.missing:
                self._refuse_missing(self.defaults)
            return self.defaults
        if isinstance(params, (dict, Mapping)):
            return self._from_names(params)
        return self._from_array(_all_values(params))

    def resolve_partly(self, params: Parameters, needed: Collection[str]) -> Array:
        """All values, where only those ``needed`` matter: missing others get arbitrary values."""
        if not self.missing or not (params is None or isinstance(params, Mapping)):
            return self.resolve(params)
        given = without_unused(params or {}, self.names, "params")
        idle = [n for n in self.missing if n not in needed and n not in given]
        return self.resolve(given | {n: self.quantities[self.index[n]].any_value for n in idle})

    def length(self, values: Array) -> float:
        """The scale of lengths: the largest parameter that is one, 1 if there is none."""
        if values is self.defaults:
            return self._default_length
        return largest_of(values, self.length_places) or 1.0

    @property
    def limits(self) -> tuple[Array, Array]:
        """The lowest and the highest value of each parameter, (np,) each."""
        lowest = [q.lower if q.closed else np.nextafter(q.lower, np.inf) for q in self.quantities]
        highest = [q.upper if q.closed else np.nextafter(q.upper, -np.inf) for q in self.quantities]
        return np.array(lowest), np.array(highest)

    def lengths(self, rows: Array) -> Array:
        """The length scale of every row (n,)."""
        if len(rows) == 1:
            return np.array([self.length(rows[0])])
        if not len(self.length_places):
            return np.ones(len(rows))
        largest = np.abs(rows[:, self.length_places]).max(axis=1)
        return np.where(largest > 0, largest, 1.0)

    def _from_names(self, params: Mapping[str, Any]) -> Array:
        usual = self._from_floats(params)
        if usual is not None:
            return usual
        if {*map(type, params)} != {str}:
            params = without_unused(params, self.names, "params")
        given = {name: self.values_of(name, value) for name, value in params.items()}
        shape = np.broadcast_shapes(*(value.shape for value in given.values()))
        values, flags = np.zeros((*shape, len(self.names))), np.zeros(len(self.names), np.uint8)
        for name, value in given.items():
            values[..., self.index[name]] = value
            flags[self.index[name]] = 1
        return self.fill_defaults(values, flags)

    def _from_floats(self, params: Mapping[str, Any]) -> Array | None:
        """The usual case, fast: names and floats, all within their bounds."""
        values, flags = np.zeros(len(self.names)), np.zeros(len(self.names), np.uint8)
        for name, value in params.items():
            i = self.index.get(name, -1)
            if i < 0 or type(value) is not float or not self._open[i][0] < value < self._open[i][1]:
                return None
            values[i] = value
            flags[i] = 1
        return self.fill_defaults(values, flags)

    def values_of(self, name: str, value: Any) -> Array:
        """Values of one parameter, each within its bounds."""
        if name not in self.index:
            raise UnknownNameError("parameter", name, self.names)
        quantity = self.quantities[self.index[name]]
        value = in_si(value, quantity)
        try:
            array = np.asarray(value, dtype=np.float64)
            array = array if isinstance(value, OWN) else array.copy()
        except (TypeError, ValueError, OverflowError):
            raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None
        quantity.check(array)
        return array

    def _from_array(self, values: Array) -> Array:
        if values.ndim and values.shape[-1] == len(self._needed) < len(self.names):
            given = np.moveaxis(values, -1, 0)
            return self._from_names({self.names[i]: given[k] for k, i in enumerate(self._needed)})
        if values.ndim == 0 or values.shape[-1] != len(self.names):
            raise ValueOutOfBoundsError(
                f"an array of parameters needs all {len(self.names)} of them along its last "
                f"axis ({', '.join(self.names)}), not the shape {values.shape}"
            )
        rows = values.reshape(math.prod(values.shape[:-1]), len(self.names))
        if not strictly_within(rows, self._lower, self._upper):
            for i, quantity in enumerate(self.quantities):
                quantity.check(values[..., i])
        return values

    def fill_defaults(self, values: Array, flags: NDArray[np.uint8]) -> Array:
        """Fill in the values that are not flagged as given, in place."""
        for i, value in self._preset.items():
            if not flags[i]:
                values[..., i] = value
                flags[i] = 1
        if values.ndim == 1:
            self._scene.complete(flags, values)
        elif self.names:
            self._scene.complete_rows(flags, values.reshape(-1, len(self.names)))
        if self.missing and np.isnan(values).any():
            self._refuse_missing(values)
        return values

    def _refuse_missing(self, values: Array) -> None:
        rows = values.reshape(-1, len(self.names))
        names = ", ".join(n for i, n in enumerate(self.names) if np.isnan(rows[:, i]).any())
        raise MissingParameterError(
            f"these parameters have no default and need a value: {names}. Give them with params "
            "(in the shell: --set NAME=VALUE), or permanently with "
            "mechc.compile(..., defaults={...})"
        )


def _all_values(params: Any) -> Array:
    try:
        return doubles(params, "an array of parameters")
    except (TypeError, ValueError):
        raise TypeError(
            "parameters are given by name, such as {'m': 2.0}, or as an array of all of them, not "
            f"as {brief(params)}"
        ) from None


def doubles(
    value: Any, what: str, *, of: NamedQuantity | None = None, copied: bool = True
) -> Array:
    """An array of doubles in SI units, row after row in memory.

    ``of``: the quantity that they are values of, where one is known.
    It is a copy, since the caller may write to what was given; ``copied=False`` is for what is only
    read before the call returns.

    Raises :class:`ValueOutOfBoundsError` for an integer beyond all doubles, texts that are no
    numbers, rows of different lengths and units of another kind; ``TypeError`` for anything else
    but an array of numbers.
    """
    bare = type(value) in (list, tuple) and {float, int}.issuperset(map(type, value))  # no units
    if not bare and (type(value) is not np.ndarray or value.dtype.kind in DATES):
        quantity = of_unknown_unit(what) if of is None else replace(of, name=what)
        value = plain_numbers(value, quantity)
    try:
        found = np.asarray(value, dtype=np.float64, order="C")
        return found.copy() if copied and not isinstance(value, OWN) else found
    except OverflowError:
        raise ValueOutOfBoundsError(f"{what} contains an integer beyond all doubles") from None
    except ValueError:
        raise ValueOutOfBoundsError(f"{what} must be numbers, not {brief(value)}") from None
    except TypeError:
        raise TypeError(f"{what} must be numbers, not {brief(value)}") from None


def one_double(value: Any, what: str, of: NamedQuantity | None = None) -> float:
    """A number as a double; raises as :func:`doubles`."""
    if isinstance(value, float):  # also of NumPy
        return float(value)
    found = doubles(value, what, of=of)
    if found.ndim:
        raise ValueOutOfBoundsError(f"{what} must be one number, not {brief(value)}")
    return float(found)


def is_table(array: object, width: int) -> bool:
    """Whether it is an array (n, width) of doubles, row after row in memory."""
    return (
        isinstance(array, np.ndarray)
        and array.shape[1:] == (width,)
        and array.dtype == np.float64
        and array.flags.c_contiguous
    )
