"""Position analysis: one assembly followed through a range of a driven coordinate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import closure
from mechc.assembly.positions import search_for, told_miss
from mechc.assembly.speeds import in_words
from mechc.errors import AssemblyError, ValueOutOfBoundsError
from mechc.native._closing import followed
from mechc.system.parameters import Array, doubles
from mechc.system.system import System

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

    def __getitem__(self, name: str) -> Array:
        """A coordinate, (..., nt)."""
        return np.asarray(self.q[..., self.system.state_index(name)])

    def ratio(self, name: str) -> Array:
        """The velocity ratio of a coordinate, (..., nt)."""
        return np.asarray(self.ratios[..., self.system.state_index(name)])

    @property
    def points(self) -> Array:
        """Positions of the named points in m, (..., nt, points, 3)."""
        still = np.zeros((*self.q.shape[:-1], len(self.system.speeds)))
        p = self.p if self.p.ndim == 1 else self.p[..., None, :]
        return self.system.points(np.concatenate([self.q, still], axis=-1), p, self.t)

    def __repr__(self) -> str:
        sets = f", {self.q.shape[:-2]} sets of parameters" if self.q.ndim > 2 else ""
        return f"<mechc.PositionSweep of {self.driven}, {len(self.values)} values{sets}>"


def sweep_positions(
    system: System, driven: str, values: Array, given: Mapping[str, float],
    near: Mapping[str, float], p: Array, t: float,
) -> PositionSweep:  # fmt: skip
    """See :meth:`mechc.Model.sweep_positions`; parameters p (..., np)."""
    place = system.state_index(driven)
    values = _checked_values(driven, values)
    rows = np.ascontiguousarray(p.reshape(-1, p.shape[-1]))
    kept = {**given, driven: float(values[0])}
    fixed = np.tile(system.default_coordinates, (len(rows), 1))
    for name, value in {**near, **kept}.items():
        fixed[:, system.state_index(name)] = value
    search = search_for(system, tuple(kept), tuple(near))
    if search is None or search.only_near:
        raise AssemblyError(
            f"the constraints do not determine a configuration for every value of {driven}: give "
            "other coordinates, fewer where none is left to be solved for"
        )
    first = search.solved(t, fixed, rows, KEPT)
    if p.ndim == 1 and not first.many[0]:
        raise AssemblyError(told_miss(system, kept, first.miss[0]))
    q = np.full((len(rows), len(values), len(system.coordinates)), np.nan)
    q[:, 0] = first.found[:, 0]
    angular = np.append(search.angular, np.uint8(system.angular[place]))
    ratios, change_points, passed, end = followed(
        closure(system, t), t, place, search.free, angular, values, q, rows,
        system.parameter_set.lengths(rows), MOST,
    )  # fmt: skip
    if system.driven is not None:
        system.driven.raise_failure()
    if p.ndim == 1 and np.isnan(ratios[0, 0]).any():
        raise AssemblyError(
            f"{in_words(system.quantities[driven], values[0])} is a change point or a dead point, "
            "where branches meet: begin the range beside it"
        )
    leading = p.shape[:-1]
    told = change_points[:, : min(int(passed.max(initial=0)), MOST)]
    return PositionSweep(
        driven, values, q.reshape(*leading, *q.shape[1:]), ratios.reshape(*leading, *q.shape[1:]),
        told.reshape(*leading, told.shape[1]), end.reshape(leading), system, p, t,
    )  # fmt: skip


def _checked_values(driven: str, given: Array) -> Array:
    values = doubles(given, f"values of {driven}")
    steps = np.diff(values) if values.ndim == 1 else np.zeros(1)
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise ValueOutOfBoundsError(f"values of {driven} must be a row of finite numbers")
    if not ((steps > 0).all() or (steps < 0).all()):
        raise ValueOutOfBoundsError(f"values of {driven} must rise or fall from each to the next")
    return values
