"""Integration rules of the methods: nodes, integrals to them, and weights between them.

A rule integrates rates K_j taken at nodes of a step of length h: at the fraction s of the step the
columns are S + h sum_j w_j(s) K_j.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from mechc.native._tableaus import PAIRS
from mechc.system.parameters import Array

RADAU_NODES = (0.1 * (4.0 - 6.0**0.5), 0.1 * (4.0 + 6.0**0.5), 1.0)  # Hairer & Wanner 1996, IV.5
GAUSS_STAGES = 8


@dataclass(frozen=True)
class Collocation:
    """Collocation at ``nodes`` (s,)."""

    nodes: Array
    coefficients: Array  # of the Lagrange polynomials, in Legendre's

    @classmethod
    def at(cls, nodes: Array) -> Collocation:
        """The rule with these nodes."""
        found = np.linalg.inv(legendre.legvander(2.0 * nodes - 1.0, len(nodes) - 1))
        return cls(nodes, np.asarray(found, float))

    @property
    def rates(self) -> int:
        """How many rates a step has."""
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


@dataclass(frozen=True)
class Pair:
    """An explicit pair: rate i at ``nodes[i]`` from row i of ``matrix``; ``end`` at the end."""

    end: int
    nodes: Array
    matrix: Array
    dense: Array  # rows of the dense output beyond the third

    @property
    def rates(self) -> int:
        """How many rates a step has, those of the dense output too."""
        return len(self.nodes)

    def weights(self, s: Array) -> Array:
        """As of the pair's dense output (runtime/run/dense_output.h): (n, rates)."""
        step, each = self.matrix[self.end], np.eye(len(self.nodes))
        bend = each[0] - step
        rows = [step, bend, step - each[self.end] - bend, *self.dense]
        total = np.zeros((len(s), len(self.nodes)))
        for number in range(len(rows) - 1, -1, -1):
            share = (1.0 - s) if number % 2 else s
            total = share[:, None] * (total + rows[number])
        return total


Rule = Collocation | Pair


@cache
def rule_of(method: str) -> Rule:
    """The rule of a method by its name."""
    if method in PAIRS:
        end, nodes, matrix, dense = PAIRS[method]
        return Pair(end, nodes, matrix, dense)
    if method == "radau5":
        return Collocation.at(np.array(RADAU_NODES))
    return Collocation.at(0.5 * legendre.leggauss(GAUSS_STAGES)[0] + 0.5)
