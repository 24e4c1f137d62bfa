"""The law that tests of the first run compile nothing is kept by a plugin, not by care."""

from pathlib import Path

import pytest

from mechc.compilation import toolchain


def test_a_compilation_in_a_test_of_the_first_run_fails_with_the_law(tmp_path: Path) -> None:
    with pytest.raises(pytest.fail.Exception, match="compiles nothing"):
        toolchain.compile_shared(tmp_path, "none.c", (), (), tmp_path / "none.so")


@pytest.mark.compiles
def test_one_that_is_marked_compiles(tmp_path: Path) -> None:
    (tmp_path / "one.c").write_text("int one = 1;", "utf-8")
    toolchain.compile_shared(tmp_path, "one.c", (), (), tmp_path / "one.so")
    assert (tmp_path / "one.so").stat().st_size
