"""A fit in words, and as JSON data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mechc.results.answer import finite, shown_quantity, value_lines
from mechc.system.quantity import shown_in

if TYPE_CHECKING:
    from mechc.fitting.measured import Measured

RARE = 1e-6  # a probability of residuals that large, below which noise is not the cause
STRONG = 0.95  # a correlation that is worth a line


def in_words(result: Any) -> str:
    """Values with their intervals, residuals, correlations, what the data leave open."""
    problem = result.problem
    recordings, correlation = len(problem.recordings), result.correlation
    how = "converged" if result.converged else "did not converge"
    lines = [
        f"fit of {result.model.name}: {len(result.names)} values from {problem.count} samples of "
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


def _values(result: Any) -> list[str]:
    level, notes = f"{100 * result.confidence:g} %", {}
    for name, (low, high) in result.intervals.items():
        _, factor = shown_quantity(result.model, name.partition("[")[0])
        if math.isfinite(high - low):
            notes[name] = f"  ({level}: {low * factor:.6g} ... {high * factor:.6g})"
    return value_lines(result, notes, "13.6g", 0)


def _residuals(result: Any, one: Measured) -> str:
    unit, factor = shown_in(one.quantity.kind, one.quantity.unit)
    rms = result.rms[one.name] * factor
    known = "" if math.isnan(one.sigma) else f", {rms / factor / one.sigma:.2f} of its sigma"
    return f"residuals of {one.name}: {rms:.3g} {unit} rms{known}"


def _notes(result: Any) -> list[str]:
    lines = []
    if result.noise_known and result.probability < RARE:
        lines.append(
            f"the residuals are larger than their noise: chi squared is {2 * result.cost:.4g} for "
            f"{result.freedoms} degrees of freedom. It is another minimum (try starts=256 between "
            "bounds), another assembly (guess=), or something that the model does not have"
        )
    for k, one in enumerate(result.problem.unknowns):
        if result.active[k]:
            side = "lower" if result.x[k] - one.lower < one.upper - result.x[k] else "upper"
            lines.append(f"{one.label} lies at its {side} bound: it has no interval")
    if not result.converged:
        lines.append(f"the search ended early: {result.message}")
    return lines


def json_of(result: Any) -> Mapping[str, Any]:
    """The result as JSON data; a number that is not finite is null."""
    found: Mapping[str, Any] = finite({
        "mechanism": result.model.name,
        "values": result.values,
        "standard_errors": result.standard_errors,
        "intervals": result.intervals,
        "confidence": result.confidence,
        "correlation": result.correlation.tolist(),
        "undetermined": [str(one) for one in result.undetermined],
        "cost": result.cost,
        "probability": result.probability,
        "samples": result.problem.count,
        "residual_rms": result.rms,
        "converged": result.converged,
        "message": result.message,
        "motions": result.motions,
    })  # fmt: skip
    return found
