"""Run time over error: one colour a tool, one line a method, wrong motions hollow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def draw(folder: Path, name: str, entry: Mapping[str, Any]) -> None:
    """Write ``work_precision_NAME.svg``."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    rows = [row for row in entry["rows"] if row["error"] is not None]
    for k, tool in enumerate(dict.fromkeys(row["tool"] for row in rows)):
        own = [row for row in rows if row["tool"] == tool]
        for method in dict.fromkeys(row["method"] for row in own):
            _curve(axes, [row for row in own if row["method"] == method], f"C{k % 10}", k // 10)
        axes.plot([], [], "os^"[k // 10 % 3] + "-", color=f"C{k % 10}", label=tool)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=f"error at {entry['t_end']:g} s",
        ylabel="run time (s)",
        title=f"{entry['title']} (hollow: another motion)",
    )
    axes.grid(which="major", alpha=0.4)
    if rows:
        axes.legend(fontsize="small")
    folder.mkdir(exist_ok=True)
    figure.savefig(folder / f"work_precision_{name}.svg")


def _curve(axes: Any, rows: Sequence[Mapping[str, Any]], colour: str, mark: int) -> None:
    right = sorted((r for r in rows if r["label"] == "right"), key=lambda row: -row["tol"])
    wrong = [r for r in rows if r["label"] == "wrong"]
    style = {"color": colour, "markersize": 4, "marker": "os^"[mark % 3]}
    for some, line, face in ((right, "-", colour), (wrong, "", "none")):
        errors = [max(row["error"], 1e-17) for row in some]
        axes.plot(errors, [row["seconds"] for row in some], line, linewidth=0.8,
                  markerfacecolor=face, **style)  # fmt: skip
