"""How long a step of a stepper takes: percentiles and a histogram.

    mechc bench stepper [--steps N] [--dt SECONDS] [--out FILE]

For a cart whose force changes at every step, the same without a change, and the four-bar through
its change points, by each method.  "beside" is the median of a step less that of the compiled step
alone, both measured in turn in the same loop: what Python adds.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc

from ..problems.particle import particle
from ..timing.processes import clocked
from ..timing.results import command_parser

METHODS = ("dopri5", "dop853", "gauss8", "radau5")  # those for one motion at a time, with inputs
PERCENTILES = (50, 90, 99, 99.9, 100)
EDGES = (0, 1, 2, 3, 4, 5, 7, 10, 15, 20, 30, 50, 100, 1000, np.inf)  # us
WARM = 100  # steps that are not counted
Array = NDArray[np.float64]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("stepper", __doc__)
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--dt", type=float, default=1e-3)
    parser.add_argument("--out", type=Path, help="a JSON file for the figures")
    given = parser.parse_args(arguments)
    rows = [row for method in METHODS for row in measured(method, given.dt, given.steps)]
    for row in rows:
        show(row)
    if given.out is not None:
        given.out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0


def measured(method: str, dt: float, steps: int) -> list[dict[str, Any]]:
    """The rows of one method."""
    cart, linkage = driven_cart(), mechc.load("four_bar")
    cart.wait_compiled()
    start = linkage.assemble({"theta_0": np.radians(85)})
    rows = []
    for name, force in (("cart, force changed", True), ("cart", False)):
        stepper = cart.stepper([0.1, 0.0], inputs={"F": 0.0}, method=method)
        rows.append(told(name, method, *cart_latencies(stepper, dt, steps, changed=force)))
    stepper = linkage.stepper(start, method=method)
    rows.append(told("four_bar", method, each(lambda _: stepper.step(dt), steps)))
    return rows


def cart_latencies(
    stepper: mechc.Stepper, dt: float, steps: int, *, changed: bool
) -> tuple[Array, Array]:
    """Microseconds of whole steps, and of compiled ones between them."""
    stepper.step(dt)
    motion = stepper._motion

    def whole(k: int) -> None:
        stepper.step(dt, {"F": 1e-3 * k} if changed else None)

    def compiled(_: int) -> None:
        motion.reach(motion.t + dt, changed)

    found = each(lambda k: (compiled if k % 2 else whole)(k), 2 * steps)
    return found[::2], found[1::2]


def each(call: Callable[[int], object], steps: int) -> Array:
    """Microseconds of each call, the first ones left out."""
    return 1e6 * np.array([clocked(partial(call, k)) for k in range(steps + WARM)])[WARM:]


def told(name: str, method: str, whole: Array, compiled: Array | None = None) -> dict[str, Any]:
    counts, _ = np.histogram(whole, EDGES)
    row = {
        "scene": name, "method": method, "histogram": counts.tolist(),
        "us": dict(zip(map(str, PERCENTILES), np.percentile(whole, PERCENTILES), strict=True)),
    }  # fmt: skip
    if compiled is not None:
        row["beside"] = float(np.median(whole) - np.median(compiled))
    return row


def show(row: dict[str, Any]) -> None:
    """Two lines: percentiles, and the share of the steps in each range of the histogram."""
    beside = f"; beside the integration {row['beside']:.2f}" if "beside" in row else ""
    shown = ", ".join(f"{share}% {value:.2f}" for share, value in row["us"].items())
    print(f"{row['scene']}, {row['method']}: us {shown}{beside}")
    total = sum(row["histogram"])
    bars = [
        f"<{high:g}: {count / total:.2%}"
        for high, count in zip(EDGES[1:], row["histogram"], strict=True)
        if count
    ]
    print("    " + "  ".join(bars))


def driven_cart() -> mechc.Model:
    """A mass on a spring, pushed by the input F."""
    q, u, push = dynamicsymbols("q u F")
    kane = particle([q], [u], [push - Symbol("k") * q])
    return mechc.compile(kane, name="cart", defaults={"m": 2.0, "k": 30.0})
