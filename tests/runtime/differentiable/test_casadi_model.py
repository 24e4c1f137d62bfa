"""A model under CasADi: values, derivatives against differences, a transcription of one's own."""

import numpy as np
import pytest

import mechc
from benchmarks.problems import optimal as problems
from tests.support.pendulums import bob_of_a_moved_pivot, driven_pendulum

casadi = pytest.importorskip("casadi")


def _check(function, arguments, atol=1e-6):
    """Compare all derivatives with central differences."""
    found = function.jacobian()(*arguments, function(*arguments))
    slopes = [np.array(one) for one in (found if isinstance(found, tuple) else [found])]
    for k, slope in enumerate(slopes):
        x = np.atleast_1d(np.asarray(arguments[k], dtype=float))
        for i, side in enumerate(1e-6 * np.eye(len(x))):
            ends = [function(*arguments[:k], x + s, *arguments[k + 1 :]) for s in (side, -side)]
            rows = (np.array(ends[0]) - np.array(ends[1])).ravel() / 2e-6
            np.testing.assert_allclose(slope[:, i], rows, rtol=1e-6, atol=atol)


@pytest.fixture(scope="module")
def bar():
    model = mechc.load("four_bar", outputs=("energy", "points", "sensitivities"))
    p = model.system.parameter_set.resolve({"l_3": 3.5})
    return model, p, model.assemble({"theta_0": 1.2}, {"omega_0": 0.7}, params=p)


def test_values(bar):
    model, p, y = bar
    f = mechc.casadi(model, near=y)
    np.testing.assert_allclose(np.array(f.rates(0, y, [], p)).ravel(), model.rhs(0.0, y, p))
    end = model.simulate(0.5, y, p).y[-1]
    np.testing.assert_allclose(np.array(f.motion(0.5, y, [], p)).ravel(), end, rtol=1e-12)
    assert float(f.output("energy")(0, y, [], p)) == pytest.approx(float(model.energy(y, p)))
    assert abs(np.array(f.constraints(0, y, [], p))).max() < 1e-12


@pytest.mark.parametrize("name", ["rates", "constraints", "velocity_constraints", "points"])
def test_derivatives_at_a_state_off_the_loops(bar, name):
    model, p, y = bar
    f = mechc.casadi(model)
    function = f.output(name) if name == "points" else getattr(f, name)
    _check(function, (0.0, y + 0.01 * np.arange(6), [], p), atol=1e-5)


def test_derivatives_of_a_motion_from_a_state_off_the_loops(bar):
    model, p, y = bar
    f = mechc.casadi(model, near=y, rtol=1e-12)
    _check(f.motion, (0.3, y + 0.01 * np.arange(6), [], p), atol=1e-5)


def test_derivatives_of_a_motion_by_an_input_in_a_constraint():
    """The start is moved onto the constraints, which the input moves too."""
    defaults = {"m": 2.0, "l": 1.3}
    model = mechc.compile(bob_of_a_moved_pivot()[0], outputs=("sensitivities",), defaults=defaults)
    guess = {"y": -1.0}
    near = model.with_inputs({"r": 0.2}).assemble({"x": 0.7}, {"u": 0.5}, guess)
    f = mechc.casadi(model, near=near, rtol=1e-12)
    y = near + 0.2 * np.array([1.0, 0.5, -1.0, 2.0])
    _check(f.motion, (0.3, y, [0.2], model.system.parameter_set.resolve(None)), atol=1e-5)


def test_a_motion_begins_at_its_time_by_its_method():
    """The equations contain cos(2 pi t)."""
    model, y = driven_pendulum(), [0.2, 0.1]
    p = model.system.parameter_set.resolve(None)
    options = {"rtol": 1e-6, "method": "dop853"}
    ends = [
        np.array(mechc.casadi(model, **given).motion(0.5, y, [], p)).ravel()
        for given in ({"t0": 0.3, **options}, options, {"t0": 0.3, "rtol": 1e-6})
    ]
    wanted = model.simulate((0.3, 0.8), np.array(y), p, **options).y[-1]
    np.testing.assert_array_equal(ends[0], wanted)
    for other in ends[1:]:
        assert abs(other - wanted).max() > 1e-12


def test_loops_need_a_state_near():
    model = mechc.load("four_bar", outputs=("energy", "points", "sensitivities"))
    with pytest.raises(mechc.MechcError, match="near="):
        _ = mechc.casadi(model).motion
    with pytest.raises(mechc.ValueOutOfBoundsError, match="6 numbers"):
        mechc.casadi(model, near=[0.0])
    with pytest.raises(mechc.UnknownNameError, match="quantity"):
        mechc.casadi(model).output("enegry")


def test_a_transcription_of_ones_own():
    """A cart over 3 m in 4 s with the least square of the force, constant in 8 intervals: that of
    lines through the least squares of its two conditions."""
    model, count = problems.double_integrator().model, 8
    motion = mechc.casadi(model).motion
    force, h = casadi.MX.sym("F", count), 4.0 / count
    y = casadi.DM.zeros(2)
    for k in range(count):
        y = motion(h, y, force[k], [2.0])
    problem = {"x": force, "f": casadi.sumsqr(force), "g": y}
    quiet = {"print_level": 0, "sb": "yes", "hessian_approximation": "limited-memory"}
    solver = casadi.nlpsol("s", "ipopt", problem, {"ipopt": quiet, "print_time": False})
    found = np.array(solver(x0=0.1, lbg=[3.0, 0.0], ubg=[3.0, 0.0])["x"]).ravel()
    left = (count - 0.5 - np.arange(count)) * h
    conditions = np.array([h * left / 2.0, np.full(count, h / 2.0)])
    np.testing.assert_allclose(found, np.linalg.pinv(conditions) @ [3.0, 0.0], atol=1e-6)
