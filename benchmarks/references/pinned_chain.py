"""Motion of a planar chain whose end is pinned to the ground, with more freedoms than one.

Thin uniform rods by their absolute angles: M a'' + h = Q + R^T lambda with the closure's rows R.
By SciPy's DOP853; every stage is put onto the closure before its rates are taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ..problems.problem import Array

GRAVITY = 9.81  # m/s^2


@dataclass(frozen=True)
class PinnedChain:
    """Rods of 1 kg and these lengths from the origin to (ground, 0), m."""

    lengths: Array
    ground: float

    def final(self, start: Array, t_end: float, tolerance: float = 1e-12) -> Array:
        """Angles and rates at ``t_end``; NaN where the integration fails."""
        run = solve_ivp(self._rates, (0.0, t_end), self.closed(start), method="DOP853",
                        rtol=tolerance, atol=tolerance)  # fmt: skip
        return self.closed(run.y[:, -1]) if run.success else np.full_like(start, np.nan)

    def _rates(self, t: float, y: Array) -> Array:
        angles, u = np.split(self.closed(y), 2)
        c, s, l = np.cos(angles), np.sin(angles), self.lengths
        middles = np.tril(np.tile(l, (len(l), 1)), -1) + np.diag(l / 2)
        inertia = middles.T @ middles
        mass = inertia * (np.outer(c, c) + np.outer(s, s)) + np.diag(l**2 / 12)
        bent = inertia * (np.outer(s, c) - np.outer(c, s))
        force = -bent @ u**2 - GRAVITY * middles.sum(0) * c
        rows = self._rows(angles)
        gamma = np.array([l * c, l * s]) @ u**2
        n = len(l)
        matrix = np.block([[mass, rows.T], [rows, np.zeros((2, 2))]])
        return np.concatenate([u, np.linalg.solve(matrix, np.concatenate([force, gamma]))[:n]])

    def _rows(self, angles: Array) -> Array:
        return np.array([-self.lengths * np.sin(angles), self.lengths * np.cos(angles)])

    def closed(self, y: Array) -> Array:
        """The nearest angles and rates that close the loop."""
        angles, u = np.split(y, 2)
        for _ in range(3):
            tip = self.lengths @ np.exp(1j * angles) - self.ground
            gap = np.array([tip.real, tip.imag])
            angles = angles - np.linalg.lstsq(self._rows(angles), gap, rcond=None)[0]
        rows = self._rows(angles)
        return np.concatenate([angles, u - np.linalg.lstsq(rows, rows @ u, rcond=None)[0]])
