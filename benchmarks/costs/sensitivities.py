"""Run times with sensitivities over those without, at the same steps.

    mechc bench sensitivities [--rounds N] [--only SCENE ...]

Of every scene: seconds of the plain run, and of the same run with derivatives by all that is named;
the least of many, turn by turn, and their ratio.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import mechc

OUTPUTS = ("energy", "sensitivities")
RTOLS = (1e-6, 1e-9, 1e-12)
TEN = (*(f"l_{k}" for k in range(4)), *(f"m_{k}" for k in range(3)), "I_0", "I_1", "I_2")


def four_bar() -> tuple[Any, ...]:
    """The regular four-bar over 20 s, by its ten lengths, masses and inertias."""
    model, params = mechc.load("four_bar", outputs=OUTPUTS), {"l_3": 3.5}
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    return model, y0, params, 20.0, TEN


def pendulum() -> tuple[Any, ...]:
    """A simple pendulum over 20 s, by length, gravity and the whole start."""
    model = mechc.load("pendulum", outputs=OUTPUTS)
    return model, np.array([1.0, 0.5]), None, 20.0, ("l_0", "g", "y0")


SCENES: dict[str, Callable[[], tuple[Any, ...]]] = {"four_bar": four_bar, "pendulum": pendulum}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="mechc bench sensitivities", description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--rounds", type=int, default=30, metavar="N", help="[30]")
    parser.add_argument("--only", nargs="*", choices=list(SCENES), default=list(SCENES))
    chosen = parser.parse_args(arguments)
    print(f"{'scene':10} {'method':7} {'rtol':>6} {'steps':>6} {'by':>3} {'plain':>9} "
          f"{'with':>9} {'ratio':>6}")  # fmt: skip
    for name in chosen.only:
        for row in _rows(name, chosen.rounds):
            print(row, flush=True)
    return 0


def _rows(name: str, rounds: int) -> Iterator[str]:
    model, y0, params, t, names = SCENES[name]()
    for method in ("gauss8", "dop853"):
        for rtol in RTOLS:
            policy = {"rtol": rtol, "method": method}
            plain, following = _least(
                rounds,
                lambda policy=policy: model.simulate(t, y0, params, **policy),
                lambda policy=policy: model.simulate(t, y0, params, sensitivities=names, **policy),
            )
            sol = model.simulate(t, y0, params, sensitivities=names, **policy)
            yield (
                f"{name:10} {method:7} {rtol:6.0e} {sol.stats['steps']:6d} "
                f"{sol.sensitivity.columns.count:3d} {1e3 * plain:6.2f} ms {1e3 * following:6.2f} "
                f"ms {following / plain:6.1f}"
            )


def _least(rounds: int, *calls: Callable[[], object]) -> list[float]:
    """The least seconds of each, called turn by turn."""
    least = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            start = time.perf_counter()
            call()
            least[k] = min(least[k], time.perf_counter() - start)
    return least
