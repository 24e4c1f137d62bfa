"""Measured quantities: names, uncertainties, and values of the model on states."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.batch.reductions import ENTRY
from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.kinds import Kind
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.quantity import NamedQuantity
from mechc.system.system import SUMS, System
from mechc.system.units import in_si

_UNITS = {"energy": "J", "kinetic_energy": "J", "potential_energy": "J", "points": "m"}


@dataclass(frozen=True)
class Measured:
    """One number that was recorded.

    Attributes
    ----------
    name
        As it is written: ``theta_0``, ``points[2,0]``.
    output, index
        A coordinate, a speed, ``energy`` or an output, and which number of it.
    sigma
        Standard deviation of its noise; NaN where that is not known.
    unit, kind
        Where known.
    """

    name: str
    output: str
    index: tuple[int, ...]
    sigma: float
    unit: str
    kind: Kind

    @property
    def weight(self) -> float:
        """The divisor of its residuals."""
        return 1.0 if math.isnan(self.sigma) else self.sigma

    def on(self, system: System, y: Array, values: Array, t: Array) -> Array:
        """The values (...) of the quantity on states (..., nq + nu)."""
        if self.output in (*system.coordinates, *system.speeds):
            return np.asarray(y[..., system.state_index(self.output)])
        return self._entry(system.evaluate(self.output, y, values, t))

    def slopes(self, sol: Any, names: Sequence[str]) -> Array:
        """The derivatives (nt, names) of the quantity along a solution with sensitivities."""
        system = sol.system
        if self.output in (*system.coordinates, *system.speeds):
            place = system.state_index(self.output)
            return np.stack([sol.sensitivity[name][:, place] for name in names], axis=-1)
        found = [self._entry(sol.sensitivity_of(self.output, name)) for name in names]
        return np.stack(found, axis=-1)

    def _entry(self, values: Array) -> Array:
        """The number of an output (..., *shape) that was measured."""
        place: Any = (..., *self.index)
        return np.asarray(values[place])


def system_for_quantities(system: System, given: Any) -> System:
    """The system with derivatives of all measured quantities; names that are none change nothing.

    Raises as :meth:`System.including`.
    """
    names = [name for name in map(name_of, _each(given)) if isinstance(name, str)]
    matches = [ENTRY.fullmatch(name) for name in names]
    return system.differentiable(*(match[1] for match in matches if match))


def checked_measured(system: System, given: Any) -> tuple[Measured, ...]:
    """The measured quantities, from ``{name: sigma}`` or from names alone.

    Raises :class:`UnknownNameError`, :class:`UnavailableOutputError`,
    :class:`ValueOutOfBoundsError` for a quantity that the model does not have, and a standard
    deviation that is none.
    """
    system = system_for_quantities(system, given)
    pairs = given.items() if isinstance(given, Mapping) else ((name, None) for name in _each(given))
    found = tuple(_measured_quantity(system, name_of(name), sigma) for name, sigma in pairs)
    if not found:
        raise ValueOutOfBoundsError("nothing is measured: give measured={'theta_0': sigma}")
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise ValueOutOfBoundsError(f"{name} is measured twice")
    if len({math.isnan(one.sigma) for one in found}) > 1:
        raise ValueOutOfBoundsError(
            "give the standard deviation of every measured quantity, or of none: without them all "
            "residuals count alike, in SI units"
        )
    return found


def known_columns(system: System, columns: Iterable[str]) -> list[str]:
    """Those of the columns of a recording that are quantities of a model.

    Raises :class:`MechcError` if none is, or what some need cannot be compiled.
    """
    columns, found = list(columns), []
    system = system_for_quantities(system, columns)
    for name in columns:
        with suppress(UnknownNameError, ValueOutOfBoundsError):
            checked_measured(system, [name])
            found.append(name)
    if not found:
        raise MechcError(
            f"no column is a quantity of {system.name}: the columns are {', '.join(columns)}, the "
            f"coordinates and speeds {', '.join((*system.coordinates, *system.speeds))}"
        )
    return found


def _each(given: Any) -> Sequence[Any]:
    if isinstance(given, Mapping):
        return list(given)
    return [given] if isinstance(given, str) or not isinstance(given, Sequence) else given


def _measured_quantity(system: System, name: Any, sigma: Any) -> Measured:
    match = ENTRY.fullmatch(name) if isinstance(name, str) else None
    if match is None:
        raise ValueOutOfBoundsError(
            f"{brief(name)} is not a quantity: write theta_0, energy or points[2,0]"
        )
    output, typed = match.groups()
    index = tuple(int(each) for each in typed.split(",")) if typed else ()
    _check_index(output, index, _shapes(system, output))
    quantity = system.quantities.get(output)
    unit = quantity.unit if quantity is not None else _UNITS.get(output, "")
    own = Kind.LENGTH if output == "points" else Kind.OTHER
    kind = quantity.kind if quantity is not None else own
    text = "".join(name.split())
    sigma = in_si(sigma, NamedQuantity(text, unit, text, -math.inf, math.inf, False, kind))
    return Measured(text, output, index, _checked_sigma(text, sigma), unit, kind)


def _shapes(system: System, output: str) -> tuple[int, ...]:
    """The shape of a quantity, of a system that has its derivatives along a motion."""
    known: dict[str, tuple[int, ...]] = dict.fromkeys((*system.coordinates, *system.speeds), ())
    known |= {name: shape for name, (_, shape) in system.derivative_rows.items()}
    known |= {name: () for name, parts in SUMS.items() if known.keys() >= {*parts}}
    if output not in known:
        raise UnknownNameError("measured quantity", output, known)
    return known[output]


def _check_index(output: str, index: tuple[int, ...], shape: tuple[int, ...]) -> None:
    if len(index) == len(shape) and all(i < n for i, n in zip(index, shape, strict=True)):
        return
    if not shape:
        raise ValueOutOfBoundsError(f"{output} is one number: write {output} without an index")
    last = ",".join(str(n - 1) for n in shape)
    raise ValueOutOfBoundsError(
        f"{output} has the shape {shape}: write one of its numbers, from "
        f"{output}[{','.join('0' for _ in shape)}] to {output}[{last}]"
    )


def _checked_sigma(name: str, sigma: Any) -> float:
    if sigma is None:
        return math.nan
    try:
        value = float(sigma)
    except (TypeError, ValueError):
        value = math.nan
    if not (value > 0 and math.isfinite(value)):
        raise ValueOutOfBoundsError(
            f"{name}: the standard deviation of its noise must be a positive number, not "
            f"{brief(sigma)}; where it is not known, give measured=[names]"
        )
    return value
