"""Laws with jumps that no sign shows, and with features narrower than the steps beside them.

A bead of 1 kg on a line.  ``hidden_jumps``: angles wrapped by atan2 and the like, and roots that
touch zero; judged by SciPy from one multiple of pi/2 to the next, with the smooth form that the law
has between them.  ``narrow_features``: pulses, bumps and smooth steps; judged by closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import mpmath as mp
import numpy as np
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, speeds
from scipy.integrate import solve_ivp
from sympy import (
    Expr,
    Float,
    Heaviside,
    Rational,
    acos,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    exp,
    pi,
    sign,
    sin,
    sqrt,
    tan,
    tanh,
)
from sympy.physics.mechanics import Particle, ReferenceFrame, dynamicsymbols

import mechc

from ..timing.cases import Array
from .judge import Row, limit_of, runs, speeds_apart, verdict

q, u = dynamicsymbols("q u")
t = dynamicsymbols._t
T_END = 20.0  # s
PLACE, WIDTH = 7.0, 0.002  # of a feature, in s or m
PUSH, SPEED = 50.0, 1.0  # m/s^2; m/s
STEEP = 1e-6  # s, of a step
METHODS = ("auto", "gauss8", "dop853", "dopri5", "radau5")
ANALYTIC = (*METHODS, "taylor")
Law = Callable[[float, float], float]  # of a place within a piece, and of q


def bead(force: Expr) -> Mechanism:
    """A bead under this force."""
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)
    point = origin.locatenew("P", q * r.x)
    point.set_vel(r, u * r.x)
    return Mechanism(
        name="bead",
        title="A bead on a line",
        frame=r,
        origin=origin,
        coordinates=coordinates([q], "m", "place"),
        speeds=speeds([u], "m/s", "velocity"),
        kinematics=(u,),
        parameters=(),
        bodies=(Particle("bead", point, 1),),
        loads=((point, force * r.x),),
        points=(origin, point),
    )


# -- jumps and corners ----------------------------------------------------------------------------


def _turns(place: float, of: float) -> float:
    return of * round(place / of)


WRAPPED: Mapping[str, tuple[Expr, Law]] = {
    "atan2": (atan2(sin(q), cos(q)), lambda place, x: x - _turns(place, 2 * np.pi)),
    "atan of tan": (atan(tan(q)), lambda place, x: x - _turns(place, np.pi)),
    "asin of sin": (
        asin(sin(q)),
        lambda place, x: (-1) ** round(place / np.pi) * (x - _turns(place, np.pi)),
    ),
    "acos of cos": (
        acos(cos(q)),
        lambda place, x: np.sign(place - _turns(place, 2 * np.pi)) * (x - _turns(place, 2 * np.pi)),
    ),
    "acos of a product": (
        acos(cos(q) * cos(1) + sin(q) * sin(1)),
        lambda place, x: (
            np.sign(place - 1 - _turns(place - 1, 2 * np.pi))
            * (x - 1 - _turns(place - 1, 2 * np.pi))
        ),
    ),
    "root": (
        q + q**3 + sqrt(q**2 + q**4) / 2,
        lambda place, x: x + x**3 + np.sign(place) * x * np.sqrt(1 + x * x) / 2,
    ),
    "sign of tan": (q + sign(tan(q)), lambda place, x: x + np.sign(np.tan(place))),
    "step of a pole": (q + Heaviside(1 / q), lambda place, x: x + (place > 0)),
    "root of a square written out": (
        q + sqrt(q**2 - pi * q + pi**2 / 4),
        lambda place, x: x + np.sign(place - np.pi / 2) * (x - np.pi / 2),
    ),
    "root of 1 - sin^2": (
        q + sqrt(1 - sin(q) ** 2),
        lambda place, x: x + np.sign(np.cos(place)) * np.cos(x),
    ),
    "root with a pole": (
        q + 1 / sqrt(1 + 1 / q**2),
        lambda place, x: x + np.sign(place) * x / np.sqrt(1 + x * x),
    ),
    "root of 1 - cos": (
        q + sqrt(1 - cos(q)),
        lambda place, x: x + np.sqrt(2) * np.sign(np.sin(place / 2)) * np.sin(x / 2),
    ),
}


def hidden_jumps(quick: bool) -> Iterator[Row]:
    """Forth and back over the jumps, from three starts."""
    for name, (law, smooth) in WRAPPED.items():
        model = mechc.compile(bead(-4 * law), outputs=())
        for speed in (3.5,) if quick else (1.5, 3.5, 6.0):
            y0 = np.array([1.2, speed])
            offset = 1.0 if "product" in name else 0.0
            exact, beside = (
                _piecewise(smooth, y0 + by, offset) for by in (np.zeros(2), np.array([1e-7, 0.0]))
            )
            condition = float(np.abs(beside - exact).max()) / 1e-7
            rtols = (1e-9,) if quick else (1e-5, 1e-7, 1e-9, 1e-11)
            for how, _, rtol, found in runs(
                model, 6.0, y0, methods=("auto", "gauss8"), rtols=rtols
            ):
                scale = speeds_apart(exact, 1)
                yield verdict(
                    f"{name}, {speed:g} m/s, {how}", found, exact, limit_of(rtol, condition), scale
                )


def _piecewise(smooth: Law, y: Array, offset: float) -> Array:
    """The state after 6 s, each piece between multiples of pi/2 by SciPy."""
    time, quarter = 0.0, np.pi / 2
    cell = int(np.floor((y[0] - offset) / quarter))
    while time < 6.0:
        place = offset + (cell + 0.5) * quarter
        sides = [lambda t, y, side=cell + k: y[0] - offset - side * quarter for k in (0, 1)]
        for k, side in enumerate(sides):
            side.terminal, side.direction = True, 2 * k - 1  # type: ignore[attr-defined]
        piece = solve_ivp(
            lambda t, y, place=place: [y[1], -4 * smooth(place, y[0])], (time, 6.0), y,
            events=sides, method="DOP853", rtol=1e-13, atol=1e-14,
        )  # fmt: skip
        time, y = float(piece.t[-1]), piece.y[:, -1]
        cell += 1 if piece.t_events[1].size else -1
    return y


# -- narrow features ------------------------------------------------------------------------------


def narrow_features(quick: bool) -> Iterator[Row]:
    """From rest until long after a pulse, or in free flight over a bump: 20 s."""
    for name, (law, y0, exact, methods) in _features().items():
        model = mechc.compile(bead(law), outputs=())
        rtols = (1e-9,) if quick else (1e-4, 1e-6, 1e-9, 1e-11)
        for how, _, rtol, found in runs(model, T_END, y0, methods=methods, rtols=rtols):
            limit = limit_of(rtol, T_END)  # a speed that is off moves the end by so much
            yield verdict(f"{name}, {how}", found, exact, limit, speeds_apart(exact, 1))
    yield from _beside_nodes(quick)


def _beside_nodes(quick: bool) -> Iterator[Row]:
    """From rest over a smooth step, wherever it lies in an integrator's step."""
    z = t / Float(STEEP)
    model = mechc.compile(bead(z / sqrt(1 + z**2)), outputs=())
    for before in np.linspace(2.0, 8.0, 15 if quick else 150):
        span = (-before, T_END - before)
        (speed, place), (last_speed, last_place) = (_root_step(x / STEEP) for x in span)
        exact = np.array([last_place - place - T_END * speed, last_speed - speed])
        limit = limit_of(1e-9, T_END)
        for how, _, _, found in runs(
            model, span, np.zeros(2), methods=("auto", "gauss8"), rtols=(1e-9,)
        ):
            case = f"step of a root {before:g} s after the start, {how}"
            yield verdict(case, found, exact, limit, speeds_apart(exact, 1))


def _root_step(z: float) -> tuple[float, float]:
    """The integral and the second integral of z / sqrt(1 + z^2), of this width."""
    root = np.sqrt(1 + z * z)
    return STEEP * root, STEEP**2 * (z * root + np.arcsinh(z)) / 2


def _features() -> dict[str, tuple[Expr, Array, Array, tuple[str, ...]]]:
    """Law, start, last state, and the methods that take it."""
    rest, left, w = np.zeros(2), T_END - PLACE, mp.mpf(WIDTH)
    z, flight = ((x - int(PLACE)) / Rational(WIDTH).limit_denominator(1000) for x in (t, q))
    gained = PUSH * WIDTH * float(mp.sqrt(mp.pi))  # by a pulse exp(-z^2)
    turned = PUSH * WIDTH * float(mp.pi)  # by a pulse 1 / cosh(z)
    stepped = PLACE**2 / 2 + left**2 / 2 - PLACE * T_END + float(w**2 * mp.pi**2 / 12)
    risen = float(left**2 / 2 + w**2 * mp.pi**2 / 6)
    on = 3.0  # rad/s, of a train of pulses sin(on t)^n
    return {
        "pulse": (PUSH * exp(-(z**2)), rest, np.array([gained * left, gained]), ANALYTIC),
        "pulse of cosh": (PUSH / cosh(z), rest, np.array([turned * left, turned]), METHODS),
        "step of tanh": (tanh(z), rest, np.array([stepped, left - PLACE]), METHODS),
        "logistic step": (1 / (1 + exp(-z)), rest, np.array([risen, left]), METHODS),
        "bump": (
            2 * flight / WIDTH / 10 * exp(-(flight**2)),
            np.array([0.0, SPEED]),
            np.array([SPEED * (T_END - _delay()), SPEED]),
            ANALYTIC,
        ),
        "fraction": (PUSH / (1 + z**2), rest, _fraction(), METHODS),
        "train": (sin(on * t) ** 2000, rest, _train(on, 2000), ANALYTIC),
    }


def _fraction() -> Array:
    """The motion from rest under PUSH / (1 + z^2), which has no end: its integrals."""
    first, last = -PLACE / WIDTH, (T_END - PLACE) / WIDTH
    turned = np.arctan(last) - np.arctan(first)
    logs = np.log1p(last**2) - np.log1p(first**2)
    moved = (T_END - PLACE) * turned - WIDTH * logs / 2
    gained: Array = PUSH * WIDTH * np.array([moved, turned])
    return gained


def _delay() -> float:
    """By how much a bump of the potential exp(-z^2) / 10 delays a bead: the integral of 1/u."""
    with mp.workdps(30):
        return float(
            WIDTH
            * mp.quad(
                lambda z: 1 / mp.sqrt(SPEED**2 - mp.exp(-(z**2)) / 5) - 1 / mp.mpf(SPEED),
                np.linspace(-9, 9, 19).tolist(),
            )
        )


def _train(on: float, n: int) -> Array:
    """Each pulse gives the integral of sin^n over half a period, at the middle of it."""
    half = mp.pi / on
    pulse = mp.beta(mp.mpf(n + 1) / 2, mp.mpf(1) / 2) / on
    times = [half * (k + mp.mpf(1) / 2) for k in range(int(T_END / half))]
    return np.array([float(pulse * sum(T_END - x for x in times)), float(pulse * len(times))])
