"""Slopes of powers that vanish: against quotients of differences in 80 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from sympy import Abs, Rational, Symbol, lambdify, sin, sqrt, symbols
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support.differences import extrapolated

q, u = dynamicsymbols("q:4"), dynamicsymbols("u:4")
c, b, n = Symbol("c"), Symbol("b"), Symbol("n")
DEFAULTS = {"c": 1.7, "b": 0.4, "n": 0.3}
# Where each vanishes its slope is 0, but the slopes of its factors are infinite there, or none.
LAWS = [
    q[0] * sqrt(Abs(q[0])) + c * sin(q[0] - q[1]) * Abs(sin(q[0] - q[1])) ** Rational(1, 4),
    q[1] * Abs(c * q[1]) ** n - q[1] * sqrt(q[1] ** 4 + q[1] ** 2),
    c * u[2] * sqrt(u[2] ** 2 + u[3] ** 2) + q[2],
    c * u[3] * sqrt(u[2] ** 2 + u[3] ** 2) + (q[3] - q[2]) * Abs(q[3] - q[2]) ** Rational(3, 4),
]
STATES = [
    np.zeros(8), [0, 0.7, 0, 0, 0.4, 0, 0, 0.2], [0.3, 0.3, 0.2, 0.2, 0, 0, -0.5, 0],
    [0.3, -0.8, 0.2, 0.5, -0.4, 0.1, 0.6, 0.2],
]  # fmt: skip


@pytest.fixture(scope="module")
def model():
    forces = [(k + 1) * b - law for k, law in enumerate(LAWS)]
    equations = mechc.from_equations(q, u, None, forces, name="powers", defaults=DEFAULTS)
    return mechc.compile(equations, outputs=("sensitivities",))


def quotients(law, state, step):
    """(f(y + h) - f(y - h)) / 2 h by each of the state, real numbers as they are."""
    plain = dict(zip((*q, *u), symbols("y:8", real=True), strict=True))
    f = lambdify([*plain.values(), c, n], law.xreplace(plain), "mpmath")
    rest = [mpmath.mpf(DEFAULTS[name]) for name in ("c", "n")]
    found = []
    for k in range(8):
        ahead, behind = ([mpmath.mpf(float(y)) for y in state] for _ in range(2))
        ahead[k] += step
        behind[k] -= step
        found.append((f(*ahead, *rest) - f(*behind, *rest)) / (2 * step))
    return found


@pytest.mark.parametrize("state", STATES)
def test_jacobians_have_the_slopes_of_the_whole(model, state):
    found = model.state_jacobian(np.asarray(state, float))[4:]
    with mpmath.workdps(200):
        wanted = [[-float(x) for x in quotients(law, state, mpmath.mpf(10) ** -60)] for law in LAWS]
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


def test_derivatives_of_a_motion_from_rest_forwards_and_backwards(model):
    """At its start every law vanishes."""

    def end(change):
        given = {"rtol": 1e-12, "method": "dop853"}
        return model.simulate(1.0, np.zeros(8), {"b": 0.4 + change}, **given).y[-1]

    sol = model.simulate(1.0, np.zeros(8), rtol=1e-10, sensitivities=["b", "q0"])
    np.testing.assert_allclose(sol.sensitivity["b"][-1], extrapolated(end, 1e-2), rtol=1e-5)
    weights = np.arange(1.0, 9.0)
    back = sol.gradient(end=weights, by=["b", "q0"])
    for name in ("b", "q0"):
        np.testing.assert_allclose(back[name], sol.sensitivity[name][-1] @ weights, rtol=1e-9)


@pytest.mark.parametrize("law", [sqrt(Abs(q[0])), q[0] / Abs(q[0]) ** Rational(1, 3)])
def test_an_infinite_slope_stays_none(law):
    model = mechc.compile(
        mechc.from_equations(q[:1], u[:1], None, [law]), outputs=("state_jacobian",)
    )
    assert not np.isfinite(model.state_jacobian([0.0, 0.0])[1, 0])
