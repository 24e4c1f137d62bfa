"""The energy of a finished run against the work that was done: a warning where it is far off."""

import numpy as np
import pytest
from sympy import cos
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.simulation.balance import energy_note, explained, imbalance
from tests.support import scenes

METHODS = ("dopri5", "dop853", "radau5", "gauss8")
q, u = dynamicsymbols("q u")


class Tampered:
    """A run whose speeds are larger by a part from the middle on."""

    def __init__(self, run, part):
        self.run, self.part, self.count = run, part, run.count
        t = run.times(0)
        self.middle = t[len(t) // 2]

    def times(self, first):
        return self.run.times(first)

    def states(self):
        t, y = self.run.states()
        return t, self._changed(t, y)

    def interpolate(self, t):
        return self._changed(t, self.run.interpolate(np.ascontiguousarray(t)))

    def _changed(self, t, y):
        y = y.copy()
        y[t > self.middle, y.shape[1] // 2 :] *= 1 + self.part
        return y


def judged(sol, run):
    stats = {"rhs_evaluations": 10**6, "examined": 0, "rounding": 0.0}
    return energy_note(sol.system, run, sol.params, sol.policy, stats)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-6, 1e-9, 1e-12])
def test_no_alarm_where_all_is_right(model, regular, method, rtol):
    params, start = regular
    for given in (params, {"l_3": 4.0}, {"l_3": 3.99}):
        start = model.assemble({"theta_0": np.radians(85)}, params=given)
        sol = model.simulate(20.0, start, given, method=method, rtol=rtol)
        assert "energy" not in str(sol.status)
        assert not judged(sol, sol._run)


@pytest.mark.parametrize(("part", "seen"), [(1e-1, True), (1e-2, True), (0.0, False)])
def test_energy_from_nowhere_is_said(model, regular, part, seen):
    params, start = regular
    sol = model.simulate(20.0, start, params)
    told = judged(sol, Tampered(sol._run, part))
    assert bool(told) == seen
    if seen:
        assert "energy is off by" in told[0]
        assert "not to be trusted" in told[0]


FORCES = {
    "a damper": -4 * q - u,
    "a force of time": -4 * q + 3 * cos(2 * dynamicsymbols._t),
    "both": -4 * q - u / 2 + 3 * cos(5 * dynamicsymbols._t),
}


@pytest.mark.parametrize("name", FORCES)
def test_the_work_of_loads_explains_what_changes(name):
    """The potential of a spring that is a force is not known: the bead's kinetic energy alone."""
    model = mechc.compile(scenes.bead_with(FORCES[name]), outputs=("energy",), backend="numpy")
    sol = model.simulate(5.0, {"q": 1.0, "u": 0.0}, rtol=1e-8)
    kinetic = sol.system.kinetic_energy(sol.y, sol.params).max()
    assert np.ptp(sol.energy) > 0.1 * kinetic
    assert imbalance(sol.system, sol._run, sol.params) < 1e-6 * kinetic
    assert not judged(sol, sol._run)
    off = imbalance(sol.system, Tampered(sol._run, 0.05), sol.params)
    assert off > explained(sol.system, sol.t, sol.y, sol.params, sol.policy, 1e-8)


def test_a_run_that_ends_early_is_not_judged(model, regular):
    params, start = regular
    sol = model.simulate(20.0, start, params, max_steps=20)
    assert "energy" not in str(sol.status)
