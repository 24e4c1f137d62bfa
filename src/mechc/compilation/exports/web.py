"""WebAssembly of a mechanism: the C of a functional mock-up unit, compiled by ``ziglang``."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mechc.compilation import toolchain
from mechc.compilation.exports.fmu import write_sources
from mechc.compilation.exports.standalone import ExportRequest
from mechc.errors import CompilerError, install_command
from mechc.progress import Notice

FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-msimd128", "-std=c99", "-Oz"),
    *("-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wl,--no-entry", "-Wl,--strip-all"),
)


def web(asked: ExportRequest, name: str) -> tuple[bytes, dict[str, Any]]:
    """Derive and compile: the module, which imports nothing, and data for JSON.

    Raises :class:`CompilerError` if the package ``ziglang`` is not installed.
    """
    from mechc_codegen.compiler import build_web
    from mechc_codegen.export.fmu import FmuOptions
    from mechc_codegen.export.web import RTOL, SOURCE

    command = toolchain.packaged_compiler()
    if command is None:
        raise CompilerError(
            f"WebAssembly is compiled by the package ziglang: {install_command('compiler')}"
        )
    options = FmuOptions(name, asked.start, asked.values, RTOL)
    with Notice(f"deriving the equations of {name} ..."):
        texts, about = build_web(asked.mechanism, options, asked.request)
    with TemporaryDirectory(prefix="mechc-web-") as folder:
        write_sources({path: text.encode() for path, text in texts.items()}, Path(folder))
        target = Path(folder) / "web.wasm"
        with Notice(f"compiling {name} to WebAssembly ..."):
            toolchain.compile_with([*command, *FLAGS, f"-I{folder}"], Path(folder) / SOURCE, target)
        return target.read_bytes(), about
