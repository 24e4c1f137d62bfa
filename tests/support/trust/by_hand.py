"""Motions of the mass of doors.py by SciPy: equations written by hand, split at events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.trust.doors import FAR, TIMES, Y0, C, K, M

AWAY = 1e-10  # s: beyond a zero, so that it is not found again
Force = Callable[[float, float, float], float]


@dataclass
class Mass:
    """m u' = F(t, q, u) - k q - c u, until it is held.

    ``side`` and ``rub``: the sign of the sliding, and the force against it.
    """

    force: Force = lambda t, q, u: 2.0
    m: float = M
    k: float = K
    c: float = C
    rub: float = 0.0
    side: float = 1.0
    held: bool = False
    times: list[float] = field(default_factory=list)  # of events

    def pull(self, t: float, q: float) -> float:
        return self.force(t, q, 0.0) - self.k * q

    def rates(self, t: float, y: np.ndarray) -> list[float]:
        if self.held:
            return [0.0, 0.0]
        total = self.force(t, *y) - self.k * y[0] - self.c * y[1] - self.side * self.rub
        return [y[1], total / self.m]


Watch = tuple[Callable[[float, Any], float], float, Callable[[Mass, float, np.ndarray], np.ndarray]]


def follow(mass: Mass, watches: Sequence[Watch] = (), breaks: Sequence[float] = ()) -> np.ndarray:
    """States at TIMES; ``watches``: zero, its direction, what happens there; ``breaks``: of F."""
    states: dict[float, np.ndarray] = {}
    time, y, stops = 0.0, Y0.copy(), [*sorted(breaks), TIMES[-1]]
    zeros = []
    for g, direction, _ in watches:

        def zero(t: float, y: np.ndarray, g: Any = g) -> float:
            return float(g(t, y))

        zero.terminal, zero.direction = True, direction  # type: ignore[attr-defined]
        zeros.append(zero)
    while time < TIMES[-1]:
        end = next(s for s in stops if s > time)
        wanted = np.array([s for s in TIMES if time <= s <= end])
        piece = solve_ivp(
            mass.rates, (time, end), y, method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.01,
            t_eval=np.append(wanted, end) if not wanted.size or wanted[-1] < end else wanted,
            events=None if mass.held else zeros or None,
        )  # fmt: skip
        states |= dict(zip(piece.t, np.transpose(piece.y), strict=True))
        if piece.status == 0:
            time, y = end, piece.y[:, -1]
            continue
        hit = next(n for n, at in enumerate(piece.t_events) if at.size)
        time, y = float(piece.t_events[hit][-1]), piece.y_events[hit][-1]
        y = watches[hit][2](mass, time, y)
        y, time = y + AWAY * np.array(mass.rates(time, y)), time + AWAY
    return np.array([states[s] for s in TIMES])


def passed(mass: Mass, t: float, y: np.ndarray) -> np.ndarray:
    """Nothing happens; the time is noted."""
    mass.times.append(t)
    return y


def turned(share: float) -> Callable[[Mass, float, np.ndarray], np.ndarray]:
    """The speed is turned back; below 1e-7 m/s the mass is held."""

    def after(mass: Mass, t: float, y: np.ndarray) -> np.ndarray:
        mass.times.append(t)
        mass.held = share * abs(y[1]) < 1e-7
        return np.array([y[0], 0.0 if mass.held else -share * y[1]])

    return after


def softened(mass: Mass, t: float, y: np.ndarray) -> np.ndarray:
    """The spring has a quarter of its stiffness; the damper, which follows it, stays."""
    mass.times.append(t)
    mass.k /= 4
    return y


def stuck_or_back(mass: Mass, t: float, y: np.ndarray) -> np.ndarray:
    """Where sliding ends."""
    pull = mass.pull(t, y[0])
    mass.held, mass.side = abs(pull) <= mass.rub, float(np.sign(pull))
    return np.array([y[0], 0.0])


def at(place: float, by: int = 0) -> Callable[[float, np.ndarray], float]:
    return lambda t, y: y[by] - place


WALL = (at(FAR), 1.0)
