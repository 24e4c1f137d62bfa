"""What fuzzers, fault injection and sanitizers share."""

import subprocess
from pathlib import Path

from mechc.compilation import toolchain


def preloadable(name: str, folder: Path) -> Path:
    """The C file of this name, compiled to a library for LD_PRELOAD in the folder."""
    target, source = folder / f"{name}.so", Path(__file__).with_name(f"{name}.c")
    command = [*toolchain.compiler(), "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([*command, str(source), "-ldl", "-o", str(target)], check=True)
    return target
