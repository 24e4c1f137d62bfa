"""Tolerances for tools whose error is far from the tolerance that they are given."""

import pytest

from benchmarks.peers import with_tighter


def test_tighter_tolerances_are_added_where_the_tightest_are_asked_for():
    assert with_tighter([1e-6, 1e-12]) == pytest.approx([1e-6, 1e-12, 1e-13, 1e-14, 1e-15])
    assert with_tighter([1e-6, 1e-8]) == [1e-6, 1e-8]
