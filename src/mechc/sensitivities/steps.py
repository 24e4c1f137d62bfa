"""Columns over the accepted steps of a run, each step by the method that made it.

The variational equations S' = A S + B are linear; A and B are taken at the stages of the motion:
those of collocation lie on its dense output, those of an explicit pair are taken again.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import MechcError
from mechc.native._codes import METHODS
from mechc.native._variational import collocation_steps, pair_steps
from mechc.sensitivities.columns import Columns
from mechc.sensitivities.rules import Pair, Rule, rule_of
from mechc.sensitivities.tangent import tangent
from mechc.system.parameters import Array
from mechc.system.system import System

NAMES = {number: name for name, number in METHODS.items()}
NUMBERS_AT_ONCE = 1 << 21  # of Jacobians, in doubles
PLAIN = 0.2  # conditioning of the constraints below which stages are kept on them too


@dataclass(frozen=True)
class Piece:
    """Consecutive steps by one rule: times (n + 1,), columns (n + 1, nx, k) at them, and their
    rates (n, stages, nx, k)."""

    rule: Rule
    t: Array
    ends: Array
    rates: Array

    def at(self, times: Array) -> Array:
        """Columns at times within the piece (m,), before they are moved onto the constraints."""
        forwards = 1.0 if self.t[-1] >= self.t[0] else -1.0
        step = np.searchsorted(forwards * self.t, forwards * times) - 1
        step = np.clip(step, 0, len(self.t) - 2)
        h = self.t[step + 1] - self.t[step]
        s = (times - self.t[step]) / h
        weights = self.rule.weights(s) * h[:, None]
        whole = self.rule.weights(np.ones(1))[0]
        rates, before = self.rates[step], self.ends[step]
        gained = np.einsum("mj,mjik->mik", weights - (s * h)[:, None] * whole, rates)
        return np.asarray(before + s[:, None, None] * (self.ends[step + 1] - before) + gained)


def follow(system: System, run: Any, values: Array, columns: Columns, start: Array) -> list[Piece]:
    """The pieces of a compiled run, from the columns (nx, k) at its start.

    Raises
    ------
    MechcError
        For a run that began at a change point.
    """
    if not hasattr(run, "methods"):
        raise MechcError(
            "the run begins at a change point, where branches of the motion cross: no derivatives "
            "are computed from there; begin beside it"
        )
    (t, y), methods = run.states(), run.methods()
    closely = bool(system.scene.rows) and run.stats()["least_singular"] < PLAIN
    pieces = []
    for first, last in _alike(methods, system.scene.width, columns.count):
        motion = Motion(system, run, values, t[first : last + 1], y[first : last + 1], columns)
        piece = motion.piece(rule_of(NAMES[int(methods[first])]), start, closely=closely)
        pieces.append(piece)
        start = piece.ends[-1]
    return pieces


def _alike(methods: Array, width: int, count: int) -> Iterator[tuple[int, int]]:
    """Steps of one method in a row, not too many at once."""
    most = max(1, NUMBERS_AT_ONCE // (16 * width * (width + count)))
    first = 0
    for step in range(1, len(methods) + 1):
        if step == len(methods) or methods[step] != methods[first] or step - first == most:
            yield first, step
            first = step


@dataclass(frozen=True)
class Motion:
    """Some steps of a run, and what is differentiated along them."""

    system: System
    run: Any
    values: Array
    t: Array
    y: Array
    columns: Columns

    def piece(self, rule: Rule, start: Array, *, closely: bool) -> Piece:
        """The columns over these steps; ``closely``: also the stages' are kept tangent."""
        h = np.diff(self.t)
        if isinstance(rule, Pair):
            times, states = self._pair_stages(rule, h)
            jacobians, forced = self._linear(times, states)
            tangents, offsets = self._tangents(states, times)
            ends, rates = pair_steps(
                rule.matrix, rule.end, h, jacobians, forced, tangents, offsets, start
            )
        else:
            times = self._within(rule.nodes)
            states = self.run.interpolate(np.ascontiguousarray(times.reshape(-1)))
            states = states.reshape(*times.shape, -1)
            jacobians, forced = self._linear(times, states)
            identity = "coordinate_rates" not in self.system.scene.outputs and not closely
            if closely:
                jacobians, forced = self._closely(jacobians, forced, states, times)
            tangents, offsets = self._tangents(self.y[1:], self._within(np.ones(1))[:, 0])
            ends, rates = collocation_steps(
                rule.nodes, rule.first, rule.second, identity, h, jacobians, forced, tangents,
                offsets, start,
            )  # fmt: skip
        return Piece(rule, self.t, np.concatenate([start[None], ends]), rates)

    def _within(self, nodes: Array) -> Array:
        """Times at the nodes (n, s), strictly within the steps: inputs may jump at their ends."""
        before, after = self.t[:-1, None], self.t[1:, None]
        low, high = np.nextafter(before, after), np.nextafter(after, before)
        times = before + (after - before) * nodes
        return np.clip(times, np.minimum(low, high), np.maximum(low, high))

    def _pair_stages(self, rule: Pair, h: Array) -> tuple[Array, Array]:
        """Times (n, r) and states (n, r, nx) of all rates, projected as the run projected them."""
        times = self._within(rule.nodes)
        states = np.empty((*times.shape, self.y.shape[1]))
        rates = np.empty_like(states)
        for i, row in enumerate(rule.matrix):
            state = self.y[:-1] + h[:, None] * np.einsum("j,njx->nx", row[:i], rates[:, :i])
            states[:, i] = self.y[1:] if i == rule.end else self._projected(times[:, i], state)
            rates[:, i] = self.system.rates(states[:, i], self.values, times[:, i])
        return times, states

    def _projected(self, times: Array, states: Array) -> Array:
        if not self.system.scene.rows:
            return states
        project = self.system.scene.project
        return np.array(
            [project(t, y, self.values)[1] for t, y in zip(times.tolist(), states, strict=True)]
        )

    def _linear(self, times: Array, states: Array) -> tuple[Array, Array]:
        """A (n, s, nx, nx) and B (n, s, nx, k) at the stages."""
        y, t = states.reshape(-1, states.shape[-1]), times.reshape(-1)
        slopes = self.system.evaluate("state_jacobian", y, self.values, t)
        names = ("parameter_jacobian", "input_jacobian")
        forced = self.columns.of(self.system, *names, y, self.values, t)
        if forced is None:
            forced = np.zeros((len(y), y.shape[1], self.columns.count))
        shape = (*times.shape, y.shape[1])
        return slopes.reshape(*shape, -1), np.ascontiguousarray(forced.reshape(*shape, -1))

    def _tangents(self, states: Array, times: Array) -> tuple[Array, Array] | tuple[None, None]:
        y = states.reshape(-1, states.shape[-1])
        found = tangent(self.system, y, self.values, times.reshape(-1), self.columns)
        if found is None:
            return None, None
        shape = states.shape[:-1]
        moved, offset = (each.reshape(*shape, *each.shape[1:]) for each in found)
        return moved, offset

    def _closely(
        self, jacobians: Array, forced: Array, states: Array, times: Array
    ) -> tuple[Array, Array]:
        """A and B at stages that are projected: A P and B + A Q."""
        tangents, offsets = self._tangents(states, times)
        if tangents is None or offsets is None:
            return jacobians, forced
        return jacobians @ tangents, forced + jacobians @ offsets
