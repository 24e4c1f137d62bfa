"""The faults that are put in one at a time are those of the files as they are."""

import pytest

from tests.mutants.faults import FAULTS
from tests.support import ROOT


def test_there_are_enough():
    assert len(FAULTS) >= 60
    assert len({fault.says for fault in FAULTS}) == len(FAULTS)


@pytest.mark.parametrize("number", range(len(FAULTS)))
def test_a_fault_has_one_place(number):
    fault = FAULTS[number]
    assert (ROOT / fault.path).read_text("utf-8").count(fault.says) == 1
    assert fault.says != fault.instead
