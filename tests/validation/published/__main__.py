"""The table of docs/validation.md, or its converged values.

python -m tests.validation.published            # computes every row and writes the table
python -m tests.validation.published converge   # writes converged.json anew; some minutes
"""

import sys
from pathlib import Path

from .compare import Row, converge, rows
from .scenes.joints import CASES

PAGE = Path(__file__).parents[3] / "docs" / "validation.md"
START, END = "<!-- table: begin -->\n", "<!-- table: end -->\n"
HEADINGS = "problem", "recorded by", "compared", "their error", "mechc's error"


def line(row: Row) -> str:
    by = "ADAMS, in Chrono" if row.problem in CASES else "Dymola, in MAP-LIB"
    theirs, ours = (f"{error:.0e}" if error else "0" for error in (row.theirs, row.ours))
    return f"| {row.problem} | {by} | {row.compared} | {theirs} | {ours} |\n"


def main(arguments: list[str]) -> None:
    if arguments == ["converge"]:
        converge()
        return
    table = f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}\n"
    for row in rows():
        print(row, flush=True)
        table += line(row)
    before, _, rest = PAGE.read_text().partition(START)
    PAGE.write_text(before + START + table + END + rest.partition(END)[2])


if __name__ == "__main__":
    main(sys.argv[1:])
