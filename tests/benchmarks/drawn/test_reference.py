"""The reference: SymPy's equations against closed forms, with rods, stops and tables."""

import numpy as np
import pytest

from benchmarks.drawn.equations import equations
from benchmarks.drawn.of_mujoco import OfMujoco
from benchmarks.drawn.reference import Reference
from benchmarks.drawn.scene import Scene

PENDULUM = """\
x, y, v, w = dynamicsymbols("x y v w")
m, g, L = sm.symbols("m g L")
q, u, rates = [x, y], [v, w], [v, w]
M, F, position = [[m, 0], [0, m]], [0, -m * g], [x**2 + y**2 - L**2]
"""
BALL = """\
z, v = dynamicsymbols("z v")
q, u, rates, M, F = [z], [v], [v], [[2]], [-2 * 9.81]
stop = (z, 0.5)
"""


def reference(text):
    names = Scene("", text, "", {}, {}).built()
    return Reference(equations(names), names)


def test_a_rod_gives_the_pendulum():
    found = reference(PENDULUM)
    params = {"m": 2.0, "g": 9.81, "L": 0.5}
    angle, rate = 0.7, 1.5
    y = 0.5 * np.array([np.sin(angle), -np.cos(angle), 0, 0])
    y[2:] = rate * np.array([-y[1], y[0]])
    exact = found.exact(0.0, y, params)
    turned = -9.81 / 0.5 * np.sin(angle)
    expected = turned * np.array([-y[1], y[0]]) - rate**2 * y[:2]
    np.testing.assert_allclose(exact[2:], expected, rtol=1e-14)
    np.testing.assert_allclose(found.rates(params)(0.0, y), exact, rtol=1e-12)
    gaps, slopes = found.closing(0.0, y, params)
    np.testing.assert_allclose(gaps, 0.0, atol=1e-15)
    along = found.along(0.0, y, params, np.ones(4))
    np.testing.assert_allclose(slopes @ along, 0.0, atol=1e-14)
    beside = found.closed(0.0, y + 1e-3, params)
    np.testing.assert_allclose(found.closing(0.0, beside, params)[0], 0.0, atol=1e-15)


def test_a_ball_bounces():
    """From 1 m: down after sqrt(2/g), up with half of the speed."""
    t1 = np.sqrt(2 / 9.81)
    times = np.array([0.0, t1 + 0.2])
    found = reference(BALL).motion(times, np.array([1.0, 0.0]), {})
    up = 0.5 * 9.81 * t1
    expected = [up * 0.2 - 9.81 * 0.2**2 / 2, up - 9.81 * 0.2]
    np.testing.assert_allclose(found[-1], expected, atol=1e-10)


def test_tables_are_those_of_scipy():
    text = """\
z, v = dynamicsymbols("z v")
curve = mechc.Table([0, 1, 2, 3], [0.0, 1.0, 0.0, 2.0])
from scipy.interpolate import CubicSpline
curve_of_scipy = CubicSpline([0, 1, 2, 3], [0.0, 1.0, 0.0, 2.0])
q, u, rates, M, F = [z], [v], [v], [[1]], [curve(z)]
"""
    found = reference(text)
    cubic = 0.5 * 1.5 * 2.5 / 2 + 2 * 0.5 * 0.5 * 1.5 / 6  # the one through all four samples
    y = np.array([0.5, 0.0])
    assert found.exact(0.0, y, {})[1] == pytest.approx(cubic, rel=1e-14)
    assert found.rates({})(0.0, y)[1] == pytest.approx(cubic, rel=1e-14)


def test_mujoco_gives_the_rates_of_a_pendulum():
    pytest.importorskip("mujoco", reason="MJCF is read by mechc[mjcf]")
    text = (
        '<mujoco><worldbody><body><joint name="j" axis="0 1 0"/>'
        '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>'
    )
    found = OfMujoco(text)
    assert found.names == ["q_j", "u_j"]
    expected = -2 * 9.81 * 0.5 * np.sin(0.4) / (0.1 + 2 * 0.25)
    np.testing.assert_allclose(found.exact(0.0, [0.4, 1.0], {}), [1.0, expected], rtol=1e-12)
