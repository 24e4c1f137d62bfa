"""One problem in a separate process: all tools built, timed in turns, and the results.

A peer that crashes or hangs takes this process with it.  The file next to the request names the
peer at work; the process that started this one reads it, and starts it again without that peer.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import peers
from ..problems import problem
from ..problems.problem import NotExpressibleError, Problem
from ..timing.cases import Case, Effort, measure
from ..timing.envelope import times_of
from . import own_cases

ITSELF = "mechc"


@dataclass(frozen=True)
class Request:
    """The problem, the peers and the settings of a comparison."""

    problem: str
    peers: tuple[str, ...]
    tolerances: tuple[float, ...]
    quick: bool
    effort: Effort
    working: Path  # the file that names the peer at work
    result: Path
    cache: Path | None = None  # where mechc compiles


def write_comparison(request: Request) -> None:
    """The work of the process."""
    warnings.simplefilter("ignore")
    if request.cache:
        os.environ["MECHC_CACHE_DIR"] = str(request.cache)
    request.result.write_text(json.dumps(compare(request)))


def compare(request: Request) -> dict[str, Any]:
    """The entry of a problem in the JSON."""
    target = problem(request.problem)
    working = Working(request.working)
    cases, setup, skipped = build_all(target, request, working)
    for case in cases:
        case.wrong = target.wrong
    of_tool = {case.tool: working.peer_of[id(case)] for case in cases}
    measured = measure(
        cases, target.error, request.effort, lambda case: working.now(of_tool[case.tool])
    )
    return entry(target, [case.record() for case in measured], setup, skipped)


class Working:
    """Says in a file which peer is at work; written only when that changes."""

    def __init__(self, path: Path) -> None:
        self.path, self.said = path, ""
        self.peer_of: dict[int, str] = {}

    def now(self, peer: str) -> None:
        if peer != self.said:
            self.path.write_text(peer)
            self.said = peer


def build_all(
    target: Problem, request: Request, working: Working
) -> tuple[list[Case], dict[str, Any], dict[str, str]]:
    """Cases of mechc and of all peers, seconds of setting up, and why peers are missing."""
    working.now(ITSELF)
    cases, setup = own_cases.build(target, request.tolerances)
    working.peer_of |= {id(case): ITSELF for case in cases}
    skipped = {}
    for name in request.peers:
        working.now(name)
        try:
            built = peers.build(name, target, request.tolerances, quick=request.quick)
        except ImportError as error:
            skipped[name] = f"not installed ({error.name or error})"
        except NotExpressibleError as reason:
            skipped[name] = str(reason)
        except Exception as error:
            skipped[name] = f"failed: {type(error).__name__}: {error}".splitlines()[0]
        else:
            cases += built.cases
            setup |= built.setup
            working.peer_of |= {id(case): name for case in built.cases}
    return cases, setup, skipped


def entry(
    target: Problem, rows: Sequence[Mapping[str, Any]], setup: Mapping[str, Any],
    skipped: Mapping[str, str],
) -> dict[str, Any]:  # fmt: skip
    return {
        "title": target.title, "note": target.note, "quantities": list(target.quantities),
        "t_end": target.t_end, "rows": list(rows), "setup": dict(setup), "skipped": dict(skipped),
        "times": times_of(rows),
    }  # fmt: skip
