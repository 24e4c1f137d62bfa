"""Derivatives of motions against those in 30 digits."""

import numpy as np
import pytest

from benchmarks.problems.data import reference
from benchmarks.references import command
from benchmarks.references.sensitivities import derivatives, sensitivities
from tests.support.marks import slow_among


@pytest.mark.parametrize("name", slow_among(["pendulum", "stiff_masses"], ["stiff_masses"]))
def test_errors_are_within_the_tolerance_times_the_condition(name: str, capsys):
    assert derivatives.main(["--only", name]) == 0
    told = capsys.readouterr().out
    assert told.count(name) == len(list(derivatives.rows(name)))


@pytest.mark.thorough
def test_errors_through_strikes_and_jumps():
    rows = list(derivatives.rows("struck_pendulum"))
    assert len(rows) == 8
    assert all(row.fine for row in rows)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["four_bar_regular", "four_bar_change_point"])
def test_errors_through_loops(name: str):
    rows = list(derivatives.rows(name))
    assert len(rows) == 8
    assert all(row.fine for row in rows)


def test_an_error_shows():
    row = derivatives.Row("pendulum", "gauss8", 1e-6, 1e-3, 1e-6, 2.0)
    assert not row.fine
    assert not row._replace(error=1e-6, backwards=1e-3).fine


def test_every_family_has_a_second_way():
    assert set(sensitivities.SECOND) == set(sensitivities.FAMILIES)
    found = sensitivities.confirmed("stiff_masses")
    assert found["stiff_masses"]["digits"] >= sensitivities.WRITTEN - 1


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["pendulum", "struck_pendulum"])
def test_both_ways_again_give_what_is_written(name):
    pytest.importorskip("gmpy2")  # without it minutes
    assert sensitivities.computed(name) == reference("sensitivities")[name]


def test_the_data_are_those_of_the_families():
    """The stiff scene's, computed again by its matrix exponential and by its modes."""
    data, family = reference("sensitivities"), sensitivities.FAMILIES["stiff_masses"]()
    assert set(data) == {*sensitivities.FAMILIES, "digits"}
    assert data["digits"] == min(data[name]["digits"] for name in sensitivities.FAMILIES)
    assert data["digits"] >= command.NEEDED
    assert sensitivities.computed("stiff_masses")["by"] == data["stiff_masses"]["by"]
    found = np.array(sensitivities.derivative(family, "k_0"), float)
    np.testing.assert_allclose(
        found, np.array(data["stiff_masses"]["by"]["k_0"], float), rtol=1e-14
    )
