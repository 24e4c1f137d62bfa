"""A cache in which nothing is."""

import pytest

from mechc.compilation import build, entries, toolchain
from tests.support.compilers.compilation import compile_as_for_users, compiler_at


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """A cache folder of the test's own, and a process that remembers nothing.

    Nothing is optimised: what is compiled here is compiled again in the next test.
    """
    compile_as_for_users(monkeypatch)
    monkeypatch.setenv("CC", compiler_at("-O0", tmp_path))
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(build, "_compiled", {})
    toolchain.version.cache_clear()
    yield tmp_path
    toolchain.version.cache_clear()


@pytest.fixture
def unit_needed(fresh, monkeypatch):
    """The same where no unit is installed that runs tapes: one is compiled; in processes that read
    the variable too."""
    monkeypatch.setattr(entries, "installed_unit", lambda _: None)
    monkeypatch.setenv("TEST_WITHOUT_UNITS", "1")
    return fresh


@pytest.fixture
def own_parts(monkeypatch):
    """Scenes wait for parts of their own: none is served by the unit for all of its kind."""
    monkeypatch.setattr("mechc_codegen.compiler.kind_of", lambda _: ())
