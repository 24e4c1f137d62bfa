"""How far the error estimates of ``sol.check()`` are from the true errors, over the whole suite.

    mechc bench check [--scene NAME ...] [--quick]

Every problem by every method at several tolerances, against its exact values; prints the histogram
of estimate over true error.  Exits with 1 where fewer than 95 in 100 estimates are within a factor
of ten, or where one is below a tenth of the error without a warning.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mechc.simulation.settings import METHODS_OF_USERS

from ..problems import NAMES, problem
from ..problems.problem import Problem
from ..timing import results

TOLERANCES, QUICK = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10), (1e-4, 1e-7, 1e-10)
FACTOR, SHARE = 10.0, 0.95
LEAST = 1e-12  # of the scale: the exact values and a state's roundings are no better known


def main(arguments: Sequence[str] | None = None) -> int:
    parser = results.command_parser("check", __doc__)
    parser.add_argument("--scene", nargs="+", choices=NAMES, default=[*NAMES], metavar="NAME")
    parser.add_argument("--quick", action="store_true", help="three tolerances")
    chosen = parser.parse_args(arguments)
    rows = []
    for name in chosen.scene:
        for row in estimates(problem(name), QUICK if chosen.quick else TOLERANCES):
            rows.append(row)
            print(f"{name:28}{row['method']:10}{row['rtol']:8.0e}  true {row['true']:8.1e}  "
                  f"estimate {row['estimate']:8.1e}  {'; '.join(row['warnings'])[:60]}",
                  flush=True)  # fmt: skip
    found = counts(rows)
    print_histogram(rows)
    print(f"{found['within']} of {found['count']} within a factor of {FACTOR:g}, "
          f"{found['silent']} below a tenth without a warning")  # fmt: skip
    results.write("check", {"rows": rows, **found})
    enough = found["count"] and found["within"] >= SHARE * found["count"]
    return 0 if enough and not found["silent"] else 1


def estimates(target: Problem, tolerances: Sequence[float]) -> Iterator[dict[str, Any]]:
    """Rows of runs that reach the end and whose true error is known."""
    for method in METHODS_OF_USERS:
        if method == "taylor" and not target.model.system.data.get("taylor"):
            continue
        for rtol in tolerances:
            sol = target.model.simulate(
                target.t_end, target.start, target.params, rtol=rtol, method=method
            )
            if not sol.status.ok:
                continue
            end = sol.record.ends()[1][1]
            observed = target.observe(end)
            true = target.error(observed)
            if true < LEAST:
                continue
            found = sol.check()
            other = target.observe(end - np.array(found.error_at_end))
            estimate = float((np.abs(observed - other) / target.scale).max())
            yield {"scene": target.name, "method": method, "rtol": rtol, "true": true,
                   "estimate": estimate, "warnings": list(found.warnings)}  # fmt: skip


def counts(rows: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Counts of estimates: all, within the factor, too small without a warning."""
    ratios = [(row["estimate"] / row["true"], row["warnings"]) for row in rows]
    return {
        "count": len(rows),
        "within": sum(1 / FACTOR <= ratio <= FACTOR for ratio, _ in ratios),
        "silent": sum(ratio < 1 / FACTOR and not warnings for ratio, warnings in ratios),
    }


def print_histogram(rows: Sequence[dict[str, Any]]) -> None:
    """One line for each quarter of a decade of estimate over true error."""
    ratios = (max(row["estimate"], 1e-300) / row["true"] for row in rows)
    bars = Counter(math.floor(4 * math.log10(ratio)) for ratio in ratios)
    for quarter in range(min(bars, default=0), max(bars, default=0) + 1):
        print(f"{10 ** (quarter / 4):9.2g} {'#' * math.ceil(60 * bars[quarter] / len(rows))} "
              f"{bars[quarter]}")  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
