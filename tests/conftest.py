"""Options of the whole suite."""

from __future__ import annotations

import os

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


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory):
    """A cache of compiled scenes that belongs to the tests alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MECHC_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "compiled"))
        yield


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory):
    """A cache for the library's mechanisms, which each test run compiles once for all workers."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "library"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
