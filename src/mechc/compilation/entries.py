"""Compiled scenes in the cache: looked up, compiled, loaded."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from mechc.compilation import cache, toolchain
from mechc.compilation.toolchain.processor import environment
from mechc.errors import CacheError
from mechc.native._driver import capsule_of, model_of_tape
from mechc.progress import Notice

_LONGEST_KEY = 100
_TAPE = b"mechc tape 1\0\0\0\0"  # what tapes begin with: see runtime/tape/read.h


def model_of(path: Path) -> Any:
    """The model of an entry: compiled, or a tape and the unit that runs it.

    Raises ImportError if it cannot be loaded.
    """
    try:
        with path.open("rb") as file:
            if file.read(len(_TAPE)) != _TAPE:
                return capsule_of(path)
            (size,) = struct.unpack("Q", file.read(8))
            unit = file.read(min(size, _LONGEST_KEY)).decode("ascii")
            file.seek(0)
            tape = file.read()
        shared = cache.find(unit) if cache.is_of_all(unit) else None
        if shared is None:
            raise ImportError("the unit that runs this tape is not there")
        with cache.copied(shared) as own:  # each scene needs one
            return model_of_tape(own, tape)
    except (OSError, UnicodeDecodeError, struct.error) as error:
        raise ImportError(f"{path}: {error}") from None


def load(key: str, load: Callable[[Path], Any] | None = None) -> Any:
    """The content of an entry, if it exists and can be loaded, else None; by default a model."""
    load = load or model_of
    path = cache.find(key)
    known = None if path is None else cache.identity(path)
    try:
        return None if path is None else load(path)
    except ImportError:
        cache.discard(key, known)
        return None


def load_or_make(
    key: str, make: Callable[[Path], None], load: Callable[[Path], Any] | None = None
) -> Any:
    """The content of an entry, which is made if it is missing or removed before it is loaded."""
    load = load or model_of
    path = cache.entry(key, make)
    known = cache.identity(path)
    try:
        return load(path)
    except ImportError:
        cache.discard(key, known)
    path = cache.entry(key, make)
    try:
        return load(path)
    except ImportError as error:
        raise CacheError(
            f"what was compiled cannot be loaded: {error}. If programs may not run from "
            f"{path.parents[1]} (a file system mounted noexec), set MECHC_CACHE_DIR to a folder "
            "elsewhere; otherwise the compiler does not work for this machine"
        ) from None


def make_first(scene: Any, folder: Path) -> None:
    """Make what a scene begins with in ``folder``: its tape, or its first unit, compiled.

    Either holds the texts of the scene too, which its parts are compiled from.
    """
    from mechc_codegen.emit.tape.scene_tape import whole_tape
    from mechc_codegen.emit.units.scene_files import texts_source
    from mechc_codegen.extension.flags import OUTPUTS_ONLY_FLAGS, RUNTIME

    target, texts = folder / cache.SHARED_OBJECT, scene.as_json()
    if scene.tape:
        target.write_bytes(whole_tape(scene.tape, _tapes_unit(scene), texts))
        return
    work, flags = folder / "work", [*OUTPUTS_ONLY_FLAGS, *scene.widest_flags]
    scene.write(work)
    (work / "first_unit.c").write_text(texts_source("scene_outputs_only.c", texts), "utf-8")
    toolchain.compile_shared(work, "first_unit.c", flags, (str(RUNTIME), str(work)), target)
    shutil.rmtree(work)


def _object(work: Path, source: tuple[str, Sequence[str]], includes: Sequence[str]) -> Path:
    return toolchain.compile_all(work, [source], includes, side_by_side=False)[0]


def _tapes_unit(scene: Any) -> str:
    """The key of the unit that runs the tapes of the scene's kind, compiled once for all of it."""
    from mechc_codegen.emit.units.general import series_source, tapes_source
    from mechc_codegen.extension.build import general_signature
    from mechc_codegen.extension.flags import (
        GENERAL_FLAGS,
        IN_PLACE_OF_SCENE,
        IN_PLACE_OF_SERIES,
        RUNTIME,
    )

    of_series = (f"-I{IN_PLACE_OF_SERIES}", f"-I{IN_PLACE_OF_SCENE}")
    flags = [*GENERAL_FLAGS, *scene.kind, *scene.tape_kind, *scene.widest_flags]
    sources = {"tapes.c": tapes_source(scene.lanes, scene.unit)}
    if "-DMECHC_KIND_SERIES=1" in scene.tape_kind:
        sources["series.c"] = series_source(scene.lanes)

    def make(folder: Path) -> None:
        work, includes = folder / "work", (str(IN_PLACE_OF_SCENE), str(RUNTIME))
        work.mkdir()
        for name, source in sources.items():
            (work / name).write_text(source, "utf-8")
        own = [(name, [*(of_series if name == "series.c" else ()), *flags]) for name in sources]
        made = [partial(_object, work, each, includes) for each in own]
        objects = toolchain.all_at_once([partial(_general_unit, scene), *made])
        general = work / "general.o"  # some compilers go by the ending
        shutil.copyfile(objects[0], general)
        toolchain.link([general, *objects[1:]], folder / cache.SHARED_OBJECT)
        shutil.rmtree(work)

    key = cache.part_key(
        general_signature("".join(sources.values()), flags, *environment()), "general"
    )
    cache.entry(key, make)
    return key


def _general_unit(scene: Any) -> Path:
    """The object of the general unit of the scene's kind, compiled once for all of the kind."""
    from mechc_codegen.emit.units.general import general_source
    from mechc_codegen.extension.build import general_signature
    from mechc_codegen.extension.flags import GENERAL_FLAGS, IN_PLACE_OF_SCENE, RUNTIME

    source = general_source(scene.lanes)
    flags = [*GENERAL_FLAGS, *scene.kind, *scene.widest_flags]

    def make(folder: Path) -> None:
        work, includes = folder / "work", (str(IN_PLACE_OF_SCENE), str(RUNTIME))
        work.mkdir()
        (work / "general.c").write_text(source, "utf-8")
        with Notice("compiling the integrator for scenes of this kind, once ..."):
            made = _object(work, ("general.c", flags), includes)
        made.rename(folder / cache.SHARED_OBJECT)  # to be linked; sealed by the name of all entries
        shutil.rmtree(work)

    key = general_signature(source, flags, *environment())
    return cache.entry(cache.part_key(key, "general"), make)


def make_part(scene: Any, part: str, folder: Path) -> None:
    """Compile a part of the scene's unit into ``folder``; only the shared object stays."""
    from mechc_codegen.extension.flags import FLAGS, part_flags

    ((source, own),) = scene.units.items()
    make_of_one(folder, scene.write, source, [*FLAGS, *part_flags(part), *own])


def make_of_one(
    folder: Path, write: Callable[[Path], Any], source: str, flags: Sequence[str]
) -> None:
    """Compile one of the files that ``write`` puts into a folder; only the shared object stays."""
    from mechc_codegen.extension.flags import RUNTIME

    work = folder / "work"
    write(work)
    includes, target = (str(RUNTIME), str(work)), folder / cache.SHARED_OBJECT
    toolchain.compile_shared(work, source, flags, includes, target)
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
