"""With which C compiler ``setup.py`` builds, where setuptools' own choice will not do.

That is a machine without the compiler that built Python, and Windows: setuptools takes Microsoft's
compiler there, which does not know GNU C.
"""

from __future__ import annotations

import runpy
import shlex
import shutil
import sysconfig
from collections.abc import Mapping
from pathlib import Path

FOUND = Path(__file__).resolve().parents[1] / "src/mechc/compilation/toolchain/found.py"
FOR_ANY_PROCESSOR = "-mcpu=baseline"  # zig compiles for this one, unless it is told
FLAGS = "-O3 -DNDEBUG -fwrapv"
WINDOWS = {"win-amd64": "x86_64-windows-gnu"}  # names of the platform: Python's, and zig's
GNU_ON_WINDOWS = "mingw32"  # setuptools' name of its class for such compilers


def installed(platform: str) -> list[str] | None:
    """The command of a compiler of this machine; None if absent, and always for Windows.

    Programs named gcc are there in several kinds, each with a C library of its own.
    """
    return None if platform in WINDOWS else runpy.run_path(str(FOUND))["installed_compiler"]()


def packaged(platform: str) -> list[str] | None:
    """The command of the package ziglang, for any processor of the platform; None if absent."""
    command = runpy.run_path(str(FOUND))["packaged_compiler"]()
    target = ["-target", WINDOWS[platform]] if platform in WINDOWS else []
    return command and [*command, *target, FOR_ANY_PROCESSOR]


def replacing(environment: Mapping[str, str], platform: str) -> dict[str, str]:
    """Variables for setuptools where the compiler that built Python will not do, and no ``$CC``.

    Python's own flags are for that compiler: of them only those are taken that any other knows.
    """
    if environment.get("CC", "").strip() or (platform not in WINDOWS and has_pythons_own()):
        return {}
    command = installed(platform) or packaged(platform)
    if not command:
        return {}
    flags = environment.get("CFLAGS", FLAGS)
    linker = environment.get("LDSHARED", shlex.join([*command, "-shared"]))
    return {"CC": shlex.join(command), "CFLAGS": flags, "LDSHARED": linker}


def has_pythons_own() -> bool:
    """Whether the compiler that built Python is on this machine."""
    own = shlex.split(sysconfig.get_config_var("CC") or "")
    return bool(own and shutil.which(own[0]))


def executables(environment: Mapping[str, str], import_library: Path) -> dict[str, list[str]]:
    """What setuptools' class for GNU C runs for Windows, where it looks at ``$CC`` alone.

    Python's header says for Microsoft's compiler only that the system has 64 bits.  The library
    for linking with a module, which nobody does, would be written beside it, and so into the wheel.
    """
    command = shlex.split(environment.get("CC", "gcc"))
    compiler = [*command, *shlex.split(environment.get("CFLAGS", FLAGS)), "-DMS_WIN64"]
    linker = shlex.split(environment.get("LDSHARED", "")) or [*command, "-shared"]
    aside = f"-Wl,--out-implib,{import_library}"
    return {"compiler": compiler, "compiler_so": compiler, "linker_so": [*linker, aside]}
