"""The least-squares problem of a synthesis: closed loops, deviations and their exact Jacobian.

The unknowns are z = (parameters, zeros of coordinates, values of the driven coordinate at the
positions where these are not given).  Derivatives go through the closure by the implicit function
theorem: the loops Phi(q, p) = 0 stay closed, so Phi_q dq = -Phi_p dp.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechc.analysis.position_sweep import PositionSweep, follow
from mechc.assembly.closed import inverse
from mechc.assembly.closer import Search, wrap
from mechc.assembly.positions import search_for
from mechc.errors import AssemblyError
from mechc.sensitivities.columns import default_slopes, with_defaults
from mechc.synthesis.conditions import Conditions
from mechc.synthesis.targets import Targets
from mechc.system.parameters import Array
from mechc.system.quantities import Quantity, quantities_of, slopes_of, values_of
from mechc.system.system import System

Slopes = tuple[Array, Array, Array, Array]
SWEEP = 72  # steps of a sweep over which conditions are judged


@dataclass(frozen=True)
class Residuals:
    """Residuals (n, r) of members, and where they were taken.

    ``q`` (n, positions, nq) closes at the positions, ``swept`` (n, m, nq) along the grid.
    """

    z: Array
    values: Array
    q: Array
    swept: Array


@dataclass
class SynthesisProblem:
    """Unknowns, targets and conditions of one linkage.

    Attributes
    ----------
    driven
        The driven coordinate.
    names, lower, upper
        Free parameters, then coordinates whose zeros are free, with their bounds.
    fixed, kept
        Parameters and coordinates that have one value.
    """

    system: System
    driven: str
    names: tuple[str, ...]
    lower: Array
    upper: Array
    fixed: Mapping[str, float]
    kept: Mapping[str, float]
    targets: Targets
    conditions: Conditions
    t: float

    def __post_init__(self) -> None:
        system = self.system
        self.place = system.state_index(self.driven)
        self.parameters = tuple(name for name in self.names if name in system.parameters)
        zeros = {name: k for k, name in enumerate(self.names) if name not in self.parameters}
        self.driven_zero = zeros.get(self.driven)
        self.zeros = [zeros.get(one.name) for one in self.targets.of_columns]
        self.timed = self.targets.driven is not None
        self.valid = ~np.isnan(self.targets.values)

    @property
    def size(self) -> int:
        """How many unknowns there are."""
        return len(self.names) + (0 if self.timed else self.targets.count)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """The least and the largest values of the unknowns, (size,) each."""
        rest = np.full(self.size - len(self.names), np.inf)
        return np.append(self.lower, -rest), np.append(self.upper, rest)

    @cached_property
    def points(self) -> list[Quantity]:
        """The numbers of all points."""
        return quantities_of(self.system, "points", differentiable=True)[1]

    @cached_property
    def search(self) -> Search:
        """The search over all assemblies."""
        found = search_for(self.system, tuple({**self.kept, self.driven: 0.0}), ())
        if found is None:
            raise AssemblyError(
                f"{self.driven} determines nothing: a linkage whose loops it moves is needed"
            )
        return found

    @cached_property
    def nearest(self) -> Search:
        """The search from a guess alone."""
        count = len(self.search.free)
        flags = np.ones(count, np.uint8)
        return Search(self.system, self.search.free, np.zeros((1, count)), flags, 1, True)

    # -- positions ----------------------------------------------------------------------------

    def values(self, x: Array) -> Array:
        """All parameters (n, np) of members with unknowns (n, k)."""
        free = {name: x[:, k] for k, name in enumerate(self.names) if name in self.parameters}
        found = self.system.parameter_set.resolve({**self.fixed, **free})
        return np.array(np.broadcast_to(found, (len(x), found.shape[-1])))

    def driven_values(self, z: Array) -> Array:
        """The driven coordinate at the positions, (n, positions)."""
        if self.targets.driven is None:
            return z[:, len(self.names) :]
        zero = 0.0 if self.driven_zero is None else z[:, [self.driven_zero]]
        return np.array(np.broadcast_to(self.targets.driven + zero, (len(z), self.targets.count)))

    def close(self, s: Array, near: Array, p: Array) -> Array:
        """The closed configurations (n, m, nq) at driven values (n, m) nearest to others.

        Parameters p (n, np); NaN where there is none near by.
        """
        guess = near.reshape(-1, near.shape[-1]).copy()
        guess[:, self.place] = s.ravel()
        lost = np.isnan(guess).any(axis=1)
        guess[lost] = 0.0
        each = np.repeat(p, s.shape[1], axis=0)
        found = self.nearest.solve(self.t, guess, each, 1, tells_miss=False).found[:, 0]
        found[lost] = np.nan
        return np.asarray(found.reshape(near.shape))

    def states(self, q: Array) -> Array:
        """States (..., nq + nu) with speeds of zero."""
        return np.concatenate([q, np.zeros((*q.shape[:-1], len(self.system.speeds)))], axis=-1)

    def sweep(self, values: Array, first: Array, p: Array) -> PositionSweep:
        """The assemblies followed from configurations (n, nq) at the first of the values."""
        return follow(self.system, self.driven, values, self.search.free, first, p, self.t)

    # -- residuals ----------------------------------------------------------------------------

    def deviations(self, x: Array, q: Array, p: Array) -> Array:
        """The targets' errors (n, positions, columns) in SI units; angles within half a turn."""
        found = values_of(self.targets.quantities, self.system, self.states(q), p[:, None], self.t)
        found = found - self.targets.values
        for column, zero in enumerate(self.zeros):
            if zero is not None:
                found[..., column] -= x[:, zero, None]
        angular = self.targets.angular
        found[..., angular] = wrap(found[..., angular])
        return found

    def residuals(
        self, z: Array, near: Array, grid: Array, anchor: Array, weight: float
    ) -> Residuals:
        """Deviations over tolerances, then what conditions fall short by along a grid.

        ``near`` (n, positions, nq) and ``anchor`` (n, nq), at the grid's first value: closed
        configurations that these go on from.  Infinite where the loops do not close, or where the
        driven coordinate should turn fully and stops.
        """
        p, count = self.values(z), len(z)
        q = self.close(self.driven_values(z), near, p)
        parts = [(self.deviations(z, q, p) / self.targets.tolerances)[:, self.valid]]
        swept = np.zeros((count, 0, q.shape[-1]))
        if len(grid):
            first = self.close(np.full((count, 1), grid[0]), anchor[:, None], p)[:, 0]
            sweep = self.sweep(grid, first, p)
            swept, short = sweep.q, weight * self.conditions.shortfalls(sweep.points)
            if self.conditions.turns:
                short[self.conditions.stops(sweep)] = np.inf
            parts.append(short.reshape(count, -1))
            if not short.size:
                parts.append(np.where(self.conditions.stops(sweep), np.inf, 0.0)[:, None])
        found = np.concatenate(parts, axis=1)
        return Residuals(z, np.where(np.isnan(found), np.inf, found), q, swept)

    def jacobian(self, at: Residuals, weight: float) -> Array:
        """The derivatives (n, r, size) of residuals that are finite."""
        p, x = self.values(at.z), at.z[:, : len(self.names)]
        by_x, by_s = self._through_loops(self.slopes(p, at.q, self.targets.quantities))
        if self.driven_zero is not None and self.timed:
            by_x[..., self.driven_zero] += by_s
        found = np.zeros((*by_s.shape, self.size))
        found[..., : x.shape[1]] = by_x
        if not self.timed:
            each = np.arange(self.targets.count)
            found[:, each, :, x.shape[1] + each] = by_s.swapaxes(0, 1)
        parts = [(found / self.targets.tolerances[:, None])[:, self.valid]]
        if at.swept.shape[1]:
            points = self.system.points(self.states(at.swept), p[:, None], self.t)
            moved = self._through_loops(self.slopes(p, at.swept, self.points))[0]
            short = self.conditions.slopes(points, moved.reshape(*points.shape, x.shape[1]))
            free = np.zeros((*short.shape[:-1], self.size - x.shape[1]))
            short = weight * np.concatenate([short, free], axis=-1).reshape(len(p), -1, self.size)
            parts.append(short if short.size else np.zeros((len(p), 1, self.size)))
        return np.concatenate(parts, axis=1)

    def _through_loops(self, slopes: Slopes) -> tuple[Array, Array]:
        """Derivatives of targets by x and the driven values while the loops stay closed."""
        by_x, by_q, gap_x, gap_q = slopes
        free, place = self.search.free, self.place
        across = by_q[..., free] @ inverse(gap_q[..., free])
        return by_x - across @ gap_x, by_q[..., place] - (across @ gap_q[..., [place]])[..., 0]

    def slopes(self, p: Array, q: Array, quantities: Sequence[Quantity]) -> Slopes:
        """Derivatives of quantities (n, m, columns, ...) and gaps (n, m, rows, ...), by parameters
        and zeros (..., k) and by coordinates (..., nq), each for itself."""
        system, y, rows = self.system, self.states(q), p[:, None]
        at, width = (system, y, rows, self.t), q.shape[-1]
        moved = np.zeros((p.shape[1], len(self.names)))
        for name in self.parameters:
            moved[system.parameters.index(name), self.names.index(name)] = 1.0
        held = (*self.parameters, *self.fixed)
        moved = with_defaults(moved, default_slopes(system, rows, held))
        by_x = slopes_of(quantities, "parameter", *at) @ moved
        if quantities is self.targets.quantities:
            for column, zero in enumerate(self.zeros):
                if zero is not None:
                    by_x[:, :, column, zero] -= 1.0
        gap_q = system.constraint_gradient(y, rows, self.t)
        gap_x = np.zeros((*gap_q.shape[:-1], len(self.names)))
        if "constraints_by_parameters" in system.scene.outputs:
            gap_x = system.evaluate("constraints_by_parameters", y, rows, self.t) @ moved
        return by_x, slopes_of(quantities, "state", *at)[..., :width], gap_x, gap_q
