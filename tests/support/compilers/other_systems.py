"""The extension modules compiled for other systems by the packaged clang.

Python's headers are this machine's but for ``pyconfig.h`` of Windows, of which there is what the
headers and Cython's C ask for; its import library is made from the names in the headers.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

from mechc_codegen.extension.flags import RUNTIME

from mechc.compilation import toolchain
from tests.support import ROOT

WINDOWS = "x86_64-windows-gnu"
NATIVE = ROOT / "src" / "mechc" / "native"
_WINDOWS_PYCONFIG = """
#pragma once
#define MS_WINDOWS
#define MS_WIN32
#define MS_WIN64
#define NT_THREADS
#define Py_ENABLE_SHARED
#define HAVE_DECLSPEC_DLL
#define HAVE_UINTPTR_T 1
#define HAVE_WCHAR_H 1
#define HAVE_STDARG_PROTOTYPES
#define HAVE_SYS_TYPES_H 1
#define HAVE_LONG_LONG 1
#define HAVE_SSIZE_T 1
#define SIZEOF_SHORT 2
#define SIZEOF_INT 4
#define SIZEOF_LONG 4
#define SIZEOF_LONG_LONG 8
#define SIZEOF_VOID_P 8
#define SIZEOF_SIZE_T 8
#define SIZEOF_TIME_T 8
#define SIZEOF_WCHAR_T 2
#define SIZEOF_PID_T 4
#define ALIGNOF_SIZE_T 8
#define ALIGNOF_MAX_ALIGN_T 8
#define WITH_DOC_STRINGS 1
"""


def zig(*arguments: str) -> None:
    """Run a command of the packaged compiler."""
    program = (toolchain.packaged_compiler() or ["zig"])[0]
    subprocess.run([program, *arguments], check=True)


def c_of_extensions(folder: Path) -> list[Path]:
    """The C that Cython makes of each extension module."""
    made = []
    for source in sorted(NATIVE.glob("*.pyx")):
        made.append(folder / f"{source.stem}.c")
        command = [sys.executable, "-m", "cython", "-3", f"-I{ROOT / 'src'}"]
        named = ["--module-name", f"mechc.native.{source.stem}", "-o", str(made[-1])]
        subprocess.run([*command, *named, str(source)], check=True)
    return made


def headers(folder: Path, target: str) -> Path:
    """Python's headers, for the target."""
    here = Path(sysconfig.get_path("include"))
    if "windows" not in target:
        return here
    shutil.copytree(here, folder / "include")
    (folder / "include" / "pyconfig.h").write_text(_WINDOWS_PYCONFIG)
    return folder / "include"


def import_library(folder: Path, include: Path) -> Path:
    """That of Python's library for Windows; names too many do no harm."""
    texts = (header.read_text("utf-8") for header in include.rglob("*.h"))
    names = sorted({name for text in texts for name in re.findall(r"\b_?Py[A-Z_]\w*", text)})
    library = f"python3{sys.version_info.minor}"
    definition = folder / f"{library}.def"
    definition.write_text(f"LIBRARY {library}.dll\nEXPORTS\n" + "\n".join(names) + "\n")
    made = folder / f"{library}.lib"
    zig("dlltool", "-m", "i386:x86-64", "-d", str(definition), "-l", str(made))
    return made


def linked(folder: Path, target: str, sources: Sequence[Path], include: Path) -> list[Path]:
    """Each source compiled and linked to an extension module."""
    on_windows = "windows" in target
    flags = ["-std=gnu11", "-O0", "-g0", "-fno-sanitize=undefined", "-Wno-absolute-value"]
    if "macos" in target:
        libraries = ["-undefined", "dynamic_lookup"]
    else:
        libraries = [str(import_library(folder, include))] if on_windows else ["-fPIC"]
    made = [folder / f"{source.stem}{'.pyd' if on_windows else '.so'}" for source in sources]
    for source, module in zip(sources, made, strict=True):
        paths = [f"-I{include}", f"-I{RUNTIME}", str(source), *libraries, "-o", str(module)]
        zig("cc", "-target", target, "-shared", *flags, *paths)
    return made
