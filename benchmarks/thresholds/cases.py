"""What tells what a constant does: stress families, smooth motions, loops to be closed.

Output of one pass: words by family, steps and evaluations of all runs, the error of every run that
has one.  Judges' own motions do not depend on mechc, and are computed once.
"""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any
from unittest.mock import patch

import numpy as np

import mechc

from .. import problems
from ..references.closure_curve import Geometry
from ..references.linkage_curve import PlanarLinkage
from ..stability import ends
from ..stability.families import FAMILIES, Family
from ..stability.judge import Row, bounded, row
from ..stability.misses import window_misses
from ..stability.stress import family_rows
from ..suite.own_cases import single
from .constants import Constant

SMOOTH = ("pendulum_2", "four_bar_regular", "slider_crank", "heavy_top", "flyball_governor",
          "windows_2", "bicycle")  # fmt: skip
TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12)
LOW_ORDER, TIGHTEST_OF_LOW_ORDER = ("dopri5", "radau5"), 1e-7
MISSES = 12  # a run of each takes half a second
LEFT_OUT = ("neutral four-bars 1e-9", "neutral four-bars 1e-12", "bad values", "bad arguments")
LOOSE = 1e3  # times the tolerance: a smooth motion's error
ROUNDING = 1e-10


def smooth_motions(quick: bool) -> Iterator[Row]:
    for name in SMOOTH:
        problem = problems.problem(name)
        for case in single(problem, TOLERANCES):
            if case.method in LOW_ORDER and case.tol < TIGHTEST_OF_LOW_ORDER:
                continue
            final, said = case.state(found := case.run()), case.word(found)
            told = f"{name}, {case.method}, {case.tol:g}"
            if final is None:
                yield row(told, "flagged", status=said)
                continue
            error = float((np.abs(final - problem.exact) / problem.scale).max())
            yield bounded(told, error, LOOSE * case.tol + ROUNDING)


def closed_loops(quick: bool) -> Iterator[Row]:
    """Both assemblies of a four-bar and of a slider-crank, or none, in metres and micrometres."""
    rng = np.random.default_rng(5)
    four_bar, slider = mechc.load("four_bar"), mechc.load("slider_crank")
    for unit in (1.0, 1e6):
        for i in range(100):
            lengths, angle = rng.uniform(0.3, 3.0, 4), rng.uniform(-np.pi, np.pi)
            p = {f"l_{k}": unit * float(l) for k, l in enumerate(lengths)}
            there = np.hypot(lengths[0] * np.cos(angle) - lengths[3], lengths[0] * np.sin(angle))
            inside = abs(lengths[1] - lengths[2]) < there < lengths[1] + lengths[2]
            yield _counted(f"four-bar {i}, {unit:g} m", four_bar, angle, p, 2 if inside else 0)
            low = abs(lengths[0] * np.sin(angle))
            p = {"l_0": unit * float(lengths[0]), "l_1": unit * float(lengths[1])}
            yield _counted(f"slider {i}, {unit:g} m", slider, angle, p, 2 * (low < lengths[1]))


def _counted(
    case: str, model: mechc.Model, angle: float, params: dict[str, float], exact: int
) -> Row:
    try:
        found = len(model.assemblies({model.coordinates[0]: angle}, params=params))
    except mechc.AssemblyError:
        found = 0
    return row(case, "right" if found == exact else "WRONG", found=found)


def positions(quick: bool) -> Iterator[Row]:
    """Coupler curves of a four-bar through a whole turn of its crank, and through change points."""
    model, turn = mechc.load("four_bar"), np.linspace(0, 2 * np.pi, 181)
    for l_3 in (3.5, 3.9, 3.999, 4.0):
        found = model.sweep_positions("theta_0", turn, params={"l_3": l_3})
        q, l = np.asarray(found.q), (1.0, 2.0, 3.0)
        x = sum(f * np.cos(q[:, k]) for k, f in enumerate(l)) - l_3
        y = sum(f * np.sin(q[:, k]) for k, f in enumerate(l))
        yield bounded(f"l_3 = {l_3}", float(np.hypot(x, y).max()), 1e-12)


def derivatives(quick: bool) -> Iterator[Row]:
    """Of a four-bar by the adjoint and along a direction."""
    model = mechc.load("four_bar", outputs=["sensitivities"])
    along = {"l_3": 1.0, "m_1": 1.0, "theta_0": -0.5}
    for method in ("gauss8", "dop853", "radau5"):
        given = (2.0, {"theta_0": 1.48, "omega_0": 0.3}, {"l_3": 3.5})
        _, dy = model.jvp(*given, along=along, method=method)
        y, pull = model.vjp(*given, by=[*along], method=method)
        back = pull(np.ones_like(y))
        off = sum(along[name] * back[name] for name in along) - dy.sum()
        yield bounded(method, abs(float(off)) / np.abs(dy).max(), 1e-9)


def window_near_misses(quick: bool) -> Iterator[Row]:
    return map(window_misses.case, range(MISSES))


CASES: dict[str, Family] = {
    **{name: family for name, family in FAMILIES.items() if name not in LEFT_OUT},
    "window near misses": Family("few of them", window_near_misses),
    "smooth motions": Family("errors in proportion to the tolerance", smooth_motions),
    "closed loops": Family("as many assemblies as there are", closed_loops),
    "positions": Family("a curve followed", positions),
    "derivatives": Family("one number forwards and backwards", derivatives),
}
CLOSING, DERIVATIVES = ("closed loops", "positions"), ("derivatives",)
STIFF = ("stiff springs", "smooth motions", "once silent", "tolerances", "derivatives")
MOTIONS = tuple(name for name in CASES if name not in CLOSING)
OF_METHODS = ("smooth motions", "tolerances", "stiff springs", "equal lengths")
CROSSINGS = ("equal lengths", "decimal lengths", "redundant constraints")
SHORT = (*CROSSINGS, "length ratios", "units", "tolerances", "smooth motions")
OF_SINGULARITIES = ("near misses", *CROSSINGS)
SHORT_CASES = tuple(dict.fromkeys((*OF_SINGULARITIES, *SHORT, *OF_METHODS, *CLOSING, *DERIVATIVES)))


def cases_of(constant: Constant, full: bool) -> tuple[str, ...]:
    """Names of the cases in whose code it is; those of seconds, or all of them."""
    folder, name = constant.header.partition("/")[0], constant.name
    if folder == "closing":
        return CLOSING
    if folder in ("variational", "adjoint"):
        return DERIVATIVES
    if "RADAU" in name:
        return tuple(each for each in STIFF if full or each in SHORT_CASES)
    if folder == "series" or "TAYLOR" in name:
        return ("smooth motions",)
    if full:
        return MOTIONS
    if folder == "singularities":
        return OF_SINGULARITIES
    return OF_METHODS if folder in ("methods", "run", "lockstep") else SHORT


WORK = ("steps", "evaluations")
JUDGES: tuple[tuple[Any, str], ...] = (
    (Geometry, "integrate"),
    (PlanarLinkage, "integrate"),
    (ends, "_change_points"),
)


def remember_judges() -> None:
    """Their motions are computed once in this process and in those forked from it."""
    for judge, name in JUDGES:
        setattr(judge, name, _remembered(getattr(judge, name)))


def _remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    known: dict[bytes, Any] = {}

    @wraps(function)
    def of(*given: Any) -> Any:
        key = pickle.dumps(given)
        if key not in known:
            known[key] = function(*given)
        return known[key]

    return of


@contextmanager
def _counting() -> Iterator[dict[str, int]]:
    """Steps, also those rejected, and evaluations of every run meanwhile."""
    work, simulate = dict.fromkeys(WORK, 0), mechc.Model.simulate

    def counted(*given: Any, **policy: Any) -> Any:
        run = simulate(*given, **policy)
        work["steps"] += run.stats["steps"] + run.stats["rejected"]
        work["evaluations"] += run.stats["rhs_evaluations"]
        return run

    with patch.object(mechc.Model, "simulate", counted):
        yield work


def measured(names: Sequence[str]) -> dict[str, Any]:
    """One pass over the cases of these names."""
    found: dict[str, dict[str, Any]] = {what: {} for what in ("words", "errors", *WORK)}
    bad: list[str] = []
    for name in names:
        with _counting() as work:
            rows, _ = family_rows(name, True, CASES)
        for what in WORK:
            found[what][name] = work[what]
        found["words"][name] = Counter(each["word"] for each in rows)
        bad += [
            f"{r['word']} {name}: {r['case']}" for r in rows if r["word"] in ("WRONG", "flagged")
        ]
        found["errors"] |= {f"{name}: {r['case']}": r["error"] for r in rows if r.get("error")}
    return {**found, "bad": bad}
