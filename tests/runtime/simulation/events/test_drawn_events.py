"""Drawn events and resets by tapes, beside the same as functions of Python by SymPy and NumPy.

Functions, corners, jumps, sums, lookup tables; their numbers are parameters, numbers, or both.
"""

import random

import numpy as np
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc

T, Q, U, M, H = (sm.Symbol(name, real=True) for name in "tqumh")
AT = np.linspace(-3.0, 3.0, 7)
TABLES = (
    mechc.Table(AT, np.sin(AT)),
    mechc.Table(AT, np.abs(AT), kind="linear", outside="repeat"),
    mechc.Table(AT, AT[:4], np.cos(np.add.outer(AT, AT[:4])), outside=("hold", "extend")),
)
NAMES = {Q: dynamicsymbols("q_0"), U: dynamicsymbols("u_0"), T: dynamicsymbols._t}
NAMES |= {M: sm.Symbol("m"), H: sm.Symbol("h")}
FUNCTIONS = (
    sm.sin, sm.cos, sm.tanh, sm.atan, sm.sinh, lambda x: sm.exp(sm.sin(x)),
    lambda x: sm.log(1 + x**2), lambda x: sm.sqrt(1 + x**2), lambda x: x**3 - x, sm.Abs,
)  # fmt: skip


def number(draw, kind):
    """A parameter, a number, or either."""
    if kind == "symbols" or (kind == "mixed" and draw.random() < 0.5):
        return draw.choice((M, H))
    return sm.Rational(draw.randint(-30, 30), 10) or sm.S.One


def expression(draw, kind, depth=3):
    if depth == 0:
        return draw.choice((Q, U, T, Q, U))
    one, other = (expression(draw, kind, depth - 1) for _ in range(2))
    match draw.randrange(7):
        case 0:
            return draw.choice(FUNCTIONS)(one)
        case 1:
            return one + number(draw, kind) * other
        case 2:
            return one * other
        case 3:
            return draw.choice((sm.Max, sm.Min))(one, number(draw, kind))
        case 4:
            return sm.Piecewise((one, other > number(draw, kind)), (one + other, True))
        case 5:
            return draw.choice(TABLES[:2])(one)
        case _:
            return TABLES[2](sm.sin(one), sm.sin(other))


def of_python(value):
    modules = [{"Abs": np.abs}, "numpy"]
    return sm.lambdify([T, Q, U, M, H], value, modules)


def motion(model, event, params):
    return model.simulate(0.8, [0.4, 0.3], params, rtol=1e-10, events=event)


def judged(model, key):
    """Whether the two motions were compared; they differ in nothing but rounding."""
    draw = random.Random(key)
    kind = draw.choice(("symbols", "numbers", "mixed"))
    params = {"m": draw.uniform(0.5, 2.0), "h": draw.uniform(-1.0, 1.0)}
    value, speed = expression(draw, kind), expression(draw, kind, 2)
    value = value - sm.Rational(draw.randint(-10, 10), 10)
    if not value.free_symbols & {Q, U, T}:
        return False
    reset = sm.sin(speed) - U / 2
    function, after = of_python(value), of_python(reset)
    given = params["m"], params["h"]
    by_tape = mechc.Event(
        value.xreplace(NAMES), terminal=4, reset={"u_0": reset.xreplace(NAMES)}
    )  # fmt: skip
    by_python = mechc.Event(
        lambda t, y: float(function(t, *y, *given)), terminal=4,
        reset=lambda t, q, u: (q, np.array([float(after(t, q[0], u[0], *given))])),
    )  # fmt: skip
    sols = [motion(model, event, params) for event in (by_tape, by_python)]
    assert not sols[0]._run_events.bound.calls_python
    assert sols[1]._run_events.bound.calls_python
    one, other = sols
    told = key, kind, value, reset, params
    assert one.status.code == other.status.code, told
    np.testing.assert_allclose(one.events[0].t, other.events[0].t, atol=1e-7, err_msg=str(told))
    np.testing.assert_allclose(one.y[-1], other.y[-1], atol=1e-5, err_msg=str(told))
    return len(one.events[0].t) > 0


def test_drawn_events_are_those_of_python(ball, seed, thorough):
    count = 1000 if thorough else 25
    compared = sum(judged(ball, f"{seed}.{k}") for k in range(count))
    assert compared > 0.3 * count
