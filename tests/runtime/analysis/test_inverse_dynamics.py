"""The inputs that produce a motion: against the motion that they were given to."""

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import on_a_line

t = dynamicsymbols._t
REGULAR = {"l_3": 3.5}


def two_masses():
    """One pushed by f, the other by nothing."""
    q, u = dynamicsymbols("q_0:2"), dynamicsymbols("u_0:2")
    return on_a_line(q, u, [Symbol("f"), 0], [Symbol("m")] * 2)


def test_inverse_dynamics_gives_back_the_torque_of_a_motion(four_bar, torque):
    driven = {**REGULAR, torque: 3.7}
    y0 = four_bar.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    sol = four_bar.simulate((0.0, 1.0), y0, driven, t_eval=np.linspace(0, 1, 7))
    rates = four_bar.rhs(sol.t, sol.y, driven)[:, 3:]
    found = four_bar.inverse_dynamics(sol.y, rates, REGULAR, inputs=(torque,), t=sol.t)
    np.testing.assert_allclose(found.inputs, np.full((7, 1), 3.7), rtol=1e-9)
    forces = four_bar.multipliers(sol.y, driven)
    np.testing.assert_allclose(found.multipliers, forces, rtol=1e-8)
    one = four_bar.inverse_dynamics(sol.y[2], rates[2], REGULAR, inputs=(torque,))
    np.testing.assert_allclose(one.inputs, [3.7], rtol=1e-9)


def test_what_no_input_can_make_is_refused(four_bar, torque):
    y = four_bar.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    rates = four_bar.rhs(0.0, y, REGULAR)[3:]
    with pytest.raises(ValueError, match="violate the constraints"):
        four_bar.inverse_dynamics(y, rates + 1.0, REGULAR, inputs=(torque,))
    with pytest.raises(mechc.MechcError, match="not linear in l_0"):
        four_bar.inverse_dynamics(y, rates, REGULAR, inputs=("l_0",))
    with pytest.raises(ValueError, match=r"must have the shape \(3,\)"):
        four_bar.inverse_dynamics(y, rates[:2], REGULAR, inputs=(torque,))
    with pytest.raises(mechc.UnknownNameError):
        four_bar.inverse_dynamics(y, rates, REGULAR, inputs=("T",))
    free = mechc.compile(two_masses(), defaults={"m": 1.0})
    with pytest.raises(mechc.MechcError, match=r"cannot produce this motion: .* remains"):
        free.inverse_dynamics(np.zeros(4), np.array([1.0, 2.0]), inputs=("f",), params={"f": 0.0})


def test_the_inputs_are_those_of_the_model_by_default(four_bar):
    q, u = dynamicsymbols("q"), dynamicsymbols("u")
    force = dynamicsymbols("F")
    pushed = mechc.compile(
        on_a_line([q], [u], [force], [Symbol("m")]), inputs=[force], defaults={"m": 2.0}
    )
    assert pushed.inverse_dynamics([0.0, 0.0], [1.5]).inputs == pytest.approx([3.0])
    y = four_bar.assemble({"theta_0": 1.1}, params=REGULAR)
    with pytest.raises(mechc.MechcError, match="which forces or torques"):
        four_bar.inverse_dynamics(y, np.zeros(3), REGULAR)


def test_the_value_of_an_input_that_is_solved_for_is_not_asked_for():
    """A mass that two forces push: one is known, the other is found."""
    (q, u), (known, sought) = (dynamicsymbols(names) for names in ("q u", "F G"))
    model = mechc.compile(
        on_a_line([q], [u], [known + 2 * sought], [Symbol("m")]), defaults={"m": 2.0}
    )
    partly = model.with_inputs({"F": 1.0})
    for asked in ({}, {"inputs": ("G",)}):
        assert partly.inverse_dynamics([0.0, 0.0], [1.5], **asked).inputs == pytest.approx([1.0])
    with pytest.raises(mechc.MissingInputError, match=r"no value: F\. Give"):
        model.inverse_dynamics([0.0, 0.0], [1.5], inputs=("G",))
    with pytest.raises(mechc.MissingInputError, match=r"no value: G\. Give"):
        partly.rhs(0.0, [0.0, 0.0])
    with pytest.raises(mechc.UnknownNameError, match=r"no input is called 'f'; known are F, G"):
        model.with_inputs({"f": 1.0})
    with pytest.raises(mechc.ValueOutOfBoundsError, match="F"):
        model.with_inputs({"F": np.nan})
