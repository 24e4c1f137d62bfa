"""What every user meets first: accuracy on the regular four-bar and the cost of one evaluation.

    python benchmarks/essentials.py

Times are minima of several runs.  What a call, the start and the installation cost: costs.py.
"""

from __future__ import annotations

import time

import numpy as np
from _scene import reference, write

import mechc


def main() -> None:
    figures = {**accuracy(), **evaluation()}
    for what, value in figures.items():
        print(f"{what:58s} {value:.4g}")
    write("essentials", [figures])


def accuracy() -> dict[str, float]:
    """Rest at 85 degrees, l_3 = 3.5 m, 20 s, rtol 1e-10, against the exact state."""
    model, params = mechc.load("four_bar"), {"l_3": 3.5}
    exact = np.array(reference("four_bar_regular")["states"]["20.0"], float)
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    sol = model.simulate(20.0, y0, params, rtol=1e-10)
    dense = model.constraints(sol(np.linspace(0, 20, 100_001)), params)
    return {
        "error at 20 s (rad, rad/s), rtol 1e-10": float(np.abs(sol.y[-1] - exact).max()),
        "closure at the steps (m)": float(sol.closure.max()),
        "closure of the dense output, 100,001 times (m)": float(np.abs(dense).max()),
        "velocity closure at the steps (m/s)": float(sol.velocity_closure.max()),
    }


def evaluation() -> dict[str, float]:
    """State rates in compiled code: one state after the other, and many at once."""
    model = mechc.load("four_bar")
    scene, values = model.system.scene, np.array(model.system.parameter_set.defaults)
    y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0})
    scalar = min(scene.rates_seconds(0.0, y, values, 100_000) for _ in range(9)) / 1e-4
    many = np.tile(y, (100_000, 1))
    batch = min(_seconds(lambda: model.rhs(0.0, many)) for _ in range(9)) / 1e-4
    return {
        "state rates, scalar, each fed by the last (ns)": scalar,
        f"state rates, {scene.lanes} lanes, from Python (ns a state)": batch,
    }


def _seconds(run: object) -> float:
    start = time.perf_counter()
    run()  # type: ignore[operator]
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
