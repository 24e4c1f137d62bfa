"""mechc on a problem: every method for one trajectory, and batches of equal members."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from mechc.native._driver import PARTS

from mechc.simulation.settings import METHODS_OF_USERS

from ..problems.problem import Problem
from ..timing.cases import Case, grid
from ..timing.processes import clocked

SINGLE, BATCH = "mechc", "mechc batch"
BATCH_METHODS = ("auto", "dop853", "gauss8", "gauss8 lockstep", "taylor")
FEWEST, MOST = 16, 1024  # members: twice as many as there are lanes, and as many as tell
BATCH_SECONDS = 0.03  # about what a batch shall take, beside which its start hardly counts
DERIVE = ("read", "describe", "derive", "differentiate", "optimize", "sensitivity")
COMPILE = ("emit", "first unit", *PARTS)


def build(problem: Problem, tolerances: Sequence[float]) -> tuple[list[Case], dict[str, Any]]:
    """The cases, and the seconds of setting up: of a model from the cache only the loading."""
    start = time.perf_counter()
    model = problem.model
    model.wait_compiled()
    model.simulate(1e-3 * problem.t_end, problem.start, problem.params)
    loaded = time.perf_counter() - start
    for method in _offered(model, BATCH_METHODS):  # parts of their own
        _batch(problem, problem.start[None], method, 1e-3 * problem.t_end)
    spent = model.build.get("seconds", {})
    setup = {"load": loaded}
    if "first unit" in spent:
        setup = {"derive": sum(spent.get(stage, 0.0) for stage in DERIVE),
                 "compile": sum(spent.get(stage, 0.0) for stage in COMPILE)}  # fmt: skip
    elif problem.shipped:
        setup = {"derive": 0.0, "compile": 0.0}
    return [*single(problem, tolerances), *batch(problem, tolerances)], {SINGLE: setup}


def single(problem: Problem, tolerances: Sequence[float]) -> list[Case]:
    """Without dense output, as the peers run."""
    model = problem.model

    def run(method: str, tol: float) -> Any:
        return model.simulate(
            problem.t_end, problem.start, problem.params, rtol=tol, method=method, dense=False
        )

    return grid(
        SINGLE, ("auto", *_offered(model, METHODS_OF_USERS)), tolerances, run,
        lambda s: problem.observe(s.y[-1]) if s.status.ok else None, lambda s: s.status.code,
    )  # fmt: skip


def batch(problem: Problem, tolerances: Sequence[float]) -> list[Case]:
    """Equal members on one thread: the time of one of them."""
    model, members = problem.model, _members(problem)
    states = np.tile(problem.start, (members, 1))

    def run(method: str, tol: float) -> Any:
        return _batch(problem, states, method, problem.t_end, tol)

    return grid(
        BATCH, _offered(model, BATCH_METHODS), tolerances, run,
        lambda b: problem.observe(b.y[-1]) if np.all(b.ok) else None,
        lambda b: b.status(members - 1).code, trajectories=members,
    )  # fmt: skip


def _batch(problem: Problem, states: Any, method: str, t_end: float, rtol: float = 1e-9) -> Any:
    name, _, lockstep = method.partition(" ")
    return problem.model.simulate_batch(
        t_end, states, problem.params, rtol=rtol, method=name, threads=1, progress=False,
        lockstep=None if name == "auto" else bool(lockstep),
    )  # fmt: skip


def _offered(model: Any, methods: Iterable[str]) -> list[str]:
    """Of these methods those that the model's equations allow."""
    return [m for m in methods if m != "taylor" or model.system.data.get("taylor")]


def _members(problem: Problem) -> int:
    """As many as one run's time lets a batch have: a power of two."""
    once = partial(
        problem.model.simulate, problem.t_end, problem.start, problem.params, dense=False
    )
    seconds = min(clocked(once) for _ in range(3))
    wished = int(BATCH_SECONDS / seconds)
    return min(max(1 << max(wished, 1).bit_length() - 1, FEWEST), MOST)
