"""Functions of a coordinate, as expressions and as data; parameters bound to expressions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from sympy import Function, Symbol, cos, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle

t = dynamicsymbols._t
m, k, c = Symbol("m"), Symbol("k"), Symbol("c")
h = Function("h")
PLACES = np.linspace(-2.0, 2.0, 21)
G = 9.81


def cart(force):
    """A mass on a line, pushed by a force of the coordinate."""
    q, u = dynamicsymbols("q u")
    return particle([q], [u], [force(q)], m), q


def road():
    """A mass on the profile y = h(x), by a constraint."""
    x, y, v, w = dynamicsymbols("x y v w")
    return particle([x, y], [v, w], [0, -m * G], m, closed=[y - h(x)]), x


@pytest.mark.parametrize(
    ("profile", "error"),
    [
        (cos, 1e-14),
        (lambda x: (PLACES, np.cos(PLACES)), 2e-2),
        pytest.param(lambda x: CubicSpline(PLACES, np.cos(PLACES)), 2e-2, marks=pytest.mark.slow),
        pytest.param(
            lambda x: mechc.Signal(PLACES, np.cos(PLACES), "quintic"), 1e-4, marks=pytest.mark.slow
        ),
    ],
)
def test_a_mass_on_a_road_is_accelerated_by_its_slope_and_bend(profile, error):
    kane, x = road()
    model = mechc.compile(kane, inputs={h(x): profile(x)}, defaults={m: 2.0})
    assert model.inputs == ()
    for at, v in ((0.51, 1.0), (-1.2, 0.4)):
        y = model.assemble({"x": at}, {"v": v}, guess={"y": 1.0})
        slope, bend = -np.sin(at), -np.cos(at)
        expected = -(slope * bend * v**2 + G * slope) / (1 + slope**2)
        assert model.rhs(0.0, y)[2] == pytest.approx(expected, abs=error)
        assert y[1] == pytest.approx(np.cos(at), abs=error)


def test_a_curve_has_the_values_of_its_data_and_goes_on_beyond_them():
    kane, q = cart(lambda q: h(q))
    curve = CubicSpline(PLACES, np.sin(3 * PLACES))
    model = mechc.compile(kane, inputs={h(q): curve}, defaults={m: 1.0})
    for at in (-2.5, -2.0, -0.37, 0.0, PLACES[12], 1.99, 2.0, 2.2):
        assert model.rhs(0.0, [at, 0.0])[1] == pytest.approx(curve(at), abs=1e-13)


def test_more_samples_are_no_more_operations_and_the_numbers_of_a_table():
    at, counts = np.linspace(-2.2, 2.2, 23), []
    for count in (20, 300):
        kane, q = cart(lambda q: h(q))
        places = np.linspace(-2.0, 2.0, count)
        samples = places, np.sin(3 * places)
        model = mechc.compile(kane, inputs={h(q): samples}, defaults={m: 1.0})
        found = model.rhs(0.0, np.stack([at, 0 * at], axis=-1))[:, 1]
        np.testing.assert_allclose(found, mechc.Table(*samples)(at), rtol=0, atol=1e-12)
        counts.append(model.system.data["operations"]["outputs"]["forcing"])
    assert counts[0] == counts[1]


@pytest.mark.slow
def test_derivatives_of_the_motion_jump_where_samples_do():
    """By differences of the motions, which know nothing of it."""
    kane, q = cart(lambda q: h(q) - k * q)
    force = mechc.Signal([-2.0, -0.3, 0.4, 1.0, 2.0], [1.0, -2.0, 3.0, 0.5, 0.2], "previous")
    model = mechc.compile(kane, inputs={h(q): force}, defaults={m: 1.0, k: 4.0})
    sol = model.simulate(3.0, [1.5, 0.0], rtol=1e-11, sensitivities=["k"])
    move = 1e-6
    ends = [model.simulate(3.0, [1.5, 0.0], {k: 4.0 + x}, rtol=1e-12).y[-1] for x in (move, -move)]
    difference = (ends[0] - ends[1]) / (2 * move)
    np.testing.assert_allclose(sol.sensitivity["k"][-1], difference, rtol=1e-5)


def test_a_parameter_of_a_load_may_be_bound_to_an_expression():
    kane, q = cart(lambda q: -k * q)
    model = mechc.compile(kane, inputs={k: c * (1 + q**2)}, defaults={m: 2.0, c: 3.0})
    assert model.parameters == ("c", "m")
    assert model.rhs(0.0, [0.5, 0.0])[1] == pytest.approx(-3.0 * 1.25 * 0.5 / 2.0, rel=1e-15)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"inputs": {}}, r"h\(q\(t\)\) is a function of q: give it as an expression"),
        ({"inputs": {"h": 0, m: sin(t)}}, "m is in more than loads"),
        ({"inputs": {"h": 0}, "defaults": {k: dynamicsymbols("q")}}, "a parameter follows param"),
    ],
)
def test_what_is_not_known_or_would_be_wrong_is_refused(options, match):
    kane, _ = cart(lambda q: k * h(q))
    with pytest.raises(mechc.MechanismError, match=match):
        mechc.compile(kane, **options)


def test_samples_of_time_belong_to_a_run():
    force = dynamicsymbols("F")
    kane, _ = cart(lambda q: force)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="are given with a run"):
        mechc.compile(kane, inputs={force: (PLACES, PLACES)})
