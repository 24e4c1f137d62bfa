"""Targets of a synthesis: what has which value at which position, in columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.kinds import Kind
from mechc.system.parameters import Array, doubles
from mechc.system.system import System
from mechc.system.units import in_si


@dataclass(frozen=True)
class Target:
    """One coordinate, point or output, and its values at the positions.

    Attributes
    ----------
    name, kind, unit
        As the user gave it; angle, length or other.
    output, entries
        None of a coordinate, else the output; and which of its numbers, or of the state's.
    values : (n, k)
        NaN where nothing is asked for.
    tolerance
        The divisor of its deviations.
    """

    name: str
    kind: Kind
    unit: str
    output: str | None
    entries: tuple[int, ...]
    values: Array
    tolerance: float

    def on(self, y: Array, outputs: Mapping[str, Array]) -> Array:
        """The numbers (..., k) at states y (..., nq + nu), of evaluated outputs."""
        whole = y if self.output is None else outputs[self.output]
        return whole[..., list(self.entries)]


@dataclass(frozen=True)
class Targets:
    """All targets but the driven coordinate, and the values of this: (n,), or None.

    ``points``: how many numbers the points of the linkage have.
    """

    each: tuple[Target, ...]
    driven: Array | None
    points: int

    @property
    def count(self) -> int:
        """The number of positions."""
        return len(self.each[0].values)

    def evaluate(self, system: System, y: Array, p: Array, t: float) -> Array:
        """All numbers (..., columns) at states y (..., nq + nu)."""
        leading = y.shape[:-1]
        names = {one.output for one in self.each if one.output is not None}
        outputs = {n: system.evaluate(n, y, p, t).reshape(*leading, -1) for n in names}
        return np.concatenate([one.on(y, outputs) for one in self.each], axis=-1)

    def slopes(self, system: System, y: Array, p: Array, t: float) -> tuple[Array, Array]:
        """Derivatives (..., columns, nq + nu) by the state, (..., columns, np) by parameters."""
        shape = (*y.shape[:-1], len(self.of_columns))
        by_state, by_parameter = np.zeros((*shape, y.shape[-1])), np.zeros((*shape, p.shape[-1]))
        if any(one.output is not None for one in self.each):
            own = [system.evaluate(f"own_{by}_jacobian", y, p, t) for by in ("state", "parameter")]
        first = 0
        for one in self.each:
            places = np.arange(first, first + len(one.entries))
            first += len(one.entries)
            if one.output is None:
                by_state[..., places, one.entries] = 1.0
                continue
            rows = np.array(system.derivative_rows[one.output][0])[list(one.entries)]
            by_state[..., places, :] = own[0][..., rows, :]
            by_parameter[..., places, :] = own[1][..., rows, :]
        return by_state, by_parameter

    @cached_property
    def of_points(self) -> Targets:
        """All points as a target without values."""
        entries = tuple(range(self.points))
        none = np.zeros((1, self.points))
        return Targets((Target("", Kind.LENGTH, "m", "points", entries, none, 1.0),), None, 0)

    @cached_property
    def of_columns(self) -> list[Target]:
        """The target of every column."""
        return [one for one in self.each for _ in one.entries]

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


def system_for_targets(system: System, names: Sequence[Any]) -> System:
    """The system with derivatives of the targets; names that are none change nothing.

    Raises as :meth:`System.including`.
    """
    outputs = [name for name in names if name in system.data["own"] or name in system.array_outputs]
    return system.differentiable("points", *outputs)


def checked_targets(
    system: System, given: Mapping[str, Any], driven: str, tolerances: Mapping[str, Any]
) -> Targets:
    """The targets of a system that :func:`system_for_targets` gave.

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
    return Targets(tuple(found), crank, 3 * len(system.point_names))


def _target(system: System, name: str, table: Array, tolerance: Any) -> Target:
    output: str | None = name
    if name in system.coordinates:
        kind, unit = system.quantities[name].kind, system.quantities[name].unit
        output, entries = None, (system.state_index(name),)
    elif name in system.point_names:
        width = table.shape[1] if table.ndim == 2 else 0
        if width not in (2, 3):
            raise ValueOutOfBoundsError(
                f"the targets of point {name} are rows (x, y) or (x, y, z), not {table.shape}"
            )
        first = 3 * system.point_names.index(name)
        output, entries, kind, unit = "points", (*range(first, first + width),), Kind.LENGTH, "m"
    elif name in system.derivative_rows and name not in ("points", "point_velocities"):
        entries, kind, unit = (*range(len(system.derivative_rows[name][0])),), Kind.OTHER, ""
    else:
        every = (*system.coordinates, *system.point_names, *system.data["own"])
        raise UnknownNameError("coordinate, point or output", name, every)
    values = table.reshape(len(table), -1) if table.ndim else table
    if values.ndim != 2 or values.shape[1] != len(entries) or not len(values):
        raise ValueOutOfBoundsError(
            f"the targets of {name} are {len(entries)} numbers a position, not {table.shape}"
        )
    if np.isinf(values).any() or np.isnan(values).all():
        raise ValueOutOfBoundsError(f"the targets of {name} are no finite numbers")
    divisor = (
        _extent(values, kind)
        if tolerance is None
        else _checked_tolerance(name, tolerance, kind, unit)
    )
    return Target(name, kind, unit, output, entries, values, divisor)


def _extent(values: Array, kind: Kind) -> float:
    """By what deviations are divided by default: a radian, or the extent of the values."""
    if kind is Kind.ANGLE:
        return 1.0
    asked = values[:, ~np.isnan(values).all(axis=0)]
    extent = float(np.linalg.norm(np.nanmax(asked, axis=0) - np.nanmin(asked, axis=0)))
    return extent or float(np.nanmax(np.abs(values))) or 1.0


def _checked_tolerance(name: str, tolerance: Any, kind: Kind, unit: str) -> float:
    from mechc.simulation.settings import checked_positive
    from mechc.system.quantity import NamedQuantity

    quantity = NamedQuantity(name, unit, name, 0.0, np.inf, False, kind)
    try:
        return checked_positive(f"the tolerance of {name}", in_si(tolerance, quantity))
    except TypeError:
        raise ValueOutOfBoundsError(f"the tolerance of {name} is {brief(tolerance)}") from None
