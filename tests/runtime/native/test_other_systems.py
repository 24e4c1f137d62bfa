"""The extension modules for other systems: compiled and linked, nothing of them is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from mechc.compilation import toolchain
from tests.support.other_systems import NATIVE, WINDOWS, c_of_extensions, headers, linked

pytestmark = [
    pytest.mark.slow,
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
