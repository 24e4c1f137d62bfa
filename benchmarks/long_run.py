"""What becomes of closure and energy in a long run?

    python benchmarks/long_run.py [T_END]

The regular four-bar (l_3 = 3.5 m) from rest at 85 degrees for T_END = 10,000 s at rtol 1e-10 by
dop853 and gauss8, and by gauss8 with fixed steps of 0.01 s (shorter than its error asks for).
Prints the largest closure (m; m/s), the largest departure of the energy relative to the largest
kinetic energy in the first tenth and in the whole run, and the time; writes JSON.  Exits with 1
where closure exceeds 1e-13 m or the departure 1e-8, or where fixed steps are not all alike.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from _scene import write

import mechc

FIXED = 0.01
RUNS = {
    "dop853": {"method": "dop853", "rtol": 1e-10},
    "gauss8": {"method": "gauss8", "rtol": 1e-10},
    "gauss8, fixed steps": {
        "method": "gauss8", "rtol": 1e-10, "first_step": FIXED, "max_step": FIXED,
    },
}  # fmt: skip


def measure(model, start, params, t_end, policy):  # type: ignore[no-untyped-def]
    began = time.perf_counter()
    sol = model.simulate(t_end, start, params, dense=False, **policy)
    seconds = time.perf_counter() - began
    kinetic = model.kinetic_energy(sol.y, params)
    departure = np.abs(sol.energy - sol.energy[0]) / kinetic.max()
    early = departure[sol.t <= t_end / 10].max()
    steps = np.diff(sol.t)
    return {
        "status": sol.status.code, "steps": int(sol.stats["steps"]), "seconds": seconds,
        "closure": float(sol.closure.max()), "velocity": float(sol.velocity_closure.max()),
        "early": float(early), "drift": float(departure.max()),
        "shortest": float(steps[:-1].min()), "longest": float(steps.max()),
    }  # fmt: skip


def main() -> int:
    t_end = float(sys.argv[1]) if len(sys.argv) > 1 else 1e4
    model, params = mechc.load("four_bar"), {"l_3": 3.5}
    start = model.assemble({"theta_0": np.radians(85)}, params=params)
    rows, sound = {}, True
    print("run                      steps  closure m    m/s     energy: early  whole      seconds")
    for name, policy in RUNS.items():
        row = rows[name] = measure(model, start, params, t_end, policy)
        print(f"{name:20s} {row['steps']:9d}   {row['closure']:.1e}  {row['velocity']:.1e}"
              f"         {row['early']:.1e}  {row['drift']:.1e}  {row['seconds']:8.2f}"
              f"  {row['status']}")  # fmt: skip
        alike = "fixed" not in name or row["shortest"] > 0.999 * row["longest"]
        sound &= row["status"] == "finished" and row["closure"] < 1e-13 and row["drift"] < 1e-8
        sound &= alike
    write("long_run", rows)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
