"""Derivatives by values of sampled signals: against differences, constants, and backwards."""

import numpy as np
import pytest

import mechc
from tests.runtime.sensitivities.test_run import GIVEN, START, T, swing
from tests.support.differences import apart, extrapolated

__all__ = ["swing"]  # a compiled scene of other tests
TIMES = np.linspace(0.0, T, 6)
VALUES = np.array([0.3, -0.8, 0.5, 0.9, -0.2, 0.4])
KINDS = ("previous", "linear", "cubic", "quintic")


def moved(model, values, kind="linear", **policy):
    torque = mechc.Signal(TIMES, values, kind)
    return model.simulate(T, START, GIVEN, inputs={"F": torque}, **policy)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("method", ["gauss8", "dop853", "radau5"])
def test_by_one_value_and_by_all(swing, kind, method):
    by = ["F", "F[3]"]
    sol = moved(swing, VALUES, kind, method=method, rtol=1e-9, sensitivities=by)
    unit = np.eye(6)[3]
    wanted = extrapolated(
        lambda change: moved(swing, VALUES + change * unit, kind, rtol=1e-13).y[-1], 0.01
    )
    assert apart(sol.sensitivity["F[3]"][-1], wanted) < 1e-8
    assert sol.sensitivity["F"].shape == (len(sol.t), 2, 6)
    np.testing.assert_array_equal(sol.sensitivity["F"][:, :, 3], sol.sensitivity["F[3]"])


@pytest.mark.parametrize("kind", KINDS)
def test_all_values_together_are_a_constant(swing, kind):
    """Also of a signal without kinks, over whose samples a run without derivatives steps."""
    sol = moved(swing, np.full(6, 0.3), kind, sensitivities=["F"])
    held = swing.simulate(T, START, GIVEN, inputs={"F": 0.3}, sensitivities=["F"])
    together = sol.sensitivity(held.t)["F"].sum(axis=-1)
    np.testing.assert_allclose(together, held.sensitivity["F"], rtol=1e-9, atol=1e-12)


def test_values_not_reached_yet_change_nothing(swing):
    sol = moved(swing, VALUES, sensitivities=["F[4]"])
    early = sol.t <= TIMES[3]
    assert not sol.sensitivity["F[4]"][early].any()
    assert sol.sensitivity["F[4]"][~early].any(axis=1).all()


def test_backward_and_forward_agree_to_rounding(swing):
    by = ["F", "l"]
    sol = moved(swing, VALUES, sensitivities=by)
    of_end = sol.gradient(end={"q": 2.0, "push": 0.3}, by=by)
    for name in by:
        wanted = 2.0 * sol.sensitivity[name][-1, 0] + 0.3 * sol.sensitivity_of("push", name)[-1]
        np.testing.assert_allclose(of_end[name], wanted, rtol=1e-12, atol=1e-13)
    of_all = sol.gradient(integral="kinetic_energy", by=["F[2]"])["F[2]"]

    def integral(change):
        values = VALUES + change * np.eye(6)[2]
        tight = moved(swing, values, rtol=1e-12)
        return np.atleast_1d(tight.gradient(integral="kinetic_energy", by=[]).value)

    assert abs(of_all - extrapolated(integral, 0.02)[0]) < 1e-8


def test_gradients_need_steps_that_end_at_samples(swing):
    """A motion over a constant signal takes longer steps; it may be told not to."""
    flat = np.full(6, 0.3)
    with pytest.raises(mechc.MechcError, match=r"by F\[2\] has a kink.*breaks='samples'"):
        moved(swing, flat).gradient(end="q", by=["F[2]"])
    torque = mechc.Signal(TIMES, flat, "linear", breaks="samples")
    sol = swing.simulate(T, START, GIVEN, inputs={"F": torque})
    forth = moved(swing, flat, sensitivities=["F[2]"])
    np.testing.assert_array_equal(sol.y, forth.y)
    found = sol.gradient(end="q", by=["F[2]"])["F[2]"]
    assert abs(found - forth.sensitivity["F[2]"][-1, 0]) < 1e-13


def test_what_has_no_samples_is_refused(swing):
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"F\[6\].*0 to 5"):
        moved(swing, VALUES, sensitivities=["F[6]"])
    with pytest.raises(mechc.MechcError, match="F is given as float"):
        swing.simulate(T, START, GIVEN, inputs={"F": 0.3}, sensitivities=["F[0]"])
    with pytest.raises(mechc.UnknownNameError, match="q"):
        moved(swing, VALUES, sensitivities=["q[0]"])
    with pytest.raises(mechc.UnknownNameError, match="rule for breaks"):
        mechc.Signal(TIMES, VALUES, breaks="never")
    from scipy.interpolate import PchipInterpolator

    smooth = PchipInterpolator(TIMES, VALUES)
    with pytest.raises(mechc.MechcError, match="F is an interpolant"):
        swing.simulate(T, START, GIVEN, inputs={"F": smooth}, sensitivities=["F"])
