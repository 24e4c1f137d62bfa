"""heyoka's adaptive Taylor integrators: one trajectory, and batches with one in each lane.

Both take the explicit rates, elimination written out, with ``high_accuracy`` and parallel mode
off, which is fastest.  Small systems are unrolled; ``compact_mode`` is for the large ones, whose
compilation would take minutes.  Only the integration is timed, and of a batch with identical
members, so that no lane waits for another, the time of one.

The first step is kept short.  A step follows from the last two coefficients of the series, and
these vanish by symmetry at some orders where a chain starts from rest: the step that they give
has no bound, and the motion is lost at once.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..formulations.equations import Equations, equations_of
from ..problems.problem import Array, Problem
from ..timing.cases import Case
from . import Built, NotExpressibleError, with_tighter

TOOLS = ("heyoka", "heyoka batch")
FIRST_STEP = 1e-3  # of the whole time
MOST_STEPS = 100_000  # right runs take hundreds, the stiff one ten thousand; lost ones never end
# Operations times the order squared up to which systems are unrolled: it makes them two to four
# times as fast, for up to half a minute of compilation, or for seconds where the run is quick.
UNROLLED, QUICKLY_UNROLLED = 60_000, 20_000
COMPILATION, QUICK_COMPILATION = 60.0, 15.0  # seconds of it that all tolerances may take
MOST_OPERATIONS = 8_000  # beyond these compilation takes more than a minute in compact mode too


@dataclass(frozen=True)
class System:
    """The arguments of an integrator."""

    heyoka: Any
    equations: Equations
    rates: list[tuple[Any, Any]]  # variable, its rate
    operations: int
    t_end: float
    unrolled: int

    def policy(self, tol: float) -> dict[str, Any]:
        compact = unrolls(self.operations, tol) > self.unrolled
        return {"tol": tol, "high_accuracy": False, "compact_mode": compact}


def unrolls(operations: int, tol: float) -> float:
    """Operations times the order squared, the order as heyoka has it."""
    return float(operations * np.ceil(1 - np.log(tol) / 2) ** 2)


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Both integrators; also on the stiff problem, which takes them milliseconds.

    Raises
    ------
    NotExpressibleError
        Where the elimination written out is too long to be compiled in a minute.
    """
    import heyoka

    began = time.perf_counter()
    system = written_out(heyoka, problem, QUICKLY_UNROLLED if quick else UNROLLED)
    derived = system.equations.seconds + time.perf_counter() - began
    end = time.perf_counter() + (QUICK_COMPILATION if quick else COMPILATION)
    compiled: dict[str, list[float]] = {tool: [] for tool in TOOLS}
    cases = []
    for tol in spread_out(with_tighter(tolerances)):
        if time.perf_counter() + sum(took[-1] for took in compiled.values() if took) > end:
            break
        for tool, make in zip(TOOLS, (one, abreast), strict=True):
            began = time.perf_counter()
            cases.append(make(system, tol))
            compiled[tool].append(time.perf_counter() - began)
    cases.sort(key=lambda case: (case.trajectories, -case.tol))
    setup = {tool: {"derive": derived, "compile": max(took)} for tool, took in compiled.items()}
    return Built(cases, setup)


def spread_out(tolerances: Sequence[float]) -> list[float]:
    """Every fourth, then those half way between, then the rest."""
    order = sorted(range(len(tolerances)), key=lambda k: (k % 4 != 0, k % 2 != 0, k))
    return [tolerances[k] for k in order]


def written_out(heyoka: Any, problem: Problem, unrolled: int) -> System:
    """The rates as heyoka's expressions."""
    equations = equations_of(problem)
    system, operations = rates_of(heyoka, equations)
    if operations > MOST_OPERATIONS:
        raise NotExpressibleError(
            f"elimination written out takes {operations} operations, which its compiler needs "
            "more than a minute for"
        )
    return System(heyoka, equations, system, operations, problem.t_end, unrolled)


def rates_of(
    heyoka: Any, equations: Equations, parameters: Sequence[Any] = ()
) -> tuple[list[tuple[Any, Any]], int]:
    """Variables with their rates as heyoka's expressions, and how many operations these take."""
    program = equations.rates()
    variables = [heyoka.expression(symbol.name) for symbol in equations.state]
    rates = program.function(heyoka)(*variables, *parameters)
    system = list(zip(variables, [heyoka.expression(0.0) + r for r in rates], strict=True))
    return system, sum(int(x.count_ops()) for _, x in program.assignments)


def one(system: System, tol: float) -> Case:
    """Its scalar integrator."""
    start = system.equations.start
    taylor = system.heyoka.taylor_adaptive(system.rates, start.tolist(), **system.policy(tol))
    first = FIRST_STEP * system.t_end

    def prepare() -> None:
        taylor.time = 0.0
        taylor.state[:] = start

    def run() -> Any:
        taylor.step(max_delta_t=first)
        return taylor.propagate_until(system.t_end, max_steps=MOST_STEPS)[0]

    return _case(TOOLS[0], system, tol, run, lambda: taylor.state, prepare)


def abreast(system: System, tol: float) -> Case:
    """Its batch integrator, the same member in every lane."""
    lanes = int(system.heyoka.recommended_simd_size())
    start = np.tile(system.equations.start[:, None], lanes)
    taylor = system.heyoka.taylor_adaptive_batch(system.rates, start, **system.policy(tol))
    first = [FIRST_STEP * system.t_end] * lanes

    def prepare() -> None:
        taylor.set_time(0.0)
        taylor.state[:] = start

    def run() -> Any:
        taylor.step(max_delta_t=first)
        taylor.propagate_until(system.t_end, max_steps=MOST_STEPS)
        return taylor.propagate_res[0][0]

    case = _case(TOOLS[1], system, tol, run, lambda: taylor.state[:, 0], prepare)
    case.trajectories = lanes
    return case


def _case(
    tool: str, system: System, tol: float, run: Callable[[], Any],
    final: Callable[[], Array], prepare: Callable[[], None],
) -> Case:  # fmt: skip
    def word(outcome: Any) -> str:
        return "finished" if outcome.name == "time_limit" else str(outcome.name)

    def state(outcome: Any) -> Array | None:
        finished = word(outcome) == "finished"
        return system.equations.observe(np.array(final())) if finished else None

    return Case(tool, "Taylor", tol, run, state, word, prepare)
