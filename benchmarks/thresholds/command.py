"""What half and twice of each constant of the C runtime do.

    mechc bench thresholds [--only NAME ...] [--factors X ...] [--full]
                           [--page MARKDOWN] [--processes N]

Scenes are compiled once, with factors for all constants that are read while they run.  Each
constant is halved and doubled; ``--full`` multiplies it by a tenth and by ten where neither shows.
With each some families of the stress suite (``--full``: all), motions with known ends and loops
with known assemblies are run, those in whose code the constant is:
how many more of them are wrong or flagged than with the constants as they are, and what becomes of
steps, evaluations and errors.  What is measured is kept in the folder of figures and goes on there
after an interruption, until the code of a header changes.  Prints the rows of
docs/theory/thresholds.md; ``--page`` writes them into it.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import exp, log
from pathlib import Path
from typing import Any

from mechc_codegen.extension.flags import RUNTIME

from ..timing import results
from ..timing.processes import environment, module_command
from .constants import Constant, code, constants
from .varied import FILE_VARIABLE, build_closing, compiler, write_factors, write_headers

NOT_MEASURED = "not measured"
HALF, TWICE, TENTH, TENFOLD = 0.5, 2.0, 0.1, 10.0
LEAST_ERROR, LEAST_CHANGE = 1e-14, 5e-3
WORK = ("steps", "evaluations")
MARKS = "<!-- the table: begin -->\n", "<!-- the table: end -->\n"
HEAD = "| constant | value | why | half | twice |\n|---|---|---|---|---|\n"
Found = dict[tuple[str, float], dict[str, Any]]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = results.command_parser("thresholds", __doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these constants")
    parser.add_argument("--factors", nargs="+", type=float, metavar="X", help="[0.5 2]")
    parser.add_argument("--full", action="store_true", help="every case: a minute a factor")
    parser.add_argument(
        "--page", type=Path,
        help="write the rows into this page; those not measured now stay as they are there",
    )  # fmt: skip
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N")
    chosen = parser.parse_args(arguments)
    known = constants()
    names = chosen.only or [each.name for each in known if "," not in each.value]
    if unknown := {*names} - {each.name for each in known}:
        parser.error(f"no constant is called {', '.join(sorted(unknown))}")
    folder, full = _folder(), chosen.full
    _measure(folder, full, [("", 1.0)], 1)
    _check_base(_found(folder, full)["", 1.0])
    tried = chosen.factors or (HALF, TWICE)
    _measure(folder, full, [(name, x) for name in names for x in tried], chosen.processes)
    found = _found(folder, full)
    if full and not chosen.factors:
        quiet = [name for name in names if not any(shows(found, name, x) for x in tried)]
        beyond = [(name, x) for name in quiet for x in (TENTH, TENFOLD)]
        _measure(folder, full, beyond, chosen.processes)
        found = _found(folder, full)
    chosen_rows = [each for each in known if each.name in names]
    print(HEAD + "".join(_row(each, found, tried) for each in chosen_rows))
    if chosen.page:
        write_page(chosen.page, [_row(each, found, tried) for each in known])
    return 0


def write_page(page: Path, rows: Sequence[str]) -> None:
    """Put the rows in the place of those that the page has; of a constant with the same value that
    was not measured now, the figures of the page stay."""
    before, _, rest = page.read_text("utf-8").partition(MARKS[0])
    old, _, after = rest.partition(MARKS[1])
    known = {_key(row): row.split(" | ")[3:] for row in old.splitlines(True) if row[:3] == "| `"}
    kept = [
        " | ".join([*row.split(" | ")[:3], *known[_key(row)]])
        if NOT_MEASURED in row and _key(row) in known
        else row
        for row in rows
    ]
    page.write_text(before + MARKS[0] + HEAD + "".join(kept) + MARKS[1] + after, "utf-8")


def _key(row: str) -> str:
    """The constant of a row, with its value."""
    return " | ".join(row.split(" | ")[:2])


# -- measuring ------------------------------------------------------------------------------------


def _folder() -> Path:
    """The folder of the figures of these headers: other code has other figures."""
    digest = hashlib.sha256()
    for header in sorted(RUNTIME.rglob("*.h")):
        digest.update(code(header).encode())
    folder = results.folder() / "thresholds" / digest.hexdigest()[:16]
    if not (folder / "prelude.h").exists():
        write_headers(constants(), folder)
    if not [*folder.rglob("_closing*.so")]:
        build_closing(folder, folder / "closing")
    return folder


def _check_base(base: Mapping[str, Any]) -> None:
    """Raise RuntimeError where a family broke off with the constants as they are."""
    if broken := [each for each in base.get("bad", (base,)) if "broke" in each]:
        raise RuntimeError(f"nothing can be compared with this: {broken[0]}")


def _size(full: bool) -> str:
    return "full" if full else "short"


def _found(folder: Path, full: bool) -> Found:
    files = folder.glob(f"{_size(full)}_*.jsonl")
    lines = [line for file in files for line in file.read_text("utf-8").splitlines()]
    rows = map(json.loads, lines)
    return {(each["name"], each["factor"]): each for each in rows}


def _measure(folder: Path, full: bool, wanted: Sequence[tuple[str, float]], processes: int) -> None:
    """Measure what is not known, in as many processes."""
    found = _found(folder, full)
    tasks = [f"{name}:{factor}" for name, factor in wanted if (name, factor) not in found]
    count = min(processes, len(tasks))
    workers = [_begin(folder, full, k, tasks[k::count]) for k in range(count)]
    for worker in workers:
        if worker.wait():
            raise RuntimeError(f"a process that measures ended with {worker.returncode}")


def _begin(folder: Path, full: bool, number: int, tasks: Sequence[str]) -> subprocess.Popen[bytes]:
    factors = folder / f"factors_{number}"
    write_factors(factors, len(constants()))
    variables = {
        "CC": compiler(folder, os.environ.get("CC", "cc")),
        "MECHC_CACHE_DIR": str(folder / "cache"),
        FILE_VARIABLE: str(factors),
    }
    command = module_command("thresholds", "worker")
    size = _size(full)
    files = [str(folder), str(folder / f"{size}_{number}.jsonl"), size]
    return subprocess.Popen([*command, *files, *tasks], env=environment(**variables))


# -- the table ------------------------------------------------------------------------------------


def _row(constant: Constant, found: Found, tried: Sequence[float]) -> str:
    cells = [told(found, constant.name, x) for x in tried]
    for k, beyond in enumerate((TENTH, TENFOLD)):
        if k < len(cells) and (constant.name, beyond) in found:
            cells[k] += (
                f"; a tenth: {told(found, constant.name, beyond)}"
                if k == 0
                else (f"; ten times: {told(found, constant.name, beyond)}")
            )
    reason = constant.reason.strip().replace("|", "\\|")
    return f"| `{constant.name}` | `{constant.value}` | {reason} | " + " | ".join(cells) + " |\n"


def shows(found: Found, name: str, factor: float) -> bool:
    """Does a factor change a count of the runs, their steps or evaluations?"""
    return told(found, name, factor) not in ("nothing", "last digits")


def told(found: Found, name: str, factor: float) -> str:
    """What a factor changes, in words."""
    base, now = found[("", 1.0)], found.get((name, factor))
    if now is None:
        return NOT_MEASURED
    if "broke" in now:
        return f"runs do not end ({now['broke']})"
    parts = [*_counts(base, now, "WRONG", "wrong"), *_counts(base, now, "flagged", "flagged")]
    for what in WORK:
        parts += _work(what, base[what], now[what])
    ratio = _ratio_of_errors(base["errors"], now["errors"])
    if abs(log(ratio)) >= log(1.02):
        parts.append(f"errors × {ratio:.2g}")
    same = all(base["errors"].get(case) == error for case, error in now["errors"].items())
    same &= all(
        base[key][name] == each for key in ("words", *WORK) for name, each in now[key].items()
    )
    return ", ".join(parts) or ("nothing" if same else "last digits")


def _counts(base: Mapping[str, Any], now: Mapping[str, Any], word: str, said: str) -> Iterator[str]:
    """How many runs more, or fewer, have a word, with the families where they are."""
    more = Counter[str]()
    for family, words in now["words"].items():
        more[family] = words.get(word, 0) - base["words"][family].get(word, 0)
    changed = {family: n for family, n in more.items() if n}
    if changed:
        yield f"{said} {', '.join(f'{n:+d} {family}' for family, n in changed.items())}"


def _work(what: str, base: Mapping[str, int], now: Mapping[str, int]) -> Iterator[str]:
    """The families whose runs take fewer, and more, by the most."""
    changes = {name: count / base[name] - 1.0 for name, count in now.items() if base[name]}
    if not changes:
        return
    for one in dict.fromkeys(
        (min(changes, key=changes.__getitem__), max(changes, key=changes.__getitem__))
    ):
        if abs(changes[one]) >= LEAST_CHANGE:
            yield f"{what} {100.0 * changes[one]:+.2g} % {one}"


def _ratio_of_errors(base: Mapping[str, float], now: Mapping[str, float]) -> float:
    """The geometric mean, of runs whose errors are more than rounding."""
    logs = [log(max(now[case], LEAST_ERROR) / error) for case, error in base.items()
            if error > LEAST_ERROR and now.get(case) is not None]  # fmt: skip
    return exp(sum(logs) / len(logs)) if logs else 1.0
