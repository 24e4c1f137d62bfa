"""WebAssembly of a mechanism: the exported C, compiled by the package ``ziglang``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mechc.compilation import toolchain
from mechc.compilation.exports.standalone import ExportRequest
from mechc.errors import CompilerError

FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O2", "-ffp-contract=off"),
    *("-Wall", "-Wextra", "-Werror", "-Wl,--no-entry", "-Wl,--strip-all"),
)


@dataclass(frozen=True)
class Web:
    """Attributes
    ----------
    name
        Of the export, an identifier.
    wasm
        The module; it imports nothing.
    about
        Data for JSON: see the compiler's ``WebScene``.
    """

    name: str
    wasm: bytes
    about: dict[str, Any]


def web(asked: ExportRequest, name: str | None) -> Web:
    """Derive and compile.

    Raises
    ------
    CompilerError
        If the package ``ziglang`` is not installed.
    """
    from mechc_codegen.compiler import build_web

    command = web_compiler()
    named = name or asked.mechanism.name
    texts, scene = build_web(asked.mechanism, named, asked.start, asked.values, asked.request)
    with TemporaryDirectory(prefix="mechc-web-") as folder:
        for file, text in {**texts, "web.c": scene.c}.items():
            (Path(folder) / file).write_text(text, "utf-8")
        target = Path(folder) / "web.wasm"
        toolchain.compile_with([*command, *FLAGS], Path(folder) / "web.c", target)
        return Web(named, target.read_bytes(), scene.about)


def web_compiler() -> list[str]:
    """The command that compiles WebAssembly with a C library."""
    command = toolchain.packaged_compiler()
    if command is None:
        raise CompilerError(
            "WebAssembly is compiled by the package ziglang: pip install 'mechc[compiler]'"
        )
    return command
