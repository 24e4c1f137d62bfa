"""Many four-bars: trajectories per second, right-hand sides per second, many streamed, none lost.

    python benchmarks/batch.py [--members 100000] [--streamed 100000] [--only NAME]

The regular four-bar (lengths 1, 2, 3 m and l_3 drawn from 3.4 ... 3.6 m, started at rest from a
crank angle drawn from 75 ... 115 degrees: from about 68 degrees it hardly falls, and any error
grows without bound), 20 s.  Errors are judged at the end, against runs at rtol 1e-13, as the
largest departure of any component of a sample of members; every tool works at the loosest
tolerance that keeps 1e-7.  Rates of one core are members per second of processor time, the best of
several rounds in which the tools take turns, so that other work on the machine hits all alike; two
cores are compared with one by the clock.  heyoka is compared where it is installed
(`pip install heyoka`).  A figure with a limit says whether it is kept; any missed makes the
command fail.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from _batch_peers import HeyokaBatch, explicit_equations, heyoka, lambdified_function, seconds_of
from _batch_trials import STREAM_METHOD, cluster, stopped_and_resumed, stream_child, streamed
from _scene import write

import mechc

ASKED = 1e-7  # largest error at 20 s
SAMPLE = 96  # a multiple of all lanes
STATES = 8192
ROUNDS = 5
TOLERANCES = 10.0 ** np.arange(-6.5, -12.0, -1 / 6)
Array = Any
Row = tuple[str, float, str, bool | None]  # what, value, limit in words, whether it is kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, default=100_000, help="of the long run")
    parser.add_argument("--streamed", type=int, default=100_000, help="members streamed to Zarr")
    parser.add_argument("--only", choices=list(PARTS))
    parser.add_argument("--stream-child", nargs=2, metavar=("MEMBERS", "DIR"),
                        help=argparse.SUPPRESS)  # fmt: skip
    chosen = parser.parse_args()
    if chosen.stream_child:
        stream_child(int(chosen.stream_child[0]), chosen.stream_child[1])
        return 0
    rows: list[Row] = []
    for name, part in PARTS.items():
        if chosen.only in (None, name):
            found = part(chosen)
            show(found)
            rows += found
    write(
        "batch", [dict(zip(("what", "value", "limit", "kept"), row, strict=True)) for row in rows]
    )
    return 1 if any(kept is False for *_, kept in rows) else 0


def show(rows: list[Row]) -> None:
    for what, value, limit, kept in rows:
        word = "" if kept is None else "kept" if kept else "MISSED"
        print(f"{what:66s} {value:10.4g}  {limit:10s} {word}".rstrip(), flush=True)


def told(what: str, value: float) -> Row:
    return what, float(value), "", None


def at_least(what: str, value: float, limit: float) -> Row:
    return what, float(value), f">= {limit:g}", bool(value >= limit)


def at_most(what: str, value: float, limit: float) -> Row:
    return what, float(value), f"<= {limit:g}", bool(value <= limit)


# -- trajectories ---------------------------------------------------------------------------


def drawn(members: int) -> tuple[dict[str, Array], Array]:
    """Parameters and assembled starts of the members."""
    draw = np.random.default_rng(0)
    params = {"l_3": draw.uniform(3.4, 3.6, members)}
    start = mechc.Assembly({"theta_0": np.radians(draw.uniform(75, 115, members))})
    model = mechc.load("four_bar")
    return params, model.simulate_batch(0.0, start, params, progress=False)["y0"]


class Members:
    """The first few members, and their motion as it is."""

    def __init__(self, count: int) -> None:
        self.model = mechc.load("four_bar")
        self.params, self.y0 = drawn(count)
        self.tight = self.run(SAMPLE, "gauss8", 1e-13).y

    def run(self, count: int, method: str, rtol: float, threads: int = 1) -> Any:
        params = {name: values[:count] for name, values in self.params.items()}
        return self.model.simulate_batch(
            20.0, self.y0[:count], params, rtol=rtol, method=method, threads=threads,
            progress=False,
        )  # fmt: skip

    def error(self, y: Array) -> float:
        return float(np.abs(y[:SAMPLE] - self.tight).max())

    def loosest(self, states: Callable[[float], Array], asked: float) -> tuple[float, float]:
        """The loosest tolerance that keeps the error asked for, and its error."""
        error = np.inf
        for tol in TOLERANCES:
            error = self.error(states(tol))
            if error <= asked:
                break
        return float(tol), error


def trajectories(chosen: Any) -> list[Row]:
    members = Members(max(chosen.members, 8000))
    work: dict[str, tuple[int, Callable[[], Any]]] = {}
    rows, asked = add_heyoka(members, work)
    tolerances = {}
    for method in ("dop853", "gauss8"):
        rtol, error = members.loosest(
            lambda tol, m=method: members.run(SAMPLE, m, tol).y, asked
        )  # fmt: skip
        equal = equal_members(members, method, rtol)
        rows += [
            told(f"mechc {method}: rtol", rtol),
            at_most(f"mechc {method}: error, no more than heyoka's", error, asked),
            at_least(f"mechc {method}: of 8, equal to simulate to the last bit", equal, 8),
        ]
        work[f"mechc {method}"] = (1000, lambda m=method, r=rtol: members.run(1000, m, r))
        tolerances[method] = rtol
    rows += compared(take_turns(work))
    rtol = tolerances["dop853"]
    return rows + two_cores(members, rtol) + the_long_run(members, rtol, chosen.members)


def compared(rates: dict[str, float]) -> list[Row]:
    rows = [told(f"{tool}: trajectories per second, one core", r) for tool, r in rates.items()]
    if "heyoka" in rates:
        times = {tool: rate / rates["heyoka"] for tool, rate in rates.items()}
        rows.append(at_least("mechc dop853 over heyoka", times["mechc dop853"], 1.5))
        rows.append(told("mechc gauss8 over heyoka", times["mechc gauss8"]))
    return rows


def equal_members(members: Members, method: str, rtol: float) -> int:
    batch = members.run(SAMPLE, method, rtol, 2)
    equal = 0
    for i in range(8):
        params = {name: values[i] for name, values in members.params.items()}
        sol = members.model.simulate(20.0, members.y0[i], params, rtol=rtol, method=method)
        equal += bool((sol.y[-1] == batch.y[i]).all())
    return equal


def add_heyoka(members: Members, work: dict[str, Any]) -> tuple[list[Row], float]:
    """Its rows, and the error that it achieves: its order goes by leaps with the tolerance."""
    hy = heyoka()
    if hy is None:
        return [], ASKED
    made: dict[float, HeyokaBatch] = {}

    def states(tol: float) -> Array:
        made[tol] = HeyokaBatch(hy, tol)
        return made[tol].run(members.y0[:SAMPLE], 20.0)

    tol, error = members.loosest(states, ASKED)
    work["heyoka"] = (400, lambda: made[tol].run(members.y0[:400], 20.0))
    return [told("heyoka: tol", tol), at_most("heyoka: error", error, ASKED)], error


def take_turns(work: dict[str, tuple[int, Callable[[], Any]]]) -> dict[str, float]:
    """Members per second of processor time, the best of several rounds."""
    rates = dict.fromkeys(work, 0.0)
    for _ in range(ROUNDS):
        for tool, (count, run) in work.items():
            rates[tool] = max(rates[tool], count / seconds_of(run))
    return rates


def two_cores(members: Members, rtol: float) -> list[Row]:
    least = {1: np.inf, 2: np.inf}
    for _ in range(ROUNDS):
        for threads in least:
            work = lambda: members.run(8000, "dop853", rtol, threads)  # noqa: E731, B023
            least[threads] = min(least[threads], seconds_of(work, time.perf_counter))
    load = os.getloadavg()[0]
    print(f"load of the machine while two cores were measured: {load:.1f}", file=sys.stderr)
    return [at_least("mechc dop853: two cores over one, by the clock", least[1] / least[2], 1.8)]


def the_long_run(members: Members, rtol: float, count: int) -> list[Row]:
    started = time.perf_counter()
    batch = members.run(count, "dop853", rtol, 2)
    seconds = time.perf_counter() - started
    return [
        told("the long run: members", count),
        at_least("the long run: members that reached 20 s", np.count_nonzero(batch.ok), count),
        told("the long run: trajectories per second, two cores, by the clock", count / seconds),
    ]


# -- right-hand sides -------------------------------------------------------------------------


def least_seconds(work: Callable[[], Any], repeats: int) -> float:
    return min(seconds_of(work, time.perf_counter) for _ in range(repeats))


def right_hand_sides(_: Any) -> list[Row]:
    """Nanoseconds a state, over 8,192 states with one set of parameters, on one core."""
    model = mechc.load("four_bar")
    _, y0 = drawn(STATES)
    draw = np.random.default_rng(1)
    y = model.simulate_batch(draw.uniform(1.0, 2.0), y0, {"l_3": 3.5}, progress=False).y
    y = np.where(np.isfinite(y), y, y0)  # what does not close with l_3 = 3.5 stays where it was
    out = np.empty_like(y)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})  # heyoka takes several where it can
    try:
        return compared_rates(model, y, out)
    finally:
        os.sched_setaffinity(0, cores)


def compared_rates(model: Any, y: Array, out: Array) -> list[Row]:
    per_state = 1e9 / len(y)
    own = [least_seconds(lambda: model.rhs(0.0, y, {"l_3": 3.5}, out=out), 100)]
    rows = [told("rates of 8,192 states, NumPy lambdify(cse=True): ns a state",
                 least_seconds(numpy_rates(y), 10) * per_state)]  # fmt: skip
    hy = heyoka()
    if hy is None:
        return [*rows, told("rates of 8,192 states, mechc: ns a state", own[0] * per_state)]
    variables, rates, _ = explicit_equations(hy)
    function = hy.cfunc(rates, vars=variables)
    columns, result = np.ascontiguousarray(y.T), np.empty(y.T.shape)
    theirs = []
    for _ in range(ROUNDS):
        theirs.append(least_seconds(lambda: function(columns, outputs=result), 50))
        own.append(least_seconds(lambda: model.rhs(0.0, y, {"l_3": 3.5}, out=out), 50))
    apart = np.abs(result.T - out) / (1 + np.abs(out))
    limit = min(theirs) * per_state
    return [
        *rows,
        told("rates of 8,192 states, heyoka's compiled function: ns a state", limit),
        at_most("rates of 8,192 states, mechc: ns a state", min(own) * per_state, round(limit, 2)),
        at_most("largest difference between the two, relative", apart.max(), 1e-12),
    ]


def numpy_rates(y: Array) -> Callable[[], Any]:
    function = lambdified_function()
    columns = [np.ascontiguousarray(column) for column in y.T]
    return lambda: function(*columns)


# -- larger than memory, killed, and spread ---------------------------------------------------


def streaming(chosen: Any) -> list[Row]:
    """Members of 20 s each streamed to Zarr by a process of its own, and the most memory of it."""
    seconds, memory = streamed(chosen.streamed)
    return [
        told(f"streamed to Zarr ({STREAM_METHOD}): members", chosen.streamed),
        told("streamed to Zarr: members per second", chosen.streamed / seconds),
        at_most("streamed to Zarr: peak memory of the process, MiB", memory, 1024),
    ]


def restarting(_: Any) -> list[Row]:
    kept, equal = stopped_and_resumed(20_000)
    return [
        at_least("killed with SIGKILL: members it had written", kept, 1),
        at_least("killed and resumed: arrays equal to those of one run", equal, 1),
    ]


def spreading(_: Any) -> list[Row]:
    equal, killed = cluster(20_000)
    return [
        at_least("Dask: workers killed in mid-run", killed, 1),
        at_least("Dask: arrays equal to those of a local run", equal, 1),
    ]


PARTS: dict[str, Callable[[Any], list[Row]]] = {
    "rhs": right_hand_sides,
    "trajectories": trajectories,
    "streaming": streaming,
    "restarting": restarting,
    "spreading": spreading,
}

if __name__ == "__main__":
    sys.exit(main())
