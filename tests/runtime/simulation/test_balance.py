"""The energy of a run against the work that was done on it, and a warning where it is far off."""

import numpy as np
import pytest
from sympy import cos
from sympy.physics.mechanics import (
    dynamicsymbols,
)

import mechc
from benchmarks.problems.particle import particle
from mechc.simulation.balance import energy_note, energy_of_errors, imbalance
from mechc.simulation.record import Record
from tests.support import scenes

METHODS = ("dopri5", "dop853", "radau5", "gauss8")
q, u = dynamicsymbols("q u")


class Tampered(Record):
    """A motion whose speeds are larger by a part from the middle on."""

    def __init__(self, record, part):
        super().__init__(record.pieces)
        self.part, t = part, record.times()
        self.middle = t[len(t) // 2]

    def states(self):
        t, y = super().states()
        return t, self._changed(t, y)

    def ends(self):
        t, y = super().ends()
        return t, self._changed(t, y)

    def interpolate(self, t):
        return self._changed(t, super().interpolate(np.ascontiguousarray(t)))

    def _changed(self, t, y):
        y = y.copy()
        y[t > self.middle, y.shape[1] // 2 :] *= 1 + self.part
        return y


def judged(sol, run):
    run.stats = {"rhs_evaluations": 10**6, "examined": 0, "rounding": 0.0}
    return energy_note(sol.system, run, sol.policy)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-6, 1e-9, 1e-12])
def test_no_alarm_where_all_is_right(model, regular, method, rtol):
    params, start = regular
    for given in (params, {"l_3": 4.0}, {"l_3": 3.99}):
        start = model.assemble({"theta_0": np.radians(85)}, params=given)
        sol = model.simulate(20.0, start, given, method=method, rtol=rtol)
        assert "energy" not in str(sol.status)
        assert not judged(sol, sol.record)


@pytest.mark.parametrize(("part", "seen"), [(1e-1, True), (1e-2, True), (0.0, False)])
def test_energy_from_nowhere_is_said(model, regular, part, seen):
    params, start = regular
    sol = model.simulate(20.0, start, params)
    told = judged(sol, Tampered(sol.record, part))
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
    model = mechc.compile(scenes.bead_with(FORCES[name]), outputs=("energy",))
    sol = model.simulate(5.0, {"q": 1.0, "u": 0.0}, rtol=1e-8)
    kinetic = sol.system.kinetic_energy(sol.y, sol.params).max()
    assert np.ptp(sol.energy) > 0.1 * kinetic
    assert imbalance(sol.system, sol.record) < 1e-6 * kinetic
    assert not judged(sol, sol.record)
    off = imbalance(sol.system, Tampered(sol.record, 0.05))
    assert off > energy_of_errors(sol.system, sol.t, sol.y, sol.params, sol.policy, 1e-8)


def test_a_run_that_ends_early_is_not_judged(model, regular):
    params, start = regular
    sol = model.simulate(20.0, start, params, max_steps=20)
    assert "energy" not in str(sol.status)


# -- the work done ----------------------------------------------------------------------------

MASS = 2.0
DRIVEN = -u / 2 + 3 * cos(2 * dynamicsymbols._t)
START = {q: 1.0, u: 0.5}


def driven_bead(force):
    """A bead of 2 kg on a straight wire under a force, with its kinetic energy alone."""
    return mechc.compile(particle([q], [u], [force], MASS))


@pytest.mark.parametrize("method", METHODS)
def test_where_energy_is_conserved_no_work_is_done(model, regular, method):
    params, start = regular
    sol = model.simulate(5.0, start, params, method=method)
    assert np.all(sol.work == 0.0)
    change = np.abs(sol.energy - sol.energy[0]).max()
    assert sol.energy_drift == change / model.kinetic_energy(sol.y, params).max()


def test_the_work_of_a_damper_and_of_a_force_of_time_is_theirs():
    model = driven_bead(DRIVEN)
    sol = model.simulate(5.0, START, rtol=1e-10)
    t = np.linspace(0, 5, 5001)
    speed = sol(t)[:, 1]
    power = speed * (-speed / 2 + 3 * np.cos(2 * t))
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(t))])
    np.testing.assert_allclose(sol.work_until(t), work, atol=1e-6 * np.abs(work).max())
    assert np.ptp(sol.energy) > 0.1
    assert sol.energy_drift < 1e-9
    shown = model.simulate(5.0, START, rtol=1e-10, t_eval=[1.0, 2.0])
    np.testing.assert_allclose(shown.work, sol.work_until([1.0, 2.0]), rtol=1e-12)
    assert shown.energy_drift == sol.energy_drift


def test_backwards_too():
    sol = driven_bead(-u / 2).simulate((5.0, 0.0), START)
    assert sol.energy[-1] > sol.energy[0]
    np.testing.assert_allclose(sol.work, sol.energy - sol.energy[0], atol=1e-8)


def test_what_a_reset_takes_away_is_work():
    floor = mechc.Event(lambda t, y: y[0], direction=-1, reset=lambda t, q, u: (q, -0.5 * u))
    sol = driven_bead(-u / 5).simulate(1.6, {q: 1.0, u: -1.0}, events=[floor])
    before, after = sol.segments[0].y1, sol.segments[1].y0
    (at,) = np.flatnonzero(np.diff(sol.t) == 0.0)
    lost = MASS / 2 * (before[1] ** 2 - after[1] ** 2)
    assert sol.work[at] - sol.work[at + 1] == pytest.approx(lost, rel=1e-9)
    assert sol.energy_drift < 1e-9


def test_without_dense_output_only_a_conserved_energy_is_judged(model, regular):
    params, start = regular
    assert model.simulate(5.0, start, params, dense=False).energy_drift < 1e-9
    fast = {"theta_0": 1.0, "omega_0": 300.0}  # 600 rad, with coarser digits
    turning = {"l_0": 1.0, "l_1": 3.0, "l_2": 2.5, "l_3": 3.5}
    assert model.simulate(2.0, fast, turning, dense=False).energy_drift < 1e-9
    sol = driven_bead(-u / 5).simulate(1.0, START, dense=False)
    assert np.isnan(sol.energy_drift)
    assert np.isnan(sol.work).all()


def test_a_loose_run_is_out_of_balance():
    model = driven_bead(DRIVEN)
    loose, tight = (model.simulate(5.0, START, rtol=rtol) for rtol in (1e-3, 1e-9))
    assert loose.energy_drift > 100 * tight.energy_drift
