"""Many random cases, each of which has to end soon, in a value or in an error that was meant."""

from __future__ import annotations

import math
import random
import time
import traceback
from collections import Counter
from collections.abc import Callable
from typing import Any

import mechc

USUAL = 40.0  # s of processor time, where not all cases are asked for
EVERY = 1000  # cases between reports
LONGEST = 10.0  # s of processor time a case may take
MEANT = (mechc.MechcError, ValueError, TypeError)  # UnknownNameError is a KeyError too
RAW = (UnicodeError,)  # ValueErrors that are nobody's message


def run_cases(
    seed: int,
    thorough: bool,
    usual: int,
    every: int,
    case: Callable[[random.Random], Callable[[], Any]],
    raw: Callable[[BaseException], bool] = lambda error: False,
) -> Counter[str]:
    """Draw and run cases, the usual number or, thorough, every one; how many ended how.

    The usual ones end after 40 s of processor time.

    Any other error than those meant, one that ``raw`` says is none of them, and any case that takes
    too long, fails the test in the end; the message holds the seed and the number of the case,
    which draw it again.
    """
    count, seconds = (every, math.inf) if thorough else (usual, USUAL)
    print(f"seed {seed}, {count} cases")
    ended: Counter[str] = Counter()
    bad: dict[str, str] = {}
    began = time.process_time()
    for number in range(count):
        if number and number % EVERY == 0:
            print(f"{number} cases: {_counted(ended)}, {len(bad)} bad", flush=True)
        if time.process_time() - began > seconds:
            break
        call = case(random.Random(f"{seed}/{number}"))
        started = time.process_time()
        try:
            call()
            ended["a value"] += 1
        except Exception as error:
            ended[type(error).__name__] += 1
            if not isinstance(error, MEANT) or isinstance(error, RAW) or raw(error):
                bad.setdefault(_where(error), f"case {number}:\n{_told(error)}")
        spent = time.process_time() - started
        if spent > LONGEST:
            bad[f"long {number}"] = f"case {number} took {spent:.0f} s"
        if len(bad) > 20:
            break
    print(f"{ended.total()} cases: {_counted(ended)}")
    assert not bad, f"seed {seed}: {len(bad)} kinds\n" + "\n".join(bad.values())
    return ended


def _counted(ended: Counter[str]) -> str:
    return ", ".join(f"{what}: {n}" for what, n in ended.most_common())


def _told(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))


def of_a_line_of_mechc(error: BaseException) -> bool:
    """Whether Python or NumPy says it of a line of mechc, which does not say what was wrong.

    Other libraries' errors, and those of calls with too few or many arguments, are theirs.
    """
    last = traceback.extract_tb(error.__traceback__)[-1]
    within = any(f"/{package}/" in last.filename for package in ("src/mechc", "mechc_codegen"))
    told = "positional argument" in str(error) or "keyword argument" in str(error)
    return within and last.filename.endswith(".py") and "raise" not in str(last.line) and not told


def _where(error: BaseException) -> str:
    """What failures of one kind have in common."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} {last.filename}:{last.lineno}"
