"""The families of the stress suite: the promise of each, and its runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from . import (
    batches,
    crossings,
    ends,
    exact_motion,
    geometry,
    laws,
    long_runs,
    random_starts,
    stiff,
    values,
)
from .drawn_laws import motions
from .judge import Row
from .misses import near_misses, window_misses
from .silent import cases, redundant_loops

TIMES_START = "of 100 rtol + 2.5e-10 times the condition"


@dataclass(frozen=True)
class Family:
    """A promise and the runs that try it.

    Parameters
    ----------
    rows
        Gives the rows; True for few of them.
    least
        The share of the runs that must be right: a suite of refusals would pass everything else.
    unit
        What the worst error is a part of.
    note
        What the rows say beyond the table.
    drawn
        The rows of seeds, where a family is drawn by seeds.
    """

    promise: str
    rows: Callable[[bool], Iterator[Row]]
    least: float = 1.0
    unit: str = TIMES_START
    note: Callable[[list[Row]], str] = lambda rows: ""
    drawn: Callable[[range], Iterator[Row]] | None = None


FAMILIES: dict[str, Family] = {
    "change points": Family(
        "random starts run straight through every change point, at every tolerance",
        random_starts.random_starts, 0.97, note=random_starts.which_failed,
    ),
    "near misses": Family(
        "l_3 = 4 +- 10^-k: the bend of the 40-digit motion, or a status where doubles cannot tell",
        near_misses.near_misses, 0.85, TIMES_START + ", and rounding of the closure",
    ),
    "window near misses": Family(
        "two and three windows in a row that miss their change points by 1e-3 to 1e-15 m",
        window_misses.window_misses, 0.8, TIMES_START + ", and rounding of the closure",
        drawn=partial(map, window_misses.case),
    ),
    "once silent": Family(
        "runs that once ended wrong without a word: each with its exact answer", cases.once_silent,
        0.98, unit="of its limit: " + TIMES_START + ", closure, drift, times",
    ),
    "exact motion": Family(
        "through change points for 20 s and 100 s, by every method at every tolerance",
        exact_motion.exact_motion, unit="of the limit that was promised",
    ),
    "other change points": Family(
        "folding slider-cranks and rows of windows keep to their branch",
        crossings.other_mechanisms, 0.9,
    ),
    "equal lengths": Family(
        "rhombi, parallelograms and kites at 1e-4 and 1e-12 pass their change points",
        crossings.equal_lengths, 0.98,
    ),
    "decimal lengths": Family(
        "lengths as 7.6, 3.8, 7.7 m that add up as typed make a change point",
        crossings.decimal_lengths, 0.99,
    ),
    "neutral four-bars 1e-9": Family(
        "typed and binary lengths of change points, 100 s at rtol 1e-9",
        partial(crossings.neutral, 1e-9), 0.998,
    ),
    "neutral four-bars 1e-12": Family(
        "the same at 1e-12", partial(crossings.neutral, 1e-12), 0.99,
    ),
    "ends near": Family(
        "runs that end within 1e-4 s of a change point, before it or after it", ends.ends, 0.98,
        note=random_starts.which_failed,
    ),
    "starts near": Family(
        "runs that start within 1e-4 s before a change point", ends.starts, 0.99,
        note=random_starts.which_failed,
    ),
    "five-bars": Family(
        "two freedoms: every motion goes around its critical configurations", crossings.five_bars,
        unit=TIMES_START + ", and the judge's error",
    ),
    "whole turns": Family(
        "the four-bar 1e3 to 1e6 turns on moves as it does without them", exact_motion.turns,
        unit=TIMES_START + ", and the last digit of its angles",
    ),
    "dead points": Family(
        "links in line without a change point are nothing special", geometry.dead_points
    ),
    "mass ratios": Family("masses from 1e-8 to 1e8 kg in one linkage", geometry.mass_ratios),
    "length ratios": Family(
        "a link of 1e-1 to 1e-8 m among links of metres", geometry.length_ratios, 0.95,
        TIMES_START + ", and an ulp of the longest link over the shortest",
    ),
    "units": Family(
        "nanometres to megametres, 1e-15 to 1e15 kg, microseconds to weeks: one motion",
        geometry.units,
    ),
    "redundant constraints": Family(
        "a second rocker, and five rows in space where two do: the motion of the plain four-bar",
        geometry.redundant, 0.8,
    ),
    "redundant loops": Family(
        "Bennett and Bricard on their closed curves, cranks and wheels as pendulums, 10 s",
        redundant_loops.redundant_loops, unit=TIMES_START + ", or of a closure of 1e-13",
    ),
    "a million periods": Family(
        "phase, energy and closure after a million swings are those of the closed form",
        long_runs.periods,
    ),
    "hidden jumps": Family(
        "angles wrapped by atan2, atan, asin, acos, and roots that touch zero: steps end there",
        laws.hidden_jumps, 0.95, unit=TIMES_START + ", speeds over the largest",
    ),
    "narrow features": Family(
        "a pulse of 2 ms in 20 s from rest, a bump of 2 mm in free flight: seen by every method",
        laws.narrow_features, 0.9, unit=TIMES_START + ", speeds over the largest",
    ),
    "random laws": Family(
        "sums, products and compositions of all functions, each beside its own motion by SciPy",
        motions.random_laws, 0.98, unit=TIMES_START + ", speeds over the largest",
        drawn=motions.of_seeds,
    ),
    "stiff springs": Family(
        "stiffness up to 1e12: the modes of the linear system, the limit of the other",
        stiff.springs, 0.8, TIMES_START + ", and the bend of the elbow",
    ),
    "tolerances": Family(
        "from 1e-2 to 1e-15 the right motion, on both reference linkages", geometry.tolerances
    ),
    "open starts": Family(
        "a start off by rounding is closed, one off by more is refused", geometry.open_starts, 0.4,
        "of the condition times 100 (rtol and gap)",
    ),
    "bad values": Family(
        "zero, subnormal, huge, infinite, NaN, negative: refused, flagged, or with its energy kept",
        values.bad_values, 0.1, "of a drift of 1e-6 of the largest kinetic energy",
    ),
    "bad arguments": Family(
        "states, times and tolerances that cannot be are refused", values.bad_arguments, 0.0, ""
    ),
    "batches": Family(
        "a member of a batch ends as its own simulation does, to the last bit", batches.batches,
        0.85, "of half an ulp of any component",
    ),
}  # fmt: skip
