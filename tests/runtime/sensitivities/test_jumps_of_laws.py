"""Derivatives over the jumps of laws, against motions that are integrated from zero to zero."""

from functools import cache

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support.differences import extrapolated
from tests.support.pendulums import pushed_mass

q, u = dynamicsymbols("q u")
t = dynamicsymbols._t
k, c, w = sm.symbols("k c w")
VALUES = {"k": 2.0, "c": 0.3, "w": 0.7}
START, T = (1.0, 0.0), 2.0

# Each law with what it jumps at, and its form while the signs of these are held.
LAWS = {
    "sign": (-k * sm.sign(q - c), [q - c], lambda s: -k * s[0]),
    "Piecewise": (
        sm.Piecewise((-k * q - 3, q > c), (-2 * k * q + 1, True)), [q - c],
        lambda s: -k * q - 3 if s[0] > 0 else -2 * k * q + 1,
    ),
    "Heaviside of time": (
        3 * sm.Heaviside(t - w) - k * q, [t - w], lambda s: 3 * int(s[0] > 0) - k * q
    ),
    "sign of a sine": (
        2 * sm.sign(sm.sin(6 * w * t)) - k * q, [sm.sin(6 * w * t)], lambda s: 2 * s[0] - k * q
    ),
    "the same law twice": (
        -k * sm.sign(q - c) - sm.Heaviside(2 * (q - c)) - q, [q - c],
        lambda s: -k * s[0] - int(s[0] > 0) - q,
    ),
    "a law in a law": (
        -k * sm.sign(q - c * sm.sign(t - w)) - q * u**2, [q - c, q + c, t - w],
        lambda s: -k * (s[0] if s[2] > 0 else s[1]) - q * u**2,
    ),
}  # fmt: skip


@cache
def held(law, change, name):
    """The end of the motion, integrated from zero to zero, where one sign changes."""
    _, zeros, form = LAWS[law]
    values = VALUES | ({name: VALUES[name] + change} if name in VALUES else {})
    numbers = {symbol: values[symbol.name] for symbol in (k, c, w)}
    zeros = [sm.lambdify((t, q, u), zero.subs(numbers)) for zero in zeros]
    at, y = 0.0, np.add(START, [change * (name == "q"), change * (name == "u")])
    signs = [np.sign(zero(1e-9, *y)) for zero in zeros]
    while at < T:
        at, y, met = _until_a_zero(at, y, signs, zeros, form(signs), numbers)
        signs = [s * (-1) ** len(times) for s, times in zip(signs, met, strict=True)]
    return y


def _until_a_zero(at, y, signs, zeros, form, numbers):
    force = sm.lambdify((t, q, u), sm.sympify(form).subs(numbers))

    def end(sign, zero):
        def value(t, y):
            return sign * zero(t, *y)

        value.terminal, value.direction = True, -1.0
        return value

    run = solve_ivp(
        lambda t, y: [y[1], force(t, *y)], (at, T), y, "DOP853", rtol=1e-13, atol=1e-14,
        events=[end(*each) for each in zip(signs, zeros, strict=True)], max_step=0.2,
    )  # fmt: skip
    return run.t[-1], run.y[:, -1], run.t_events


@pytest.fixture(scope="module", params=LAWS)
def case(request):
    model = mechc.compile(
        pushed_mass(LAWS[request.param][0]), outputs=("sensitivities",), name="law",
        defaults={"m": 1.0},
    )  # fmt: skip
    return request.param, model


@pytest.mark.parametrize("method", ["auto", "dop853", "radau5"])
def test_through_jumps_forwards_and_backwards(case, method):
    law, model = case
    params = {name: VALUES[name] for name in model.parameters if name in VALUES}
    by = [*params, "q", "u"]
    sol = model.simulate(T, START, params, rtol=1e-10, method=method, sensitivities=by)
    back = sol.gradient(end=[1.0, -2.0], by=by)
    for name in by:
        found = sol.sensitivity[name][-1]
        wanted = extrapolated(lambda change: held(law, change, name), 1e-3)  # noqa: B023
        tolerance = 1e-7 if method == "auto" else 1e-5
        np.testing.assert_allclose(found, wanted, rtol=tolerance, atol=tolerance, err_msg=name)
        assert abs(back[name] - found @ [1.0, -2.0]) < 1e-12 * max(1.0, np.abs(found).max())


def test_speeds_that_vanish_together_are_no_jump():
    """Rates that vanish there too, or rest, differ by rounding; derivatives were no numbers."""
    (x, y, z), (a, b, d) = dynamicsymbols("x y z"), dynamicsymbols("a b d")
    law = [-k * x - a * sm.Abs(a), -k * y - b * sm.Abs(b), -z]
    model = mechc.compile(mechc.from_equations([x, y, z], [a, b, d], None, law))

    def end(change):
        given = {"rtol": 1e-12, "method": "dop853"}
        return model.simulate(5.0, [1, 1, 0, 0, 0, 0], {"k": VALUES["k"] + change}, **given).y[-1]

    wanted = extrapolated(end, 1e-3)
    for method in ("auto", "dop853", "radau5"):
        sol = model.simulate(
            5.0, [1, 1, 0, 0, 0, 0], {"k": 2.0}, rtol=1e-10, method=method, sensitivities=["k"]
        )
        np.testing.assert_allclose(sol.sensitivity["k"][-1], wanted, atol=1e-5)


@pytest.fixture(scope="module")
def braked():
    """A mass that friction by sign(u) and a force c bring to rest."""
    return mechc.compile(
        mechc.from_equations([q], [u], None, [c - k * sm.sign(u)], name="braked"),
        outputs=("sensitivities",),
    )


@pytest.mark.parametrize("method", ["auto", "gauss8", "dop853", "radau5"])
@pytest.mark.parametrize("start", [1.0, 0.7, -1.5])
def test_there_are_none_where_both_sides_lead_back_to_a_jump(braked, method, start):
    """Steps go to and fro there until the run ends; until then columns are of u0 + (c - k s) t."""
    params, side = {"k": 2.0, "c": 0.5}, np.sign(start)
    sol = braked.simulate(4.0, [0.0, start], params, method=method, sensitivities=["k", "q", "u"])
    rest = start / (side * 2.0 - 0.5)
    assert not sol.status.ok
    assert sol.t[-1] == pytest.approx(rest, abs=1e-8)
    t, found = sol.t, sol.sensitivity
    wanted = {
        "k": [-side * t**2 / 2, -side * t], "q": [1 + 0 * t, 0 * t], "u": [t, 1 + 0 * t],
    }  # fmt: skip
    for name, columns in wanted.items():
        past = np.isnan(found[name]).any(axis=1)
        assert not past[t < rest - 1e-6].any()
        np.testing.assert_allclose(found[name][~past], np.transpose(columns)[~past], atol=1e-8)
    gradient = sol.gradient(end="q", by=["k"])["k"]
    np.testing.assert_allclose(gradient, found["k"][-1, 0], rtol=1e-12)
    if method != "radau5":  # which may end before the jump
        assert past[-1]
        assert "both sides lead back" in found.notes[0]
