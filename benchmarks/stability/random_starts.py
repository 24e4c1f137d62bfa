"""Motions through change points of the four-bar, from random starts.

Starts of lengths 1, 2, 3, 4 and five of each of several other four-bars whose lengths are multiples
of 2^-20 that meet the change-point condition exactly (parallelogram and kite among them), at rest
or moving.  The judge integrates the same motion on the exact closure curve
(references/closure_curve.py), where nothing is singular.  Right: largest difference of the links'
unit vectors, and of the speeds over the largest, within (100 rtol + 2.5e-10) condition; where an
angle grows beyond a hundred radians, whose last digit is coarser, the rounding in proportion.
Condition: the largest |d state / d start| met at ten times along the run, by differences.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

import mechc

from ..problems.problem import Array
from ..references.closure_curve import Geometry
from .judge import METHODS, ROUNDING, Row, bounded, limit_of, row, runs

RTOLS = (1e-6, 1e-8, 1e-10, 1e-12)
UNIT = 2.0**-20
TOLERANCES = (6e-13, 1.2e-12)  # of the exact motion's second and third computation
SHIFT = 1e-6
LARGE = 100.0  # rad
LOOKS = 10  # times along the run at which the condition is measured


@dataclass(frozen=True)
class Trials:
    """Starts (n, 6) on geometries with change points, exact states at ``t_end``, conditions."""

    names: tuple[str, ...]
    geometry: Geometry
    psi: Array  # (2, n), the closure curve's coordinate and its rate
    t_end: float
    exact: Array
    condition: Array

    @property
    def first(self) -> Array:
        return self.geometry.state(self.psi)

    def __len__(self) -> int:
        return len(self.names)

    def params(self, i: int) -> dict[str, float]:
        return {f"l_{k}": float(l) for k, l in enumerate(self.geometry.lengths[i])}


def random_starts(quick: bool) -> Iterator[Row]:
    """A thousand starts, three quarters of them of the reference linkage."""
    given = trials(*(40, 8, 20.0) if quick else (750, 50, 100.0))
    yield from judged(given, METHODS, RTOLS)


def which_failed(rows: list[Row]) -> str:
    """Which method failed how often at which tolerance."""
    counts = Counter((r.get("method"), r.get("rtol"), r["word"]) for r in rows)
    ways = sorted({way[:2] for way in counts if way[2] in ("flagged", "WRONG")})
    return (
        "; ".join(
            f"{method} at {rtol:g}: {counts[method, rtol, 'flagged']} flagged, "
            f"{counts[method, rtol, 'WRONG']} wrong silently"
            for method, rtol in ways
        )
        or "none failed at any tolerance"
    )


def trials(starts: int, geometries: int, t_end: float, seed: int = 1) -> Trials:
    rng = np.random.default_rng(seed)
    return trials_of(rng, *cases(rng, starts, geometries), t_end)


def trials_of(
    rng: np.random.Generator, names: tuple[str, ...], geometry: Geometry, t_end: float
) -> Trials:
    """A random start for every geometry, two in five moving."""
    n = len(names)
    psi = np.stack([rng.uniform(0, 2 * np.pi, n), rng.normal(0, 3, n) * (rng.random(n) < 0.4)])
    exact, condition = judge(geometry, psi, np.linspace(0, t_end, LOOKS + 1)[1:])
    return Trials(names, geometry, psi, t_end, exact, condition)


def judged(given: Trials, methods: Sequence[str], rtols: Sequence[float]) -> Iterator[Row]:
    """A row a start, method and tolerance: what became of it, its error and limit."""
    model, ways = mechc.load("four_bar"), {"methods": methods, "rtols": rtols, "dense": False}
    for i, (name, start) in enumerate(zip(given.names, given.first, strict=True)):
        for told, method, rtol, found in runs(
            model, given.t_end, start, given.params(i), **ways, max_steps=2_000_000
        ):
            figures = {"method": method, "rtol": rtol, "kind": name, "start": list(start),
                       "lengths": list(given.geometry.lengths[i])}  # fmt: skip
            yield _word(f"{name}, start {i}, {told}", found, given, i, rtol, figures)


def _word(case, found, given, i, rtol, figures):  # type: ignore[no-untyped-def]
    condition, exact = given.condition[i], given.exact[i]
    if not (condition > 0 and np.isfinite(exact).all()):
        return row(case, "unjudged", status="the judge's motion takes too many steps", **figures)
    if isinstance(found, str):
        return row(case, "refused", status=found, **figures)
    figures |= {"seconds": found.stats["wall_s"], "least_singular": found.stats["least_singular"]}
    if not found.status.ok:
        return row(case, "flagged", status=found.status.code, t=found.status.t, **figures)
    error = error_of(found.y[-1], exact)
    turned = float(np.abs(found.y[:, : len(found.model.coordinates)]).max())
    limit = limit_of(rtol, condition, ROUNDING * max(1.0, turned / LARGE))
    return bounded(case, error, limit, condition=condition, **figures)


def error_of(state: Array, exact: Array) -> float:
    turned = abs(np.exp(1j * state[:3]) - np.exp(1j * exact[:3])).max()
    scale = max(1.0, abs(exact[3:]).max())  # tolerances of speeds are relative to them
    return float(max(turned, abs(state[3:] - exact[3:]).max() / scale))


# -- geometries and the judge ---------------------------------------------------------------------


def cases(
    rng: np.random.Generator, starts: int, geometries: int
) -> tuple[tuple[str, ...], Geometry]:
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


def judge(geometry: Geometry, y0: Array, times: Array) -> tuple[Array, Array]:
    """Exact states at the last time, and conditions."""
    n, many = len(geometry), geometry.repeated(3)
    pushed = [y0, y0 + np.array([[SHIFT], [0]]), y0 + np.array([[0], [SHIFT]])]
    start = np.concatenate(pushed, axis=1)

    def vectors(y: Array) -> Array:
        state = many.state(y)
        return np.concatenate([np.exp(1j * state[:, :3]), state[:, 3:]], axis=1)

    first, y, condition = vectors(start), many.integrate(start, times), np.ones(n)
    for each in y:
        end = vectors(each)
        for part in (slice(n, 2 * n), slice(2 * n, 3 * n)):
            moved = abs(end[part] - end[:n]).max(1) / abs(first[part] - first[:n]).max(1)
            condition = np.maximum(condition, moved)  # NaN stays
    # An error estimate that is near zero by chance lets one step through: the median does not.
    others = [geometry.state(geometry.integrate(y0, times, each)[-1]) for each in TOLERANCES]
    return np.median([many.state(y[-1])[:n], *others], axis=0), condition
