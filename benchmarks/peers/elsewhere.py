"""What other tools say of mechanisms whose exact motion is known.

    mechc bench elsewhere [--problem NAME ...] [--peer NAME ...] [--page MARKDOWN]

Each tool runs each problem by each of its methods at three tolerances, MuJoCo and Exudyn at three
steps, once, in a process of its own.  A cell has the largest error of the final state in the
problem's scale; in bold where that is another motion and the tool says nothing; in italics what a
tool says where it gives none.  ``--page`` writes the tables into a page, between its marks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from ..problems import NAMES as PROBLEM_NAMES
from ..suite.apart import compare_apart
from ..timing import results
from ..timing.cases import Effort
from ..timing.machine import about
from . import NAMES

PROBLEMS = ("four_bar_change_point", "four_bar_regular", "slider_crank", "andrews")
PEERS = tuple(name for name in NAMES if name != "pinocchio")  # which has no loops here
TOLERANCES = (1e-6, 1e-9, 1e-12)
ONCE = Effort(longest=60.0, cut=60.0, rounds=0)
PATIENCE = 300.0  # s
BEGIN, END = "<!-- begin: mechc bench elsewhere -->", "<!-- end -->"
MOST = 60  # letters of a status


def main(arguments: Sequence[str] | None = None) -> int:
    parser = results.command_parser("elsewhere", __doc__)
    parser.add_argument(
        "--problem", nargs="+", choices=PROBLEM_NAMES, default=PROBLEMS, metavar="NAME"
    )
    parser.add_argument("--peer", nargs="+", choices=NAMES, default=PEERS,
                        metavar="NAME")  # fmt: skip
    parser.add_argument("--page", type=Path, metavar="MARKDOWN")
    chosen = parser.parse_args(arguments)
    found = {
        name: compare_apart(
            name, tuple(chosen.peer), TOLERANCES, ONCE, quick=False, patience=PATIENCE
        )
        for name in chosen.problem
    }
    results.write("elsewhere", {"about": about(), "problems": found})
    text = "\n".join([versions(about()), *(table(each) for each in found.values())])
    print(text)
    if chosen.page:
        head, _, rest = chosen.page.read_text("utf-8").partition(BEGIN)
        tail = rest.partition(END)[2]
        chosen.page.write_text(f"{head}{BEGIN}\n{text}\n{END}{tail}", "utf-8")
    return 0


def versions(machine: Mapping[str, Any]) -> str:
    """The date, and the packages that are installed."""
    known = (f"{name} {each}" for name, each in machine["versions"].items() if each)
    return f"{machine['date'][:10]}, Python {machine['python']}: {', '.join(known)}.\n"


def table(entry: Mapping[str, Any]) -> str:
    """A problem in Markdown: a row for each tool and method, from loose to tight."""
    head = f"\n### {entry['title']}, {entry['t_end']:g} s\n"
    lines = [head, "| tool | method | loose | | tight |", "|---|---|---|---|---|"]
    lines += [f"| {' | '.join(cells)} |" for cells in rows(entry)]
    missing = [f"{name}: {why}" for name, why in entry["skipped"].items()]
    return "\n".join([*lines, *(["", "Not run: " + "; ".join(missing) + "."] if missing else [])])


def rows(entry: Mapping[str, Any]) -> Iterator[list[str]]:
    for (tool, method), every in groupby(entry["rows"], lambda row: (row["tool"], row["method"])):
        ordered = sorted(every, key=lambda row: -row["tol"])
        first, last = ordered[0], ordered[-1]
        chosen = [first, ordered[len(ordered) // 2], last] if len(ordered) > 2 else ordered
        yield [tool, method, *(cell(row) for row in chosen), *([""] * (3 - len(chosen)))]


def cell(row: Mapping[str, Any]) -> str:
    """The error of a run, or what the tool said."""
    if row["label"] == "flagged":
        return f"*{row['status'][:MOST].replace('|', '/')}*"
    told = f"{row['tol']:g}: {row['error']:.1e}"
    return f"**{told}**" if row["label"] == "wrong" else told
