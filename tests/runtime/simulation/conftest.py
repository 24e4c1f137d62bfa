"""Scenes on a line that several files of tests let jump."""

import pytest

from tests.support.impacts import points_on_a_line


@pytest.fixture(scope="session")
def ball():
    return points_on_a_line("ball", 1, lambda q, u, m: -9.81 * m)


@pytest.fixture(scope="session")
def five_springs():
    return points_on_a_line("five_springs", 5, lambda q, u, m: -4 * m * q)
