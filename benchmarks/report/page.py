"""One page of HTML from results.json: nothing is fetched, everything is in the file.

The order: what it was measured on; the ratios to the best peer; every problem with its plot and
tables; stability; growth; many at once; what the product itself costs; the comparison with an
earlier run.  A part that has not been run is named, not left out in silence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from string import Template
from typing import Any

from ..timing.results import finite
from . import compare, tables, work_precision
from .html import NONE, Markup, details, element, seconds, table

TEMPLATE = Path(__file__).resolve().parent / "templates" / "report.html"
NEVER_RUN = "not run"
GUIDE = (
    "A ratio is the time of the best peer over mechc's, at the error in the head of the column,"
    " along each method's lower envelope of time over error: first with the best of mechc's"
    " methods, then with its default one, both one trajectory at a time; a batch integrates many at"
    " once, and the time of one of them is compared with the best of all peers. Derivation and"
    " compilation are apart."
)
Results = Mapping[str, Any]

# By script, or by family of the stress suite: the title, and what shows its figures.
STABILITY = {
    "stress": ("Under stress", tables.stress),
    "change points": ("Random starts through change points", tables.verdicts),
    "near misses": ("Geometries that nearly have a change point", tables.verdicts),
    "exact motion": ("Through change points, against the exact motion", tables.anything),
    "a million periods": ("Energy and closure over many periods", tables.anything),
}
GROWTH: dict[str, tuple[str, Callable[[Any], Markup]]] = {
    "growth": ("Growth with the number of links", tables.growth),
    "batch": ("Many trajectories at once", tables.limits),
}
COSTS = {
    "costs": ("What the product itself costs", tables.costs),
    "scenes": ("Compiled scenes, with and without parameters fixed", tables.anything),
}


def write_report(results: Results, earlier: Results | None, to: Path) -> list[dict[str, Any]]:
    """The page as a file; what is worse than it was in an earlier run."""
    results = finite(results)
    to.write_text(page(results, earlier), "utf-8")
    return compare.worse(compare.compare(results, earlier)) if earlier else []


def page(results: Results, earlier: Results | None = None) -> str:
    """The whole report."""
    parts = [
        _work_precision(results),
        *_chapter("Stability", STABILITY, results),
        *_chapter("Growth", GROWTH, results),
        *_chapter("Costs", COSTS, results),
    ]
    if earlier is not None:
        rows = compare.compare(results, earlier)
        told = Markup(compare.section(rows, earlier))
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
        "date": about.get("date"), "commit": about.get("commit") or "an installed release",
        "processor": f"{about.get('processor')}, {about.get('cores')} cores; {flags}",
        "mechc uses": about.get("instruction_set"),
        "memory": f"{about.get('memory_GiB', NONE)} GiB",
        "load at the start": None if load is None else f"{load:.2f} processes",
        "system": about.get("system"), "python": about.get("python"),
        "compiler": about.get("compiler"),
    }  # fmt: skip
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
    problems = work_precision.problems_of(results)
    if not problems:
        return element("section", title, element("p", NEVER_RUN, class_="quiet"))
    colour = work_precision.colours(problems)
    guide = element("p", GUIDE, class_="quiet")
    each = [work_precision.problem_section(name, one, colour) for name, one in problems.items()]
    return element("section", title, guide, work_precision.summary(problems), *each)


def _chapter(
    title: str, parts: Mapping[str, tuple[str, Callable[[Any], Markup]]], results: Results
) -> list[Markup]:
    """The sections of several scripts or families below one title."""
    shown = []
    for script, (name, section) in parts.items():
        shown.append(element("h3", name, id=script.replace(" ", "-")))
        reason = results.get("skipped", {}).get(script, NEVER_RUN)
        data = _of_script(results, script)
        shown.append(section(data) if data
                     else element("p", reason, class_="quiet"))  # fmt: skip
    return [element("section", element("h2", title), *shown)]


def _of_script(results: Results, name: str) -> Any:
    """A script's figures, or the rows of a family of the stress suite."""
    if name in results:
        return results[name]
    rows = results.get("stress", {}).get("rows", ())
    return [
        {key: value for key, value in row.items() if key != "family"}
        for row in rows if row.get("family") == name
    ]  # fmt: skip


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
