"""Statistics of the values found: covariance, intervals, undetermined combinations.

The covariance is that of the linearised problem, (J^T J)^-1 times a variance: 1 where the noise is
known, else that of the residuals; with a robust loss that of an M-estimator,
K^2 sum psi^2 / (n - k) / mean(psi')^2 (Huber & Ronchetti 2009, Robust Statistics, 7.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.fitting.losses import Loss
from mechc.system.parameters import Array

SHARE = 0.05  # of a direction's largest share: a smaller one is not put into words


@dataclass(frozen=True)
class Combination:
    """A direction in the unknowns, and how well the data determine it.

    Attributes
    ----------
    shares
        Label -> its share of a step along the direction, in units of its own size: 0.7 and -0.7
        for two values of which one grows by a per cent where the other shrinks by one.
    uncertainty
        Standard deviation along it, in the same units; infinite where the data say nothing.
    """

    shares: dict[str, float]
    uncertainty: float

    def __str__(self) -> str:
        largest = max(map(abs, self.shares.values()))
        told = ", ".join(f"{name} {share / largest:+.2g} %" for name, share in self.shares.items())
        if len(self.shares) == 1:
            told = next(iter(self.shares))
        if np.isinf(self.uncertainty):
            return f"{told}: changes nothing that was measured"
        return f"{told}: known to {100 * self.uncertainty / largest:.0f} % only"


@dataclass(frozen=True)
class Statistics:
    """Covariance (k, k), and the directions by what the data say of them, the weakest first.

    ``robust``: whether the loss is.
    """

    covariance: Array
    combinations: tuple[Combination, ...]
    robust: bool


def statistics_of(
    jacobian: Array, residuals: Array, loss: Loss, *, absolute: bool, sizes: Array, active: Any,
    labels: Sequence[str], rounding: float,
) -> Statistics:  # fmt: skip
    """The statistics at a solution.

    Parameters
    ----------
    jacobian : (n, k)
    sizes : (k,)
        In units of which changes are measured.
    active : (k,)
        Which values lie at a bound: they are held, and have no variance (NaN).
    absolute
        Whether the noise is known.
    rounding
        Relative error of the Jacobian: a smaller singular value is none.
    """
    open_ = np.flatnonzero(~active)
    _, singular, rows = np.linalg.svd(jacobian[:, open_] * sizes[open_], full_matrices=False)
    largest = singular.max(initial=0.0)
    known = singular > max(rounding, len(singular) * np.finfo(float).eps) * largest
    back = rows.T * np.where(known, 1.0 / np.where(known, singular, 1.0), 0.0)
    spread = back @ back.T * _variance(residuals, loss, len(open_), absolute)
    spread[_unknowns_in(rows[~known])] = np.inf
    spread[:, _unknowns_in(rows[~known])] = np.inf
    covariance = np.full((len(sizes), len(sizes)), np.nan)
    covariance[np.ix_(open_, open_)] = spread * np.outer(sizes[open_], sizes[open_])
    names = [labels[k] for k in open_.tolist()]
    along = [float(np.sqrt(row @ np.where(np.isinf(spread), 0.0, spread) @ row)) for row in rows]
    found = [
        _combination(names, row, width if sure else np.inf)
        for row, width, sure in zip(rows, along, known, strict=True)
    ]
    return Statistics(covariance, tuple(reversed(found)), loss.robust)


def _variance(residuals: Array, loss: Loss, count: int, absolute: bool) -> float:
    """The variance, the factor of (J^T J)^-1, of residuals that count alike."""
    if absolute and not loss.robust:
        return 1.0
    psi, slope = loss.influence(residuals)
    mean = float(slope.mean())
    if not mean > 0:
        return np.inf
    correction = 1.0 + count / len(psi) * float(slope.var()) / mean**2
    return correction**2 * float(psi @ psi) / max(1, len(psi) - count) / mean**2


def _unknowns_in(directions: Array) -> Array:
    """The unknowns that partake in these directions."""
    return np.asarray((np.abs(directions) > 1e-6).any(axis=0))


def _combination(names: Sequence[str], direction: Array, uncertainty: float) -> Combination:
    largest = np.abs(direction).max()
    sign = np.sign(direction[np.argmax(np.abs(direction))])
    shares = {
        name: float(sign * share)
        for name, share in zip(names, direction, strict=True)
        if abs(share) > SHARE * largest
    }
    return Combination(shares, uncertainty)


def correlation_of(covariance: Array) -> Array:
    """Correlation coefficients (k, k); NaN where a value has no finite variance."""
    spread = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore"):
        return np.asarray(covariance / np.outer(spread, spread))


def half_widths(covariance: Array, level: float, freedoms: int | None) -> Array:
    """Half widths (k,) of the intervals that hold a value with this probability.

    ``freedoms``: of Student's distribution, where the noise is estimated; None where it is known.
    """
    from scipy.stats import norm, t

    tail = 0.5 + 0.5 * level
    factor = norm.ppf(tail) if freedoms is None else t.ppf(tail, max(1, freedoms))
    return np.asarray(factor * np.sqrt(np.diag(covariance)))
