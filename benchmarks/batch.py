"""Many four-bars: trajectories per second, right-hand sides per second, a million streamed.

    python benchmarks/batch.py [--members 2000] [--streamed 100000] [--only NAME]

The regular four-bar (lengths 1, 2, 3 m and l_3 drawn from 3.4 ... 3.6 m, started at rest from a
crank angle drawn from 75 ... 115 degrees: from about 68 degrees it hardly falls, and any error
grows without bound), 20 s.  Errors are judged at the end, against runs at
rtol 1e-13, as the largest departure of any component of a sample of members.  heyoka (its batch
integrator and compiled function) is compared where it is installed; it integrates the index-1
equations without projection, its lanes across trajectories.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from _scene import write

import mechc

ASKED = 1e-7  # largest error at 20 s
SAMPLE = 100
STATES = 8192
Array = Any


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--members", type=int, default=2000)
    parser.add_argument("--streamed", type=int, default=100_000)
    parser.add_argument("--only", choices=list(PARTS))
    parser.add_argument("--stream-child", nargs=2, metavar=("MEMBERS", "DIR"))
    chosen = parser.parse_args()
    if chosen.stream_child:
        stream_child(int(chosen.stream_child[0]), chosen.stream_child[1])
        return
    figures: dict[str, Any] = {}
    for name, part in PARTS.items():
        if chosen.only in (None, name):
            figures |= part(chosen)
    for what, value in figures.items():
        print(f"{what:66s} {value:.4g}")
    write("batch", [figures])


# -- trajectories ---------------------------------------------------------------------------


def drawn(members: int) -> tuple[dict[str, Array], Array]:
    """Parameters and assembled starts of the members."""
    draw = np.random.default_rng(0)
    params = {"l_3": draw.uniform(3.4, 3.6, members)}
    start = mechc.Assembly({"theta_0": np.radians(draw.uniform(75, 115, members))})
    model = mechc.load("four_bar")
    return params, model.simulate_batch(0.0, start, params)["y0"]


def sample_error(y: Array, tight: Array) -> float:
    return float(np.abs(y[: len(tight)] - tight).max())


def cut(params: dict[str, Array], members: int) -> dict[str, Array]:
    return {name: values[:members] for name, values in params.items()}


def trajectories(chosen: Any) -> dict[str, float]:
    """One core at the loosest tolerance that keeps the error asked for; then two cores."""
    model = mechc.load("four_bar")
    params, y0 = drawn(chosen.members)
    few = min(SAMPLE, chosen.members)
    tight = model.simulate_batch(20.0, y0[:few], cut(params, few), rtol=1e-13).y
    found: dict[str, float] = {}

    def run(rtol: float, threads: int) -> Any:
        return model.simulate_batch(20.0, y0, params, rtol=rtol, threads=threads, progress=False)

    for rtol in (1e-7, 5e-8, 2e-8, 1e-8, 5e-9, 2e-9, 1e-9):
        batch = run(rtol, 1)
        found["mechc: rtol"] = rtol
        found["mechc: largest error of the sample"] = sample_error(batch.y, tight)
        if found["mechc: largest error of the sample"] <= ASKED:
            break
    one = least_seconds(lambda: run(found["mechc: rtol"], 1), 3)
    two = least_seconds(lambda: run(found["mechc: rtol"], 2), 3)
    spent = least_seconds(lambda: run(found["mechc: rtol"], 1), 3, time.process_time)
    found["mechc: trajectories per second of processor time"] = chosen.members / spent
    found["mechc: trajectories per second, one core"] = chosen.members / one
    found["mechc: trajectories per second, two cores"] = chosen.members / two
    found["mechc: two cores over one"] = one / two
    found |= heyoka_trajectories(chosen, params, y0, tight)
    return found


def least_seconds(
    work: Callable[[], Any], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> float:
    seconds = []
    for _ in range(repeats):
        started = clock()
        work()
        seconds.append(clock() - started)
    return min(seconds)


# -- heyoka -----------------------------------------------------------------------------------


def explicit_equations(hy: Any) -> tuple[list[Any], list[Any], Any]:
    """State variables, their rates, and the parameter l_3, of the closed four-bar.

    Written down by hand from the geometry: two accelerations follow from the crank's by Cramer's
    rule, and the crank's from d'Alembert's principle, so that no multiplier is solved for.
    """
    q, u = hy.make_vars("a", "b", "c"), hy.make_vars("ua", "ub", "uc")
    lengths, masses, g = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 9.81
    sine, cosine = [hy.sin(x) for x in q], [hy.cos(x) for x in q]
    # closure: sum l_i cos q_i = l_3, sum l_i sin q_i = 0; speeds of links 1 and 2 per crank speed
    det = lengths[1] * lengths[2] * (sine[2] * cosine[1] - cosine[2] * sine[1])
    squares = [x * x for x in u]
    bias_x = sum(l * c * s for l, c, s in zip(lengths, cosine, squares, strict=True))
    bias_y = sum(l * n * s for l, n, s in zip(lengths, sine, squares, strict=True))

    def solve(x: Any, y: Any) -> tuple[Any, Any]:
        """Angular rates of links 1 and 2 that add (x, y) = sum over them of l (-sin, cos) w."""
        first = (x * cosine[2] + y * sine[2]) * lengths[2] / det
        second = -(x * cosine[1] + y * sine[1]) * lengths[1] / det
        return first, second

    per_crank = (1.0, *solve(lengths[0] * sine[0], -lengths[0] * cosine[0]))
    free = (0.0, *solve(bias_x, bias_y))  # accelerations with the crank's at nought
    mass, force = mass_and_force(lengths, masses, g, sine, cosine, squares)
    inertia = sum(per_crank[i] * mass[i][j] * per_crank[j] for i in range(3) for j in range(3))
    drive = sum(
        per_crank[i] * (force[i] - sum(mass[i][j] * free[j] for j in range(3))) for i in range(3)
    )
    crank = drive / inertia
    rates = [*u, crank, *(per_crank[i] * crank + free[i] for i in (1, 2))]
    return [*q, *u], rates, det


def mass_and_force(
    lengths: Array, masses: Array, g: float, sine: Array, cosine: Array, squares: Array
) -> tuple[list[list[Any]], list[Any]]:
    """Of the open chain of thin rods: M and F over the three absolute angles."""
    reach = [
        [lengths[j] * (1.0 if j < i else 0.5 if j == i else 0.0) for j in range(3)]
        for i in range(3)
    ]  # of body i's centre along link j
    weight = [[sum(m * r[i] * r[j] for m, r in zip(masses, reach, strict=True)) for j in range(3)]
              for i in range(3)]  # fmt: skip
    inertia = [m * l * l / 12 for m, l in zip(masses, lengths, strict=True)]
    mass = [
        [weight[i][j] * (cosine[i] * cosine[j] + sine[i] * sine[j]) for j in range(3)]
        for i in range(3)
    ]
    force = []
    for i in range(3):
        mass[i][i] = weight[i][i] + inertia[i]
        whirl = sum(
            weight[i][j] * (cosine[i] * sine[j] - sine[i] * cosine[j]) * squares[j]
            for j in range(3)
            if j != i
        )
        moment = sum(m * r[i] for m, r in zip(masses, reach, strict=True))
        force.append(whirl - g * moment * cosine[i])
    return mass, force


def heyoka() -> Any:
    try:
        import heyoka as hy
    except ImportError:
        print("heyoka is not installed: nothing to compare with", file=sys.stderr)
        return None
    return hy


def heyoka_trajectories(
    chosen: Any, params: dict[str, Array], y0: Array, tight: Array
) -> dict[str, float]:
    """Its batch integrator, at the loosest tolerance that keeps the error asked for."""
    hy = heyoka()
    if hy is None:
        return {}
    variables, rates, _ = explicit_equations(hy)
    members = min(chosen.members, 800)  # it takes longer, and the rate is the same
    lanes = int(hy.recommended_simd_size())
    members -= members % lanes
    found: dict[str, float] = {}
    for tol in (1e-9, 3e-10, 1e-10, 3e-11, 1e-11):
        system = list(zip(variables, rates, strict=True))
        integrator = hy.taylor_adaptive_batch(
            system, np.zeros((len(variables), lanes)), tol=tol, compact_mode=False
        )
        y, seconds, spent = heyoka_run(integrator, y0[:members], lanes)
        found["heyoka: tol"] = tol
        found["heyoka: largest error of the sample"] = sample_error(y, tight)
        found["heyoka: trajectories per second of processor time"] = members / spent
        found["heyoka: trajectories per second, one core"] = members / seconds
        if found["heyoka: largest error of the sample"] <= ASKED:
            break
    return found


def heyoka_run(integrator: Any, y0: Array, lanes: int) -> tuple[Array, float, float]:
    y = np.empty_like(y0)
    started, before = time.perf_counter(), time.process_time()
    for first in range(0, len(y0), lanes):
        integrator.set_time(0.0)
        integrator.state[:] = y0[first : first + lanes].T
        integrator.propagate_until(20.0)
        y[first : first + lanes] = integrator.state.T
    return y, time.perf_counter() - started, time.process_time() - before


# -- right-hand sides -------------------------------------------------------------------------


def right_hand_sides(_: Any) -> dict[str, float]:
    """Nanoseconds a state, over 8,192 states with one set of parameters, on one core."""
    model = mechc.load("four_bar")
    _, y0 = drawn(STATES)
    draw = np.random.default_rng(1)
    y = model.simulate_batch(draw.uniform(1.0, 2.0), y0[:STATES], {"l_3": 3.5}).y
    y = np.where(np.isfinite(y), y, y0)  # what does not close with l_3 = 3.5 stays where it was
    out = np.empty_like(y)
    seconds = least_seconds(lambda: model.rhs(0.0, y, {"l_3": 3.5}, out=out), 200)
    found = {"mechc: rhs, ns a state": seconds / STATES * 1e9}
    hy = heyoka()
    if hy is None:
        return found
    variables, rates, _ = explicit_equations(hy)
    function = hy.cfunc(rates, vars=variables)
    columns, result = np.ascontiguousarray(y.T), np.empty((6, STATES))
    seconds = least_seconds(lambda: function(columns, outputs=result), 200)
    found["heyoka: compiled function, ns a state"] = seconds / STATES * 1e9
    found["largest difference between the two, relative"] = float(
        (np.abs(result.T - out) / (1 + np.abs(out))).max()
    )
    found["NumPy lambdify(cse=True), ns a state"] = lambdified_seconds(y) / STATES * 1e9
    return found


def lambdified_seconds(y: Array) -> float:
    """The same hand-written equations, through SymPy's lambdify to NumPy."""
    import sympy as sm

    class Symbolic:
        sin, cos = staticmethod(sm.sin), staticmethod(sm.cos)

        @staticmethod
        def make_vars(*names: str) -> list[sm.Symbol]:
            return list(sm.symbols(names))

    variables, rates, _ = explicit_equations(Symbolic)
    function = sm.lambdify(variables, rates, "numpy", cse=True)
    columns = [np.ascontiguousarray(column) for column in y.T]
    return least_seconds(lambda: function(*columns), 20)


# -- a million, streamed ------------------------------------------------------------------------


def streaming(chosen: Any) -> dict[str, float]:
    """Members of 2 s each streamed to Zarr in a process of its own, and the most memory it took."""
    folder = tempfile.mkdtemp()
    command = [sys.executable, __file__, "--stream-child", str(chosen.streamed), folder]
    try:
        told = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    finally:
        shutil.rmtree(folder)
    seconds, memory = map(float, told[-2:])
    return {
        "streamed: members": chosen.streamed,
        "streamed: seconds": seconds,
        "streamed: members per second": chosen.streamed / seconds,
        "streamed: peak memory of the process, MiB": memory,
    }


def stream_child(members: int, folder: str) -> None:
    draw = np.random.default_rng(0)
    params = {"l_3": draw.uniform(3.4, 3.6, members)}
    start = mechc.Assembly({"theta_0": np.radians(draw.uniform(75, 115, members))})
    started = time.perf_counter()
    mechc.load("four_bar").simulate_batch(
        2.0, start, params, rtol=1e-8, reduce=["max(theta_2)"], out=f"{folder}/batch"
    )
    seconds = time.perf_counter() - started
    print(seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


PARTS: dict[str, Callable[[Any], dict[str, float]]] = {
    "rhs": right_hand_sides,
    "trajectories": trajectories,
    "streaming": streaming,
}

if __name__ == "__main__":
    main()
