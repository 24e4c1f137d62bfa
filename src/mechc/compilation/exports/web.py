"""WebAssembly of a mechanism: the C of a functional mock-up unit, compiled by ``ziglang``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mechc.compilation import toolchain
from mechc.compilation.exports.standalone import Exported
from mechc.errors import CompilerError

FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-msimd128", "-std=c99", "-Oz"),
    *("-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wl,--no-entry", "-Wl,--strip-all"),
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


def web(asked: Exported, name: str | None) -> Web:
    """Derive and compile.

    Raises
    ------
    CompilerError
        If the package ``ziglang`` is not installed.
    """
    from mechc_codegen.compiler import build_web
    from mechc_codegen.export.fmu import FmuOptions
    from mechc_codegen.export.web import RTOL, SOURCE

    command = web_compiler()
    named = name or asked.mechanism.name
    options = FmuOptions(named, asked.start, asked.values, rtol=RTOL)
    scene = build_web(asked.mechanism, options, asked.request)
    with TemporaryDirectory(prefix="mechc-web-") as folder:
        for file, text in scene.texts.items():
            path = Path(folder) / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
        target = Path(folder) / "web.wasm"
        arguments = [*command, *FLAGS, f"-I{folder}"]
        toolchain.compile_with(arguments, Path(folder) / SOURCE, target)
        return Web(named, target.read_bytes(), scene.about)


def web_compiler() -> list[str]:
    """The command that compiles WebAssembly with a C library."""
    command = toolchain.packaged_compiler()
    if command is None:
        raise CompilerError(
            "WebAssembly is compiled by the package ziglang: pip install 'mechc[compiler]'"
        )
    return command
