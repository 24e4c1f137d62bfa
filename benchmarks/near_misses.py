"""The four-bar that misses its change point by 10^-k: right, or flagged?

    python benchmarks/near_misses.py

l_3 = 4 +- 10^-k, k = 1 ... 16, from rest at 85 degrees, 3 s, against the motion of the same doubles
in 40 digits (near_miss_reference.py made benchmarks/data/four_bar_near_misses.json).
4 - 1e-16 is 4.0 itself and is held against the change point's own exact motion.  Right: within
100 rtol times a condition of 100, and 2.5e-8 for rounding.
"""

from __future__ import annotations

import sys

import numpy as np
from _scene import METHODS, FourBar, reference, write

START = 1.48352986419518014
LIMIT = 100.0
ROUNDING = 2.5e-10


def start(bar: FourBar) -> np.ndarray:
    """Elbow up at 85 degrees, at rest."""
    l = bar.p[:4]
    reach = l[3] - l[0] * np.exp(1j * START)
    bend = np.arccos((l[1] ** 2 + abs(reach) ** 2 - l[2] ** 2) / (2 * l[1] * abs(reach)))
    theta_1 = np.angle(reach) + bend
    theta_2 = np.angle(reach - l[1] * np.exp(1j * theta_1))
    return bar.project(np.array([START, theta_1, theta_2, 0.0, 0.0, 0.0]))


def main() -> int:
    exact = reference("four_bar_near_misses")
    exact["4.0"] = reference("four_bar_change_point")["states"]
    grounds = sorted({4.0 + sign * 10.0**-k for k in range(1, 17) for sign in (-1, 1)})
    rows, counts = [], {"right": 0, "flagged": 0, "WRONG": 0}
    for ground in grounds:
        if repr(ground) not in exact:
            print(f"{ground - 4:9.1e}  no reference yet")
            continue
        final = np.array(exact[repr(ground)]["3.0"], float)
        bar = FourBar((1.0, 2.0, 3.0, ground))
        for method in METHODS:
            line = f"{ground - 4:9.1e} {method:7s}"
            for rtol in (1e-6, 1e-9, 1e-12):
                run = bar.run(start(bar), 3.0, rtol, method)
                error = float(abs(run.y[-1] - final).max()) if run.ok else np.inf
                limit = (100 * rtol + ROUNDING) * LIMIT
                word = ("right" if error <= limit else "WRONG") if run.ok else "flagged"
                counts[word] += 1
                line += f"   {word:7s} {error:8.1e} {run.stats['steps']:6d} {run.word[:12]:12s}"
                rows.append({"l_3": ground, "method": method, "rtol": rtol, "word": word,
                             "error": error, "status": run.word, "steps": run.stats["steps"],
                             "passages": len(run.change_points)})  # fmt: skip
            print(line, flush=True)
    print(counts)
    write("near_misses", rows)
    return 1 if counts["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
