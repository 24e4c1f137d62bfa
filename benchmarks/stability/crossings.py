"""Change points of other mechanisms, each branch by a form of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.slider_crank import slider_crank
from scipy.integrate import solve_ivp

import mechc

from ..formulations.equations import derive
from ..problems.closed_loops import five_bar
from ..problems.windows_motion import first_upright, upright_start
from ..references.closure_curve import Geometry
from ..timing.cases import Array
from . import random_starts
from .judge import (
    LARGEST,
    METHODS,
    ROUNDING,
    Row,
    limit_of,
    row,
    runs,
    speeds_apart,
    verdict,
)

RTOLS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
SHIFT = 1e-6
TOGETHER = 1e-7  # N + 1 rows of a row of windows lose rank at once; docs/growth.md measures it
WINDOWS_CONDITION = 10.0
UNTOLD = "a change of the start as small as rtol moves the end beyond any limit"


@dataclass(frozen=True)
class Branch:
    """A motion with one degree of freedom: mass(x) x'' + slope(x) x'^2 / 2 = force(x).

    ``state`` gives the mechanism's state of (x, x'); nothing in it is singular at a crossing.
    """

    name: str
    mass: Callable[[float], float]
    slope: Callable[[float], float]
    force: Callable[[float], float]
    state: Callable[[float, float], Array]

    def final(self, start: Sequence[float], t_end: float, rtol: float) -> Array:
        def rates(t: float, y: Array) -> list[float]:
            pull = self.force(y[0]) - self.slope(y[0]) * y[1] ** 2 / 2
            return [y[1], pull / self.mass(y[0])]

        run = solve_ivp(rates, (0.0, t_end), start, method="DOP853", rtol=rtol, atol=rtol)
        return self.state(*run.y[:, -1])


def other_mechanisms(quick: bool) -> Iterator[Row]:
    rtols = (1e-8,) if quick else RTOLS
    yield from _slider_crank(rtols)
    yield from _windows((2,) if quick else (2, 5, 40), rtols)


# -- crank and rod of one length: the slider comes to the crank's pivot ---------------------------


def _slider_crank(rtols: Sequence[float]) -> Iterator[Row]:
    model = mechc.compile(slider_crank())
    l = 0.75
    p = dict(zip(model.parameters, map(float, model.defaults.values()), strict=True))
    m, T = [p[f"m_{k}"] for k in range(3)], p["T"]
    unfolds = Branch(
        "slider-crank that unfolds",
        lambda x: l * l * (m[0] / 3 + m[1] / 3 + (2 * m[1] + 4 * m[2]) * np.sin(x) ** 2),
        lambda x: l * l * (2 * m[1] + 4 * m[2]) * np.sin(2 * x),
        lambda x: T,
        lambda x, v: np.array([x, -x, 2 * l * np.cos(x), v, -v, -2 * l * np.sin(x) * v]),
    )
    folded = Branch(
        "slider-crank that stays folded", lambda x: l * l * (m[0] + m[1]) / 3, lambda x: 0.0,
        lambda x: T, lambda x, v: np.array([x, x + np.pi, 0.0, v, v, 0.0]),
    )  # fmt: skip
    for branch in (unfolds, folded):
        for start in ((0.3, 3.0), (0.3, -6.0)):
            yield from _along(model, branch, start, 4.0, {"l_0": l, "l_1": l}, rtols)


def _along(
    model: mechc.Model, branch: Branch, start: tuple[float, float], t_end: float,
    params: dict[str, float], rtols: Sequence[float],
) -> Iterator[Row]:  # fmt: skip
    exact, loose = (branch.final(start, t_end, rtol) for rtol in (1e-13, 1e-11))
    scale = speeds_apart(exact, len(exact) // 2)
    pushed = branch.final((start[0] + SHIFT, start[1]), t_end, 1e-12)
    condition = float((np.abs(pushed - exact) / scale).max()) / SHIFT
    for told, _, rtol, found in runs(model, t_end, branch.state(*start), params, rtols=rtols):
        limit = limit_of(rtol, condition) + float((np.abs(exact - loose) / scale).max())
        case = f"{branch.name}, from {start[1]:g} rad/s, {told}"
        yield verdict(case, found, exact, limit, scale)


# -- lengths in pairs at the tightest tolerance, and lengths typed as decimals --------------------


def equal_lengths(quick: bool) -> Iterator[Row]:
    """Rhombi, parallelograms, kites; loosely, and at 1e-12, where rounding is all that is left."""
    starts, rng = 8 if quick else 40, np.random.default_rng(3)
    names, rows = [], []
    for kind in ("rhombus", "parallelogram", "antiparallelogram", "kite", "other kite"):
        for _ in range(starts):
            lengths, signs = random_starts.special_lengths(rng, kind.replace("rhombus", "kite"))
            equal = [lengths[0]] * 4, [1.0, 1.0, -1.0]
            rows.append(equal if kind == "rhombus" else (lengths, signs))
            names.append(kind)
    yield from _four_bars(rng, names, rows, 20.0, (1e-12,) if quick else (1e-4, 1e-12))


def decimal_lengths(quick: bool) -> Iterator[Row]:
    """Lengths to a decimal that meet the condition as typed; as doubles, but for rounding."""
    rng = np.random.default_rng(4)
    rows = [_typed(rng) for _ in range(40 if quick else 300)]
    yield from _four_bars(rng, ["decimal"] * len(rows), rows, 20.0, (1e-9, 1e-12))


def neutral(rtol: float, quick: bool) -> Iterator[Row]:
    """Typed lengths and multiples of 2^-20 in turn, 100 s by the default method."""
    rng, count = np.random.default_rng(5), 60 if quick else 3000
    kinds = {"decimal": _typed, "binary": random_starts.random_lengths}
    names = [*kinds] * (count // 2)
    rows = [kinds[name](rng) for name in names]
    yield from _four_bars(rng, names, rows, 100.0, (rtol,), ("auto",))


def _typed(rng: np.random.Generator) -> tuple[Sequence[float], Sequence[float]]:
    """Lengths of one decimal, and signs."""
    while True:
        l, s = np.round(rng.uniform(0.4, 9.0, 3), 1), rng.choice([-1.0, 1.0], 3)
        ground = round(float(l @ s), 1)
        a0, a1, a2 = l * s
        bends = (a1 * a2 / a0) ** 2 - (a2 * a2 / a0 + a2) * (a1 * a1 / a0 + a1)
        if ground > 0.3 and bends > 1e-3:
            return [*l, ground], s


def _four_bars(
    rng: np.random.Generator, names: list[str], rows: list[tuple[Sequence[float], Sequence[float]]],
    t_end: float, rtols: Sequence[float], methods: Sequence[str] = METHODS,
) -> Iterator[Row]:  # fmt: skip
    lengths, signs = map(np.array, zip(*rows, strict=True))
    translates = np.array([name in ("rhombus", "parallelogram") for name in names])
    geometry = Geometry(lengths, signs, np.tile([1.0, 2.0, 3.0], (len(rows), 1)), translates)
    given = random_starts.trials_of(rng, tuple(names), geometry, t_end)
    yield from random_starts.judged(given, methods, rtols)


# -- five-bars: two freedoms, around the apex of a cone -------------------------------------------


def five_bars(quick: bool) -> Iterator[Row]:
    """Random lengths, every other neutral, against SymPy's Kane equations.

    Of two freedoms many motions are chaotic: where a change of the start by rtol moves the end
    beyond any limit, nothing can be told.
    """
    model, cases = mechc.compile(five_bar()), 0
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        lengths = np.round(rng.uniform(0.5, 2.0, 4), 2)
        sum_of = abs(float(lengths @ rng.choice([-1.0, 1.0], 4)))
        ground = round(sum_of, 2) if seed % 2 and 0.4 < sum_of < 4.0 else 1.5
        params = dict(zip("abcdg", [*lengths.tolist(), ground], strict=True))
        angles = dict(zip(("q_0", "q_1"), rng.uniform(-3, 3, 2), strict=True))
        speeds = {"u_0": 1.0, "u_1": -1.0}
        try:
            start = model.assemble(angles, speeds, params=params)
        except mechc.MechcError:
            continue  # these lengths do not reach
        near = dict(zip(model.coordinates[2:], start[2:4].tolist(), strict=True))
        pushed = [model.assemble({**angles, "q_0": angles["q_0"] + SHIFT}, speeds, near, params),
                  model.assemble(angles, {**speeds, "u_0": 1.0 + SHIFT}, near, params)]  # fmt: skip
        yield from _five_bar(model, seed, start, pushed, params)
        cases += 1
        if cases == (2 if quick else 40):
            return


def _five_bar(
    model: mechc.Model, seed: int, start: Array, pushed: list[Array], params: dict[str, float]
) -> Iterator[Row]:
    exact, loose = (five_bar_end(start, params, tolerance) for tolerance in (1e-13, 1e-11))
    scale = speeds_apart(exact, 4)
    ends = [five_bar_end(each, params, 1e-11) for each in pushed]
    condition = max(float((np.abs(end - exact) / scale).max()) / SHIFT for end in ends)
    for told, _, rtol, found in runs(model, 5.0, start, params, rtols=(1e-6, 1e-9, 1e-12)):
        case = f"five-bar {seed}, {told}"
        if rtol * condition > LARGEST:
            yield row(case, "unjudged", status=UNTOLD, condition=condition)
            continue
        limit = limit_of(rtol, condition) + float((np.abs(exact - loose) / scale).max())
        yield verdict(case, found, exact, limit, scale, condition=condition)


@cache
def _rates_of_the_five_bar() -> tuple[Callable[..., list[float]], list[str]]:
    """The rates of a state and parameters, by SymPy's KanesMethod, and the parameters' names."""
    equations = derive(five_bar(), {})
    return equations.rates().function("math"), [p.name for p in equations.parameters]


def five_bar_end(start: Array, params: dict[str, float], tolerance: float, t: float = 5.0) -> Array:
    """The state at a time; NaN where the integration fails."""
    rates, names = _rates_of_the_five_bar()
    given = [params[name] for name in names]
    run = solve_ivp(lambda _, y: rates(*y.tolist(), *given), (0.0, t), start, method="DOP853",
                    rtol=tolerance, atol=tolerance)  # fmt: skip
    return run.y[:, -1] if run.success else np.full_like(start, np.nan)


# -- rows of windows: all couplers and uprights in line at once -----------------------------------


def _windows(counts: Sequence[int], rtols: Sequence[float]) -> Iterator[Row]:
    for count in counts:
        model = mechc.compile(windows(count))
        exact, ways = first_upright(count, np.array([20.0]))[0], {"methods": ("auto",)}
        start, params = upright_start(count), {"tilt": 0.3}
        for told, _, rtol, found in runs(model, 20.0, start, params, **ways, rtols=rtols):
            limit = limit_of(rtol, WINDOWS_CONDITION, max(ROUNDING, TOGETHER))
            sol = None if isinstance(found, str) else found
            figures = sol and {"t": sol.t[-1], "steps": sol.stats["steps"],
                               "crossings": len(sol.change_points)}  # fmt: skip
            yield verdict(f"{count} windows, {told}", found, exact, limit, observe=lambda sol:
                          np.array([np.cos(sol.q[-1, 0]), np.sin(sol.q[-1, 0])]),
                          **figures or {})  # fmt: skip
