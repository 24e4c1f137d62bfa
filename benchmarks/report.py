"""One page of HTML from results.json: nothing is fetched, everything is in the file.

    python benchmarks/report.py [RESULTS.json] [--against EARLIER.json] [--out PAGE.html]

The order: what it was measured on; the ratios to the best peer; every problem with its plot and
tables; stability; growth; many at once; what the product itself costs; the comparison with an
earlier run.  A part that has not been run is named, not left out in silence.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

import _results
import report_compare
import report_tables
import report_work
from report_html import NONE, Markup, details, element, seconds, table

TEMPLATE = Path(__file__).resolve().parent / "templates" / "report.html"
NEVER_RUN = "not run"
GUIDE = (
    "A ratio is the time of the best peer over mechc's, at the error in the head of the column,"
    " along each tool's lower envelope of time over error: first with the best of mechc's methods,"
    " then with its default one, both one trajectory at a time; a batch integrates many at once,"
    " and the time of one of them is compared with the best of all peers. Derivation and"
    " compilation are apart."
)
Results = Mapping[str, Any]

STABILITY = {
    "stress": ("Under stress", report_tables.stress),
    "failure_rate": ("Random starts through change points", report_tables.verdicts),
    "near_misses": ("Geometries that nearly have a change point", report_tables.verdicts),
    "change_point": ("Through change points, against the exact motion", report_tables.anything),
    "long_run": ("Energy and closure over many periods", report_tables.anything),
}
GROWTH: dict[str, tuple[str, Callable[[Any], Markup]]] = {
    "growth": ("Growth with the number of links", report_tables.growth),
    "batch": ("Many trajectories at once", report_tables.limits),
}
COSTS = {
    "costs": ("What the product itself costs", report_tables.costs),
    "first_value": ("From an object of SymPy's to the first value", report_tables.first_value),
    "essentials": ("What every user meets first", report_tables.anything),
    "scenes": ("Compiled scenes beside the same in NumPy", report_tables.anything),
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("results", type=Path, nargs="?", default=_results.OUT / "results.json")
    parser.add_argument("--against", type=Path, metavar="JSON", help="an earlier results.json")
    parser.add_argument("--out", type=Path, help="the page [results.html beside the results]")
    chosen = parser.parse_args(arguments)
    results = json.loads(chosen.results.read_text("utf-8"))
    earlier = json.loads(chosen.against.read_text("utf-8")) if chosen.against else None
    target = chosen.out or chosen.results.with_suffix(".html")
    target.write_text(page(results, earlier), "utf-8")
    print(target)


def write_report(results: Results, earlier: Results | None, out: Path) -> list[dict[str, Any]]:
    """``results.html`` in a folder; what is worse than it was in an earlier run."""
    results = _results.finite(results)
    (out / "results.html").write_text(page(results, earlier), "utf-8")
    return report_compare.worse(report_compare.compare(results, earlier)) if earlier else []


def page(results: Results, earlier: Results | None = None) -> str:
    """The whole report."""
    parts = [
        _work_precision(results),
        *_chapter("Stability", STABILITY, results),
        *_chapter("Growth", GROWTH, results),
        *_chapter("Costs", COSTS, results),
    ]
    if earlier is not None:
        rows = report_compare.compare(results, earlier)
        told = Markup(report_compare.section(rows, earlier))
        parts.append(element("section", element("h2", "Against an earlier run"), told))
    parts.append(_what_was_run(results))
    about = results["about"]
    return Template(TEMPLATE.read_text("utf-8")).substitute(
        about=_about(about), body="\n".join(parts), date=element("span", about.get("date", ""))
    )


def _about(about: Results) -> Markup:
    """Machine, versions, commit, date."""
    flags = ", ".join(about.get("flags", ()))
    load = about.get("load")
    lines = {
        "date": about.get("date"),
        "commit": about.get("commit") or "an installed release",
        "processor": f"{about.get('processor')}, {about.get('cores')} cores; {flags}",
        "mechc uses": about.get("instruction_set"),
        "memory": f"{about.get('memory_GiB', NONE)} GiB",
        "load at the start": None if load is None else f"{load:.2f} processes",
        "system": about.get("system"),
        "python": about.get("python"),
        "compiler": about.get("compiler"),
    }
    listed = [element("dt", name) + element("dd", value) for name, value in lines.items() if value]
    versions = ", ".join(f"{name} {number}" for name, number in about.get("versions", {}).items()
                         if number)  # fmt: skip
    absent = ", ".join(name for name, number in about.get("versions", {}).items() if not number)
    listed.append(element("dt", "versions") + element("dd", versions))
    if absent:
        listed.append(element("dt", "not installed") + element("dd", absent))
    return element("dl", *map(Markup, listed))


def _work_precision(results: Results) -> Markup:
    """The summary of all problems, and then each of them."""
    title = element("h2", "Run time against error")
    problems = report_work.problems_of(results)
    if not problems:
        return element("section", title, element("p", NEVER_RUN, class_="quiet"))
    colour = report_work.colours(problems)
    guide = element("p", GUIDE, class_="quiet")
    each = [report_work.problem_section(name, one, colour) for name, one in problems.items()]
    return element("section", title, guide, report_work.summary(problems), *each)


def _chapter(
    title: str, parts: Mapping[str, tuple[str, Callable[[Any], Markup]]], results: Results
) -> list[Markup]:
    """The sections of several scripts below one title."""
    shown = []
    for script, (name, section) in parts.items():
        shown.append(element("h3", name, id=script))
        reason = results.get("skipped", {}).get(script, NEVER_RUN)
        shown.append(_figures(section, results[script]) if script in results
                     else element("p", reason, class_="quiet"))  # fmt: skip
    return [element("section", element("h2", title), *shown)]


def _figures(section: Callable[[Any], Markup], data: Any) -> Markup:
    """A script's section; figures of another shape than expected are shown as they are."""
    try:
        return section(data)
    except (KeyError, TypeError, AttributeError, IndexError, ValueError):
        return report_tables.anything(data)


def _what_was_run(results: Results) -> Markup:
    """Scripts with the seconds that they took, and how they ended."""
    rows = []
    for script, code in results.get("codes", {}).items():
        ended = element("td", "ran through" if code == 0 else f"ended with {code}",
                        class_="" if code == 0 else "slower")  # fmt: skip
        rows.append((script, seconds(results.get("seconds", {}).get(script)), ended))
    shown = table(("script", "took", ""), rows, class_="figures")
    whole = sum(results.get("seconds", {}).values())
    return details(f"What was run ({results.get('size', 'some of it')}, {whole:.0f} s)", shown)


if __name__ == "__main__":
    main()
