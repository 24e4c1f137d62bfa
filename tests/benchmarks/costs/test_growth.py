"""What more links cost: columns, exponents, an earlier run's rows."""

import pytest

from benchmarks.costs import growth
from benchmarks.timing import results


@pytest.mark.thorough
def test_growth_runs_through_and_goes_on_from_its_rows(out):
    """The smallest chains: columns, file; measured once."""
    assert growth.main(["--scenes", "planar", "--most", "2"]) == 0
    first = results.read(out / "growth.json")
    assert [row["links"] for row in first["rows"]["planar"]] == [1, 2]
    assert all(row[c] >= 0 for row in first["rows"]["planar"] for c in growth.COLUMNS)
    assert growth.main(["--scenes", "planar", "--most", "2", "--resume"]) == 0
    assert results.read(out / "growth.json")["rows"] == first["rows"]


def test_growth_fits_the_exponent_of_a_power():
    rows = [{"n": n, "links": n, "rhs_us": 3.0 * n**1.5} for n in (1, 5, 10, 20, 40)]
    assert growth.exponent(rows, "rhs_us") == pytest.approx(1.5)
    wrong = {"rows": {"planar": [{"n": 40, "rhs_us": 21.0}], "rings": [{"n": 40, "rhs_us": 60.0}]}}
    assert len(growth.missed(wrong)) == 1
