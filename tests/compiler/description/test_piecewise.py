"""Functions with corners and jumps in the equations: their values, slopes, and motions."""

import mpmath
import numpy as np
import pytest
from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.terms import bottom_up
from sympy import (
    Abs,
    And,
    DiracDelta,
    Eq,
    Heaviside,
    Max,
    Min,
    Mod,
    Ne,
    Not,
    Or,
    Piecewise,
    Rational,
    Symbol,
    ceiling,
    floor,
    frac,
    lambdify,
    sign,
    sin,
    sqrt,
    symbols,
    tan,
)
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support import scenes
from tests.support.differences import extrapolated

q, u = dynamicsymbols("q u")
f = Symbol("f")
CORNERED = {
    "stop": Piecewise((-50 * (q - 1), q > 1), (-50 * (q + 1), q < -1), (0, True)),
    "saturated": Max(-f, Min(f, 3 * q)),
    "dry": -f * sign(u) + Abs(q * u),
    "late": Heaviside(q - f) + Heaviside(u, Rational(1, 4)),
    "within": Piecewise((sin(q), And(q >= 0, Or(u < f, Ne(q, u)))), (u**2, True)),
    "otherwise": Piecewise((f, Not(Or(q > u, Eq(q, -2)))), (q / f, True)),
    "compared": Piecewise((q * u, Piecewise((q, u > f), (2 * u, True)) > f / 3), (f, True)),
    "stairs": floor(2 * q) * u - ceiling(q + u),
    "sawtooth": Mod(q, f) + frac(u) - Mod(u, -Rational(1, 2)),
    "three": Max(q, u, f * q * u) + Min(q, u, f),
}


@pytest.mark.parametrize("label", CORNERED)
def test_what_has_corners_is_computed_as_sympy_does(label):
    expression = CORNERED[label]
    parameter = scenes.bead_with(expression, default=1.25)
    model = mechc.compile(parameter, outputs=("state_jacobian", {"own": expression}))
    known = expression.replace(frac, lambda x: x - floor(x))
    exact = lambdify((q, u, f), known, "numpy")
    states = np.random.default_rng(1).uniform(-3, 3, (200, 2))
    states[:3] = [[0.0, 0.0], [1.25, 1.25], [-2.0, 0.5]]  # on corners
    expected = np.array([exact(*state, 1.25) for state in states], dtype=float)
    np.testing.assert_allclose(model.rhs(0.0, states)[:, 1], expected, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(model.output("own", states), expected, rtol=1e-13, atol=1e-14)
    jacobian, h = model.state_jacobian(states)[:, 1], 1e-6
    for k in range(2):
        step = h * np.eye(2)[k]
        sides = [model.rhs(0.0, states + s * step)[:, 1] for s in (-1, 1)]
        away = np.abs(sides[1] - sides[0]) < 0.01  # from jumps
        away[:3] = False
        away &= np.abs(sides[1] + sides[0] - 2 * expected) < 1e-9  # and from corners
        slope = (sides[1] - sides[0]) / (2 * h)
        assert away.sum() > 150
        np.testing.assert_allclose(jacobian[away, k], slope[away], atol=1e-7)


def test_a_mass_between_stops_bounces_as_the_closed_form_says():
    """Half a period on a stop, a free flight, and so on: the period is known."""
    model = mechc.compile(scenes.bead_with(CORNERED["stop"]), outputs=())
    speed, omega = 2.0, np.sqrt(50.0)
    period = 2 * (2.0 / speed) + 2 * np.pi / omega
    sol = model.simulate(3 * period, [0.0, speed], rtol=1e-10)
    assert sol.t[-1] == pytest.approx(3 * period)
    np.testing.assert_allclose(sol.y[-1], [0.0, speed], atol=1e-7)
    assert sol.y[:, 0].max() == pytest.approx(1 + speed / omega, abs=2e-2)


def test_a_piecewise_without_a_last_value_is_refused():
    with pytest.raises(mechc.MechcError, match=r"add a last pair \(value, True\)"):
        mechc.compile(scenes.bead_with(Piecewise((q, q > 1))))


def test_an_impulse_in_a_force_is_refused_in_words() -> None:
    """It was taken as zero, which is right of a derivative across a jump alone."""
    with pytest.raises(mechc.MechanismError, match="the load on B has an impulse"):
        scenes.bead_with(DiracDelta(q - 1) - q)


def test_what_sympy_makes_of_a_rewritten_node_is_rewritten_too():
    """sign(tan(sign(x))) becomes -sign(tan(...)) where Step(-x) comes before Step(x)."""
    x, y = symbols("q0 u0", real=True)
    for argument in (x + y, -x - y, x - y, y - x, 1 - x):
        found = bottom_up(sign(tan(sign(argument))), without_corners, {})
        assert not found.has(sign)
        for values in ({x: 0.4, y: 0.7}, {x: -1.3, y: 0.2}):
            expected = sign(tan(sign(argument))).subs(values)
            assert found.subs(values) == expected


@pytest.mark.parametrize("factor", [1, Rational(9, 4), Symbol("k", real=True)])
def test_the_root_of_a_square_written_out_is_never_that_of_a_negative_number(factor):
    """x^2 - 2 c x + c^2 is -1e-17 at some x near c."""
    x, c = symbols("x c", real=True)
    square = (factor * (x - c) ** 2).expand()
    found = bottom_up(sqrt(square), without_corners, {})
    place = {x: 0.1 + 0.2, c: 0.3, Symbol("k", real=True): 1.7}
    assert found.subs(place).is_real
    assert found.subs({**place, x: 2.0}).evalf() == pytest.approx(
        float(sqrt(square).subs({**place, x: 2.0}))
    )
    typed = bottom_up(sqrt(x**2 - 0.6 * x + 0.09), without_corners, {})
    assert typed.has(Abs)
    kept = sqrt(x**2 + c**2)
    assert bottom_up(kept, without_corners, {}) == kept


# -- powers whose slope is taken as a whole, against quotients of differences in many digits ----

places, speeds = dynamicsymbols("q:4"), dynamicsymbols("u:4")
c, b, n = Symbol("c"), Symbol("b"), Symbol("n")
DEFAULTS = {"c": 1.7, "b": 0.4, "n": 0.3}
# Where each vanishes its slope is 0, but the slopes of its factors are infinite there, or none.
LAWS = [
    places[0] * sqrt(Abs(places[0]))
    + c * sin(places[0] - places[1]) * Abs(sin(places[0] - places[1])) ** Rational(1, 4),
    places[1] * Abs(c * places[1]) ** n - places[1] * sqrt(places[1] ** 4 + places[1] ** 2),
    c * speeds[2] * sqrt(speeds[2] ** 2 + speeds[3] ** 2) + places[2],
    c * speeds[3] * sqrt(speeds[2] ** 2 + speeds[3] ** 2)
    + (places[3] - places[2]) * Abs(places[3] - places[2]) ** Rational(3, 4),
]
STATES = [
    np.zeros(8), [0, 0.7, 0, 0, 0.4, 0, 0, 0.2], [0.3, 0.3, 0.2, 0.2, 0, 0, -0.5, 0],
    [0.3, -0.8, 0.2, 0.5, -0.4, 0.1, 0.6, 0.2],
]  # fmt: skip


@pytest.fixture(scope="module")
def model():
    forces = [(k + 1) * b - law for k, law in enumerate(LAWS)]
    equations = mechc.from_equations(places, speeds, None, forces, name="powers", defaults=DEFAULTS)
    return mechc.compile(equations, outputs=("sensitivities",))


def quotients(law, state, step):
    """(f(y + h) - f(y - h)) / 2 h by each of the state, real numbers as they are."""
    plain = dict(zip((*places, *speeds), symbols("y:8", real=True), strict=True))
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


@pytest.mark.slow
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


@pytest.mark.parametrize(
    "law", [sqrt(Abs(places[0])), places[0] / Abs(places[0]) ** Rational(1, 3)]
)
def test_an_infinite_slope_stays_none(law):
    model = mechc.compile(
        mechc.from_equations(places[:1], speeds[:1], None, [law]), outputs=("state_jacobian",)
    )
    assert not np.isfinite(model.state_jacobian([0.0, 0.0])[1, 0])
