"""The cost of a call of ``simulate`` besides the integration, and its parts.

A span of 1 ns on the four-bar, minus the compiled run of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import mechc
from mechc.simulation.initialise import begin, checked_state
from mechc.simulation.settings import checked_policy

from ..timing.processes import least_of_rounds

INSTANT = 1e-9  # s, one step
PARAMS = {"l_3": 3.5}
CALLS, ROUNDS = 40, 300  # short rounds: some are not interrupted on a busy machine
BARE = "the compiled run of one step"


def calls_of(model: mechc.Model, y0: Any) -> dict[str, Callable[[], object]]:
    """The whole call, the same with times of its own, and the compiled run alone."""
    values = model.system.parameter_set.resolve(PARAMS)
    policy = model.simulate(INSTANT, y0, PARAMS).policy
    return {
        "simulate, one step": lambda: model.simulate(INSTANT, y0, PARAMS),
        "simulate, one step and t_eval": lambda: (
            model.simulate(INSTANT, y0, PARAMS, t_eval=(INSTANT,)).y
        ),
        BARE: lambda: begin(model.system, (0.0, INSTANT), y0, values, policy).advance(1000),
    }


def parts() -> dict[str, float]:
    """Microseconds; the first three are whole calls, minus the compiled run."""
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": np.radians(85)}, params=PARAMS)
    default = model.assemble({"theta_0": 1.0})
    values, calls = model.system.parameter_set.resolve(PARAMS), calls_of(model, y0)
    bare = each(calls[BARE])
    policy = {"rtol": 1e-9, "atol": None, "method": "auto", "first_step": None, "max_step": np.inf,
              "max_steps": 10_000_000, "dense": True, "on_change_point": "continue"}  # fmt: skip
    return {
        "simulate": each(lambda: model.simulate(INSTANT, default)) - bare,
        "simulate, parameters by name": each(calls["simulate, one step"]) - bare,
        "simulate, t_eval, states read": (
            each(lambda: model.simulate(INSTANT, default, t_eval=(INSTANT,)).y) - bare
        ),
        "  of it: parameters by name": each(lambda: model.system.parameter_set.resolve(PARAMS)),
        "  of it: tolerances and method": each(lambda: checked_policy(model.system, **policy)),
        "  of it: the state, projected": each(lambda: checked_state(model.system, y0, values, 0.0)),
        BARE: bare,
    }


def each(call: Callable[[], object]) -> float:
    """Microseconds a call, the least of several rounds."""
    (seconds,) = least_of_rounds(ROUNDS, lambda: [call() for _ in range(CALLS)])
    return seconds / CALLS * 1e6
