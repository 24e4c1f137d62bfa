"""Branches: folds, branchings, tori and their numbers by theory; ends and refusals."""

import numpy as np
import pytest

import mechc
from tests.support.pendulums import driven_pendulum, van_der_pol

WEAK = {"mu": 0.1, "A": 3.0}
DRIVEN = "2*pi/Omega"


def cycle_of(model, params, start=1.0, seconds=300):
    """The cycle that a driven motion settles on, at an instant when the drive's phase is 0."""
    period = 2 * np.pi / params["Omega"]
    late = model.simulate(round(seconds / period) * period, {"q": start}, params).y[-1]
    return model.periodic(late, DRIVEN, params)


def amplitude(cycle):
    return np.abs(cycle.samples(2001)[:, 0]).max()


def test_entrainment_ends_at_folds_where_averaging_says():
    """rho = a^2/4 at the folds is (2 +- sqrt(1 - 3 s^2)) / 3, s = (1 - Omega^2) / (mu Omega)
    (Guckenheimer and Holmes 1983, section 2.1), to the order of mu."""
    branch = cycle_of(van_der_pol(), {**WEAK, "A": 0.6, "Omega": 1.02}).follow("A", (0.6, 0.01))
    s = (1 - 1.02**2) / (0.1 * 1.02)
    rho = (2 + np.array([1, -1]) * np.sqrt(1 - 3 * s**2)) / 3
    folds = branch.folds
    assert [amplitude(p.cycle) for p in folds[:2]] == pytest.approx(2 * np.sqrt(rho), rel=0.01)
    assert [abs(p.cycle.multipliers - 1).min() for p in folds[:2]] == pytest.approx(
        [0, 0], abs=1e-6
    )
    assert not (branch.stable & (branch.values < folds[0].value)).any()


def test_entrainment_far_from_resonance_ends_at_a_torus_where_averaging_says():
    """At rho = a^2/4 = 1/2."""
    branch = cycle_of(van_der_pol(), {**WEAK, "Omega": 1.3}).follow("A", (3.0, 0.8), step=0.1)
    (torus,) = branch.special
    assert torus.kind == "torus"
    assert abs(torus.cycle.multipliers) == pytest.approx([1, 1], abs=1e-6)
    assert amplitude(torus.cycle) == pytest.approx(np.sqrt(2), rel=1e-3)
    with pytest.raises(mechc.MechcError, match="no other branch of cycles begins at a torus"):
        torus.switch()


def test_a_symmetric_cycle_loses_its_symmetry_at_a_branching():
    whole = cycle_of(driven_pendulum(), {"gamma": 0.95, "Omega": 2 * np.pi}, 0.0, 40)
    branch = whole.follow("gamma", (0.95, 1.02), step=0.2)
    (point,) = branch.special
    assert point.kind == "branching"
    lopsided = point.switch()

    def asymmetry(cycle):
        half = cycle.solution(0.5) + cycle.y0
        return abs(half[0] - 2 * np.pi * np.round(half[0] / (2 * np.pi)))

    assert asymmetry(point.cycle) < 1e-3 < 0.05 < asymmetry(lopsided)
    assert lopsided.shot.trial.value > point.value
    assert lopsided.stable


def test_a_branch_ends_at_its_ends_or_after_the_most_cycles():
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5)
    branch = cycle.follow("mu", (1.0, 2.0), step=0.3)
    assert branch.values[[0, -1]] == pytest.approx([1.0, 2.0], abs=1e-15)
    assert branch[-1].period == pytest.approx(7.6298744797, abs=1e-8)  # by scipy's DOP853
    few = cycle.follow("mu", (1.0, 2.0), most=3, step=0.01)
    assert (len(few), few.ended) == (3, "3 cycles")
    assert str(few).count("\n") == 4
    assert few.plot("u") is not None


def test_a_branch_is_refused_outside_its_ends_and_without_its_parameter():
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="must lie within the ends"):
        cycle.follow("mu", (2.0, 3.0))
    with pytest.raises(mechc.UnknownNameError):
        cycle.follow("nu", (0.0, 3.0))


def test_the_drives_frequency_is_followed_by_a_period_that_follows_it():
    given = {"gamma": 0.2, "Omega": 2 * np.pi}
    cycle = cycle_of(driven_pendulum(), given, 0.0, 20)
    branch = cycle.follow("Omega", (2 * np.pi, 7.0))
    assert branch.periods * branch.values == pytest.approx(np.full(len(branch), 2 * np.pi))
    fixed = driven_pendulum().periodic(cycle.y0, 1.0, given)
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"period='2\*pi/Omega'"):
        fixed.follow("Omega", (2 * np.pi, 7.0))


def test_arguments_that_lead_to_no_branch_are_refused():
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5)
    with pytest.raises(mechc.ValueOutOfBoundsError, match="time drives the motion where A"):
        cycle.follow("A", (0.0, 0.5))
    with pytest.raises(mechc.ValueOutOfBoundsError, match="already at the second end"):
        cycle.follow("mu", (0.5, 1.0))
    with pytest.raises(mechc.MechcError, match="step"):
        cycle.follow("mu", (1.0, 0.5), step=-0.1)
