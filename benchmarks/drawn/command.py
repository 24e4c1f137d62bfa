"""Scenes drawn from a grammar of what users write: do all methods and doors give one motion?

    mechc bench drawn [--count N] [--seed S] [--minutes M] [--only DOOR ...] [--having WORD]
    mechc bench drawn --seed S --only-case K

A case is the text of a mechanism, compiled once and run with several sets of numbers and starts.
Each of these scenes is computed by SymPy's own matrices, by SciPy, by every method, in batches and
through the other doors; what differs by more than the tolerances, times the growth of the motion,
is printed with the command that repeats it.  Exits with 1 if anything does.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..timing.results import command_parser
from .processes import each
from .scene import drawn
from .tally import Tally

HASHES = "PYTHONHASHSEED"  # the order of SymPy's sets is that of a seed
NUMBERS = 10  # of each case
BAD_SYSTEM, INTERRUPTED = 2, 130
MOST = 1_000_000  # cases that are looked at


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    chosen = _parse(given)
    hashes = str(chosen.seed % 2**32)
    if not hasattr(os, "fork"):
        print("mechc bench drawn: needs fork, which this system has not", file=sys.stderr)
        return BAD_SYSTEM
    if os.environ.get(HASHES) != hashes:
        alone = ["-P"] * sys.flags.safe_path
        return _in_place_of_this([*alone, "-m", __spec__.name, *given], hashes)
    if chosen.constructs:
        tally = Tally(chosen.seed)
        for case in range(chosen.first, chosen.first + chosen.count):
            tally.constructs.update(drawn(chosen.seed, case).used)
        tally.print_constructs()
        return 0
    with tempfile.TemporaryDirectory(prefix="mechc-drawn-") as folder:
        _compile_there(Path(folder), chosen.optimised)
        return _run(chosen, Path(folder))


def _in_place_of_this(arguments: Sequence[str], hashes: str) -> int:
    """Python again with these hashes: a process of its own, which gets the same signals."""
    command = [sys.executable, *arguments]
    with subprocess.Popen(command, env={**os.environ, HASHES: hashes}) as again:
        try:
            return again.wait()
        except BaseException:
            again.terminate()
            return again.wait()


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = command_parser("drawn", __doc__)
    parser.add_argument("--count", type=int, default=100, metavar="N", help="cases [100]")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the cases [0]")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="the first case [0]")
    parser.add_argument("--only-case", type=int, metavar="K", help="this case alone, with its text")
    parser.add_argument("--only", nargs="+", default=(), metavar="WORD",
                        help="doors whose names have one of these words")  # fmt: skip
    parser.add_argument("--having", metavar="WORD",
                        help="cases with a construct of this word")  # fmt: skip
    parser.add_argument("--numbers", type=int, default=NUMBERS, metavar="N",
                        help=f"sets of numbers of each case [{NUMBERS}]")  # fmt: skip
    parser.add_argument("--minutes", type=float, default=float("inf"), metavar="M",
                        help="begin no case after so long")  # fmt: skip
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes [2]")
    parser.add_argument("--constructs", action="store_true",
                        help="count what the cases are made of, and run none")  # fmt: skip
    parser.add_argument("--optimised", action="store_true",
                        help="compile as for users, in twice the time")  # fmt: skip
    return parser.parse_args(arguments)


def _compile_there(folder: Path, optimised: bool) -> None:
    """A cache of its own, and a compiler that does not optimise."""
    os.environ["MECHC_CACHE_DIR"] = str(folder / "cache")
    found = os.environ.get("CC") or shutil.which("gcc") or shutil.which("cc")
    if optimised or not found:
        return
    fast = folder / "cc-O0"
    fast.write_text(f'#!/bin/sh\nexec {found} "$@" -O0\n', encoding="utf-8")
    fast.chmod(0o755)
    os.environ["CC"] = fast.name
    os.environ["PATH"] = os.pathsep.join((str(folder), os.environ["PATH"]))


def _run(chosen: argparse.Namespace, folder: Path) -> int:
    from .case import judge_case, warm

    warm()
    begun, tally = time.monotonic(), Tally(chosen.seed)
    print(f"seed {chosen.seed}", flush=True)
    alone = chosen.only_case is not None

    def judge(case: int) -> object:
        own = folder / f"case-{case}"
        own.mkdir()
        os.chdir(own)  # for files that a scene writes
        os.environ["MECHC_CACHE_DIR"] = str(own / "cache")
        return judge_case(chosen.seed, case, chosen.numbers, chosen.only)

    cases = iter([chosen.only_case]) if alone else _cases(chosen, begun)
    interrupted = False
    try:
        for case, outcome, seconds in each(cases, judge, 1 if alone else chosen.jobs, folder):
            tally.add(case, outcome, seconds, show=alone)
            shutil.rmtree(folder / f"case-{case}", ignore_errors=True)
    except KeyboardInterrupt:
        interrupted = True
    tally.print(time.monotonic() - begun)
    return INTERRUPTED if interrupted else int(tally.failed > 0)


def _cases(chosen: argparse.Namespace, begun: float) -> Iterator[int]:
    """The cases that were asked for, until the time is over."""
    found = 0
    for case in range(chosen.first, chosen.first + MOST):
        if found == chosen.count or time.monotonic() - begun > 60 * chosen.minutes:
            return
        if not chosen.having or any(chosen.having in x for x in drawn(chosen.seed, case).used):
            found += 1
            yield case


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the cases too
    sys.exit(main())
