"""An optional package that is absent is told from one that is broken."""

import sys

import pytest

from mechc.errors import MissingPackageError, package


def test_a_package_that_is_absent_is_told_with_the_advice(monkeypatch):
    for name in ("no_such_package", "no_such_package.part"):
        with pytest.raises(MissingPackageError, match=r"^pip install it$"):
            package(name, "pip install it")
    monkeypatch.setitem(sys.modules, "hidden_package", None)
    with pytest.raises(MissingPackageError, match=r"^pip install it$"):
        package("hidden_package", "pip install it")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("import no_such_package", "ModuleNotFoundError: No module named 'no_such_package'"),
        ("from math import tau2", "ImportError: cannot import name 'tau2'"),
        ("raise OSError('libbroken.so: file too short')", "OSError: libbroken.so: file too short"),
        ("from .missing import part", "ModuleNotFoundError: No module named 'broken_package.miss"),
    ],
)
def test_a_package_that_is_broken_is_told_with_the_reason(line, words, tmp_path, monkeypatch):
    (tmp_path / "broken_package").mkdir()
    (tmp_path / "broken_package" / "__init__.py").write_text(line)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingPackageError) as told:
        package("broken_package", "pip install it")
    assert f"broken_package is installed but cannot be imported: {words}" in str(told.value)
