"""Run time against error: the summary of all problems, and a plot and tables of each."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from ..timing.envelope import TARGETS as ERRORS
from ..timing.envelope import (
    envelope,
    fastest,
    is_batch,
    method_of,
    points_of,
    printed,
    time_at,
    wrong_when_tighter,
)
from .html import NONE, Markup, details, element, figure, power, seconds, table, times
from .plots import Curve, Point, key, log_plot

TARGETS = tuple(map(printed, ERRORS))
OURS = "mechc"
WAYS = {"any": "best method", "auto": "auto", "batch": "batch"}
MARK = "\N{DAGGER}"
DOUBTFUL = (
    f"{MARK}: the peer is right at a loose tolerance and follows a wrong motion, without a word, at"
    " tighter ones; nobody can know from its runs which of them is right."
)
SMALLEST = 1e-17  # an error of zero is drawn here
Problem = Mapping[str, Any]


def problems_of(results: Mapping[str, Any]) -> Mapping[str, Problem]:
    return results.get("work_precision", {}).get("problems", {})  # type: ignore[no-any-return]


def ours(tool: str) -> bool:
    """Whether a tool is one of mechc's own ways to run."""
    return tool.split(",")[0].split()[0] == OURS


def colours(problems: Mapping[str, Problem]) -> dict[str, int]:
    """Tool -> number of its colour, the same in all plots; mechc has the first."""
    tools = {row["tool"] for problem in problems.values() for row in problem["rows"]}
    order = sorted(tools, key=lambda tool: (not ours(tool), len(tool) if ours(tool) else 0, tool))
    return {tool: k for k, tool in enumerate(order)}


def time_of(problem: Problem, mine: str, target: str) -> float | None:
    """Seconds of mechc for an error: of its best method, of ``auto``, or of its batches."""
    if mine == "auto":
        return time_at(right_points(problem, OURS, "auto"), float(target))
    tool = f"{OURS} batch" if mine == "batch" else OURS
    return problem["times"].get(tool, {}).get(target)  # type: ignore[no-any-return]


def right_points(
    problem: Problem, tool: str, method: str | None = None
) -> list[tuple[float, float]]:
    """(error, seconds) of a tool's runs that follow the exact motion."""
    return points_of(
        row for row in problem["rows"] if row["tool"] == tool and method in (None, row["method"])
    )


# -- summary ----------------------------------------------------------------------------------


def ratios(problem: Problem, mine: str = "any") -> list[dict[str, Any]]:
    """For every error mechc's time, the best peer, and that peer's time over mechc's.

    ``mine`` is "any" for mechc's best method, "auto" for its default one, "batch" for many
    trajectories at once.
    """
    rows = []
    for target in TARGETS:
        peer = fastest(problem["times"], target, batch=mine == "batch")
        seconds_mine = time_of(problem, mine, target)
        row: dict[str, Any] = {"target": target, "mine": seconds_mine, "peer": "", "ratio": None,
                               "doubtful": False}  # fmt: skip
        if peer is not None:
            row |= _of_peer(problem, peer[0], float(target))
            row["ratio"] = peer[1] / seconds_mine if seconds_mine else None
        rows.append(row)
    return rows


def _of_peer(problem: Problem, peer: str, target: float) -> dict[str, Any]:
    """The peer, its method, and whether its tighter runs follow a wrong motion."""
    method = method_of(problem["rows"], peer, target)
    doubtful = wrong_when_tighter(problem["rows"], peer, method, target)
    return {"peer": peer, "method": method, "doubtful": doubtful}


def kinds(problem: Problem) -> list[str]:
    """The ways to run mechc that are compared: batches only where they were measured."""
    return [mine for mine in WAYS if mine != "batch" or f"{OURS} batch" in problem["times"]]


def summary(problems: Mapping[str, Problem]) -> Markup:
    """The table of ratios, and in words where mechc is not the fastest."""
    heads = ["problem", "mechc", *(Markup(f"error {power(float(at))}") for at in TARGETS)]
    rows = []
    for name, problem in problems.items():
        link = element("a", problem.get("title", name), href=f"#problem-{name}")
        several = kinds(problem)
        first = [element("th", link, rowspan=str(len(several)), scope="row")]
        for mine in several:
            rows.append([*first, WAYS[mine], *map(_ratio, ratios(problem, mine))])
            first = []
    words = element("p", said(problems))
    note = element("p", DOUBTFUL, class_="quiet")
    return element("div", words, table(heads, rows, class_="ratios"), note, _slower(problems))


def _ratio(row: Mapping[str, Any]) -> Markup:
    """A cell: how many times longer the best peer takes, and which it is."""
    if row["mine"] is None:
        return element("td", "not reached", class_="slower" if row["peer"] else "quiet")
    if row["ratio"] is None:
        return element("td", "no peer gets there", class_="quiet")
    peer = element("span", row["peer"], class_="peer")
    class_ = "faster" if row["ratio"] >= 1 else "slower"
    title = f"{row['peer']} {row['method']}; mechc {seconds(row['mine'])}"
    mark = MARK if row["doubtful"] else ""
    return element("td", times(row["ratio"]), mark, " ", peer, class_=class_, title=title)


def said(problems: Mapping[str, Problem]) -> str:
    """The table in a sentence."""
    met = [row["ratio"] for problem in problems.values() for row in ratios(problem)
           if row["ratio"] is not None]  # fmt: skip
    if not met:
        return "No peer was measured beside mechc."
    fastest = sum(ratio >= 1 for ratio in met)
    return (
        f"At {len(met)} pairs of a problem and an error that mechc and a peer both reach, mechc"
        f" is the fastest tool at {fastest}; the best peer takes {times(min(met))} to"
        f" {times(max(met))} mechc's time, {times(statistics.median(met))} in the median."
    )


def _slower(problems: Mapping[str, Problem]) -> Markup:
    """Where mechc is not the fastest, named; nothing where it is everywhere."""
    lines = [line for name, problem in problems.items() for line in _told_slower(name, problem)]
    if not lines:
        return Markup()
    title = element("h3", "Where mechc is not the fastest")
    return element("div", title, element("ul", *(element("li", line) for line in lines)))


def _told_slower(name: str, problem: Problem) -> list[str]:
    """A line for each way to run mechc, and one for errors that it does not meet."""
    title, lines = problem.get("title", name), []
    missed = [f"{row['target']} ({row['peer']})" for row in ratios(problem)
              if row["peer"] and row["mine"] is None]  # fmt: skip
    if missed:
        lines.append(f"{title}: peers reach errors that mechc does not: {', '.join(missed)}")
    for mine in kinds(problem):
        behind = [row for row in ratios(problem, mine) if row["ratio"] and row["ratio"] < 1]
        for peer in dict.fromkeys((row["peer"], row["method"]) for row in behind):
            at = [f"{times(1 / row['ratio'])}{MARK * row['doubtful']} at {row['target']}"
                  for row in behind if (row["peer"], row["method"]) == peer]  # fmt: skip
            by = f"{peer[0]} ({peer[1]})" if peer[1] else peer[0]
            lines.append(f"{title}, {WAYS[mine]}: mechc's time over that of {by}: {', '.join(at)}")
    return lines


def ratios_table(results: Mapping[str, Any]) -> str:
    """A line for each problem and way to run mechc: the best peer's time over mechc's."""
    heads = ["problem", "mechc", *TARGETS]
    lines = [heads, ["---"] * len(heads)]
    for name, problem in problems_of(results).items():
        for mine in kinds(problem):
            lines.append([name, WAYS[mine], *map(_in_words, ratios(problem, mine))])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"{table}\n\n{DOUBTFUL}"


def _in_words(row: Mapping[str, Any]) -> str:
    """A ratio with its mark; in words where either side has no time."""
    if row["mine"] is None:
        return "not reached"
    if row["ratio"] is None:
        return "no peer"
    return f"{row['ratio']:.{2 if row['ratio'] < 2 else 1}f}{MARK * row['doubtful']}"


# -- one problem ------------------------------------------------------------------------------


def problem_section(name: str, problem: Problem, colour: Mapping[str, int]) -> Markup:
    """Plot, legend and tables of one problem."""
    parts = [element("h3", problem.get("title", name), id=f"problem-{name}")]
    if problem.get("note"):
        parts.append(element("p", f"{problem['note'][:1].upper()}{problem['note'][1:]}"))
    parts += [element("p", _compared(problem), class_="quiet"), _plot(problem, colour)]
    parts += [_legend(problem, colour), _times(problem)]
    parts += [_skipped(problem), details("all runs", _all_rows(problem))]
    return element("section", *parts, class_="problem")


def _compared(problem: Problem) -> str:
    names = ", ".join(problem.get("quantities", ()))
    at = figure(problem.get("t_end"))
    return f"Error: the largest departure of {names} at {at} s from the exact values."


def methods(problem: Problem, tool: str) -> list[str]:
    """A tool's methods in the order in which they were measured."""
    return list(dict.fromkeys(row["method"] for row in problem["rows"] if row["tool"] == tool))


def _plot(problem: Problem, colour: Mapping[str, int]) -> Markup:
    curves = []
    for tool in dict.fromkeys(row["tool"] for row in problem["rows"]):
        for shape, method in enumerate(methods(problem, tool)):
            points = [_point(row) for row in problem["rows"]
                      if (row["tool"], row["method"]) == (tool, method)
                      and row["error"] is not None]  # fmt: skip
            curves.append(Curve(colour[tool], shape, points, strong=ours(tool)))
    front = envelope(right_points(problem, OURS))
    curves.append(Curve(colour.get(OURS, 0), 0, (), strong=True,
                        envelope=[(max(e, SMALLEST), s) for e, s in front]))  # fmt: skip
    return log_plot(curves, "error", "run time, s", falling=True)


def _point(row: Mapping[str, Any]) -> Point:
    title = (f"{row['tool']}, {row['method']}, tolerance {row['tol']:g}\n"
             f"error {row['error']:.2g}, {seconds(row['seconds'])}")  # fmt: skip
    wrong = row["label"] != "right"
    if wrong:
        title += "\nanother motion than the exact one"
    return Point(max(row["error"], SMALLEST), row["seconds"], title, wrong)


def _legend(problem: Problem, colour: Mapping[str, int]) -> Markup:
    """A button a tool, which shows and hides it; its methods with their markers."""
    items = []
    for tool in sorted({row["tool"] for row in problem["rows"]}, key=lambda tool: colour[tool]):
        shapes = [Markup(f"{key(k, colour[tool])}{element('span', method)}")
                  for k, method in enumerate(methods(problem, tool))]  # fmt: skip
        name = element("b" if ours(tool) else "span", tool)
        items.append(element("button", name, *shapes, type="button", data_tool=colour[tool]))
    return element("div", *items, class_="legend")


def _times(problem: Problem) -> Markup:
    """Time and ratio at the errors, setting up, and how much the times scatter."""
    heads = ["tool", *(Markup(f"error {power(float(target))}") for target in TARGETS)]
    heads += ["spread", "derive", "compile", "first run"]
    rows = []
    for tool, at in sorted(problem["times"].items(), key=lambda item: not ours(item[0])):
        alike = f"{OURS} batch" if is_batch(tool) else OURS
        mine = problem["times"].get(alike, {})
        cells = [_time(at.get(target), mine.get(target), tool) for target in TARGETS]
        setup = problem.get("setup", {}).get(tool, {})
        rows.append([
            element("th", tool, scope="row"), *cells, _spread(problem, tool),
            *(seconds(setup.get(stage) or None) for stage in ("derive", "compile")),
            _first(problem, tool),
        ])  # fmt: skip
    return table(heads, rows, class_="figures")


def _time(at: float | None, mine: float | None, tool: str) -> Markup:
    if at is None:
        return element("td", NONE, class_="quiet")
    ratio = [] if ours(tool) or not mine else [" ", element("span", times(at / mine), class_="x")]
    return element("td", seconds(at), *ratio)


def _spread(problem: Problem, tool: str) -> str:
    """The median of the interquartile ranges over the medians, of cases that ran several times."""
    known = [row["spread"] for row in problem["rows"] if row["tool"] == tool
             and row.get("spread") is not None and row["repeats"] > 1]  # fmt: skip
    return f"{100 * statistics.median(known):.0f} %" if known else NONE


def _first(problem: Problem, tool: str) -> str:
    """Of the tool's first run of all."""
    known = [row["first"] for row in problem["rows"]
             if row["tool"] == tool and row.get("first") is not None]  # fmt: skip
    return seconds(known[0]) if known else NONE


def _skipped(problem: Problem) -> Markup:
    reasons = problem.get("skipped", {})
    if not reasons:
        return Markup()
    told = "; ".join(f"{peer}: {reason}" for peer, reason in reasons.items())
    return element("p", f"Not measured: {told}.", class_="quiet")


def _all_rows(problem: Problem) -> Markup:
    heads = ("tool", "method", "tolerance", "motion", "error", "status", "least", "median",
             "spread", "runs", "first")  # fmt: skip
    rows: list[Sequence[Any]] = []
    for row in problem["rows"]:
        spread = row.get("spread")
        motion = element("td", row["label"], class_="slower" if row["label"] == "wrong" else None)
        rows.append((
            row["tool"], row["method"], f"{row['tol']:.1e}", motion,
            NONE if row["error"] is None else f"{row['error']:.1e}", row.get("status", ""),
            seconds(row["seconds"]), seconds(row.get("median")),
            NONE if spread is None else f"{100 * spread:.0f} %", row.get("repeats", ""),
            seconds(row.get("first")),
        ))  # fmt: skip
    return table(heads, rows, class_="figures")
