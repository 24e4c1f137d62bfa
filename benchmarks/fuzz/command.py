"""Short motions of random linkages: is any of them wrong without a word?

    mechc bench fuzz [--cases N] [--seed N] [--minutes M] [--show] [--exact]

Every case has a seed of its own, from ``--seed`` on; ``--seed N --cases 1 --show`` draws it again.
Five compiled scenes take random parameters: planar, spherical and spatial linkages of one to three
loops, with redundant rods and without (scenes.py, draw.py); judged by closure, energy, reversal and
a second method (judge.py).  Exits with 1 if a case is WRONG.  With ``--exact`` such a case
(every one with ``--show``) is integrated in 50 digits, to tell which end is off (exact.py).
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence

from ..timing.results import command_parser
from .draw import drawn
from .judge import in_digits, judged

WORDS = ("right", "refused", "flagged", "warned", "WRONG")


def main(arguments: Sequence[str] | None = None) -> int:
    chosen = _parse(arguments)
    begun, counts, wrong = time.perf_counter(), Counter[tuple[str, str, str]](), list[str]()
    done = 0
    for seed in range(chosen.seed, chosen.seed + chosen.cases):
        if time.perf_counter() - begun > 60 * chosen.minutes:
            break
        case = drawn(seed)
        found = judged(case)
        counts[case.topology, case.kind, found.word] += 1
        done += 1
        if chosen.show:
            print(case, case.params, case.y0.tolist(), case.t_end, sep="\n")
        if found.word == "WRONG" or (chosen.show and found.why):
            wrong += [f"{found.word}  {case}: {found.why}"] * (found.word == "WRONG")
            print(f"{found.word}  {case}: {found.why}", flush=True)
        if chosen.exact and (found.word == "WRONG" or (chosen.show and found.word != "refused")):
            print(in_digits(case), flush=True)
    _print_table(counts)
    print(f"{done} cases from seed {chosen.seed} in {time.perf_counter() - begun:.0f} s; "
          f"{len(wrong)} WRONG")  # fmt: skip
    return 1 if wrong else 0


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = command_parser("fuzz", __doc__)
    parser.add_argument("--cases", type=int, default=1000, metavar="N", help="at most [1000]")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the first case [0]")
    parser.add_argument("--minutes", type=float, default=float("inf"), metavar="M",
                        help="begin no case after so long")  # fmt: skip
    parser.add_argument("--show", action="store_true", help="print every case")
    parser.add_argument("--exact", action="store_true",
                        help="what is WRONG, or shown, in 50 digits: minutes a case")  # fmt: skip
    return parser.parse_args(arguments)


def _print_table(counts: Counter[tuple[str, str, str]]) -> None:
    print(f"{'topology':32s}{'kind':12s}" + "".join(f"{word:>10s}" for word in WORDS))
    for topology, kind in sorted({key[:2] for key in counts}):
        figures = [counts[topology, kind, word] for word in WORDS]
        print(f"{topology:32s}{kind:12s}" + "".join(f"{n:10d}" for n in figures))
