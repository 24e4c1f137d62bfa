"""Two results.json of different days: what became slower, larger or wrong, and what better.

A time is taken relative to those of the peers in the same run, which nobody has changed: another
machine, clock or load is then not taken for a regression.  Figures that are the same on every run
(instructions, operations, generated code) are compared as they are, and promises that
were kept must be kept still.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping
from typing import Any

from .html import element, figure, table, times

SCATTER = 1.25  # a time is told from another beyond this ratio
EXACT = 1.0 + 1e-9
EXACT_COLUMNS = ("operations", "kilobytes")  # of growth
# Of files, memory and instructions (of Python and the allocator), which depend a little on paths
# and on what was loaded before.
SIZES = 1.02
INSTRUCTIONS = "instructions"
OURS = "mechc"
Results = Mapping[str, Any]
Row = dict[str, Any]


def compare(now: Results, earlier: Results) -> list[Row]:
    """Rows of {"what", "kind", "before", "now", "ratio", "verdict", "told"}.

    ``verdict`` is "worse", "better" or "same"; a ratio above one is for the worse.  What only one
    of the two has measured is not compared.
    """
    return [*_times(now, earlier), *_exact(now, earlier), *_promises(now, earlier)]


def worse(rows: list[Row]) -> list[Row]:
    return [row for row in rows if row["verdict"] == "worse"]


def _row(what: str, kind: str, before: float, now: float, ratio: float, allowed: float) -> Row:
    verdict = "worse" if ratio > allowed else "better" if ratio < 1 / allowed else "same"
    told = f"{figure(before)} then, {figure(now)} now: {times(ratio)}"
    return {"what": what, "kind": kind, "before": before, "now": now, "ratio": ratio,
            "verdict": verdict, "told": told}  # fmt: skip


# -- times ------------------------------------------------------------------------------------


def _times(now: Results, earlier: Results) -> Iterator[Row]:
    """mechc's times at the errors, over the change of its peers'."""
    then = earlier.get("work_precision", {}).get("problems", {})
    for name, problem in now.get("work_precision", {}).get("problems", {}).items():
        mine, was = (run.get("times", {}).get(OURS, {}) for run in (problem, then.get(name, {})))
        for target, at in mine.items():
            if at and was.get(target):
                clock = _clock(problem["times"], then[name]["times"])
                kind = "time" if clock is None else "time, over the peers'"
                ratio = at / was[target] / (clock or 1.0)
                yield _row(f"{name}, error {target}", kind, was[target], at, ratio, SCATTER)


def _clock(now: Results, earlier: Results) -> float | None:
    """How many times longer the peers take than they did, in the median; None without any."""
    found = [
        at / earlier[tool][target]
        for tool, row in now.items() if not tool.startswith(OURS) and tool in earlier
        for target, at in row.items() if at and earlier[tool].get(target)
    ]  # fmt: skip
    return statistics.median(found) if found else None


# -- figures that do not scatter --------------------------------------------------------------


def _exact(now: Results, earlier: Results) -> Iterator[Row]:
    mine, was = dict(_deterministic(now)), dict(_deterministic(earlier))
    for what, value in mine.items():
        if value and was.get(what):
            yield _row(what, "exact", was[what], value, value / was[what], EXACT)
    before = _sizes(earlier)
    for what, value in _sizes(now).items():
        if value and before.get(what):
            yield _row(what, "size", before[what], value, value / before[what], SIZES)


def _deterministic(results: Results) -> Iterator[tuple[str, float]]:
    """Names and values of what every run gives alike."""
    for name, rows in results.get("growth", {}).get("rows", {}).items():
        for row in rows:
            for column in EXACT_COLUMNS:
                yield f"growth: {name}, {row['links']} links, {column}", row.get(column)
    yield from ((what, value) for what, unit, value in _counts(results) if unit != INSTRUCTIONS)


def _counts(results: Results) -> Iterator[tuple[str, str, float]]:
    """Names, units and values of what the costs count."""
    for row in results.get("costs", {}).get("instructions") or ():
        unit = row.get("unit") or INSTRUCTIONS
        yield f"costs: {row['what']} ({unit})", unit, row["value"]


def _sizes(results: Results) -> dict[str, float]:
    """What is counted in bytes, and instructions."""
    rows = results.get("costs", {}).get("rows") or ()
    found = {f"costs: {row['what']}": row["value"] for row in rows if row.get("unit") == "bytes"}
    return found | {what: value for what, unit, value in _counts(results) if unit == INSTRUCTIONS}


# -- promises ---------------------------------------------------------------------------------


def _promises(now: Results, earlier: Results) -> Iterator[Row]:
    """What was right, kept or run through then and is not now; and the other way round."""
    mine, was = dict(_kept(now)), dict(_kept(earlier))
    for what, kept in mine.items():
        if what in was and kept != was[what]:
            told = "kept now, not then" if kept else "kept then, not now"
            verdict = "better" if kept else "worse"
            yield {"what": what, "kind": "promise", "before": was[what], "now": kept,
                   "ratio": None, "verdict": verdict, "told": told}  # fmt: skip


def _kept(results: Results) -> Iterator[tuple[str, bool]]:
    for name, code in results.get("codes", {}).items():
        yield f"{name} runs through", code == 0
    stress = results.get("stress", {})
    for row in stress.get("families", ()) if isinstance(stress, dict) else ():
        yield f"stress: {row['family']}", bool(row.get("passed"))
    for row in results.get("costs", {}).get("rows") or ():
        if row.get("kept") is not None:
            yield f"costs: {row['what']}", row["kept"]
    for name, problem in results.get("work_precision", {}).get("problems", {}).items():
        for row in problem.get("rows", ()):
            if row["tool"] == OURS:
                what = f"{name}: {row['method']} at {row['tol']:g} is not wrong"
                yield what, row["label"] != "wrong"


# -- shown ------------------------------------------------------------------------------------


def section(rows: list[Row], earlier: Results) -> str:
    """Changes for the worse, then for the better; how many stayed."""
    about = earlier["about"]
    same = sum(row["verdict"] == "same" for row in rows)
    told = (f"Against {about.get('commit') or 'a run'} of {about.get('date', '')}:"
            f" {len(worse(rows))} worse, {len(rows) - same - len(worse(rows))} better,"
            f" {same} the same (times within {SCATTER} are the same).")  # fmt: skip
    changed = sorted((row for row in rows if row["verdict"] != "same"), key=_weight)
    shown = [
        (row["what"], row["kind"], figure(row["before"]), figure(row["now"]), times(row["ratio"]),
         element("td", row["verdict"], class_="slower" if row["verdict"] == "worse" else "faster"))
        for row in changed
    ]  # fmt: skip
    heads = ("", "kind", "then", "now", "ratio", "")
    return element("p", told) + (table(heads, shown, class_="figures") if shown else "")


def _weight(row: Row) -> tuple[bool, float]:
    return row["verdict"] != "worse", -(row["ratio"] or float("inf"))
