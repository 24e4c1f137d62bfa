"""The figures of fits."""

import pytest

from benchmarks.costs import fitting

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("kind", fitting.PENDULUMS)
def test_intervals_hold_the_truth_as_often_as_they_say(kind: str):
    """Of 40 draws at least 34: fewer have a probability of 0.3 % where it is 95 % a draw."""
    for name, count in fitting.coverage(kind, 40, 7).items():
        assert count >= 34, name


def test_the_command_prints_counts_and_parts_of_the_time(capsys: pytest.CaptureFixture[str]):
    assert fitting.main(["--draws", "2", "--rounds", "2"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert [line.split()[-2] for line in told[:7]] == ["2"] * 7
    assert float(told[7].split(":")[1].split()[0]) > 0
    assert [line.split()[0].isdigit() for line in told[8:]] == [True, True, False]
