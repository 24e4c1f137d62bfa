"""Options of the whole suite."""

from __future__ import annotations

import pytest
from hypothesis import settings

# --hypothesis-profile=thorough: ten times the random mechanisms, others at every run
settings.register_profile("usual", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("thorough", deadline=None, derandomize=False, max_examples=1000)
settings.load_profile("usual")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files anew from what the compiler emits now",
    )
