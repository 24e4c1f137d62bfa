"""Scenes on a line that several files of tests let jump."""

import pytest

from tests.support.impacts import points_on_a_line


@pytest.fixture(scope="session")
def ball():
    """Falls; its stop may stand at a height h, with a restitution e that nothing else contains."""
    more = {"e": 0.5, "h": 0.0}
    return points_on_a_line("ball", 1, lambda q, u, m: -9.81 * m, parameters=more)


@pytest.fixture(scope="session")
def five_springs():
    return points_on_a_line("five_springs", 5, lambda q, u, m: -4 * m * q)
