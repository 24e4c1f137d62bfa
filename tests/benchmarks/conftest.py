"""What the benchmarks measure in a test goes into a folder of the test's own."""

import pytest

from benchmarks.timing.results import FOLDER_VARIABLE


@pytest.fixture(autouse=True)
def out(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    return tmp_path
