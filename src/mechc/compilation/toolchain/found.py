"""The C compilers of a machine: its own, and that of the package ``ziglang``.

The build of mechc runs this file too, when mechc itself cannot be imported yet: it imports the
standard library alone.
"""

from __future__ import annotations

import importlib.util
import shlex
import shutil
import sysconfig


def installed_compiler() -> list[str] | None:
    """gcc, clang, cc or Python's own; None if absent."""
    for name in ("gcc", "clang", "cc"):
        if shutil.which(name):
            return [name]
    words = shlex.split(sysconfig.get_config_var("CC") or "")  # slow
    return words if words and shutil.which(words[0]) else None


def packaged_compiler() -> list[str] | None:
    """The clang in the Python package ``ziglang``, of the extra ``compiler``; None if absent.

    By its defaults code compiled with little optimisation checks for undefined behaviour, which
    needs a library, and has debug information.
    """
    package = importlib.util.find_spec("ziglang")
    for folder in (package and package.submodule_search_locations) or ():
        if found := shutil.which("zig", path=folder):
            return [found, "cc", "-fno-sanitize=undefined", "-g0"]
    return None
