"""Tolerances in words: a table for each result, and where drawn motions are others than it says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mechc.system.quantity import shown_in

APART = 0.1  # of the standard deviation: a departure from the first order that is worth a line


def in_words(found: Any) -> str:
    """The table that ``print`` shows."""
    lines = [
        f"tolerances of {found.model.name}: {len(found.drawn)} drawn motions, {found.drawing.words}"
    ]
    for i, text in enumerate(found.results):
        lines += _result(found, i, found.to_dict()[text])
    return "\n".join([*lines, *differences(found)])


def _result(found: Any, i: int, numbers: Mapping[str, Any]) -> Iterator[str]:
    """The lines of one result."""
    one = found.reductions[i]
    unit, factor = shown_in(one.kind, one.unit)

    def told(name: str, form: str = ".4g") -> str:
        value = factor * numbers[name]
        return f"{value:{form}} {unit}".rstrip() if np.isfinite(value) else "none"

    yield f"{one.text} = {told('nominal', '.6g')}"
    yield (
        f"  first order: worst case +-{told('worst_case')}, root-sum-square "
        f"+-{told('root_sum_square')}, sigma {told('sigma')}"
    )
    yield (
        f"  drawn: mean {told('drawn_mean', '.6g')}, sigma {told('drawn_sigma')}, "
        f"from {told('drawn_min', '.6g')} to {told('drawn_max', '.6g')}"
    )
    width = max(map(len, found.names))
    for k in np.argsort(-found.shares[i], kind="stable"):
        quantity = found.model.quantities.get(found.names[k])
        own, part = ("", 1.0) if quantity is None else shown_in(quantity.kind, quantity.unit)
        effect, share = factor * found.effects[i, k], 100 * found.shares[i, k]
        yield (
            f"  {found.names[k]:{width}}  +-{part * found.tolerances[k]:<8.4g} {own:5} "
            + (f"effect {effect:+11.4g} {unit}" if np.isfinite(effect) else "no first order")
            + (f", share {share:.2f} %" if np.isfinite(share) else "")
        )


def differences(found: Any) -> Iterator[str]:
    """Where drawn motions are others than the first order takes them to be, one line each."""
    batch: Any = found.batch
    yield from found.notes
    drawn, ok = len(batch) - 1, batch.ok
    for code in np.unique(batch["status"][~ok]):
        members = np.flatnonzero(batch["status"] == code)
        yield f"{len(members)} of {drawn} drawn motions: {batch.status(int(members[0]))}"
    for name, what in (("change_points", "change points"), ("event_counts", "impacts or events")):
        if name not in batch.arrays:
            continue
        counts = batch[name].reshape(len(batch), -1)
        others = ok & (counts != counts[0]).any(axis=1)
        if others.any():
            passed = ", ".join(map(str, counts[0]))
            yield (
                f"{others.sum()} of {drawn} drawn motions have other numbers of {what} than the "
                f"nominal one ({passed}): member {np.flatnonzero(others)[0]} for example"
            )
    apart = np.abs(found.drawn - found.first_order)
    rounding = batch.recipe.policy.rtol * np.abs(found.nominal)
    for i, one in enumerate(found.reductions):
        if found.departure[i] > APART * found.sigma[i] + rounding[i]:
            unit, factor = shown_in(one.kind, one.unit)
            worst = int(np.nanargmax(apart[:, i]))
            parts = ", ".join(
                f"{name} {value:+.3g}" for name, value in
                zip(found.names, found.points[1 + worst] - found.nominal_parts, strict=True)
            )  # fmt: skip
            yield (
                f"{one.text} is not linear within these tolerances: drawn motions depart from the "
                f"first order by {factor * found.departure[i]:.3g} {unit} (root mean square), most "
                f"member {1 + worst} ({parts})"
            )
