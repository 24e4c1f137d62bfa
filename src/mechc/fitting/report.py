"""A fit in words, and as JSON data."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.system.kinds import shown_in

if TYPE_CHECKING:
    from mechc.fitting.findings import Findings
    from mechc.fitting.measured import Measured

RARE = 1e-6  # a probability of residuals that large, below which noise is not the cause
STRONG = 0.95  # a correlation that is worth a line


def in_words(result: Findings) -> str:
    """Values with their intervals, residuals, correlations, what the data leave open."""
    problem = result.problem
    recordings, correlation = len(problem.recordings), result.correlation
    how = "converged" if result.converged else "did not converge"
    lines = [
        f"fit of {problem.model.name}: {len(result.names)} values from {problem.count} samples of "
        f"{recordings} recording{'s' * (recordings > 1)}, {how} ({result.motions} motions)",
        *_values(result),
        *(_residuals(result, one) for one in problem.measured),
        *(
            f"{result.names[i]} and {result.names[j]} are correlated: {correlation[i, j]:+.3f}"
            for i in range(len(result.names))
            for j in range(i)
            if abs(correlation[i, j]) > STRONG
        ),
        *(f"the data do not determine {one}" for one in result.undetermined),
        *_notes(result),
    ]
    return "\n".join(lines)


def _values(result: Findings) -> list[str]:
    level = f"{100 * result.confidence:g} %"
    width = max(map(len, result.names))
    lines = []
    for name, (low, high) in result.intervals.items():
        quantity = result.problem.model.quantities.get(name.partition("[")[0])
        unit, factor = ("", 1.0) if quantity is None else shown_in(quantity.kind, quantity.unit)
        value = f"  {name:{width}}  {result[name] * factor:12.6g} {unit}"
        if math.isfinite(high - low):
            value += f"  ({level}: {low * factor:.6g} ... {high * factor:.6g})"
        lines.append(value)
    return lines


def _residuals(result: Findings, one: Measured) -> str:
    unit, factor = shown_in(one.quantity.kind, one.quantity.unit)
    rms = result.rms[one.name] * factor
    known = "" if math.isnan(one.sigma) else f", {rms / factor / one.sigma:.2f} of its sigma"
    return f"residuals of {one.name}: {rms:.3g} {unit} rms{known}"


def _notes(result: Findings) -> list[str]:
    lines = []
    if result.noise_known and result.probability < RARE:
        lines.append(
            f"the residuals are larger than their noise: chi squared is {2 * result.cost:.4g} for "
            f"{result.freedoms} degrees of freedom. It is another minimum (try starts=256 between "
            "bounds), or something that the model does not have"
        )
    for k, one in enumerate(result.problem.unknowns):
        if result.active[k]:
            side = "lower" if result.x[k] - one.lower < one.upper - result.x[k] else "upper"
            lines.append(f"{one.label} lies at its {side} bound: it has no interval")
    if not result.converged:
        lines.append(f"the search ended early: {result.message}")
    return lines


def json_of(result: Findings) -> dict[str, Any]:
    """The result as JSON data; a number that is not finite is null."""
    return {
        "mechanism": result.problem.model.name,
        "values": result.values,
        "standard_errors": _finite(result.standard_errors),
        "intervals": {n: [_or_none(x) for x in ends] for n, ends in result.intervals.items()},
        "confidence": result.confidence,
        "correlation": [[_or_none(x) for x in row] for row in result.correlation.tolist()],
        "undetermined": [str(one) for one in result.undetermined],
        "cost": result.cost,
        "probability": _or_none(result.probability),
        "samples": result.problem.count,
        "residual_rms": _finite(result.rms),
        "converged": result.converged,
        "message": result.message,
        "motions": result.motions,
    }


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    return {name: _or_none(value) for name, value in values.items()}


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
