"""How often is a motion through change points wrong without a word?

    python benchmarks/failure_rate.py [STARTS [GEOMETRIES [T_END [METHOD ...]]]]

STARTS random starts of lengths 1, 2, 3, 4 and five of each of GEOMETRIES other four-bars whose
lengths are multiples of 2^-20 that meet the change-point condition exactly (parallelogram and kite
among them), at rest or moving, at rtol 1e-6, 1e-8, 1e-10, 1e-12.  The judge integrates the same
motion on the exact closure curve (closure_curve.py), where nothing is singular.  Right: largest
difference of the links' unit vectors, and of the speeds over the largest, within
(100 rtol + 2.5e-10) condition;
condition: the largest |d state / d start| met at ten times along the run, by differences.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from _scene import METHODS, FourBar, write
from closure_curve import Geometry, integrate

RTOLS = (1e-6, 1e-8, 1e-10, 1e-12)
UNIT = 2.0**-20
ROUNDING = 2.5e-10


def random_lengths(rng):  # type: ignore[no-untyped-def]
    """Lengths and signs with s_0 l_0 + s_1 l_1 + s_2 l_2 = l_3: a crossing, no isolated point."""
    while True:
        l = np.round(rng.uniform(0.4, 4.0, 3) / UNIT) * UNIT
        s = rng.choice([-1.0, 1.0], 3)
        ground = float(l @ s)
        a0, a1, a2 = l * s
        real = (a1 * a2 / a0) ** 2 - (a2 * a2 / a0 + a2) * (a1 * a1 / a0 + a1)
        if 0.4 < ground < 6.0 and real > 0:
            return [*l, ground], s


def special_lengths(rng, kind):  # type: ignore[no-untyped-def]
    a, b = np.round(rng.uniform(0.5, 3.0, 2) / UNIT) * UNIT
    if abs(a - b) < 0.2:
        b = a + 0.5
    return {
        "antiparallelogram": ([a, b, a, b], [1.0, 1.0, -1.0]),
        "parallelogram": ([a, b, a, b], [1.0, 1.0, -1.0]),
        "kite": ([a, a, b, b], [1.0, -1.0, 1.0]),
        "other kite": ([b, a, a, b], [1.0, 1.0, -1.0]),
    }[kind]


def cases(rng, starts, geometries):  # type: ignore[no-untyped-def]
    """Geometry of every start, one a row, with names."""
    rows = [("1 2 3 4", [1.0, 2.0, 3.0, 4.0], [-1.0, 1.0, 1.0])] * starts
    kinds = ["antiparallelogram", "parallelogram", "kite", "other kite"]
    for i in range(geometries):
        kind = kinds[i] if i < 4 else kinds[i - 4] if i < 8 else "general"
        lengths, signs = random_lengths(rng) if i >= 8 else special_lengths(rng, kind)
        rows += [(kind, lengths, signs)] * 5
    names, lengths, signs = zip(*rows, strict=True)
    n = len(rows)
    geometry = Geometry(
        np.array(lengths), np.array(signs), np.tile([1.0, 2.0, 3.0], (n, 1)),
        np.array([name == "parallelogram" for name in names]),
    )  # fmt: skip
    return names, geometry


def judge(geometry, y0, times):  # type: ignore[no-untyped-def]
    """Exact states at the last time, conditions, and the judge's own energy error."""
    n, shift = y0.shape[1], 1e-6
    many = Geometry(*(np.concatenate([x] * 3) for x in vars(geometry).values()))
    pushed = [y0, y0 + np.array([[shift], [0]]), y0 + np.array([[0], [shift]])]
    start = np.concatenate(pushed, axis=1)
    y = integrate(many, start, times)
    drift = abs(many.energy(y[-1]) - many.energy(start))[:n]

    def vectors(y):  # type: ignore[no-untyped-def]
        state = many.state(y)
        return np.concatenate([np.exp(1j * state[:, :3]), state[:, 3:]], axis=1)

    first = vectors(start)
    condition = np.zeros(n)
    for each in y:
        end = vectors(each)
        for part in (slice(n, 2 * n), slice(2 * n, 3 * n)):
            moved = abs(end[part] - end[:n]).max(1) / abs(first[part] - first[:n]).max(1)
            condition = np.maximum(condition, moved)  # NaN stays
    return many.state(y[-1])[:n], np.maximum(condition, 1.0), drift


def error_of(state, exact):  # type: ignore[no-untyped-def]
    turned = abs(np.exp(1j * state[:3]) - np.exp(1j * exact[:3])).max()
    scale = max(1.0, abs(exact[3:]).max())  # tolerances of speeds are relative to them
    return float(max(turned, abs(state[3:] - exact[3:]).max() / scale))


def main() -> int:
    arguments = sys.argv[1:]
    starts, geometries, t_end = (
        int(arguments[0]) if arguments else 500,
        int(arguments[1]) if len(arguments) > 1 else 50,
        float(arguments[2]) if len(arguments) > 2 else 100.0,
    )
    methods = arguments[3:] or list(METHODS)
    rng = np.random.default_rng(1)
    names, geometry = cases(rng, starts, geometries)
    n = len(names)
    y0 = np.stack([rng.uniform(0, 2 * np.pi, n), rng.normal(0, 3, n) * (rng.random(n) < 0.4)])
    began = time.perf_counter()
    exact, condition, drift = judge(geometry, y0, np.linspace(0, t_end, 11)[1:])
    seconds = time.perf_counter() - began
    print(f"judge: {seconds:.0f} s, energy drift up to {np.nanmax(drift):.1e} J,"
          f" conditions {np.nanquantile(condition, [0.5, 0.9, 1.0])}")  # fmt: skip
    first = geometry.state(y0)
    rows = []
    print("method    rtol    group            runs  right  flagged  WRONG   ms a run")
    for method in methods:
        for rtol in RTOLS:
            results = []
            for i in range(n):
                bar = FourBar(tuple(geometry.lengths[i]))
                run = bar.run(bar.project(first[i]), t_end, rtol, method)
                error = error_of(run.y[-1], exact[i]) if run.ok else np.inf
                limit = (100 * rtol + ROUNDING) * condition[i]
                word = "unjudged"
                if not (condition[i] > 0 and np.isfinite(exact[i]).all()):
                    results.append((word, run.seconds))
                    continue
                word = ("right" if error <= limit else "wrong") if run.ok else run.word
                results.append((word, run.seconds))
                rows.append({
                    "method": method, "rtol": rtol, "kind": names[i], "case": i, "word": word,
                    "error": error, "condition": condition[i], "lengths": list(geometry.lengths[i]),
                    "start": list(first[i]), "psi": list(y0[:, i]), "exact": list(exact[i]),
                    "least_singular": run.stats["least_singular"], "t": float(run.t[-1]),
                })  # fmt: skip
            for name in dict.fromkeys(names):
                words = [r[0] for r, k in zip(results, names, strict=True) if k == name]
                spent = [r[1] for r, k in zip(results, names, strict=True) if k == name]
                right, wrong = words.count("right") + words.count("unjudged"), words.count("wrong")
                print(f"{method:7s} {rtol:6.0e}  {name:17s} {len(words):5d} {right:6d}"
                      f" {len(words) - right - wrong:7d} {wrong:6d}  {1e3 * np.mean(spent):8.1f}",
                      flush=True)  # fmt: skip
    write("failure_rate", rows)
    return 1 if any(row["word"] == "wrong" for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
