"""The table of optimal motions with known costs."""

from __future__ import annotations

import pytest

from benchmarks.formulations import optimal


@pytest.mark.thorough
def test_exact_derivatives_and_differences_find_the_known_cost(capsys) -> None:
    assert optimal.main(["--only", "thrown ball", "--solver", "slsqp"]) == 0
    rows = capsys.readouterr().out.splitlines()[1:]
    assert [row[19:31].strip() for row in rows] == ["exact", "differences"]
    for row in rows:
        assert abs(float(row[31:].split()[1])) < 1e-6, row
