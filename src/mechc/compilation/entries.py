"""Compiled scenes in the cache: looked up, compiled, loaded."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mechc.compilation import cache, toolchain
from mechc.errors import CacheError
from mechc.native._driver import Scene, capsule_of


def found(key: str) -> Scene | None:
    """The scene of an entry that exists and can be loaded."""
    path = cache.find(key)
    try:
        return None if path is None else scene_in(path)
    except ImportError:
        cache.discard(key)
        return None


def made(key: str, make: Callable[[Path], None]) -> Scene:
    """The scene of an entry, made if it is missing, or if it is removed before it is loaded."""
    try:
        return scene_in(cache.entry(key, make))
    except ImportError:
        cache.discard(key)
    path = cache.entry(key, make)
    try:
        return scene_in(path)
    except ImportError as error:
        raise CacheError(
            f"the compiled scene cannot be loaded: {error}. If programs may not run from "
            f"{path.parents[1]} (a file system mounted noexec), set MECHC_CACHE_DIR to a folder "
            "elsewhere; otherwise the compiler does not work for this machine"
        ) from None


def scene_in(path: Path) -> Scene:
    """The scene in a shared object."""
    return Scene(capsule_of(str(path)), None)


def make_outputs_only(scene: Any, folder: Path) -> None:
    """Compile the scene's first unit into ``folder``; only the shared object stays."""
    from mechc_codegen.extension.flags import OUTPUTS_ONLY_FLAGS, RUNTIME

    work = folder / "work"
    scene.write(work)
    flags, includes = [*OUTPUTS_ONLY_FLAGS, *scene.outputs_only_flags], (str(RUNTIME), str(work))
    target = folder / cache.SHARED_OBJECT
    toolchain.compile_shared(work, "scene_outputs_only.c", flags, includes, target)
    shutil.rmtree(work)


def make_whole(scene: Any, folder: Path) -> None:
    """Write, compile and link one scene into ``folder``; only the shared object stays."""
    from mechc_codegen.extension.flags import FLAGS, RUNTIME, SHARED

    work = folder / "work"
    scene.write(work)
    sources = [(name, (*FLAGS, *SHARED, *flags)) for name, flags in scene.flags.items()]
    includes = (str(RUNTIME), str(work))
    objects = toolchain.compile_all(work, sources, includes, side_by_side=False)
    toolchain.link(objects, folder / cache.SHARED_OBJECT)
    shutil.rmtree(work)
