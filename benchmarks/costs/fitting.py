"""Fits: how often their intervals hold the truth, and how long they take.

    mechc bench fit [--draws N] [--rounds N] [--seed N]

Coverage, two pendulums, 201 samples each with noise of 0.05: in how many draws the 95 % interval of
each value holds it.
  angle: 1.3 m long, over 20 s; length and start from the angle, from 256 starts in a wide box (the
    problem of Vyasarayani, Uchida, Carvalho & McPhee 2011, Multibody System Dynamics 26)
  coordinates: a point mass on a rod, x and y with a constraint, over 5 s; length, gravity and start
    from both coordinates (after Betts 2010, Practical Methods for Optimal Control, ch. 5)

Time: a regular four-bar over 2 s, 1,000 samples of an angle, of which two masses and the start are
found, from first values that are 30 % off; and what part of it is that of the motions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sympy import symbols
from sympy.physics.mechanics import dynamicsymbols

import mechc

from ..problems.particle import particle
from ..timing.processes import least_of_rounds
from ..timing.results import command_parser

SIGMA = 0.05
OUTPUTS = ("energy", "points", "sensitivities")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("fit", __doc__)
    parser.add_argument("--draws", type=int, default=100, metavar="N", help="[100]")
    parser.add_argument("--rounds", type=int, default=20, metavar="N", help="[20]")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the noise [0]")
    chosen = parser.parse_args(arguments)
    for kind in PENDULUMS:
        for name, count in coverage(kind, chosen.draws, chosen.seed).items():
            told = f"holds it in {count} of {chosen.draws} draws"
            print(f"{kind}: the 95 % interval of {name} {told}", flush=True)
    for line in times(chosen.rounds):
        print(line)
    return 0


def coverage(kind: str, draws: int, seed: int) -> dict[str, int]:
    """Name -> number of draws whose interval holds the true value."""
    problem = PENDULUMS[kind]()
    t = np.linspace(0.0, problem.seconds, 201)
    model, truth = problem.model, problem.truth
    y0 = {name: value for name, value in truth.items() if name not in model.parameters}
    params = {name: value for name, value in truth.items() if name in model.parameters}
    state = model.assemble(
        {name: value for name, value in y0.items() if name in model.coordinates},
        {name: value for name, value in y0.items() if name in model.speeds},
        problem.given.get("guess"), params,
    )  # fmt: skip
    sol = model.simulate(problem.seconds, state, params, t_eval=t, rtol=1e-12)
    exact = np.stack([sol[name] for name in problem.measured], axis=-1)
    rng = np.random.default_rng(seed)
    inside = dict.fromkeys(truth, 0)
    for _ in range(draws):
        data = exact + SIGMA * rng.normal(size=exact.shape)
        sigmas = dict.fromkeys(problem.measured, SIGMA)
        found = model.fit((t, data), problem.free, sigmas, **problem.given)
        for name, (low, high) in found.intervals.items():
            inside[name] += low <= truth[name] <= high
    return inside


@dataclass(frozen=True)
class Pendulum:
    """What is recorded of it, what is free, and what a fit is given besides."""

    model: Any
    seconds: float
    truth: dict[str, float]
    free: dict[str, tuple[float, float]]
    measured: tuple[str, ...]
    given: dict[str, Any]


def _by_angle() -> Pendulum:
    model = mechc.load("pendulum", outputs=OUTPUTS)
    truth = {"l_0": 1.3, "theta_0": 1.1, "omega_0": -0.6}
    box = {"l_0": (0.3, 4.0), "theta_0": (-3.0, 3.0), "omega_0": (-4.0, 4.0)}
    return Pendulum(model, 20.0, truth, box, ("theta_0",), {"starts": 256})


def _by_coordinates() -> Pendulum:
    (x, y, v, w), (length, g) = dynamicsymbols("x y v w"), symbols("l g")
    rod = x**2 + y**2 - length**2
    method = particle([x, y], [v, w], [0, -g], 1, closed=[rod])
    model = mechc.compile(method, defaults={"l": 1.0, "g": 9.0}, outputs=("sensitivities",))
    truth = {"l": 1.3, "g": 9.81, "x": 0.9, "v": -0.5}
    free = {"l": (0.95, 3.0), "g": (5.0, 15.0), "x": (-0.94, 0.94), "v": (-3.0, 3.0)}
    return Pendulum(model, 5.0, truth, free, ("x", "y"), {"guess": {"y": -1.0}})


PENDULUMS = {"angle": _by_angle, "coordinates": _by_coordinates}


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
    whole, plain, sloped = least_of_rounds(
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
