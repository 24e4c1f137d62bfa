"""The extension modules for other systems: compiled and linked, nothing of them is run."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from mechc.compilation import toolchain
from tests.support.compilers.compilation import built_by_setup
from tests.support.compilers.other_systems import (
    NATIVE,
    WINDOWS,
    c_of_extensions,
    headers,
    import_library,
    linked,
)

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(
        toolchain.packaged_compiler() is None, reason="the package ziglang compiles for others"
    ),
]


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return c_of_extensions(tmp_path_factory.mktemp("c"))


@pytest.mark.parametrize(
    ("target", "magic"),
    [
        (WINDOWS, b"MZ"),
        ("aarch64-macos", b"\xcf\xfa\xed\xfe"),
        ("aarch64-linux-gnu.2.28", b"\x7fELF"),
    ],
)
def test_extensions_compile_for_other_systems(
    target: str, magic: bytes, sources: list[Path], tmp_path: Path
) -> None:
    made = linked(tmp_path, target, sources, headers(tmp_path, target))
    assert len(made) == len(list(NATIVE.glob("*.pyx")))
    for module in made:
        content = module.read_bytes()
        assert content.startswith(magic)
        assert f"PyInit_{module.stem}".encode() in content


def test_setup_py_builds_a_shipped_scene_for_windows(tmp_path: Path) -> None:
    """By setuptools' class for GNU C, as on Windows, which is told where Python's files are."""
    include = headers(tmp_path, WINDOWS)
    library = import_library(tmp_path, include)
    kept = {k: v for k, v in os.environ.items() if k not in ("CC", "CFLAGS", "LDSHARED")}
    suffix = f".cp3{sys.version_info.minor}-win_amd64.pyd"
    built = built_by_setup(
        tmp_path,
        ["mechc._scenes.four_bar"],
        {**kept, "SETUPTOOLS_EXT_SUFFIX": suffix},
        *("--plat-name", "win-amd64", "--include-dirs", str(include)),
        *("--library-dirs", str(library.parent), "--libraries", library.stem),
    )
    (module,) = built  # and no import library of it, which would be put into the wheel
    assert module.relative_to(tmp_path / "lib").as_posix() == f"mechc/_scenes/four_bar{suffix}"
    content = module.read_bytes()
    assert content.startswith(b"MZ")
    assert b"PyInit_four_bar" in content
    python = f"{library.stem}.dll".encode()
    needed = {name.lower() for name in re.findall(rb"[\w.-]+\.dll\b", content)}
    assert python in needed
    others = needed - {python, b"kernel32.dll"}
    assert all(name.startswith(b"api-ms-win-crt-") for name in others), others
