"""The motion near a change point, in 38 digits: what is kept in data/ comes out again."""

import pytest
from mpmath import mpf

from benchmarks.problems.data import reference
from benchmarks.references import command, near_misses


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("ground", [3.9, 4.001])
def test_the_digits_that_are_kept_come_out_again(ground):
    known = reference("four_bar_near_misses")[repr(ground)]["0.5"]
    (found,) = near_misses.motion(ground, (0.5,))
    assert max(abs(a - mpf(b)) for a, b in zip(found, known, strict=True)) < mpf(10) ** -18


def test_a_name_that_is_no_reference_is_refused(capsys):
    with pytest.raises(SystemExit) as raised:
        command.main(["nonsense"])
    assert raised.value.code == 2
    assert "four_bar_near_misses" in capsys.readouterr().err
