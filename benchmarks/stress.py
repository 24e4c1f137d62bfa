"""What becomes of the four-bar under stress?  Right, refused, or ended with a status: never else.

    python benchmarks/stress.py

Units, mass and length ratios, tolerances, dead points, starts off the loop, and parameters at
zero, subnormal, infinite and NaN, by ``auto`` and ``dop853``.  Exact states judge the reference
scenes; else the judge is SciPy's DOP853 at 1e-13 on equations written independently
(_four_bar_forms.py), with its own error measured, and conditions by differences.  Right: within
(100 rtol + 2.5e-10) condition.  Exits with 1 where anything is wrong without a word.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from _four_bar_forms import accelerations
from _scene import reference, write
from _timing import Array
from scipy.integrate import solve_ivp

import mechc

MODEL = mechc.load("four_bar")
TRIED = ("auto", "dop853")
REGULAR: Mapping[str, float] = {"l_3": 3.5}
CONDITION = {"regular": 5.8, "change_point": 80.0}
SINGLE = {"zero": 0.0, "subnormal": 5e-324, "infinite": np.inf, "NaN": np.nan, "negative": -1.0}
EVALUATIONS = 40_000
Row = dict[str, Any]
REFUSALS = (mechc.MechcError, ValueError)


def main() -> int:
    rows: list[Row] = []
    for part in (
        units,
        tolerances,
        mass_ratios,
        length_ratios,
        dead_points,
        open_starts,
        bad_values,
    ):
        rows += part()
    print(f"{'family':16s}{'runs':>6s}{'right':>7s}{'refused':>9s}{'flagged':>9s}{'unjudged':>10s}{'WRONG':>7s}"
          "  worst error / limit")  # fmt: skip
    for family in dict.fromkeys(row["family"] for row in rows):
        some = [row for row in rows if row["family"] == family]
        words = [row["word"] for row in some]
        worst = max(some, key=lambda row: row.get("excess") or 0.0)
        print(
            f"{family:16s}{len(some):6d}{words.count('right'):7d}{words.count('refused'):9d}"
            f"{words.count('flagged'):9d}{words.count('unjudged'):10d}{words.count('WRONG'):7d}"
            f"  {worst.get('excess') or 0.0:.2g}: {worst['case']}"
        )
    wrong = [row for row in rows if row["word"] == "WRONG"]
    for row in wrong:
        print("WRONG:", row)
    write("stress", rows)
    return 1 if wrong else 0


# -- families ---------------------------------------------------------------------------------


def units() -> Iterator[Row]:
    """Lengths with gravity, or masses, in other units: the same angles at 20 s."""
    exact = np.array(reference("four_bar_regular")["states"]["20.0"], float)
    for scale in (1e-9, 1e-6, 1e-3, 1e3, 1e6):
        lengths = {f"l_{k}": scale * l for k, l in enumerate((1.0, 2.0, 3.0, 3.5))}
        params = {**lengths, "g": 9.81 * scale}
        yield from _runs("unit of length", f"{scale:g} m", params, 20.0, exact, 5.8)
    for scale in (1e-15, 1e-8, 1e8, 1e15):
        params = {**REGULAR, **{f"m_{k}": scale * (k + 1) for k in range(3)}}
        yield from _runs("unit of mass", f"{scale:g} kg", params, 20.0, exact, 5.8)


def tolerances() -> Iterator[Row]:
    for name, params in (("regular", REGULAR), ("change_point", {"l_3": 4.0})):
        exact = np.array(reference(f"four_bar_{name}")["states"]["20.0"], float)
        rtols = [10.0**-k for k in range(2, 16)]
        yield from _runs("tolerance", name, params, 20.0, exact, CONDITION[name], rtols)


def mass_ratios() -> Iterator[Row]:
    for k in range(3):
        for mass in (1e-8, 1e-4, 1e4, 1e8):
            params = {**REGULAR, f"m_{k}": mass}
            yield from _judged("mass ratio", f"m_{k} = {mass:g} kg", params, 5.0)


def length_ratios() -> Iterator[Row]:
    """A crank ever shorter, for as many of its own periods."""
    for k in (1, 2, 4, 6, 8):
        crank = 10.0**-k
        params = {"l_0": crank, "l_1": 3.0, "l_2": 3.0, "l_3": 3.5}
        yield from _judged("length ratio", f"l_0 = {crank:g} m", params, 5.0 * crank**0.5)


def dead_points() -> Iterator[Row]:
    """Coupler and rocker in line at both ends of the crank's swing: there and back again."""
    params = {"l_0": 3.0, "l_1": 1.2, "l_2": 2.0, "l_3": 4.0}
    y0 = MODEL.assemble({"theta_0": 0.5}, speeds={"omega_0": 3.0}, params=params)
    for method in TRIED:
        for rtol in (1e-6, 1e-9, 1e-11):
            case = f"{method}, {rtol:g}"
            there = MODEL.simulate((0.0, 3.0), y0, params, rtol=rtol, method=method)
            if not there.status.ok:
                yield _row("dead points", case, "flagged", status=there.status.code)
                continue
            bent = np.sin(there.q[:, 1] - there.q[:, 2])
            if not bent.min() < 0 < bent.max():
                raise RuntimeError("the scene misses its dead points")
            back = MODEL.simulate((3.0, 0.0), there.y[-1], params, rtol=rtol, method=method)
            yield _verdict("dead points", case, back, y0, (100 * rtol + 2.5e-10) * 100)


def open_starts() -> Iterator[Row]:
    """Off by rounding: projected; off by more: refused with the gap."""
    y0 = MODEL.assemble({"theta_0": 1.0}, params=REGULAR)
    for gap in (1e-16, 1e-13, 1e-10, 1e-7, 1e-4, 1e-2, 1.0):
        start = y0 + gap * np.array([0, 1.0, 0, 0, 0, 0])
        for method in TRIED:
            sol = _attempt(REGULAR, start, 1.0, 1e-9, method)
            case = f"theta_1 off by {gap:g}, {method}"
            if isinstance(sol, str):
                yield _row("open start", case, "refused" if gap > 1e-9 else "WRONG", status=sol)
            else:
                closed = sol.closure.max() < 1e-12 and gap < 1e-6
                yield _row("open start", case, "right" if closed else "WRONG")


def bad_values() -> Iterator[Row]:
    """Whatever a parameter is: refused, flagged, or a motion that stays closed and finite."""
    for name in MODEL.parameters:
        for word, value in SINGLE.items():
            case, params = f"{name} {word}", {**REGULAR, name: value}
            try:
                y0 = MODEL.assemble({"theta_0": 1.0}, params=params)
                sol = MODEL.simulate(1.0, y0, params)
            except REFUSALS as error:
                yield _row("bad value", case, "refused", status=str(error))
                continue
            if not sol.status.ok:
                yield _row("bad value", case, "flagged", status=sol.status.code)
                continue
            sound = np.isfinite(sol.y).all() and sol.closure.max() < 1e-12
            drift = _drift(sol, params)
            yield _row("bad value", case, "right" if sound and drift < 1e-6 else "WRONG",
                       status=f"energy {drift:.1e}")  # fmt: skip


def _drift(sol: mechc.Solution, params: Mapping[str, float]) -> float:
    """Departure of the energy over the largest kinetic energy; zero where there is none."""
    departure = float(np.abs(sol.energy - sol.energy[0]).max())
    kinetic = float(np.max(sol.model.kinetic_energy(sol.y, params)))
    return departure / kinetic if kinetic > 0 else departure


# -- runs and their judge ---------------------------------------------------------------------


def _runs(
    family: str, case: str, params: Mapping[str, float], t_end: float, exact: Array,
    condition: float, rtols: list[float] | None = None,
) -> Iterator[Row]:  # fmt: skip
    y0 = MODEL.assemble({"theta_0": np.radians(85)}, params=params)
    for method in TRIED:
        for rtol in rtols or [1e-6, 1e-8, 1e-10]:
            sol = _attempt(params, y0, t_end, rtol, method)
            limit = (100 * rtol + 2.5e-10) * condition
            yield _verdict(family, f"{case}, {method}, {rtol:g}", sol, exact, limit)


def _judged(family: str, case: str, params: Mapping[str, float], t_end: float) -> Iterator[Row]:
    """Against the independent equations, with their own error and condition."""
    y0 = MODEL.assemble({"theta_0": np.radians(85)}, params=params)
    p = MODEL._parameters.resolve(params).tolist()
    pushed = MODEL.assemble({"theta_0": np.radians(85) + 1e-6}, params=params)
    judged = [
        _judge(start, p, t_end, rtol) for start, rtol in ((y0, 1e-13), (y0, 1e-11), (pushed, 1e-12))
    ]
    if any(final is None for final in judged):
        yield _row(family, case, "unjudged", status="the judge's own run does not end")
        return
    exact, loose, beside = judged
    moved = np.abs(beside - exact).max() / 1e-6
    scale = np.where(np.arange(6) < 3, 1.0, max(1.0, float(np.abs(exact[3:]).max())))
    for method in TRIED:
        for rtol in (1e-6, 1e-8, 1e-10):
            sol = _attempt(params, y0, t_end, rtol, method)
            limit = (100 * rtol + 2.5e-10) * max(moved, 1.0) + np.abs(exact - loose).max()
            yield _verdict(family, f"{case}, {method}, {rtol:g}", sol, exact, limit, scale)


def _judge(y0: Array, p: list[float], t_end: float, rtol: float) -> Any:
    """The final state, or None where the unprojected equations take too many evaluations."""
    left = EVALUATIONS

    def rates(t: float, y: Array) -> Any:
        nonlocal left
        left -= 1
        if left < 0:
            raise StopIteration
        return [*y[3:], *accelerations(y[:3].tolist(), y[3:].tolist(), p, math.sin, math.cos)]

    try:
        return solve_ivp(rates, (0, t_end), y0, method="DOP853", rtol=rtol, atol=rtol).y[:, -1]
    except StopIteration:
        return None


def _attempt(
    params: Mapping[str, float], y0: Array, t_end: float, rtol: float, method: str
) -> mechc.Solution | str:
    """A solution, or why it was refused."""
    try:
        return MODEL.simulate(t_end, y0, params, rtol=rtol, method=method, max_steps=200_000)
    except REFUSALS as error:
        return str(error)


def _verdict(
    family: str, case: str, sol: mechc.Solution | str, exact: Array, limit: float,
    scale: Array | float = 1.0,
) -> Row:  # fmt: skip
    if isinstance(sol, str):
        return _row(family, case, "refused", status=sol)
    if not sol.status.ok:
        return _row(family, case, "flagged", status=sol.status.code)
    error = float((np.abs(sol.y[-1] - exact) / scale).max())
    return _row(family, case, "right" if error <= limit else "WRONG", error=error,
                limit=float(limit), excess=error / limit)  # fmt: skip


def _row(family: str, case: str, word: str, **figures: Any) -> Row:
    return {"family": family, "case": case, "word": word, **figures}


if __name__ == "__main__":
    sys.exit(main())
