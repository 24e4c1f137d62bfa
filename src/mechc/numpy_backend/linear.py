"""The linear algebra of many states at once: constraint rows, and the motion that they allow.

Rows of J are scaled by the square roots of M's diagonal, so that speeds of different units may be
added, and decomposed by singular values: no normal equations are formed.  They are not scaled to
one length: at a change point a whole row may be zero.  Directions whose singular values are of the
size of rounding of the largest are redundant.
"""

from __future__ import annotations

import numpy as np

from mechc.system.parameters import Array

EPS = float(np.finfo(float).eps)
REDUNDANT = 16 * EPS  # of the largest singular value: a smaller one is zero


class Rows:
    """Rows (n, nc, nu) in the metric of a mass matrix's diagonal (n, nu).

    ``singular``: singular values (n, min(nc, nu)).
    """

    def __init__(self, jacobian: Array, diagonal: Array) -> None:
        with np.errstate(all="ignore"):
            self.weight = 1.0 / np.sqrt(diagonal)
            scaled = jacobian * self.weight[:, None, :]
            self.sound = np.isfinite(scaled).all(axis=(1, 2))
            scaled[~self.sound] = 0.0
        left, self.singular, right = np.linalg.svd(scaled)
        self.left, self.right = left, right
        largest = self.singular[:, :1]
        self.kept = self.singular > max(jacobian.shape[1:]) * REDUNDANT * largest
        self.inverse = np.where(self.kept, 1.0 / np.where(self.kept, self.singular, 1.0), 0.0)

    def least_change(self, values: Array) -> Array:
        """The least speeds x (n, nu), in the metric, with J x = values (n, nc)."""
        return self._marked(self.weight * self._along(values))

    def _along(self, values: Array) -> Array:
        size = self.inverse.shape[1]
        parts = times(np.swapaxes(self.left[:, :, :size], 1, 2), values) * self.inverse
        return times(np.swapaxes(self.right[:, :size], 1, 2), parts)

    def motion(self, mass: Array, forcing: Array, gamma: Array) -> tuple[Array, Array]:
        """u' (n, nu) and multipliers (n, nc) of M u' + J^T lambda = F, J u' = gamma.

        The motion is solved in the directions that the rows allow, only where M must be
        positive; multipliers are those of least norm.
        """
        with np.errstate(all="ignore"):
            metric = self.weight[:, :, None] * mass * self.weight[:, None, :]
            force = self.weight * forcing
            x = self._along(gamma)
            rank = self.kept.sum(axis=1)
            for r in {*rank.tolist()}:
                own = rank == r
                x[own] += _free_motion(metric[own], force[own], x[own], self.right[own, r:])
            reaction = force - times(metric, x)
            return self._marked(self.weight * x), self._marked(self._multipliers(reaction))

    def _multipliers(self, reaction: Array) -> Array:
        size = self.inverse.shape[1]
        parts = times(self.right[:, :size], reaction) * self.inverse
        return times(self.left[:, :, :size], parts)

    def _marked(self, values: Array) -> Array:
        values[~self.sound] = np.nan
        return values


def _free_motion(metric: Array, force: Array, x: Array, free: Array) -> Array:
    """The component of the solution along the free directions (n, f, nu)."""
    onto = np.swapaxes(free, 1, 2)
    along = solved(free @ metric @ onto, times(free, force - times(metric, x)))
    return times(onto, along)


def times(matrix: Array, vector: Array) -> Array:
    """(n, i, j) times (n, j): (n, i)."""
    return np.asarray((matrix @ vector[:, :, None])[:, :, 0])


def diagonal(matrix: Array) -> Array:
    """(n, i) of (n, i, i)."""
    return np.asarray(np.diagonal(matrix, axis1=1, axis2=2))


def free_motion(mass: Array, forcing: Array) -> Array:
    """u' (n, nu) of M u' = F."""
    with np.errstate(all="ignore"):
        weight = 1.0 / np.sqrt(diagonal(mass))
        metric = weight[:, :, None] * mass * weight[:, None, :]
        return np.asarray(weight * solved(metric, weight * forcing))


def solved(matrix: Array, right: Array) -> Array:
    """x (n, m) of A x = b; NaN where A is singular."""
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            return np.full(right.shape, np.nan)
    return np.concatenate([solved(matrix[n : n + 1], right[n : n + 1]) for n in range(len(matrix))])


def massless(mass: Array) -> int:
    """The first speed in whose direction M (nu, nu) is not positive definite, or -1."""
    for size in range(1, len(mass) + 1):
        try:
            lower = np.linalg.cholesky(mass[:size, :size])
        except np.linalg.LinAlgError:
            return size - 1
        if not lower[-1, -1] ** 2 > 2 * EPS * mass[size - 1, size - 1]:
            return size - 1
    return -1
