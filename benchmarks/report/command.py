"""The report of figures measured before.

mechc bench report [RESULTS.json] [--against EARLIER.json] [--to PAGE.html] [--table]
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..timing import results
from ..timing.results import command_parser
from .page import write_report
from .work_precision import ratios_table


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("report", __doc__)
    default = results.folder() / "results.json"
    parser.add_argument("results", type=Path, nargs="?", default=default, help=f"[{default}]")
    parser.add_argument("--against", type=Path, metavar="JSON", help="an earlier results.json")
    parser.add_argument("--to", "--out", type=Path, metavar="PAGE",
                        help="[results.html beside the results]")  # fmt: skip
    parser.add_argument("--table", action="store_true",
                        help="the table of ratios in Markdown, and no page")  # fmt: skip
    chosen = parser.parse_args(arguments)
    if chosen.table:
        print(ratios_table(results.read_option(parser, chosen.results)))
        return 0
    earlier = results.read_option(parser, chosen.against)
    target = chosen.to or chosen.results.with_suffix(".html")
    write_report(results.read_option(parser, chosen.results), earlier, target)
    print(target)
    return 0
