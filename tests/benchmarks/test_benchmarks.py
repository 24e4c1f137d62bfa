"""The benchmarks measure what they say: envelopes, verdicts, regressions; and one runs through."""

import numpy as np
import pytest


def test_the_forms_given_to_peers_are_the_right_equations(module):
    """The hand-written accelerations equal the compiled ones on the loop."""
    import mechc

    forms, model = module("_four_bar_forms"), mechc.load("four_bar")
    params = {"l_3": 3.5}
    y = model.assemble({"theta_0": 1.1}, speeds={"omega_0": 2.0}, params=params)
    p = model.system.parameter_set.resolve(params)
    given = forms.accelerations(y[:3], y[3:], p, np.sin, np.cos)
    np.testing.assert_allclose(given, model.rhs(0.0, y, params)[3:], rtol=1e-11)


def test_the_first_value_is_measured_in_processes_of_their_own(module):
    """Cold there is something to derive and compile, cached nothing; the values are the same."""
    run = module("first_value")
    row = run.measured("by hand", 1)
    assert {"derive", "emit", "first unit"} <= set(row["cold"])
    assert set(row["cached"]) == {"import mechc", "read", "load", "first value", "processor"}
    assert row["cached"]["processor"] < 0.3 * row["cold"]["processor"]
    assert row["largest difference"] < 1e-12


def test_growth_runs_through_and_goes_on_from_its_rows(module):
    """The smallest chains: columns, file, plot; measured once."""
    growth = module("growth")
    first = growth.main(["--scenes", "planar", "--most", "2"])
    assert [row["links"] for row in first["rows"]["planar"]] == [1, 2]
    assert all(row[c] >= 0 for row in first["rows"]["planar"] for c in growth.COLUMNS)
    again = growth.main(["--scenes", "planar", "--most", "2", "--resume"])
    assert again["rows"] == first["rows"]
    assert (growth.OUT / "growth.svg").stat().st_size > 1000


def test_growth_fits_the_exponent_of_a_power(module):
    growth = module("growth")
    rows = [{"n": n, "links": n, "rhs_us": 3.0 * n**1.5} for n in (1, 5, 10, 20, 40)]
    assert growth.exponent(rows, "rhs_us") == pytest.approx(1.5)
    wrong = {"rows": {}, "follow": [{"status": "finished", "error": 2.0, "n": 40, "rtol": 1e-6}]}
    assert len(growth.missed(wrong)) == 1
