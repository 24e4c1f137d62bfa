"""Run time against achieved error, mechc and its peers, on the four-bar.

    python benchmarks/work_precision.py [--quick] [--scene regular|change_point] [--only NAME ...]

From rest at 85 degrees, 20 s; error: the largest difference of any component from the exact
state (16 digits) at 20 s.  Times are minima of runs that take turns in one process; derivation
and compilation are apart.  mechc runs without dense output, as its peers do.  A peer that is not
installed is named and skipped; a wrong motion is shown with its error.  The table below the
points gives, along each tool's lower envelope, the time at an error and its ratio to mechc's.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from _envelope import TARGETS, ratios, summary
from _machine import about
from _peers import PEERS, T_END, Scene
from _scene import OUT, reference, write
from _timing import Array, Case, measure

import mechc
from mechc.policy import METHODS

SCENES = {"regular": {"l_3": 3.5}, "change_point": {"l_3": 4.0}}
WHOLE = [10.0**-k for k in range(3, 14)]
HALVES = [10 ** (-k / 2) for k in range(5, 29)]


def main(arguments: Sequence[str] | None = None) -> dict[str, Any]:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("--quick", action="store_true", help="fewer tolerances and repeats")
    parser.add_argument("--scene", choices=SCENES, action="append")
    parser.add_argument("--only", choices=PEERS, nargs="*", help="these peers alone")
    chosen = parser.parse_args(arguments)
    peers = list(PEERS) if chosen.only is None else chosen.only
    results = {
        name: compare(name, peers, quick=chosen.quick) for name in chosen.scene or list(SCENES)
    }
    data = {"about": about(), "scenes": results}
    write("work_precision", data)
    for name, result in results.items():
        draw(name, result["rows"])
    print(f"written: {OUT / 'work_precision.json'} and a plot of each scene")
    return data


def compare(name: str, peers: Sequence[str], *, quick: bool) -> dict[str, Any]:
    """All cases of one scene, printed; rows, seconds of setting up, times at errors."""
    scene, exact = four_bar_scene(name)
    tols = WHOLE[::2] if quick else WHOLE
    cases, setup = mechc_cases(scene, WHOLE if quick else HALVES), {}
    for peer in peers:
        try:
            more, setup[peer] = PEERS[peer](scene, tols)
        except ImportError as missing:
            print(f"{peer}: skipped, not installed ({missing.name})")
            continue
        cases += more
    error_of = lambda y: float(np.abs(y - exact).max())  # noqa: E731
    measure(cases, error_of, rounds=10 if quick else 40, budget=0.3 if quick else 1.0)
    rows = [case.record() for case in cases]
    times = summary(rows)
    print_points(name, rows)
    print_summary(times)
    return {"rows": rows, "setup": setup, "times": times, "ratios": ratios(times, "mechc")}


def four_bar_scene(name: str) -> tuple[Scene, Array]:
    """The scene, and its exact state at 20 s."""
    model, params = mechc.load("four_bar"), SCENES[name]
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    exact = np.array(reference(f"four_bar_{name}")["states"][str(T_END)], float)
    return Scene(np.array(model._parameters.resolve(params)), y0, params), exact


def mechc_cases(scene: Scene, tols: Sequence[float]) -> list[Case]:
    """Every method by name, and the one that auto chooses."""
    model = mechc.load("four_bar")

    def run(method: str, tol: float) -> Any:
        return model.simulate(T_END, scene.y0, scene.params, rtol=tol, method=method, dense=False)

    return [
        Case(
            "mechc", method, tol,
            lambda method=method, tol=tol: run(method, tol),
            lambda s: s.y[-1] if s.status.ok else None,
            lambda s: s.status.code,
        )
        for method in ("auto", *METHODS)
        for tol in tols
        if not (method in ("radau5", "dopri5") and tol < 1e-11)
    ]  # fmt: skip


def print_points(name: str, rows: list[dict[str, Any]]) -> None:
    print(
        f"\n{name}\n{'tool':32s}{'method':10s}{'tol':>8s}{'error':>10s}{'ms':>11s}{'median':>11s}"
    )
    for row in rows:
        error = "-" if row["error"] is None else f"{row['error']:.1e}"
        word = "" if row["label"] == "right" else f"  {row['label']}: {row['status']}"
        print(
            f"{row['tool']:32s}{row['method']:10s}{row['tol']:8.0e}{error:>10s}"
            f"{1e3 * row['seconds']:11.4f}{1e3 * row['median']:11.4f}{word}"
        )


def print_summary(times: dict[str, dict[str, float | None]]) -> None:
    """Milliseconds at an error, and how many times mechc's that is."""
    print("\nms at an error (times mechc's)")
    print(f"{'':32s}" + "".join(f"{target:>20.0e}" for target in TARGETS))
    for tool, at in times.items():
        line = f"{tool:32s}"
        for target, seconds in at.items():
            mine = times["mechc"][target]
            ratio = f" ({seconds / mine:.2f})" if seconds and mine else ""
            line += f"{f'{1e3 * seconds:.4f}{ratio}' if seconds else '-':>20s}"
        print(line)


def draw(name: str, rows: list[dict[str, Any]]) -> None:
    """Time over error, one colour a tool; other motions hollow."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    tools = list(dict.fromkeys(row["tool"] for row in rows))
    for k, tool in enumerate(tools):
        for method in dict.fromkeys(row["method"] for row in rows if row["tool"] == tool):
            curve = [r for r in rows if (r["tool"], r["method"]) == (tool, method) and r["error"]]
            curve.sort(key=lambda row: -row["tol"])
            axes.plot([r["error"] for r in curve], [r["seconds"] for r in curve],
                      "-", color=f"C{k}", linewidth=0.8)  # fmt: skip
            for label, face in (("right", f"C{k}"), ("wrong", "none")):
                some = [r for r in curve if r["label"] == label]
                axes.plot([r["error"] for r in some], [r["seconds"] for r in some], "o",
                          color=f"C{k}", markerfacecolor=face, markersize=4)  # fmt: skip
        axes.plot([], [], "o-", color=f"C{k}", label=tool)
    axes.set(xscale="log", yscale="log", xlabel="error at 20 s (rad, rad/s)", ylabel="run time (s)",
             title=f"four-bar, {name.replace('_', ' ')} (hollow: another motion)")  # fmt: skip
    axes.grid(which="major", alpha=0.4)
    axes.legend(fontsize="small")
    OUT.mkdir(exist_ok=True)
    figure.savefig(OUT / f"work_precision_{name}.svg")


if __name__ == "__main__":
    main()
