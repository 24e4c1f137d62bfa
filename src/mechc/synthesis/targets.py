"""Targets of a synthesis: what has which value at which position, in columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.simulation.settings import checked_positive
from mechc.system.parameters import Array, doubles
from mechc.system.quantities import Quantity, quantities_of, read_quantity
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.system import System
from mechc.system.units import in_si

NO_TARGETS = {"points", "point_velocities"}  # a point has its own name


@dataclass(frozen=True)
class Target:
    """One coordinate, point or output, and its values at the positions.

    Attributes
    ----------
    name
        As the user gave it.
    quantities
        Its numbers, one for each column.
    values : (n, k)
        NaN where nothing is asked for.
    tolerance
        The divisor of its deviations.
    """

    name: str
    quantities: tuple[Quantity, ...]
    values: Array
    tolerance: float

    @property
    def kind(self) -> Kind:
        return self.quantities[0].kind

    @property
    def unit(self) -> str:
        return self.quantities[0].unit

    @property
    def is_coordinate(self) -> bool:
        return self.quantities[0].of_state


@dataclass(frozen=True)
class Targets:
    """All targets but the driven coordinate, and the values of this: (n,), or None."""

    each: tuple[Target, ...]
    driven: Array | None

    @property
    def count(self) -> int:
        """The number of positions."""
        return len(self.each[0].values)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantity of every column."""
        return tuple(quantity for one in self.each for quantity in one.quantities)

    @cached_property
    def of_columns(self) -> list[Target]:
        """The target of every column."""
        return [one for one in self.each for _ in one.quantities]

    @cached_property
    def values(self) -> Array:
        """The values asked for, (n, columns)."""
        return np.concatenate([one.values for one in self.each], axis=1)

    @cached_property
    def tolerances(self) -> Array:
        """(columns,)"""
        return np.array([one.tolerance for one in self.of_columns])

    @cached_property
    def angular(self) -> Array:
        """Which columns are angles."""
        return np.array([one.kind is Kind.ANGLE for one in self.of_columns])


def checked_targets(
    system: System, given: Mapping[str, Any], driven: str, tolerances: Mapping[str, Any]
) -> Targets:
    """The targets of a system that has their derivatives, and those of the points.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for names that are no
    coordinate, point or output, and values of wrong shapes.
    """
    found, rows = [], {}
    for name in tolerances:
        if name not in given or name == driven:
            raise UnknownNameError("target", name, [each for each in given if each != driven])
    for name, values in given.items():
        if name in system.coordinates:
            values = in_si(values, system.quantities[name])
        table = doubles(values, f"the targets of {name}")
        rows[name] = table.shape[:1]
        if name != driven:
            found.append(_target(system, name, table, tolerances.get(name)))
    if not found:
        raise ValueOutOfBoundsError(
            "there is no target besides the driven coordinate: give a point, {'C': [(x, y), ...]}, "
            "a coordinate or an output with its values"
        )
    if len({*rows.values()}) > 1:
        told = ", ".join(f"{name} {shape[0] if shape else 1}" for name, shape in rows.items())
        raise ValueOutOfBoundsError(f"targets have as many rows as there are positions: {told}")
    crank = None
    if driven in given:
        crank = doubles(in_si(given[driven], system.quantities[driven]), driven)
        if crank.ndim != 1 or not np.isfinite(crank).all():
            raise ValueOutOfBoundsError(f"the values of {driven} must be a row of finite numbers")
    return Targets(tuple(found), crank)


def _target(system: System, name: str, table: Array, tolerance: Any) -> Target:
    if name in system.point_names:
        width = table.shape[1] if table.ndim == 2 else 0
        if width not in (2, 3):
            raise ValueOutOfBoundsError(
                f"the targets of point {name} are rows (x, y) or (x, y, z), not {table.shape}"
            )
        names = [f"points[{system.point_names.index(name)},{k}]" for k in range(width)]
        numbers = [read_quantity(system, each, differentiable=True) for each in names]
    elif name in system.coordinates or name in {*system.derivative_rows} - NO_TARGETS:
        numbers = quantities_of(system, name, differentiable=True)[1]
    else:
        every = (*system.coordinates, *system.point_names, *system.data["own"])
        raise UnknownNameError("coordinate, point or output", name, every)
    values = table.reshape(len(table), -1) if table.ndim else table
    if values.ndim != 2 or values.shape[1] != len(numbers) or not len(values):
        raise ValueOutOfBoundsError(
            f"the targets of {name} are {len(numbers)} numbers a position, not {table.shape}"
        )
    if np.isinf(values).any() or np.isnan(values).all():
        raise ValueOutOfBoundsError(f"the targets of {name} are no finite numbers")
    meaning = numbers[0].meaning
    divisor = (
        _extent(values, meaning.kind)
        if tolerance is None
        else _checked_tolerance(name, tolerance, meaning)
    )
    return Target(name, tuple(numbers), values, divisor)


def _extent(values: Array, kind: Kind) -> float:
    """By what deviations are divided by default: a radian, or the extent of the values."""
    if kind is Kind.ANGLE:
        return 1.0
    asked = values[:, ~np.isnan(values).all(axis=0)]
    extent = float(np.linalg.norm(np.nanmax(asked, axis=0) - np.nanmin(asked, axis=0)))
    return extent or float(np.nanmax(np.abs(values))) or 1.0


def _checked_tolerance(name: str, tolerance: Any, meaning: NamedQuantity) -> float:
    positive = replace(meaning, name=name, lower=0.0)
    try:
        return checked_positive(f"the tolerance of {name}", in_si(tolerance, positive))
    except TypeError:
        raise ValueOutOfBoundsError(f"the tolerance of {name} is {brief(tolerance)}") from None
