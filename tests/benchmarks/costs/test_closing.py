"""What closing loops takes: every figure, its limit."""

import re

import pytest

from benchmarks.costs import closing


@pytest.mark.thorough
def test_every_figure_has_microseconds_and_a_limit_that_is_told(capsys):
    missed = closing.main(["--quick"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert all(re.search(r" +[\d.e+]+ us", line) for line in lines)
    assert missed == any("MISSED" in line for line in lines)
