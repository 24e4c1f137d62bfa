"""Many four-bars: trajectories per second, right-hand sides per second, many streamed.

    mechc bench batch [--members 100000] [--streamed 100000] [--only NAME]

The regular four-bar (lengths 1, 2, 3 m and l_3 drawn from 3.4 ... 3.6 m, started at rest from a
crank angle drawn from 75 ... 115 degrees: from about 68 degrees it hardly falls, and any error
grows without bound), 20 s.  Errors are judged at the end, against runs at rtol 1e-13, as the
largest departure of any component of a sample of members; every tool works at the loosest
tolerance that keeps 1e-7.  Rates of one core are members per second of processor time, the best of
several rounds in which the tools take turns, so that other work on the machine hits all alike; two
cores are compared with one by the clock.  heyoka is compared where it is installed.  A figure with
a limit says whether it is kept; any missed makes the command fail.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

import mechc

from ..problems.problem import Array
from ..timing.figures import Figure
from ..timing.processes import answer, clocked, module_command, peak_bytes
from ..timing.results import command_parser, write
from .batch_peers import HeyokaBatch, heyoka_rates, heyoka_system, numpy_rates

T_END = 20.0
ASKED = 1e-7  # largest error then
SAMPLE = 96  # a multiple of all lanes
STATES = 8192
ROUNDS = 5
TOLERANCES = 10.0 ** np.arange(-6.5, -12.0, -1 / 6)
STREAM_METHOD, STREAM_RTOL, MEMORY = "dop853", 1e-9, 1024  # MiB
Work = dict[str, tuple[int, Callable[[], Any]]]  # by tool: members, and what integrates them


def main(arguments: Sequence[str] | None = None) -> int:
    chosen = _options().parse_args(arguments)
    rows: list[Figure] = []
    for name, part in PARTS.items():
        if chosen.only in (None, name):
            found = part(chosen)
            print("\n".join(row.line() for row in found), flush=True)
            rows += found
    write("batch", [row.record() for row in rows])
    return 1 if any(row.kept is False for row in rows) else 0


def _options() -> argparse.ArgumentParser:
    parser = command_parser("batch", __doc__)
    parser.add_argument("--members", type=int, default=100_000, help="of the long run")
    parser.add_argument("--streamed", type=int, default=100_000, help="members streamed to Zarr")
    parser.add_argument("--only", choices=list(PARTS))
    return parser


def at_least(what: str, value: float, limit: float) -> Figure:
    return Figure(what, value, limit=limit, least=True)


# -- trajectories ---------------------------------------------------------------------------


def drawn(members: int) -> tuple[dict[str, Array], mechc.Assembly]:
    """Parameters and starts of the members."""
    draw = np.random.default_rng(0)
    params = {"l_3": draw.uniform(3.4, 3.6, members)}
    return params, mechc.Assembly({"theta_0": np.radians(draw.uniform(75, 115, members))})


def assembled(members: int) -> tuple[dict[str, Array], Array]:
    """Parameters and closed states (members, 6) of the members."""
    params, start = drawn(members)
    return params, mechc.load("four_bar").simulate_batch(0.0, start, params, progress=False)["y0"]


class Members:
    """The first few members, and their motion as it is."""

    def __init__(self, count: int) -> None:
        self.model = mechc.load("four_bar")
        self.params, self.y0 = assembled(count)
        self.tight = self.run(SAMPLE, "gauss8", 1e-13).y

    def run(self, count: int, method: str, rtol: float, threads: int = 1) -> Any:
        params = {name: values[:count] for name, values in self.params.items()}
        return self.model.simulate_batch(
            T_END, self.y0[:count], params, rtol=rtol, method=method, threads=threads,
            progress=False,
        )  # fmt: skip

    def error(self, y: Array) -> float:
        return float(np.abs(y[:SAMPLE] - self.tight).max())

    def loosest(self, states: Callable[[float], Array], asked: float) -> tuple[float, float]:
        """The loosest tolerance that keeps the error requested, and its error."""
        error = np.inf
        for tol in TOLERANCES:
            error = self.error(states(tol))
            if error <= asked:
                break
        return float(tol), error


def trajectories(chosen: Any) -> list[Figure]:
    members = Members(max(chosen.members, 8000))
    work: Work = {}
    rows, asked = add_heyoka(members, work)
    tolerances = {}
    for method in ("dop853", "gauss8"):
        rtol, error = members.loosest(
            lambda tol, method=method: members.run(SAMPLE, method, tol).y, asked
        )
        rows += [
            Figure(f"mechc {method}: rtol", rtol),
            Figure(f"mechc {method}: error, no more than heyoka's", error, limit=asked),
        ]  # fmt: skip
        work[f"mechc {method}"] = 1000, partial(members.run, 1000, method, rtol)
        tolerances[method] = rtol
    rows += compared(take_turns(work))
    rtol = tolerances["dop853"]
    return rows + two_cores(members, rtol) + the_long_run(members, rtol, chosen.members)


def add_heyoka(members: Members, work: Work) -> tuple[list[Figure], float]:
    """Its rows, and the error that it achieves: its order goes by leaps with the tolerance."""
    system = heyoka_system()
    if system is None:
        return [], ASKED
    made: dict[float, HeyokaBatch] = {}

    def states(tol: float) -> Array:
        made[tol] = HeyokaBatch(system, tol)
        return made[tol].run(members.y0[:SAMPLE], T_END)

    tol, error = members.loosest(states, ASKED)
    work["heyoka"] = 400, partial(made[tol].run, members.y0[:400], T_END)
    return [Figure("heyoka: tol", tol), Figure("heyoka: error", error, limit=ASKED)], error


def take_turns(work: Work) -> dict[str, float]:
    """Members per second of processor time, the best of several rounds."""
    rates = dict.fromkeys(work, 0.0)
    for _ in range(ROUNDS):
        for tool, (count, run) in work.items():
            rates[tool] = max(rates[tool], count / clocked(run, time.process_time))
    return rates


def compared(rates: dict[str, float]) -> list[Figure]:
    rows = [Figure(f"{tool}: trajectories per second, one core", r) for tool, r in rates.items()]
    if "heyoka" in rates:
        times = {tool: rate / rates["heyoka"] for tool, rate in rates.items()}
        rows.append(at_least("mechc dop853 over heyoka", times["mechc dop853"], 1.5))
        rows.append(Figure("mechc gauss8 over heyoka", times["mechc gauss8"]))
    return rows


def two_cores(members: Members, rtol: float) -> list[Figure]:
    least = {1: np.inf, 2: np.inf}
    for _ in range(ROUNDS):
        for threads in least:
            took = clocked(partial(members.run, 8000, "dop853", rtol, threads))
            least[threads] = min(least[threads], took)
    load = os.getloadavg()[0]
    print(f"load of the machine while two cores were measured: {load:.1f}", file=sys.stderr)
    return [at_least("mechc dop853: two cores over one, by the clock", least[1] / least[2], 1.8)]


def the_long_run(members: Members, rtol: float, count: int) -> list[Figure]:
    started = time.perf_counter()
    batch = members.run(count, "dop853", rtol, 2)
    seconds = time.perf_counter() - started
    return [
        Figure("the long run: members", count),
        at_least("the long run: members that reached 20 s", np.count_nonzero(batch.ok), count),
        Figure("the long run: trajectories per second, two cores, by the clock", count / seconds),
    ]


# -- right-hand sides -------------------------------------------------------------------------


def right_hand_sides(_: Any) -> list[Figure]:
    """Nanoseconds a state, over 8,192 states with one set of parameters, on one core."""
    model = mechc.load("four_bar")
    _, y0 = assembled(STATES)
    draw = np.random.default_rng(1)
    y = model.simulate_batch(draw.uniform(1.0, 2.0), y0, {"l_3": 3.5}, progress=False).y
    y = np.where(np.isfinite(y), y, y0)  # members that do not close with l_3 = 3.5 stay unchanged
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})  # heyoka takes several where it can
    try:
        return compared_rates(model, y)
    finally:
        os.sched_setaffinity(0, cores)


def compared_rates(model: mechc.Model, y: Array) -> list[Figure]:
    def nanoseconds(work: Callable[[], Any], repeats: int) -> float:
        return 1e9 / len(y) * min(clocked(work) for _ in range(repeats))

    out, what = np.empty_like(y), "rates of 8,192 states"
    mine = partial(model.rhs, 0.0, y, {"l_3": 3.5}, out=out)
    own = [nanoseconds(mine, 100)]
    lambdified = nanoseconds(numpy_rates(y), 10)
    rows = [Figure(f"{what}, NumPy lambdify(cse=True): ns a state", lambdified)]
    system = heyoka_system()
    if system is None:
        return [*rows, Figure(f"{what}, mechc: ns a state", own[0])]
    run, result = heyoka_rates(system, y)
    theirs = []
    for _ in range(ROUNDS):
        theirs.append(nanoseconds(run, 50))
        own.append(nanoseconds(mine, 50))
    apart, limit = np.abs(result.T - out) / (1 + np.abs(out)), round(min(theirs), 2)
    return [
        *rows,
        Figure(f"{what}, heyoka's compiled function: ns a state", min(theirs)),
        Figure(f"{what}, mechc: ns a state", min(own), limit=limit),
        Figure("largest difference between the two, relative", apart.max(), limit=1e-12),
    ]


# -- larger than memory -----------------------------------------------------------------------


def streaming(chosen: Any) -> list[Figure]:
    """Members streamed to Zarr by a process of its own, and the most memory of it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [*module_command("suite", "batch"), str(chosen.streamed), f"{folder}/batch"]
        seconds, memory = answer(command)
    return [
        Figure(f"streamed to Zarr ({STREAM_METHOD}): members", chosen.streamed),
        Figure("streamed to Zarr: members per second", chosen.streamed / seconds),
        Figure("streamed to Zarr: peak memory of the process, MiB", memory, limit=MEMORY),
    ]


def stream(members: int, folder: str) -> None:
    """The work of that process, which prints its seconds and MiB."""
    params, start = drawn(members)
    run = partial(
        mechc.load("four_bar").simulate_batch, T_END, start, params, out=folder,
        rtol=STREAM_RTOL, method=STREAM_METHOD, progress=False,
    )  # fmt: skip
    print([clocked(run), peak_bytes() / 2**20])


PARTS: dict[str, Callable[[Any], list[Figure]]] = {
    "rhs": right_hand_sides, "trajectories": trajectories, "streaming": streaming,
}  # fmt: skip

if __name__ == "__main__":
    stream(int(sys.argv[1]), sys.argv[2])
