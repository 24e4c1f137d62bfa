"""Error control of the derivatives' own: steps short enough for them as for the motion.

The error of each step of the columns is estimated as that of the motion is, by the embedded
formulas of explicit pairs and by what the polynomials of collocation lack.  Where it is above the
tolerance the motion is computed again with shorter steps, until no error is.  What is tolerated
follows Hindmarsh et al. (2005), ACM TOMS 31, 363-396: a derivative times the size of what it is by
is held to the tolerances of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from mechc.inputs.samples import input_of, signal_of
from mechc.sensitivities.columns import Columns
from mechc.sensitivities.history import Sensitivity
from mechc.sensitivities.steps import Piece
from mechc.simulation.settings import Policy
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array

SAFETY = 0.9  # of the length that the order of the method tells
SHORTEST = 0.3  # of a step's length: of one far too long the error tells little
RUNS = 12
ROUNDING = 3
LEAST_FALL = 0.999  # with the third power of the length, else an error is rounding
EPS = float(np.finfo(float).eps)
Made = TypeVar("Made", bound=Trajectory)


@dataclass(frozen=True)
class StepErrors:
    """The errors of the columns in the steps of a run, with their times increasing.

    Attributes
    ----------
    times : (n + 1,)
        Between them the steps count.
    lengths, errors, orders : (n,)
        Their whole lengths, their errors over what is tolerated, and the powers of the length that
        these follow.
    stayed : (n,)
        In how many runs in a row shorter steps have not lowered them, by the third power of the
        length at least.  At first they may not be short enough to tell; thrice it is rounding.
    """

    times: Array
    lengths: Array
    errors: Array
    orders: Array
    stayed: Array

    def counted_after(self, before: StepErrors | None) -> StepErrors:
        """The errors with ``stayed`` counted on from the run before."""
        if before is None:
            return self
        middles = 0.5 * (self.times[1:] + self.times[:-1])
        place = np.searchsorted(before.times, middles, side="right") - 1
        place = np.clip(place, 0, len(before.errors) - 1)
        shrunk = np.minimum(self.lengths / before.lengths[place], 1.0)
        tried = before.errors[place] > 1.0
        stays = tried & (self.errors > LEAST_FALL * before.errors[place] * shrunk**3)
        return replace(self, stayed=np.where(stays, before.stayed[place] + 1, 0))

    @property
    def tighter(self) -> Array:
        """Flags (n,) of the steps to be shortened: their error is too large and no rounding."""
        return np.asarray((self.errors > 1.0) & (self.stayed < ROUNDING))

    @property
    def limits(self) -> tuple[Array, Array]:
        """The longest steps that keep to the tolerance, none longer than now; any where shorter
        ones are of no use."""
        factors = SAFETY * np.maximum(self.errors, EPS) ** (-1.0 / self.orders)
        longest = self.lengths * np.clip(factors, SHORTEST, 1.0)
        return self.times, np.where(self.stayed < ROUNDING, longest, np.inf)


def controlled(
    again: Callable[[Policy], Made], sol: Made, differentiate: Callable[[Made], Sensitivity]
) -> tuple[Made, Sensitivity]:
    """A run with steps short enough for its derivatives too, and these; ``again`` makes runs."""
    before: StepErrors | None = None
    for _ in range(RUNS):
        found = differentiate(sol)
        errors = step_errors(sol, found).counted_after(before)
        if not errors.tighter.any():
            break
        limits = lower_limits(sol.policy.limits, errors.limits)
        before, sol = errors, again(sol.policy._replace(limits=limits))
    else:
        found = differentiate(sol)
        errors = step_errors(sol, found)
    left = errors.errors > 1.0
    if left.any():  # errors that shorter steps do not lower
        first = errors.times[:-1][left][0]
        told = (
            f"The error of the derivatives is above the tolerance in {int(left.sum())} steps, "
            f"first at t = {first:.9g} s, and shorter ones did not lower it"
        )
        sol.status = replace(sol.status, warnings=(*sol.status.warnings, told))
    return sol, found


def lower_limits(one: tuple[Array, Array] | None, two: tuple[Array, Array]) -> tuple[Array, Array]:
    """The smaller of two limits at each time."""
    if one is None:
        return two
    times = np.union1d(one[0], two[0])
    middles = 0.5 * (times[1:] + times[:-1])
    longest = np.full(len(middles), np.inf)
    for own, lengths in (one, two):
        place = np.searchsorted(own, middles, side="right") - 1
        inside = (place >= 0) & (place < len(lengths))
        longest[inside] = np.minimum(longest[inside], lengths[place[inside]])
    return times, longest


# -- errors of steps ------------------------------------------------------------------------------


def step_errors(sol: Trajectory, found: Sensitivity) -> StepErrors:
    """The errors of the steps of all pieces of a run."""
    sizes = _ColumnSizes(sol, found.columns, found.pieces)
    forwards = 1.0 if sol.span[1] >= sol.span[0] else -1.0
    ends = [*(forwards * piece.t[0] for piece in found.pieces[1:]), np.inf]
    parts = []
    for piece, end in zip(found.pieces, ends, strict=True):
        t = forwards * piece.t
        own = t[:-1] < end
        errors, orders = _of_piece(piece, sizes)
        cut = np.minimum(t[1:], end)
        parts.append(np.stack([t[:-1], cut, np.diff(t), errors, orders])[:, own])
    start, end, lengths, errors, orders = np.concatenate(parts, axis=1)[:, :: int(forwards)]
    times = np.append(start, end[-1:]) if forwards > 0 else -np.append(end, start[-1:])
    return StepErrors(times, np.abs(lengths), errors, orders, np.zeros(len(errors), int))


def _of_piece(piece: Piece, sizes: _ColumnSizes) -> tuple[Array, Array]:
    """The largest error of a column in each step of a piece, and its order; 0 without any."""
    size, tolerated = sizes.along(piece)
    found, orders = np.zeros(len(size)), np.ones(len(size))
    for first, last in piece.alike(np.arange(len(size))):
        own = slice(first, last)
        orders[own] = piece.rule(first).order
        found[own] = _of_steps(piece, first, last, size[own], tolerated[own])
    return found, orders


def _of_steps(piece: Piece, first: int, last: int, size: Array, tolerated: Array) -> Array:
    """The largest error of a column in each of some steps by one method."""
    rule, ends = piece.rule(first), slice(first + 1, last + 1)
    h = np.diff(piece.t[first : last + 1])[:, None, None]

    def project(errors: Array) -> Array:
        none, y = np.zeros_like(piece.directions), piece.run.states()[1]
        piece.run.project_columns(piece.t[ends], y[ends], none, errors)
        return errors

    errors = rule.errors(h, piece.rates(first, last)[1], size, rule.share * tolerated, project)
    alive = np.isfinite(piece.ends[ends]).all(axis=1) & np.isfinite(errors)
    return np.asarray(np.where(alive, errors, 0.0).max(axis=1, initial=0.0))


class _ColumnSizes:
    """The sizes of the columns' components, and the errors that are tolerated of them.

    What is tolerated follows the largest so far, of all coordinates or all speeds of a column in
    their units, and never less than the sizes of the motion over that of what the column is by.
    """

    def __init__(self, sol: Trajectory, columns: Columns, pieces: Sequence[Piece]) -> None:
        system = sol.system
        self.rtol, self.atol = sol.policy.rtol, sol.policy.atol
        self.coordinates = len(system.coordinates)
        self.units = system.scale(sol.params)[:, None]
        self.span = abs(sol.span[1] - sol.span[0]) or 1.0
        self.by = np.ones(columns.count)  # values of parameters and of inputs
        for name, place in columns.places.items():
            if name in system.parameters:
                self.by[place] = abs(sol.params[system.parameters.index(name)])
            elif (signal := signal_of(system, name)) is not None:
                self.by[place] = np.abs(signal.values).max()
            elif (own := input_of(name, system)) is not None:
                assert system.driven is not None
                self.by[place] = abs(float(system.driven.given[own]))
        self.by = np.where(self.by > 0.0, self.by, 1.0)
        y = np.abs(np.vstack([piece.run.states()[1] for piece in pieces])).max(axis=0)[:, None]
        sizes = np.where(np.arange(len(y))[:, None] < self.coordinates, self.units,
                         np.maximum(y, self.units / self.span))  # fmt: skip
        self.least = sizes / self.by
        self.reached = np.zeros((2, columns.count))

    def along(self, piece: Piece) -> tuple[Array, Array]:
        """Sizes and tolerated errors, (n, nx, k) each, at the steps of a piece; pieces are to be
        asked for in their order."""
        h = np.abs(np.diff(piece.t))[:, None]
        q, u = self._largest(np.abs(piece.ends) / self.units)
        here = [np.fmax(each[1:], each[:-1]) for each in (q, u)]
        sizes = self._of_components(np.fmax(here[0], h * here[1]), np.fmax(here[1], here[0] / h))
        q, u = (
            np.fmax.accumulate(np.vstack([before[None], each]))
            for before, each in zip(self.reached, (q, u), strict=True)
        )
        u = np.fmax(u, q / self.span)
        self.reached = np.stack([q[-1], u[-1]])
        tolerated = self._tolerance(self._of_components(q[2:], u[2:]))
        return np.fmax(sizes, tolerated), tolerated

    def _tolerance(self, reached: Array) -> Array:
        size = np.fmax(reached, self.least)
        if self.atol is None:
            return self.rtol * size
        asked = self.rtol * reached + np.reshape(self.atol, (-1, 1)) / self.by
        return np.maximum(asked, EPS * size)

    def _largest(self, whole: Array) -> list[Array]:
        """The largest of coordinates and of speeds."""
        parts = (whole[:, : self.coordinates], whole[:, self.coordinates :])
        return [np.fmax.reduce(part, axis=1, initial=0.0) for part in parts]

    def _of_components(self, q: Array, u: Array) -> Array:
        counts = [self.coordinates, len(self.units) - self.coordinates]
        return np.asarray(np.repeat(np.stack([q, u], axis=1), counts, axis=1) * self.units)
