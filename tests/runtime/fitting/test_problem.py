"""The motions of a fit: loops and their assemblies, inputs, starts, and those that fail."""

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

import mechc
from tests.support.differences import apart, extrapolated
from tests.support.pendulums import bob_on_a_rod

T = np.linspace(0.0, 1.5, 61)
TRUE = {"l_3": 3.5, "m_1": 1.4}
DOWN = {"theta_1": -1.0, "theta_2": 0.0}


@pytest.fixture(scope="module")
def bar():
    return mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities"))


@pytest.fixture(scope="module")
def pushed():
    """A pendulum with a torque that is given with a run."""
    q, u, torque = dynamicsymbols("q u F")
    m, l, g = (Symbol(name) for name in "mlg")
    r, e, _, bob = bob_on_a_rod(q, u, m, l, g)
    method = KanesMethod(r, [q], [u], [q.diff(dynamicsymbols._t) - u])
    method.kanes_equations([bob], [(bob.point, -m * g * r.y), (e, torque * r.z)])
    given = {"m": 1.3, "l": 0.8, "g": 9.81}
    outputs = ("energy", "sensitivities", {"power": torque * u})
    return mechc.compile(method, name="pushed", defaults=given, outputs=outputs)


@pytest.mark.slow
def test_an_assembly_near_a_guess_and_whole_turns_that_nobody_measured(bar):
    y0 = bar.assemble({"theta_0": 1.2}, {"omega_0": 0.4}, guess=DOWN, params=TRUE)
    sol = bar.simulate(1.5, y0, TRUE, t_eval=T, rtol=1e-12)
    data = {"t": T, "theta_1": sol["theta_1"] + 4 * np.pi, "omega_2": sol["omega_2"]}
    free = {"m_1": (0.2, 9.0), "l_3": (3.3, 3.9), "theta_0": (1.0, 1.5)}
    found = bar.fit(
        data, free, {"theta_1": 0.01, "omega_2": 0.05}, guess=DOWN,
        y0={"theta_0": 1.15, "omega_0": 0.4}, params={"l_3": 3.45},
    )  # fmt: skip
    assert found.values == pytest.approx(TRUE | {"theta_0": 1.2}, abs=1e-7)
    assert np.abs(found.residuals[0]).max() < 1e-6
    found.plot()
    problem, x = found.problem, np.array([1.3, 3.52, 1.22])
    problem.motions[0].policy["rtol"] = 1e-12
    for k, h in enumerate(np.eye(3)):
        wanted = extrapolated(lambda s, h=h: problem.residuals(x + s * h), 0.004)
        assert apart(problem.jacobian(x)[:, k], wanted) < 1e-7


@pytest.mark.slow
def test_points_where_loops_do_not_close_are_passed_over(bar):
    sol = bar.simulate(1.5, {"theta_0": 1.2, "omega_0": 0.4}, TRUE, t_eval=T, rtol=1e-12)
    data, wide = {"t": T, "theta_0": sol["theta_0"]}, {"l_3": (0.1, 9.0), "m_1": (0.2, 9.0)}
    start = {"theta_0": 1.2, "omega_0": 0.4}
    found = bar.fit(data, wide, {"theta_0": 0.01}, y0=start, params={"l_3": 8.0}, starts=64)
    assert found.values == pytest.approx(TRUE, abs=1e-6)
    with pytest.raises(mechc.AssemblyError, match="begins at l_3 = 8"):
        bar.fit(data, wide, {"theta_0": 0.01}, y0=start, params={"l_3": 8.0})


@pytest.mark.slow
def test_no_derivative_through_a_change_point_of_these_lengths(bar):
    sol = bar.simulate(3.0, {"theta_0": 1.4, "omega_0": 0.0})
    assert sol.change_points
    data = (sol.t, sol["theta_0"])
    start = {"y0": {"theta_0": 1.4, "omega_0": 0.0}}
    with pytest.raises(mechc.MechcError, match="change point of exactly these lengths"):
        bar.fit(data, {"l_3": (3.0, 5.0)}, {"theta_0": 0.01}, **start)
    found = bar.fit(data, {"m_1": None}, {"theta_0": 0.01}, params={"m_1": 2.2}, **start)
    assert found["m_1"] == pytest.approx(2.0, abs=1e-6)


@pytest.mark.slow
def test_constant_inputs_and_starts_before_the_first_sample(pushed):
    starts, torques = [{"q": 0.7, "u": -0.5}, {"q": -0.2, "u": -0.5}], [0.9, 0.9]
    data = []
    for start, torque in zip(starts, torques, strict=True):
        sol = pushed.simulate((-1.0, 1.5), start, {"l": 0.9}, inputs={"F": torque}, rtol=1e-12)
        data.append((T, sol(T)[:, 0]))
    given = {"inputs": {"F": 0.1}, "t0": -1.0, "shared": ["u"]}
    free = {"l": (0.5, 1.5), "F": (-2.0, 2.0), "q": (-1.0, 1.0), "u": (-1.0, 1.0)}
    wanted = {"l": 0.9, "F": 0.9, "q[0]": 0.7, "q[1]": -0.2, "u": -0.5}
    for count in (1, 16):
        found = pushed.fit(data, free, {"q": 0.01}, starts=count, **given)
        assert found.values == pytest.approx(wanted, abs=1e-6)
    assert found.starts[1] == {"q": found["q[1]"], "u": found["u"]}
    again = found.problem.motions[1].arguments(found.x)
    sol = pushed.simulate((-1.0, 1.5), again.start, found.params, inputs=again.inputs)
    np.testing.assert_allclose(sol(T)[:, 0], data[1][1], atol=1e-6)


@pytest.mark.parametrize("inputs", [{"F": 0.4}, {"F": lambda t: 0.3 + 0.0 * t}])
def test_outputs_that_contain_inputs(pushed, inputs):
    start = {"q": 0.7, "u": -0.5}
    sol = pushed.simulate(1.5, start, {"l": 0.9}, inputs={"F": 0.3}, t_eval=T, rtol=1e-12)
    data = {"t": T, "q": sol["q"], "power": sol.model.output("power", sol.y, sol.params, T)}
    known = isinstance(inputs["F"], float)
    free = {"l": (0.5, 1.5)} | ({"F": (-2.0, 2.0)} if known else {})
    measured = {"q": 0.01, "power": 0.1} if known else {"q": 0.01}
    found = pushed.fit(data, free, measured, y0=start, inputs=inputs, starts=8)
    assert found["l"] == pytest.approx(0.9, abs=1e-6)
    assert not known or found["F"] == pytest.approx(0.3, abs=1e-6)
    assert found.plot().axes


def test_a_whole_state_and_all_parameters(pushed):
    sol = pushed.simulate(1.5, [0.7, -0.5], {"l": 0.9}, inputs={"F": 0.3}, t_eval=T, rtol=1e-12)
    found = pushed.fit(
        (T, sol["q"]), {"l": (0.3, 3.0)}, {"q": 0.01}, y0=[0.7, -0.5], inputs={"F": 0.3},
        params=np.array([pushed.defaults[name] for name in pushed.parameters]),
    )  # fmt: skip
    assert found["l"] == pytest.approx(0.9, abs=1e-7)
    assert set(found.params) == set(pushed.parameters)


@pytest.mark.slow
def test_past_a_change_point_lengths_cannot_be_fitted(bar):
    """The start can."""
    y0 = {"theta_0": np.radians(85), "omega_0": 0.0}
    sol = bar.simulate(1.5, y0, t_eval=T, rtol=1e-11)
    assert sol.change_points
    data, sigma = {"t": T, "theta_0": sol["theta_0"]}, {"theta_0": 0.01}
    near = y0 | {"theta_0": 1.47}
    found = bar.fit(data, {"theta_0": (1.4, 1.55)}, sigma, y0=near)
    assert found.values["theta_0"] == pytest.approx(y0["theta_0"], abs=1e-7)
    with pytest.raises(mechc.MechcError, match=r"by l_3: none from t = .*change point"):
        bar.fit(data, {"l_3": (3.9, 4.1)}, sigma, y0=y0, params={"l_3": 4.0})
