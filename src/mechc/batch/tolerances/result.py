"""Tolerances and what they do: shares of the first order, drawn parts, and where both differ."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechc.batch.reductions import Reduction
from mechc.batch.results import Batch
from mechc.batch.tolerances.words import in_words
from mechc.errors import package
from mechc.system.parameters import Array


def _normal(points: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri(points) / 3.0)


class Distribution(NamedTuple):
    """How parts lie within their tolerances: words, standard deviations in a tolerance, and the
    deviations over tolerances from points in the unit cube."""

    words: str
    deviations: float
    of_unit: Callable[[Array], Array]


DISTRIBUTIONS: Mapping[str, Distribution] = {
    "normal": Distribution("normal, a tolerance is 3 sigma", 3.0, _normal),
    "uniform": Distribution("uniform", math.sqrt(3.0), lambda points: 2.0 * points - 1.0),
}


@dataclass(frozen=True, repr=False)
class Tolerances:
    """What tolerances of k parts do to m results of a motion, in SI units.

    Attributes
    ----------
    model
        The :class:`mechc.Model` that was asked.
    names, nominal_parts, tolerances
        What has a tolerance, its nominal value (k,) and its tolerance (k,).
    reductions
        What the results are; ``results`` has their texts.
    slopes : (m, k)
        Derivative of each result by each part; NaN where there is none.
    batch
        Member 0 is the nominal motion, the others have drawn parts: ``points`` (1 + n, k).
    distribution, seed
        How the parts were drawn.
    notes
        Why there is no first order, if there is none.
    """

    model: Any
    names: Sequence[str]
    nominal_parts: Array
    tolerances: Array
    reductions: Sequence[Reduction]
    slopes: Array
    batch: Batch
    points: Array
    distribution: str
    seed: int
    notes: Sequence[str]

    @property
    def drawing(self) -> Distribution:
        """How the parts lie within their tolerances."""
        return DISTRIBUTIONS[self.distribution]

    @property
    def results(self) -> list[str]:
        """The texts of the results."""
        return [one.text for one in self.reductions]

    @property
    def nominal(self) -> Array:
        """The results (m,) of the nominal motion."""
        return np.asarray(self._values[0])

    @property
    def drawn(self) -> Array:
        """The results (n, m) of the drawn motions; NaN of those that do not reach their end."""
        return np.asarray(self._values[1:])

    @property
    def _values(self) -> Array:
        return np.stack([self.batch[text] for text in self.results], axis=1)

    @property
    def effects(self) -> Array:
        """What each tolerance does to each result by the first order (m, k): slope times it."""
        return self.slopes * self.tolerances

    @property
    def shares(self) -> Array:
        """The share (m, k) of each part in the variance of each result; 0 where nothing varies."""
        squares = self.effects**2
        total = squares.sum(axis=1, keepdims=True)
        return np.asarray(np.divide(squares, total, out=np.zeros_like(squares), where=total != 0.0))

    @property
    def worst_case(self) -> Array:
        """The change (m,) of the results with every part at its worst end, by the first order."""
        return np.asarray(np.abs(self.effects).sum(axis=1))

    @property
    def root_sum_square(self) -> Array:
        """The root of the sum of the squared effects (m,)."""
        return np.asarray(np.sqrt((self.effects**2).sum(axis=1)))

    @property
    def sigma(self) -> Array:
        """The standard deviation (m,) of the results by the first order."""
        return self.root_sum_square / self.drawing.deviations

    @property
    def first_order(self) -> Array:
        """What the first order gives for the drawn parts, (n, m)."""
        return self.nominal + (self.points[1:] - self.nominal_parts) @ self.slopes.T

    @property
    def departure(self) -> Array:
        """Root mean square (m,) of drawn results less those of the first order; NaN without."""
        apart = self.drawn - self.first_order
        counts = np.isfinite(apart).sum(axis=0)
        return np.asarray(np.sqrt(np.nansum(apart**2, axis=0) / np.where(counts, counts, np.nan)))

    def __getitem__(self, text: str) -> Array:
        """A result (n,) of the drawn motions, by its text."""
        return self.batch[text][1:]

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Result -> nominal value, worst case, root-sum-square, sigma, departure; mean, standard
        deviation, least and largest value of the drawn motions; and by part slope, effect and
        share."""
        found = {}
        for i, text in enumerate(self.results):
            own = self.drawn[:, i][np.isfinite(self.drawn[:, i])]
            seen = (
                (own.mean(), own.std(ddof=1), own.min(), own.max())
                if len(own) > 1
                else [math.nan] * 4
            )
            found[text] = {
                **{name: float(getattr(self, name)[i]) for name in
                   ("nominal", "worst_case", "root_sum_square", "sigma", "departure")},
                **dict(zip(("drawn_mean", "drawn_sigma", "drawn_min", "drawn_max"),
                           map(float, seen), strict=True)),
                "parts": {
                    name: {"slope": float(self.slopes[i, k]), "effect": float(self.effects[i, k]),
                           "share": float(self.shares[i, k])}
                    for k, name in enumerate(self.names)
                },
            }  # fmt: skip
        return found

    def to_dataframe(self) -> Any:
        """Tolerance, slope, effect and share, a row for each result and part: a pandas.DataFrame.

        Raises
        ------
        MissingPackageError
            If pandas is not installed: ``pip install pandas``.
        """
        pandas = package("pandas", "pandas is not installed: pip install pandas")
        rows = [(text, name) for text in self.results for name in self.names]
        columns = {
            "tolerance": np.tile(self.tolerances, len(self.results)),
            "slope": self.slopes.ravel(), "effect": self.effects.ravel(),
            "share": self.shares.ravel(),
        }  # fmt: skip
        return pandas.DataFrame(
            columns, index=pandas.MultiIndex.from_tuples(rows, names=["result", "part"])
        )

    def plot(self) -> Any:
        """A matplotlib figure: for each result a tornado of its parts, and a histogram of the drawn
        motions over the normal curve of the first order."""
        from mechc.batch.tolerances.figures import draw_tolerances

        return draw_tolerances(self)

    def __repr__(self) -> str:
        return in_words(self)
