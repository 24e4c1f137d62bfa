"""What every user meets first: accuracy on the regular four-bar, cost of one evaluation, start-up.

    python benchmarks/essentials.py

Times are minima of several runs; processes are whole ones.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
from _scene import reference, write

import mechc
from mechc.start import begin


def main() -> None:
    figures = {**accuracy(), **evaluation(), **a_call(), **operations(), **startup()}
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
    scene, values = model._scene, np.array(model._parameters.defaults)
    y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0})
    scalar = min(scene.rates_seconds(0.0, y, values, 100_000) for _ in range(9)) / 1e-4
    many = np.tile(y, (100_000, 1))
    batch = min(_seconds(lambda: model.rhs(0.0, many)) for _ in range(9)) / 1e-4
    return {
        "state rates, scalar, each fed by the last (ns)": scalar,
        f"state rates, {scene.lanes} lanes, from Python (ns a state)": batch,
    }


def a_call() -> dict[str, float]:
    """What `simulate` costs beside the integration: a span of 1 ns, less the compiled run of it."""
    model, params = mechc.load("four_bar"), {"l_3": 3.5}
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    values, state = model._parameters.resolve(params), model.assemble({"theta_0": 1.0})
    policy = model.simulate(1e-9, y0, params).policy

    def compiled() -> None:
        begin(model, (0.0, 1e-9), y0, values, policy).advance(1000)

    bare = _each(compiled)
    return {
        "simulate beside the integration (us)": _each(lambda: model.simulate(1e-9, state)) - bare,
        "the same, parameters given by name (us)": (
            _each(lambda: model.simulate(1e-9, y0, params)) - bare
        ),
    }


def _each(call: Callable[[], object]) -> float:
    """Microseconds a call, the least of several rounds."""
    return min(_seconds(lambda: [call() for _ in range(500)]) for _ in range(15)) / 500 * 1e6


def operations() -> dict[str, float]:
    counts = mechc.load("four_bar")._data["operations"]
    return {
        "operations of all outputs as derived": counts["before"],
        "operations of all outputs compiled": counts["after"],
        "operations once a run": counts["once_per_run"],
    }


def startup() -> dict[str, float]:
    """Whole processes; the import is timed inside one, numpy first."""
    script = (
        "import time, numpy; t = time.perf_counter(); import mechc; print(time.perf_counter() - t)"
    )
    imports = [float(_output(["-c", script])) for _ in range(7)]
    run = ["-m", "mechc", "run", "four_bar", "--json"]
    return {
        "import mechc beyond numpy (s)": min(imports),
        "mechc run four_bar --json, as a process (s)": min(
            _seconds(lambda: _output(run)) for _ in range(7)
        ),
        "python -c 'import numpy', as a process (s)": min(
            _seconds(lambda: _output(["-c", "import numpy"])) for _ in range(7)
        ),
    }


def _output(arguments: list[str]) -> str:
    command = [sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _seconds(run: object) -> float:
    start = time.perf_counter()
    run()  # type: ignore[operator]
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
