"""The cost of a call of ``simulate`` besides the integration, and its parts.

A span of 1 ns on the four-bar, minus the compiled run of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import mechc
from mechc.simulation.initialise import begin, checked_state
from mechc.simulation.settings import checked_policy

INSTANT = 1e-9  # s, one step
CALLS, ROUNDS = 40, 300  # short rounds: some are not interrupted on a busy machine


def parts() -> dict[str, float]:
    """Microseconds; the first three are whole calls, minus the compiled run."""
    model, params = mechc.load("four_bar"), {"l_3": 3.5}
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    default = model.assemble({"theta_0": 1.0})
    values = model.system.parameter_set.resolve(params)
    policy = model.simulate(INSTANT, y0, params).policy

    def compiled() -> None:
        begin(model.system, (0.0, INSTANT), y0, values, policy).advance(1000)

    bare = each(compiled)
    return {
        "simulate": each(lambda: model.simulate(INSTANT, default)) - bare,
        "simulate, parameters by name": each(lambda: model.simulate(INSTANT, y0, params)) - bare,
        "simulate, t_eval, states read": (
            each(lambda: model.simulate(INSTANT, default, t_eval=(INSTANT,)).y) - bare
        ),
        "  of it: parameters by name": each(lambda: model.system.parameter_set.resolve(params)),
        "  of it: tolerances and method": each(lambda: _policy(model)),
        "  of it: the state, projected": each(lambda: checked_state(model.system, y0, values, 0.0)),
        "the compiled run of one step": bare,
    }


def _policy(model: mechc.Model) -> object:
    return checked_policy(
        model.system, rtol=1e-9, atol=None, method="auto", first_step=None, max_step=np.inf,
        max_steps=10_000_000, dense=True, on_change_point="continue",
    )  # fmt: skip


def each(call: Callable[[], object]) -> float:
    """Microseconds a call, the least of several rounds."""
    return min(_seconds(call) for _ in range(ROUNDS)) / CALLS * 1e6


def _seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    for _ in range(CALLS):
        call()
    return time.perf_counter() - start
