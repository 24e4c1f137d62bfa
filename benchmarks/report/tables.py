"""Everything but the work-precision runs as tables and plots: one function a script's figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

from .html import NONE, Markup, details, element, figure, quantity, seconds, table
from .plots import Curve, Point, key, log_plot

Rows = Sequence[Mapping[str, Any]]
COUNTED = ("right", "refused", "unjudged")
BUILD = ("derive_s", "emit_s", "first_s", "whole_s")
RUN = ("rhs_us", "lane_us")
MOST_ROWS = 200  # of figures that nothing is known of
UNFOLDED = 12


def verdict(good: bool | None) -> Markup:
    """A cell that says whether a promise was kept."""
    if good is None:
        return element("td", NONE, class_="quiet")
    return element("td", "kept" if good else "NOT KEPT", class_="faster" if good else "slower")


# -- stress -----------------------------------------------------------------------------------


def stress(data: Any) -> Markup:
    """One line a family: what it promises, how its runs ended, and the worst of them."""
    families = data.get("families") if isinstance(data, dict) else None
    if families is None:
        return anything(data)
    counts = ("runs", "right", "refused", "flagged", "unjudged", "wrong")
    heads = ("family", "promise", "", *counts, "worst", "worst case", "note")
    rows = [
        (
            element("th", row["family"], scope="row"), row.get("promise", ""),
            verdict(row.get("passed")), *(figure(row.get(count)) for count in counts),
            f"{figure(row.get('worst'))} {row.get('unit') or ''}", row.get("worst_case", ""),
            row.get("note", ""),
        )
        for row in families
    ]  # fmt: skip
    failed = [str(row["family"]) for row in families if row.get("passed") is False]
    told = (f"{len(families) - len(failed)} of {len(families)} families keep their promise"
            + (f"; not: {', '.join(failed)}." if failed else "."))  # fmt: skip
    return Markup(element("p", told) + table(heads, rows, class_="words"))


def verdicts(data: Any) -> Markup:
    """Counts of how runs ended for every method and tolerance, and the rate of wrong ones."""
    rows = data.get("rows", ()) if isinstance(data, dict) else data
    if not rows or not {"method", "rtol", "word"} <= set(rows[0]):
        return anything(data)

    def group(row: Mapping[str, Any]) -> tuple[str, float]:
        return row["method"], -row["rtol"]

    shown = []
    for (method, rtol), several in groupby(sorted(rows, key=group), key=group):
        words = [row["word"].lower() for row in several]
        shown.append((method, f"{-rtol:.0e}", len(words), *_counts(words)))
    heads = ("method", "tolerance", "runs", *COUNTED, "ended with a status", "wrong", "wrong")
    return table(heads, shown, class_="figures")


def _counts(words: Sequence[str]) -> list[Any]:
    """How many of each, and the part of those judged that is wrong without a status."""
    wrong, counts = words.count("wrong"), [words.count(word) for word in COUNTED]
    judged = len(words) - words.count("unjudged")
    rate = f"{100 * wrong / judged:.3g} %" if judged else NONE
    told = element("td", rate, class_="slower" if wrong else None)
    return [*counts, len(words) - wrong - sum(counts), wrong, told]


# -- growth -----------------------------------------------------------------------------------


def growth(data: Any) -> Markup:
    """Curves over the number of links, with their exponents; a table of all."""
    parts = [
        _growth_plot(data["rows"], BUILD, 1.0, "processor time, s"),
        _growth_plot(data["rows"], RUN, 1e-6, "one right-hand side, s"),
        _exponents(data),
    ]
    columns = [key for row in next(iter(data["rows"].values()), [])[:1] for key in row]
    for name, rows in data["rows"].items():
        cells = [[figure(row.get(column)) for column in columns] for row in rows]
        parts.append(details(f"figures: {name}", table(columns, cells, class_="figures")))
    return Markup("".join(parts))


def _growth_plot(rows: Mapping[str, Rows], columns: Sequence[str], unit: float, y: str) -> Markup:
    """A colour a mechanism, a marker and a dash a column."""
    curves, legend = [], []
    for colour, (name, several) in enumerate(rows.items()):
        for k, column in enumerate(columns):
            points = [
                Point(row["links"], unit * row[column],
                      f"{name}, {row['links']} links\n{column}: {seconds(unit * row[column])}")
                for row in several if row.get(column)
            ]  # fmt: skip
            curves.append(Curve(colour, k, points, dash=k))
            legend.append(element("span", key(k, colour, k), f"{name}, {column.rsplit('_', 1)[0]}"))
    plot = log_plot(curves, "links", y)
    return element("figure", plot, element("div", *legend, class_="legend"))


def _exponents(data: Mapping[str, Any]) -> Markup:
    found = data.get("exponents", {})
    columns = list(next(iter(found.values()), {}))
    rows = [[name, *(figure(at.get(column)) for column in columns)] for name, at in found.items()]
    caption = element("p", "Exponents of the number of links, fitted from five on:")
    return Markup(caption + table(["", *columns], rows, class_="figures")) if rows else Markup()


# -- costs ------------------------------------------------------------------------------------


def costs(data: Any) -> Markup:
    """What the product itself costs, with the limits that it keeps."""
    parts = [limits(data["rows"])] if data.get("rows") else []
    if data.get("install"):
        parts.append(details("installation", pairs(data["install"])))
    if data.get("instructions"):
        title = element("h4", "Instructions and operations (the same on every run)")
        rows = [(element("th", row["what"], scope="row"), figure(row["value"]), row.get("unit", ""))
                for row in data["instructions"]]  # fmt: skip
        parts += [title, table(("", "", ""), rows, class_="figures")]
    parts += [element("p", f"Not measured: {what}: {reason}.", class_="quiet")
              for what, reason in (data.get("skipped") or {}).items()]  # fmt: skip
    return Markup("".join(parts))


def limits(data: Any) -> Markup:
    """Figures with a limit each, or none, and whether it is kept."""
    rows = data.get("rows", ()) if isinstance(data, dict) else data
    shown = [
        (
            element("th", row["what"], scope="row"),
            quantity(row["value"], row.get("unit")), quantity(row.get("limit"), row.get("unit")),
            verdict(row.get("kept")),
        )
        for row in rows
    ]  # fmt: skip
    return table(("", "figure", "limit", ""), shown, class_="figures")


# -- anything else ----------------------------------------------------------------------------


def anything(data: Any) -> Markup:
    """Figures as they are: a list of rows as a table, names with values in two columns."""
    if isinstance(data, list) and data and all(isinstance(row, dict) for row in data):
        return pairs(data[0]) if len(data) == 1 else _rows(data)
    if isinstance(data, dict):
        kept = {name: value for name, value in data.items() if name != "about"}
        if kept and all(isinstance(value, dict) for value in kept.values()):
            return _rows([{"": name, **value} for name, value in kept.items()])
        return pairs(kept)
    return element("p", figure(data))


def pairs(data: Mapping[str, Any]) -> Markup:
    """Names and values; whatever has parts itself is unfolded on request."""
    plain = {name: value for name, value in data.items() if not isinstance(value, (dict, list))}
    rows = [(element("th", name, scope="row"), figure(value)) for name, value in plain.items()]
    parts = [table(("", ""), rows, class_="figures")] if rows else []
    parts += [details(name, anything(data[name])) for name in data if name not in plain]
    return Markup("".join(parts))


def _rows(rows: Rows) -> Markup:
    columns = [name for name in dict.fromkeys(name for row in rows for name in row)
               if not any(isinstance(row.get(name), (dict, list)) for row in rows)]  # fmt: skip
    shown: Iterable[list[str]] = (
        [figure(row.get(name, "")) for name in columns] for row in rows[:MOST_ROWS]
    )
    left = len(rows) - MOST_ROWS
    more = element("p", f"and {left:,} more rows in results.json", class_="quiet")
    whole = Markup(table(columns, shown, class_="figures") + (more if left > 0 else ""))
    return details(f"{len(rows):,} rows", whole) if len(rows) > UNFOLDED else whole
