"""Measured quantities and the standard deviations of their noise."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.quantities import Quantity, is_quantity, outputs_in, read_quantity
from mechc.system.system import System
from mechc.system.units import in_si


@dataclass(frozen=True)
class Measured:
    """A quantity that was recorded.

    Attributes
    ----------
    quantity
        A number of the model.
    sigma
        Standard deviation of its noise; NaN where that is not known.
    """

    quantity: Quantity
    sigma: float

    @property
    def name(self) -> str:
        """As it is written: ``theta_0``, ``points[2,0]``."""
        return self.quantity.name

    @property
    def weight(self) -> float:
        """The divisor of its residuals."""
        return 1.0 if math.isnan(self.sigma) else self.sigma


def checked_measured(system: System, given: Any) -> tuple[System, tuple[Measured, ...]]:
    """The measured quantities, from ``{name: sigma}`` or from names alone; and the system with
    their derivatives.

    Raises :class:`UnknownNameError`, :class:`UnavailableOutputError`,
    :class:`ValueOutOfBoundsError` for a quantity that the model does not have, and a standard
    deviation that is none.
    """
    system = system.differentiable(*outputs_in(_each(given)))
    pairs = given.items() if isinstance(given, Mapping) else ((name, None) for name in _each(given))
    found = tuple(_measured(system, name, sigma) for name, sigma in pairs)
    if not found:
        raise ValueOutOfBoundsError("nothing is measured: give measured={'theta_0': sigma}")
    written = [one.name for one in found]
    for name in written:
        if written.count(name) > 1:
            raise ValueOutOfBoundsError(f"{name} is measured twice")
    if len({math.isnan(one.sigma) for one in found}) > 1:
        raise ValueOutOfBoundsError(
            "give the standard deviation of every measured quantity, or of none: without them all "
            "residuals count alike, in SI units"
        )
    return system, found


def known_columns(system: System, columns: Iterable[str]) -> list[str]:
    """The columns of a recording that are quantities of a model.

    Raises :class:`MechcError` if none is, or what some need cannot be compiled.
    """
    columns, found = list(columns), []
    named = [name for name in columns if is_quantity(name)]
    system = system.differentiable(*outputs_in(named))
    for name in named:
        with suppress(UnknownNameError, ValueOutOfBoundsError):
            read_quantity(system, name, differentiable=True)
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


def _measured(system: System, name: Any, sigma: Any) -> Measured:
    quantity = read_quantity(system, name, differentiable=True)
    return Measured(quantity, _checked_sigma(quantity.name, in_si(sigma, quantity.meaning)))


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
