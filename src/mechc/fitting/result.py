"""The result of a fit, with its report and its figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechc.fitting.figures import draw_fit
from mechc.fitting.findings import Findings
from mechc.fitting.report import in_words, json_of


class FitResult(Findings):
    __doc__ = Findings.__doc__

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
        return f"<mechc.FitResult of {self.problem.model.name}: {told}>"
