"""Position analysis: one assembly followed through a range of a driven coordinate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.assembly.closed import following
from mechc.assembly.closer import closure
from mechc.assembly.positions import miss_message, search_for
from mechc.assembly.speeds import in_words
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError
from mechc.native._closing import trace_assemblies
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles
from mechc.system.quantities import quantities_of, slopes_of
from mechc.system.system import System
from mechc.system.units import in_si

KEPT = 16  # first assemblies of one member among which the preferred one is chosen
MOST = 64  # change points told of one member


@dataclass(frozen=True)
class PositionSweep:
    """One assembly followed through a range, for one or many sets of parameters (...).

    Attributes
    ----------
    driven
        The name of the driven coordinate.
    values : (nt,)
        Its values (rad, m).
    q : (..., nt, nq)
        Configurations; NaN beyond the end of the assembly.
    ratios : (..., nt, nq)
        Velocity ratios: derivatives of the coordinates by the driven one.
    change_points : (..., k)
        Values of the driven coordinate at the change points passed, filled up with NaN.
    end : (...)
        Where the assembly ends: a limit of the driven coordinate; NaN where it goes through.
    """

    driven: str
    values: Array
    q: Array
    ratios: Array
    change_points: Array
    end: Array
    system: System
    p: Array
    t: float
    free: tuple[int, ...]

    def __getitem__(self, name: str) -> Array:
        """A coordinate, (..., nt)."""
        return np.asarray(self.q[..., self.system.state_index(name)])

    def ratio(self, name: str) -> Array:
        """The velocity ratio of a coordinate, (..., nt)."""
        return np.asarray(self.ratios[..., self.system.state_index(name)])

    @property
    def points(self) -> Array:
        """Positions of the named points in m, (..., nt, points, 3)."""
        return self.system.points(self._states, self._values, self.t)

    def transmission_angle(self, before: str, joint: str, after: str) -> Array:
        """The acute angle between two links at the joint between them, rad, (..., nt).

        ``before``, ``joint`` and ``after`` are named points: in a four-bar the crank's end, the
        joint of coupler and rocker, and the rocker's pivot.  Near pi/2 forces are passed on well;
        at 0 the linkage locks.

        Raises
        ------
        UnknownNameError
            If there is no such point.
        """
        names = self.system.point_names
        for name in (before, joint, after):
            if name not in names:
                raise UnknownNameError("point", name, names)
        points = self.points
        a, b = (points[..., names.index(n), :] - points[..., names.index(joint), :]
                for n in (before, after))  # fmt: skip
        across = np.linalg.norm(np.cross(a, b), axis=-1)
        return np.asarray(np.arctan2(across, np.abs((a * b).sum(axis=-1))))

    def sensitivity(self, parameter: Any) -> Array:
        """The derivative of the coordinates by a parameter, (..., nt, nq).

        The driven coordinate and those given are held, and parameters whose defaults follow this
        one.  NaN at change points and dead points, where it does not exist.

        Raises
        ------
        UnavailableOutputError
            If the model cannot be compiled with sensitivities.
        UnknownNameError
            If there is no such parameter.
        """
        return self._sensitivity(self.system.including("sensitivities"), parameter)

    def _sensitivity(self, system: System, parameter: Any) -> Array:
        """:meth:`sensitivity` by a parameter of a system that may have further outputs."""
        y, values = self._states, system.values_of(self.system, self._values)
        place = _place(system, parameter)
        gradient = system.constraint_gradient(y, values, self.t)
        lengths = system.attitudes.lengths_gradient(self.q, self.free)
        rows = np.concatenate([gradient, lengths], axis=-2)[..., list(self.free)]
        opened = np.zeros(rows.shape[:-1])
        if "constraints_by_parameters" in system.scene.outputs:
            by = system.evaluate("constraints_by_parameters", y, values, self.t)
            opened[..., : by.shape[-2]] = by[..., place]
        found = np.zeros_like(self.q)
        found[np.isnan(self.q).any(axis=-1)] = np.nan
        usable = np.isfinite(rows).all(axis=(-1, -2))
        moved, determined = following(rows[usable], opened[usable, :, None])
        part = found[usable]
        part[:, list(self.free)] = np.where(determined[:, None], moved[..., 0], np.nan)
        found[usable] = part
        return found

    def point_sensitivity(self, parameter: Any) -> Array:
        """The derivative of the points' positions by a parameter, (..., nt, points, 3).

        As :meth:`sensitivity`.
        """
        system = self.system.including("points", "sensitivities")
        place = _place(system, parameter)
        _, points = quantities_of(system, "points", differentiable=True)
        at = system, self._states, system.values_of(self.system, self._values), self.t
        by_state = slopes_of(points, "state", *at)[..., : self.q.shape[-1]]
        found = (by_state @ self._sensitivity(system, parameter)[..., None])[..., 0]
        found = found + slopes_of(points, "parameter", *at)[..., place]
        return np.asarray(found.reshape(*found.shape[:-1], -1, 3))

    @property
    def _states(self) -> Array:
        """States (..., nt, nq + nu) with speeds of zero."""
        still = np.zeros((*self.q.shape[:-1], len(self.system.speeds)))
        return np.concatenate([self.q, still], axis=-1)

    @property
    def _values(self) -> Array:
        """Parameters that go along with the states."""
        return self.p if self.p.ndim == 1 else self.p[..., None, :]

    def __repr__(self) -> str:
        sets = f", {self.q.shape[:-2]} sets of parameters" if self.q.ndim > 2 else ""
        return f"<mechc.PositionSweep of {self.driven}, {len(self.values)} values{sets}>"


def sweep_positions(
    system: System, driven: str, values: Array, given: Mapping[str, float],
    near: Mapping[str, float], p: Array, t: float,
) -> PositionSweep:  # fmt: skip
    """See :meth:`mechc.Model.sweep_positions`; parameters p (..., np)."""
    values = _checked_values(system, driven, values)
    rows = np.ascontiguousarray(p.reshape(math.prod(p.shape[:-1]), p.shape[-1]))
    kept = {**given, driven: float(values[0])}
    fixed = system.default_configurations(len(rows), (*near, *kept))
    for name, value in {**near, **kept}.items():
        fixed[:, system.state_index(name)] = value
    search = search_for(system, tuple(kept), tuple(near))
    if search is None or search.only_near:
        raise AssemblyError(
            f"the constraints do not determine a configuration for every value of {driven}: give "
            "other coordinates, fewer where none is left to be solved for"
        )
    first = search.solve(t, fixed, rows, KEPT)
    if p.ndim == 1 and not first.many[0]:
        raise AssemblyError(miss_message(system, kept, near, first.open[0], p, t))
    sweep = follow(system, driven, values, search.free, first.found[:, 0], rows, t)
    if p.ndim == 1 and np.isnan(sweep.ratios[0, 0]).any():
        raise AssemblyError(
            f"{in_words(system.quantities[driven], values[0])} is a change point or a dead point, "
            "where branches meet: begin the range beside it"
        )
    leading = p.shape[:-1]
    shapes = {
        "q": (*leading, *sweep.q.shape[1:]), "ratios": (*leading, *sweep.q.shape[1:]),
        "change_points": (*leading, sweep.change_points.shape[1]), "end": leading, "p": p.shape,
    }  # fmt: skip
    shaped = {name: getattr(sweep, name).reshape(shape) for name, shape in shapes.items()}
    return replace(sweep, **shaped)


def follow(
    system: System, driven: str, values: Array, free: Any, first: Array, p: Array, t: float
) -> PositionSweep:
    """The assemblies of members that begin at closed configurations ``first`` (n, nq).

    ``free``: the coordinates that close the loops.  Parameters p (n, np); NaN where the first
    configuration is none, or is singular.
    """
    q = np.full((len(p), len(values), len(system.coordinates)), np.nan)
    q[:, 0] = first
    ratios, change_points, passed, end = trace_assemblies(
        closure(system, t), t, system.state_index(driven), free, values, q, p,
        system.parameter_set.lengths(p), MOST,
    )  # fmt: skip
    if system.driven is not None:
        system.driven.raise_failure()
    told = change_points[:, : min(int(passed.max(initial=0)), MOST)]
    places = tuple(int(i) for i in free)
    return PositionSweep(driven, values, q, ratios, told, end, system, p, t, places)


def _place(system: System, parameter: Any) -> int:
    name = name_of(parameter)
    if name not in system.parameters:
        raise UnknownNameError("parameter", name, system.parameters)
    return system.parameters.index(name)


def _checked_values(system: System, driven: str, given: Array) -> Array:
    values = doubles(in_si(given, system.quantities[driven]), f"values of {driven}")
    steps = np.diff(values) if values.ndim == 1 else np.zeros(1)
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise ValueOutOfBoundsError(f"values of {driven} must be a row of finite numbers")
    if not ((steps > 0).all() or (steps < 0).all()):
        raise ValueOutOfBoundsError(f"values of {driven} must rise or fall from each to the next")
    return values
