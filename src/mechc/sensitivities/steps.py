"""Columns over the accepted steps of a run, each step by the method that made it.

The variational equations S' = A S + B are linear; compiled code solves them at the stages of the
motion (runtime/variational/): those of collocation lie on its dense output, those of an explicit
pair are taken again.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from mechc.assembly.closed import rank
from mechc.errors import MechcError
from mechc.native._codes import METHODS
from mechc.sensitivities.columns import Columns
from mechc.sensitivities.rules import Rule, rule_of
from mechc.sensitivities.samples import check_steps
from mechc.simulation.record import Record
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array
from mechc.system.system import System

TrajectoryT = TypeVar("TrajectoryT", bound=Trajectory)
NAMES = {number: name for name, number in METHODS.items()}
NUMBERS_AT_ONCE = 1 << 21  # of rates, in doubles


@dataclass(frozen=True)
class Piece:
    """A compiled run with its columns: times (n + 1,) and columns (n + 1, nx, k) at its steps."""

    run: Any
    columns: Columns
    t: Array
    ends: Array

    @property
    def directions(self) -> Array:
        """The directions of the columns."""
        return self.columns.directions

    @cached_property
    def methods(self) -> Array:
        """The number of each step's method."""
        found: Array = self.run.methods()
        return found

    def at(self, times: Array) -> Array:
        """Columns at times within the piece (m,), before they are moved onto the constraints."""
        forwards = 1.0 if self.t[-1] >= self.t[0] else -1.0
        step = np.searchsorted(forwards * self.t, forwards * times) - 1
        step = np.clip(step, 0, len(self.t) - 2)
        found = np.empty((len(times), *self.ends.shape[1:]))
        at_step = times == self.t[step + 1]
        found[at_step] = self.ends[step[at_step] + 1]
        for first, last in self.alike(np.unique(step[~at_step])):
            here = np.flatnonzero((step >= first) & (step < last) & ~at_step)
            found[here] = self._between(first, last, step[here], times[here])
        return found

    def on_tangent_space(self, t: Array, y: Array, found: Array) -> Array:
        """Columns (m, nx, k) at times and states, moved onto the constraints, in place."""
        self.run.project_columns(t, y, self.directions, found, self.columns.shapes)
        return found

    def alike(self, steps: Any) -> Iterator[tuple[int, int]]:
        """Ranges of steps by one method, among those given, each of limited length."""
        most = max(1, NUMBERS_AT_ONCE // (16 * self.ends[0].size + 1))
        first = 0
        for k in range(1, len(steps) + 1):
            if (
                k == len(steps)
                or steps[k] != steps[k - 1] + 1
                or k - first == most
                or self.methods[steps[k]] != self.methods[steps[first]]
            ):
                yield int(steps[first]), int(steps[k - 1]) + 1
                first = k

    def rule(self, step: int) -> Rule:
        """The rule of a step's method."""
        return rule_of(NAMES[int(self.methods[step])])

    def rates(self, first: int, last: int) -> tuple[Array, Array]:
        """Columns (steps + 1, nx, k) at the ends of steps first ... last - 1 by one method, before
        a law jumps there, and rates S' (steps, rates, nx, k) in them."""
        start, count = np.ascontiguousarray(self.ends[first]), self.rule(first).rates
        shapes = self.columns.shapes
        found: tuple[Array, Array] = self.run.vary(
            first, last, self.directions, start, count, shapes=shapes
        )
        return found

    def _between(self, first: int, last: int, step: Any, times: Array) -> Array:
        """Columns at times within steps first ... last - 1, by the dense output of their method."""
        rule = self.rule(first)
        ends, rates = self.rates(first, last)
        h = self.t[step + 1] - self.t[step]
        s = (times - self.t[step]) / h
        weights = rule.weights(s) * h[:, None]
        whole = rule.weights(np.ones(1))[0]
        before = self.ends[step]
        gained = np.einsum("mj,mjik->mik", weights - (s * h)[:, None] * whole, rates[step - first])
        return np.asarray(before + s[:, None, None] * (ends[step + 1 - first] - before) + gained)


def follow(system: System, run: Any, values: Array, columns: Columns, start: Array) -> Piece:
    """The columns over a compiled run, from those (nx, k) at its start.

    Raises :class:`MechcError` for a run that began at a change point, and for inputs that are
    functions of the state.
    """
    checked_run(system, run, values)
    t = run.times(0)
    if columns.samples is not None and len(t) > 1:
        check_steps(system, columns.names, t)
    last = max(len(t) - 1, 0)
    ends, _ = run.vary(0, last, columns.directions, start, shapes=columns.shapes)
    return Piece(run, columns, t, ends)


def on_tangent_space(
    system: System, record: Record, columns: Columns, start: Array, values: Array
) -> Array:
    """Columns (nx, k) at the start of a motion, moved onto the constraints' tangent space."""
    run: Any = record.pieces[0].steps
    checked_run(system, run, values)
    given = columns.directions, start
    moved: Array = run.vary(0, 0, *given, project=True, shapes=columns.shapes)[0][0]
    return moved


def differentiable(sol: TrajectoryT) -> TrajectoryT:
    """A copy of a motion whose system has derivatives of motions; they are compiled if need be."""
    system = sol.system.differentiable()
    if system is sol.system:
        return sol
    other = copy(sol)
    other.system, other.record = system, sol.record.read_by(system)
    return other


def refuse_contact(sol: Trajectory) -> None:
    """Raises :class:`MechcError` for a run with friction, or in which contacts lasted, or whose
    parameters have changed.
    """
    if sol.record.changes_params:
        raise MechcError(
            "there are no derivatives of a motion whose resets change parameters: make what they "
            "change a state whose rate is zero, mechc.compile(..., states={x: 0})"
        )
    rub = sol._run_events is not None and sol._run_events.rub
    if rub or any(piece.lasts for piece in sol.record.pieces):
        raise MechcError(
            "there are no derivatives of a motion with friction or with contacts that last: end "
            "the run before them"
        )


def checked_run(system: System, run: Any, values: Array) -> None:
    """Check that a run has derivatives.

    Raises :class:`MechcError` as :func:`follow` says.
    """
    first, last = (
        rank(system.constraint_jacobian(state, values, float(time)))
        for time, state in zip(*run.ends(), strict=True)
    )
    if first < last:
        raise MechcError(
            "the run begins at a change point, where branches of the motion cross: no derivatives "
            "are computed from there; begin beside it"
        )
    t, y = run.tail(1)
    if len(t) and system.driven is not None:  # inputs for which there are no derivatives raise
        system.evaluate("state_jacobian", y[0], values, float(t[-1]))
