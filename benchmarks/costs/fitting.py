"""Fits: how often their intervals hold the truth, and how long they take.

    mechc bench fit [--draws N] [--rounds N] [--seed N]

Coverage: a pendulum of 1.3 m over 20 s, 201 angles with noise of 0.05 rad; length and start are
found from 256 starts in a wide box (the problem of Vyasarayani, Uchida, Carvalho & McPhee
2011, Multibody System Dynamics 26).  Printed is in how many draws the 95 % interval
of each holds it.

Time: a regular four-bar over 2 s, 1,000 samples of an angle, of which two masses and the start are
found, from first values that are 30 % off; and what part of it is that of the motions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import mechc

TRUTH = {"l_0": 1.3, "theta_0": 1.1, "omega_0": -0.6}
FREE = {"l_0": (0.3, 4.0), "theta_0": (-3.0, 3.0), "omega_0": (-4.0, 4.0)}
SIGMA = 0.05
OUTPUTS = ("energy", "points", "sensitivities")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="mechc bench fit", description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--draws", type=int, default=100, metavar="N", help="[100]")
    parser.add_argument("--rounds", type=int, default=20, metavar="N", help="[20]")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the noise [0]")
    chosen = parser.parse_args(arguments)
    inside = coverage(chosen.draws, chosen.seed)
    for name, count in inside.items():
        print(f"the 95 % interval of {name} holds it in {count} of {chosen.draws} draws")
    for line in times(chosen.rounds):
        print(line)
    return 0


def coverage(draws: int, seed: int) -> dict[str, int]:
    """Name -> number of draws whose interval holds the true value."""
    model = mechc.load("pendulum", outputs=OUTPUTS)
    t = np.linspace(0.0, 20.0, 201)
    start = {name: TRUTH[name] for name in ("theta_0", "omega_0")}
    params = {name: TRUTH[name] for name in ("l_0",)}
    exact = model.simulate(20.0, start, params, t_eval=t, rtol=1e-12)["theta_0"]
    rng = np.random.default_rng(seed)
    inside = dict.fromkeys(FREE, 0)
    for _ in range(draws):
        data = exact + SIGMA * rng.normal(size=len(t))
        found = model.fit((t, data), FREE, {"theta_0": SIGMA}, starts=256)
        for name, (low, high) in found.intervals.items():
            inside[name] += low <= TRUTH[name] <= high
    return inside


def times(rounds: int) -> Iterator[str]:
    """Milliseconds of the fit, of its motions, and of what is between them."""
    model = mechc.load("four_bar", outputs=OUTPUTS)
    t = np.linspace(0.0, 2.0, 1000)
    truth, start = {"l_3": 3.5, "m_1": 2.0, "m_2": 3.0}, {"theta_0": 1.48, "omega_0": 0.3}
    exact = model.simulate(2.0, start, truth, t_eval=t, rtol=1e-12)["theta_0"]
    data = exact + 0.01 * np.random.default_rng(0).normal(size=len(t))
    free = {"m_1": (0.1, 9.0), "m_2": (0.1, 9.0), "theta_0": (1.0, 2.0), "omega_0": (-1.0, 1.0)}
    first = {"l_3": 3.5, "m_1": 2.6, "m_2": 2.1}

    def fit() -> Any:
        return model.fit((t, data), free, {"theta_0": 0.01}, params=first)

    problem, x = fit().problem, fit().x
    counted = _counted(problem, fit)
    whole, plain, sloped = _least(
        rounds, fit, lambda: problem.simulate(x, 0).y, lambda: _columns(problem, x)
    )
    motions = counted[0] * plain + counted[1] * sloped
    yield f"fit of 1,000 samples, 4 values: {1e3 * whole:.1f} ms"
    yield f"  {counted[0]} motions of {1e3 * plain:.2f} ms without derivatives"
    yield f"  {counted[1]} motions of {1e3 * sloped:.2f} ms with derivatives at the samples"
    yield f"  all else: {1e3 * (whole - motions):.1f} ms"


def _columns(problem: Any, x: Any) -> Any:
    names = [one.name for one in problem.unknowns]
    return problem.simulate(x, 0, names).sensitivity[names[0]]


def _counted(problem: Any, fit: Callable[[], Any]) -> list[int]:
    """How many motions a fit computes without derivatives, and with them."""
    counts, kind = [0, 0], type(problem)
    simulate = kind.simulate

    def counting(self: Any, x: Any, place: int, names: Sequence[str] = ()) -> Any:
        counts[bool(names)] += 1
        return simulate(self, x, place, names)

    kind.simulate = counting
    try:
        fit()
    finally:
        kind.simulate = simulate
    return counts


def _least(rounds: int, *calls: Callable[[], object]) -> list[float]:
    """The least seconds of each, called turn by turn."""
    least = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            begun = time.perf_counter()
            call()
            least[k] = min(least[k], time.perf_counter() - begun)
    return least
