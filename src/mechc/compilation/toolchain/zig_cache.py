"""The cache in which the compiler of ``ziglang`` keeps its compiled C library."""

from __future__ import annotations

import os
from pathlib import Path

from mechc.compilation.cache import security

_VARIABLE = "ZIG_GLOBAL_CACHE_DIR"


def environment(folder: Path) -> dict[str, str]:
    """The variable that names it, for a compilation in ``folder``; nothing if the user set it."""
    return {} if os.environ.get(_VARIABLE) else {_VARIABLE: str(_place(folder))}


def _place(folder: Path) -> Path:
    """zig's default; if it cannot be written, beside the compiled scenes, or else in ``folder``.

    Without it zig compiles nothing.  Where the user's cache folder is read-only or full, scenes are
    in a folder of this process, and this is there too.
    """
    if private := security.private_folder():
        return private / "zig"
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    for place in (Path(os.path.expanduser(base)), security.cache_folder()):
        if _can_be_made(place):
            return place / "zig"
    return folder / "zig"


def _can_be_made(folder: Path) -> bool:
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return os.access(existing, os.W_OK)
