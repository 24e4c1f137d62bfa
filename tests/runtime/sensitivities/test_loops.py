"""Sensitivities through closed loops: the start's assembly, the constraints, change points."""

import numpy as np
import pytest

import mechc
from mechc.errors import MechcError
from tests.support.differences import apart, extrapolated

START = {"theta_0": 1.4835, "omega_0": 0.3}
REGULAR = {"l_3": 3.5}


@pytest.fixture(scope="module")
def bar():
    return mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities"))


def moved(model, name, t=1.5, start=START, params=REGULAR, **policy):
    def run(change):
        y0, p = dict(start), dict(params)
        given = y0 if name in y0 else p
        given[name] = given.get(name, model.defaults.get(name, 0.0)) + change
        return model.simulate(t, y0, p, rtol=1e-13, **policy).y[-1]

    return run


@pytest.mark.parametrize("method", ["gauss8", "dop853", "radau5"])
@pytest.mark.parametrize("name", ["l_0", "l_3", "m_2", "I_1", "theta_0", "omega_0"])
def test_by_every_kind_of_name(bar, name, method):
    sol = bar.simulate(1.5, START, REGULAR, method=method, rtol=1e-10, sensitivities=[name])
    assert apart(sol.sensitivity[name][-1], extrapolated(moved(bar, name), 0.004)) < 1e-8


@pytest.mark.parametrize("name", ["l_3", "m_1", "theta_0"])
def test_multipliers_follow(bar, name):
    sol = bar.simulate(1.5, START, REGULAR, rtol=1e-11, sensitivities=[name])
    end = moved(bar, name)

    def forces(change):
        params = bar.defaults | REGULAR
        own = {name: params[name] + change} if name in bar.parameters else {}
        return bar.output("multipliers", end(change), REGULAR | own, 1.5)

    found = sol.sensitivity_of("multipliers", name)
    assert found.shape == (len(sol.t), 2)
    assert apart(found[-1], extrapolated(forces, 0.004)) < 1e-7


def test_columns_stay_tangent(bar):
    """The constraints' own derivative along a column vanishes, at the steps and between."""
    sol = bar.simulate(2.0, START, REGULAR, rtol=1e-6, sensitivities=["l_3", "theta_0"])
    for t in (sol.t, np.linspace(0, 2, 41)):
        y, columns = sol(t), sol.sensitivity(t)
        h = 1e-6
        for name, by in (("l_3", h), ("theta_0", 0.0)):
            apart_by = [
                bar.constraints(y + s * h * columns[name], {"l_3": 3.5 + s * by}) for s in (1, -1)
            ]
            drift = (apart_by[0] - apart_by[1]) / (2 * h)
            assert np.abs(drift).max() < 1e-8
            rates = [
                bar.velocity_constraints(y + s * h * columns[name], {"l_3": 3.5 + s * by})
                for s in (1, -1)
            ]
            assert np.abs(rates[0] - rates[1]).max() / (2 * h) < 1e-7


def test_the_start_follows_assembly(bar):
    sol = bar.simulate(0.1, START, REGULAR, sensitivities=["l_1", "theta_0", "omega_0"])

    def start(name):
        def assembled(change):
            y0, p = dict(START), dict(REGULAR) | {"l_1": 2.0}
            (y0 if name in y0 else p)[name] += change
            coordinates = {"theta_0": y0["theta_0"]}
            return bar.assemble(coordinates, {"omega_0": y0["omega_0"]}, params=p)

        return assembled

    for name in sol.sensitivity:
        wanted = extrapolated(start(name), 0.01)
        np.testing.assert_allclose(sol.sensitivity[name][0], wanted, rtol=1e-9, atol=1e-9)


def test_a_whole_state_is_not_assembled(bar):
    y0 = bar.assemble({"theta_0": 1.4835}, {"omega_0": 0.3}, params=REGULAR)
    with pytest.raises(mechc.MechcError, match="tie theta_0 to the others"):
        bar.simulate(1.0, y0, REGULAR, sensitivities=["theta_0"])
    whole = bar.simulate(1.0, y0, REGULAR, rtol=1e-11, sensitivities=["y0"])
    named = bar.simulate(1.0, START, REGULAR, rtol=1e-11, sensitivities=["theta_0"])
    along = whole.sensitivity["y0"] @ named.sensitivity["theta_0"][0]
    np.testing.assert_allclose(along[-1], named.sensitivity["theta_0"][-1], rtol=1e-9)


def test_inertias_follow_lengths_unless_they_are_given(bar):
    free = bar.simulate(1.0, START, REGULAR, rtol=1e-11, sensitivities=["m_1", "I_1"])
    held = bar.simulate(
        1.0, START, REGULAR | {"I_1": bar.defaults["I_1"]}, rtol=1e-11, sensitivities=["m_1"]
    )
    follows = free.sensitivity["m_1"] - free.sensitivity["I_1"] * (bar.defaults["l_1"] ** 2 / 12)
    np.testing.assert_allclose(follows, held.sensitivity["m_1"], rtol=1e-8, atol=1e-9)


def test_past_a_change_point_lengths_have_no_derivative(bar):
    start = {"theta_0": np.radians(85)}
    sol = bar.simulate(2.0, start, rtol=1e-9, sensitivities=["l_3", "theta_0", "m_1"])
    crossed = sol.change_points[0].t
    by_length = sol.sensitivity["l_3"]
    last = sol.t[sol.t < crossed][-1]
    assert np.isfinite(by_length[sol.t <= last]).all()
    assert np.isnan(by_length[sol.t > crossed]).all()
    assert np.isfinite(sol.sensitivity["theta_0"]).all()
    assert np.isfinite(sol.sensitivity["m_1"]).all()
    (note,) = sol.sensitivity.notes
    assert "by l_3" in note
    assert "change point" in note


def test_where_the_loop_just_closes_there_is_no_derivative(bar):
    """At the rocker's dead point crank and coupler are in line."""
    high = bar.limits("theta_2", params=REGULAR)[-1][1]
    sol = bar.simulate(0.01, {"theta_2": high}, REGULAR, sensitivities=["theta_2", "m_1"])
    assert np.isnan(sol.sensitivity["theta_2"]).all()
    assert np.isfinite(sol.sensitivity["m_1"]).all()
    assert "just close" in sol.sensitivity.notes[0]


def test_a_start_at_a_change_point_has_no_derivatives(bar):
    """Two branches leave it: the derivative by a length does not exist there."""
    y0 = bar.assemble({"theta_0": np.pi}, speeds={"omega_0": 2.0}, guess={"omega_1": -0.58})
    with pytest.raises(MechcError, match="begins at a change point"):
        bar.simulate(0.3, y0, sensitivities=["l_0"])
    with pytest.raises(MechcError, match="begins at a change point"):
        bar.simulate(0.3, y0).gradient(end="theta_1", by=["m_1"])


def test_within_rounding_of_a_change_point_a_note_says_that_it_is_one(bar):
    y0 = bar.assemble({"theta_0": np.pi - 1e-10}, {"omega_0": 2.0}, guess={"omega_1": -0.58})
    (note,) = bar.simulate(0.01, y0, sensitivities=["l_0"]).sensitivity.notes
    assert "or this is a change point, where derivatives do not exist" in note
