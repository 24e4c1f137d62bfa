"""The table of the models: what each step costs, and against lambdify and solve_ivp.

    python -m tests.validation.models.table [model or family ...]

Columns: seconds of the derivation in SymPy, of lambdify, until the first rates, until the first
motion after that, and of compiling again from the cache; the largest relative difference of rates
at 20 random states; microseconds of one call of the right-hand side, and how many times less that
is than of the lambdified one; milliseconds of a trajectory at rtol 1e-9, how many times less that
is than of solve_ivp (DOP853), and the end's error of both.  Compiling is measured by the clock, as
the C compiler is another process; all else by the processor's time of this thread.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mechc.compilation import build

from .catalogue import FAMILIES, MODELS
from .reference import SympyNumbers
from .use import compiled, driven, started

RTOL, EXACT = 1e-9, 1e-12
HEADINGS = (
    *("derive, s", "lambdify, s", "first rates, s", "first motion, s", "cached, s", "difference"),
    *("rhs, us", "lambdify/rhs", "motion, ms", "solve_ivp/motion", "error", "solve_ivp's"),
)


def main(chosen: list[str]) -> None:
    """Print the table, a line as soon as it is known."""
    warnings.simplefilter("ignore")
    names = [name for one in chosen or FAMILIES for name in FAMILIES.get(one, (one,))]
    print(f"| model | {' | '.join(HEADINGS)} |\n|{'---|' * (len(HEADINGS) + 1)}")
    faster: list[float] = []
    for name in names:
        figures = list(row(name))
        faster.append(figures[HEADINGS.index("solve_ivp/motion")])
        print(f"| {name} | {' | '.join(f'{x:.2g}' for x in figures)} |", flush=True)
    least, middle = min(faster), sorted(faster)[len(faster) // 2]
    print(f"{len(names)} models; solve_ivp/motion: least {least:.3g}, in the middle {middle:.3g}")


def row(name: str) -> Iterator[float]:
    """The figures of one model, in the order of the headings."""
    seconds, script = timed(MODELS[name].derive)
    yield seconds
    seconds, sympy = timed(lambda: SympyNumbers(script))
    yield seconds
    seconds, model = elapsed(lambda: first_rates(script, sympy))
    yield seconds
    y0 = started(model, script)
    yield elapsed(lambda: model.simulate(script.t_end, y0))[0]
    build._compiled.clear()
    yield timed(lambda: compiled(script))[0]
    yield difference(sympy, model)
    ours = least_time(lambda: model.rhs(0.0, y0))
    yield ours * 1e6
    yield least_time(lambda: sympy.rates(0.0, y0)) / ours
    yield from trajectories(script, sympy, model, y0)


def trajectories(script: Any, sympy: Any, model: Any, y0: Any) -> Iterator[float]:
    """Milliseconds, the ratio to solve_ivp, and the errors of both at the end."""
    ours = least_time(lambda: model.simulate(script.t_end, y0, rtol=RTOL))
    theirs, run = timed(lambda: sympy.motion(script.t_end, y0, RTOL))
    exact = sympy.motion(script.t_end, y0, EXACT).y[:, -1]
    yield ours * 1e3
    yield theirs / ours
    for end in (model.simulate(script.t_end, y0, rtol=RTOL).y[-1], run.y[:, -1]):
        yield float(np.abs(end - exact).max())


def first_rates(script: Any, sympy: Any) -> Any:
    model = driven(compiled(script), script)
    model.rhs(0.0, sympy.random_state(np.random.default_rng(0)))
    return model


def difference(sympy: Any, model: Any) -> float:
    """The largest difference of rates over the largest rate, at random states."""
    draw = np.random.default_rng(7)
    found = []
    for _ in range(20):
        y = sympy.random_state(draw)
        expected = sympy.rates(0.0, y)
        found.append(np.abs(model.rhs(0.0, y) - expected).max() / np.abs(expected).max())
    return float(max(found))


def timed(
    run: Callable[[], Any], clock: Callable[[], float] = time.thread_time
) -> tuple[float, Any]:
    begun = clock()
    made = run()
    return clock() - begun, made


def elapsed(run: Callable[[], Any]) -> tuple[float, Any]:
    return timed(run, time.perf_counter)


def least_time(run: Callable[[], Any], repeats: int = 7) -> float:
    """Seconds of one call, the least of several rounds of 20 ms."""
    calls = max(1, int(0.02 / max(timed(run)[0], 1e-6)))
    return min(timed(lambda: [run() for _ in range(calls)])[0] / calls for _ in range(repeats))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MECHC_CACHE_DIR"] = folder  # so that the first compilation is one
        main(sys.argv[1:])
