"""The table of ratios in Markdown, for documents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .work_precision import DOUBTFUL, MARK, TARGETS, WAYS, kinds, problems_of, ratios


def ratios_table(results: Mapping[str, Any]) -> str:
    """A line for each problem and way to run mechc: the best peer's time over mechc's."""
    heads = ["problem", "mechc", *TARGETS]
    lines = [heads, ["---"] * len(heads)]
    for name, problem in problems_of(results).items():
        for mine in kinds(problem):
            lines.append([name, WAYS[mine], *map(cell, ratios(problem, mine))])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"{table}\n\n{DOUBTFUL}"


def cell(row: Mapping[str, Any]) -> str:
    """A ratio with its mark; in words where either side has no time."""
    if row["mine"] is None:
        return "not reached"
    if row["ratio"] is None:
        return "no peer"
    return f"{row['ratio']:.{2 if row['ratio'] < 2 else 1}f}{MARK * row['doubtful']}"
