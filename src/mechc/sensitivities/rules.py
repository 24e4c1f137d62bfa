"""Integration rules of the methods: nodes, integrals to them, and weights between them.

A rule integrates rates K_j taken at nodes of a step of length h: at the fraction s of the step the
columns are S + h sum_j w_j(s) K_j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from mechc.native._codes import RULE_PAIR, RULE_RADAU, RULES
from mechc.native._tableaus import PAIRS, SHARE, SHARE_OF_MANY
from mechc.system.parameters import Array

RADAU_NODES = (0.1 * (4.0 - 6.0**0.5), 0.1 * (4.0 + 6.0**0.5), 1.0)  # Hairer & Wanner 1996, IV.5
GAUSS_STAGES = 8

Kept = Callable[[Array], Array]


@dataclass(frozen=True)
class Collocation:
    """Collocation at ``nodes`` (s,)."""

    nodes: Array
    coefficients: Array  # of the Lagrange polynomials, in Legendre's
    order: int  # of a step's error in its length
    highest: int  # coefficients of the rates that tell of it
    safety: float  # of their squares
    share: float = SHARE

    @classmethod
    def at(cls, nodes: Array, *estimate: Any) -> Collocation:
        """The rule with these nodes."""
        found = np.linalg.inv(legendre.legvander(2.0 * nodes - 1.0, len(nodes) - 1))
        return cls(nodes, np.asarray(found, float), *estimate)

    @property
    def rates(self) -> int:
        """The number of rates of a step."""
        return len(self.nodes)

    def weights(self, s: Array) -> Array:
        """Integrals from the step's start to the fractions s (n,): (n, stages)."""
        degree = len(self.nodes) - 1
        values = legendre.legvander(2.0 * s - 1.0, degree + 1)
        powers = np.empty((len(s), degree + 1))
        powers[:, 0] = s
        for n in range(1, degree + 1):
            powers[:, n] = (values[:, n + 1] - values[:, n - 1]) / (4 * n + 2)
        return np.asarray(powers @ self.coefficients)

    def errors(self, h: Array, rates: Array, size: Array, tolerated: Array, kept: Kept) -> Array:
        """Errors of steps over those tolerated, (m, k), as in runtime/methods/gauss/gauss.h.

        h : (m, 1, 1)
            Lengths of the steps.
        rates : (m, rates, nx, k)
            Of the columns.
        size, tolerated : (m, nx, k)
            Of the columns' components, and of their errors.
        kept
            What the constraints leave of columns at the steps' ends.
        """
        highest = h * _weighted_sums(self.coefficients[-self.highest :], rates)
        squares = self.safety * (highest**2).sum(axis=0)
        return np.asarray((squares / (size * tolerated)).mean(axis=1))


@dataclass(frozen=True)
class ExplicitPair:
    """An explicit pair: rate i at ``nodes[i]`` from row i of ``matrix``; ``end`` at the end."""

    end: int
    nodes: Array
    matrix: Array
    dense: Array  # rows of the dense output beyond the third
    estimates: Array  # (1 or 2, end + 1) weights of the rates
    order: int
    share: float

    @property
    def rates(self) -> int:
        """The number of rates of a step, those of the dense output too."""
        return len(self.nodes)

    def weights(self, s: Array) -> Array:
        """The weights (n, rates) of the pair's dense output (runtime/run/dense_output.h)."""
        step, each = self.matrix[self.end], np.eye(len(self.nodes))
        bend = each[0] - step
        rows = [step, bend, step - each[self.end] - bend, *self.dense]
        total = np.zeros((len(s), len(self.nodes)))
        for number in range(len(rows) - 1, -1, -1):
            share = (1.0 - s) if number % 2 else s
            total = share[:, None] * (total + rows[number])
        return total

    def errors(self, h: Array, rates: Array, size: Array, tolerated: Array, kept: Kept) -> Array:
        """Errors as :meth:`Collocation.errors` has them, by the pair's embedded formulas."""
        every = h * _weighted_sums(self.estimates, rates[:, : self.end + 1])
        found = np.stack([kept(each) for each in every])
        squares = ((found / tolerated) ** 2).mean(axis=2)
        if len(squares) == 1:
            return np.asarray(np.sqrt(squares[0]))
        whole = np.sqrt(squares[0] + 0.01 * squares[1])
        return np.asarray(squares[0] / np.where(whole > 0.0, whole, 1.0))


Rule = Collocation | ExplicitPair


def _weighted_sums(weights: Array, rates: Array) -> Array:
    """Sums (e, m, nx, k) of rates (m, rates, nx, k) by weights (e, rates)."""
    flat = weights @ rates.reshape(*rates.shape[:2], -1)
    return np.ascontiguousarray(flat.swapaxes(0, 1)).reshape(-1, len(rates), *rates.shape[2:])


@cache
def rule_of(method: str) -> Rule:
    """The rule of a method by its name."""
    if RULES[method] == RULE_PAIR:
        return ExplicitPair(*PAIRS[method])
    if RULES[method] == RULE_RADAU:
        return Collocation.at(np.array(RADAU_NODES), 6, 1, 1.0, SHARE_OF_MANY)
    return Collocation.at(0.5 * legendre.leggauss(GAUSS_STAGES)[0] + 0.5, 16, 2, 1e3)
