"""Loops with rows that are redundant on closed configurations only, 10 s by every method.

Bennett's and Bricard's loops against their motion on the closed curve in 30 digits
(references/closed_loops.py); three and five parallel cranks, and three wheels of a locomotive with
its two rods, against the pendulum that they are (Jacobi's functions), swinging and turning over.
Cranks and bar come in line as they go: the cranks' change points; rods of wheels take turns there.

Right: unit vectors of the angles and speeds over the largest within (100 rtol + 2.5e-10) times the
condition, and the loops closed at every step to 1e-13 of the longest rod and the last digit of
angles of many turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import mpmath as mp
import numpy as np
from mechc_codegen.description.mechanism import Mechanism
from scipy.integrate import solve_ivp

import mechc

from ...problems.closed_loops import bennett, bricard, locomotive, parallel_cranks
from ...problems.data import reference
from ...problems.problem import Array
from ...references.arithmetic import numbers
from ...references.closed_loops import LOOPS
from ..judge import Row, limit_of, runs, verdict
from ..long_runs import swing
from ..misses.on_curve import fastest, vectors
from .cases import closed

METHODS = ("auto", "dopri5", "dop853", "gauss8", "radau5")
RTOLS = tuple(10.0**-k for k in range(3, 13))
T_END, SHIFT = 10.0, 1e-6
SPEED = 9.0  # rad/s: over the top, and not slowly


@dataclass(frozen=True)
class Motion:
    """A start, its exact end, and how an error of the start grows until then.

    ``longest``: of the rods, m; with two cranks of 1 m it is a loop, and its angle a sum of two.
    """

    name: str
    model: mechc.Model
    start: Array
    exact: Array
    condition: float
    longest: float


def redundant_loops(quick: bool) -> Iterator[Row]:
    """Three cranks, and Bennett's loop alone, at two tolerances if quick."""
    for motion in _motions(quick):
        yield from judged(motion, (1e-3, 1e-9) if quick else RTOLS)


def judged(motion: Motion, rtols: Sequence[float]) -> Iterator[Row]:
    exact, ways = vectors(motion.exact), {"methods": METHODS, "rtols": rtols, "dense": False}
    for told, method, rtol, found in runs(motion.model, T_END, motion.start, **ways):
        case, limit = f"{motion.name}, {told}", limit_of(rtol, motion.condition)
        figures = {"method": method, "rtol": rtol, "condition": motion.condition}
        yield verdict(case, found, exact, limit, fastest(exact),
                      lambda sol: vectors(sol.y[-1]), **figures)  # fmt: skip
        if not isinstance(found, str) and found.status.ok:
            yield closed(case, found, motion.longest, 2.0 + 2 * motion.longest)


def _motions(quick: bool) -> Iterator[Motion]:
    yield from _pendulums("three cranks", parallel_cranks(3), *_of_cranks(3), 1.0, 2.0)
    yield _on_closed_curve("bennett", bennett, 2.0)
    if quick:
        return
    yield _on_closed_curve("bricard", bricard, 1.0)
    yield from _pendulums("five cranks", parallel_cranks(5), *_of_cranks(5), 1.0, 4.0)
    yield from _pendulums("locomotive", locomotive(3), *_of_wheels(3), -0.3, 2.0)


# -- on closed curves -----------------------------------------------------------------------------


def _on_closed_curve(name: str, build: Callable[[], Mechanism], longest: float) -> Motion:
    start, exact = (np.array(reference("closed_loops")[name][at], float) for at in ("start", "end"))
    return Motion(name, mechc.compile(build()), start, exact, _growth(name), longest)


def _growth(name: str) -> float:
    """Of an error of the start along the curve, and of one of the speed, in doubles."""
    loop = LOOPS[name]()

    def end(along: float, speed: float) -> Array:
        with mp.workprec(53):
            a, b = numbers(loop.first)
            by_a, by_b = loop.slopes(a, b)
            run = solve_ivp(
                lambda t, y: [float(x) for x in loop.rates(numbers(y))], (0.0, T_END),
                [float(a - along * by_b), float(b + along * by_a), speed],
                method="DOP853", rtol=1e-8, atol=1e-8,
            )  # fmt: skip
            return vectors(np.array([float(x) for x in loop.state(numbers(run.y[:, -1]))]))

    exact = end(0.0, 0.0)
    apart = [np.abs((end(*shift) - exact) / fastest(exact)).max() for shift in np.eye(2) * SHIFT]
    return max(apart) / SHIFT


# -- pendulums ------------------------------------------------------------------------------------


def _of_cranks(count: int) -> tuple[float, float]:
    """Square of the frequency of small swings; the crank's angle from hanging, at zero.

    Cranks of 1 kg turn, the bar of 1 kg goes along with their ends.
    """
    return 9.81 * (count / 2 + 1) / (count / 3 + 1), np.pi / 2


def _of_wheels(count: int) -> tuple[float, float]:
    """Discs turn, two rods go along with pins a right angle apart."""
    return 9.81 * np.sqrt(2.0) / (count / 2 + 2), 3 * np.pi / 4


def _pendulums(
    name: str, mechanism: Mechanism, square: float, hanging: float, angle: float, longest: float
) -> Iterator[Motion]:
    """From rest, and turning over the top."""
    model = mechc.compile(mechanism)
    signs = np.array([-1.0 if n.startswith(("q_bar", "q_rod")) else 1.0 for n in model.coordinates])
    both: dict[str, tuple[Callable[[float, float], tuple[float, float]], float]] = {
        "swings": (partial(swinging, square), 0.0), "turns": (partial(turning, square), SPEED),
    }  # fmt: skip
    for kind, (end, speed) in both.items():
        state = partial(_state, signs, end, hanging)
        exact = state(angle, speed)
        shifts: Sequence[tuple[float, float]] = [(SHIFT, 0.0), (0.0, SHIFT * (speed > 0))]
        moved = [vectors(state(angle + a, speed + u)) - vectors(exact) for a, u in shifts]
        condition = max(np.abs(each / fastest(vectors(exact))).max() for each in moved) / SHIFT
        start = np.concatenate([signs * angle, signs * speed])
        yield Motion(f"{name} that {kind}", model, start, exact, float(condition), longest)


def _state(
    signs: Array, end: Callable[[float, float], tuple[float, float]], hanging: float, angle: float,
    speed: float,
) -> Array:  # fmt: skip
    """Bars keep their directions, and their angles are counted from the cranks'."""
    last, rate = end(angle + hanging, speed)
    return np.concatenate([signs * (last - hanging), signs * rate])


def swinging(square: float, angle: float, speed: float) -> tuple[float, float]:
    """Angle from hanging and its rate after 10 s, from rest."""
    pace = mp.sqrt(square / mp.mpf(9.81))  # of the pendulum of 1 m
    last, rate = swing(mp.mpf(angle), T_END * pace)
    return float(last), float(pace * rate)


def turning(square: float, angle: float, speed: float) -> tuple[float, float]:
    """The same of one that turns over: sin(x/2) = sn(v t/2, k), v the speed at the bottom.

    Whole turns are left out.
    """
    with mp.workdps(30):
        half = mp.mpf(angle) / 2
        v = mp.sqrt(mp.mpf(speed) ** 2 + 4 * square * mp.sin(half) ** 2)
        m = 4 * square / v**2
        u = mp.ellipf(half, m) + v * T_END / 2
        sn, cn, dn = (mp.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))
        return float(2 * mp.atan2(sn, cn)), float(v * dn)
