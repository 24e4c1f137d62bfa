"""The answer of a fit: values with what is known of them, motions, report and figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.fitting.figures import draw_fit
from mechc.fitting.problem import Problem
from mechc.fitting.report import in_words, json_of
from mechc.fitting.statistics import Combination, Statistics, correlation_of, half_widths
from mechc.results.answer import Answer
from mechc.system.parameters import Array

UNSURE = 1.0  # a combination known to less than its own size is not determined


@dataclass(frozen=True)
class FitResult(Answer):
    """Values that make motions agree with recordings.

    Attributes
    ----------
    names
        Of the free values, in the order of all matrices; ``theta_0[1]`` is a start of recording 1.
    x : (k,)
        Their values, in SI units.
    converged, message
        Whether the search ended at a minimum, and how.
    cost
        Half the sum of the squared residuals in units of sigma (of the loss, where it is robust).
    covariance : (k, k)
        NaN for a value at a bound, infinite for one that the data leave open.
    confidence
        The probability with which an interval of ``intervals`` holds the value, one by one.
    noise_known
        Whether standard deviations were given; if not, that of the residuals is taken.
    ends
        Values and cost of every start that was refined, the best first.
    """

    problem: Problem = field(repr=False)
    names: tuple[str, ...]
    x: Array
    cost: float
    converged: bool
    message: str
    statistics: Statistics = field(repr=False)
    confidence: float
    noise_known: bool
    active: Array = field(repr=False)
    ends: tuple[tuple[Array, float], ...] = field(repr=False)
    motions: int

    @property
    def values(self) -> dict[str, float]:
        """Name -> value."""
        return dict(zip(self.names, self.x.tolist(), strict=True))

    @property
    def covariance(self) -> Array:
        return self.statistics.covariance

    @property
    def standard_errors(self) -> dict[str, float]:
        """Name -> standard deviation of the value."""
        found = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, found, strict=True))

    @property
    def correlation(self) -> Array:
        """Correlation coefficients (k, k)."""
        return correlation_of(self.covariance)

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Name -> confidence interval at the level ``confidence``."""
        return self.intervals_at(self.confidence)

    def intervals_at(self, confidence: float) -> dict[str, tuple[float, float]]:
        """Confidence intervals at another level, between 0 and 1.

        Raises
        ------
        ValueOutOfBoundsError
            For a level that is no probability.
        """
        if not 0 < confidence < 1:
            raise ValueOutOfBoundsError(f"confidence = {confidence} must lie between 0 and 1")
        freedoms = None if self.noise_known else self.freedoms
        half = half_widths(self.covariance, confidence, freedoms)
        pairs = zip(self.names, (self.x - half).tolist(), (self.x + half).tolist(), strict=True)
        return {name: (low, high) for name, low, high in pairs}

    @property
    def freedoms(self) -> int:
        """Samples minus free values."""
        return self.problem.count - len(self.names)

    @property
    def probability(self) -> float:
        """The probability of residuals at least as large, for noise as given (chi-squared test).

        NaN where it is not known, and with a robust loss.
        """
        from scipy.stats import chi2

        if not self.noise_known or self.statistics.robust or not self.freedoms:
            return float("nan")
        return float(chi2.sf(2.0 * self.cost, self.freedoms))

    @property
    def undetermined(self) -> tuple[Combination, ...]:
        """Combinations of values that the data do not determine to their own size, in words."""
        return tuple(one for one in self.statistics.combinations if one.uncertainty > UNSURE)

    # -- the motions --------------------------------------------------------------------------

    @property
    def model(self) -> Any:
        """The :class:`mechc.Model` that was fitted."""
        return self.problem.motions[0].model

    @property
    def params(self) -> dict[str, Any]:
        """Parameters for ``simulate``: those found, and those that were given."""
        return dict(self.problem.motions[0].arguments(self.x).params)

    @property
    def y0(self) -> Array:
        """The start (nq + nu,) of the first recording's motion."""
        return np.asarray(self.solutions[0].record.ends()[1][0])

    @property
    def run(self) -> dict[str, Any]:
        """See :attr:`Answer.run`: of the first recording."""
        function = self.problem.motions[0]
        inputs = function.arguments(self.x).inputs
        return {"t_span": self.problem.span(0), "inputs": inputs or None, **function.policy}

    @property
    def starts(self) -> list[Any]:
        """The start of each recording, for ``simulate``."""
        return [function.arguments(self.x).start for function in self.problem.motions]

    @cached_property
    def solutions(self) -> tuple[Any, ...]:
        """The fitted motion of each recording, a :class:`mechc.Solution`."""
        count = len(self.problem.recordings)
        return tuple(self.problem.simulate(self.x, place) for place in range(count))

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Model minus data (nt, measured) of each recording, in SI units; NaN without a sample."""
        weights = np.array([one.weight for one in self.problem.measured])
        return tuple(
            self.problem.deviations(sol.system, sol.y, sol.params, place) * weights
            for place, sol in enumerate(self.solutions)
        )

    @property
    def rms(self) -> dict[str, float]:
        """Name of what was measured -> root mean square of its residuals, in SI units."""
        every = np.concatenate(self.residuals)
        found = np.sqrt(np.nanmean(every**2, axis=0)).tolist()
        return dict(zip((one.name for one in self.problem.measured), found, strict=True))

    # -- words and pictures -------------------------------------------------------------------

    def plot(self) -> Any:
        """Data over the fit, and the residuals below, in one matplotlib figure."""
        return draw_fit(self)

    def to_json(self) -> Mapping[str, Any]:
        """Numbers and words as JSON data."""
        return json_of(self)

    def __str__(self) -> str:
        return in_words(self)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} = {value:.6g}" for name, value in self.values.items())
        return f"<mechc.FitResult of {self.model.name}: {told}>"
