"""Compiled scenes in the cache: looked up, compiled, loaded."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

from mechc.compilation import cache, toolchain
from mechc.compilation.toolchain.processor import environment, native
from mechc.errors import CacheError
from mechc.native._driver import capsule_of, model_of_tape
from mechc.progress import Notice

_LONGEST_KEY = 100
_SETS = {2: "baseline", 4: "avx2", 8: "avx512"}  # lanes -> how names of installed units end
_INSTALLED = Path(__file__).resolve().parents[1] / "_units"
_TAPE = b"mechc tape 6\0\0\0\0"  # what tapes begin with: see runtime/tape/read.h


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
        shared, signature = None, unit.partition(".")[0]
        if cache.is_unit_key(unit):
            shared = installed_unit(signature) or cache.find(unit)
        if shared is None:
            raise ImportError("the unit that runs this tape is not there")
        with cache.copied(unit, shared) as own:  # each scene needs one
            return model_of_tape(own, tape, signature.encode())
    except (OSError, UnicodeDecodeError, struct.error) as error:
        raise ImportError(f"{path}: {error}") from None


@lru_cache
def installed_unit(signature: str) -> Path | None:
    """The unit with this signature that was compiled when mechc was installed, or None."""
    return next((file for file in installed_units() if _has_key(file, signature)), None)


def installed_units() -> list[Path]:
    """The units that were compiled for this processor when mechc was installed."""
    ending = f"_{_SETS[native().lanes]}{EXTENSION_SUFFIXES[0]}"
    return sorted(_INSTALLED.glob(f"*{ending}"))


def _has_key(file: Path, signature: str) -> bool:
    return signature.encode() in file.read_bytes()


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


def _tapes_unit(scene: Any) -> str:
    """The name of the unit that runs the tapes of the scene's kind.

    It is installed with mechc, or compiled once for all of the kind.
    """
    from mechc_codegen.emit.units.general import kind_flags, unit_sources
    from mechc_codegen.extension.build import digest, unit_signature
    from mechc_codegen.extension.flags import GENERAL_FLAGS

    sources = unit_sources(scene.kind, scene.lanes, scene.unit)
    flags = [*GENERAL_FLAGS, *kind_flags(scene.kind)]
    signature = unit_signature(sources, flags)
    if installed_unit(signature) is None:
        flags += scene.widest_flags
        signature = digest([signature, *scene.widest_flags, *environment()])
        cache.entry(cache.unit_key(signature), partial(_make_unit, sources, flags))
    return cache.unit_key(signature)


def _make_unit(sources: Mapping[str, str], flags: Sequence[str], folder: Path) -> None:
    from mechc_codegen.extension.build import write_texts
    from mechc_codegen.extension.flags import GENERAL_INCLUDES

    work = folder / "work"
    write_texts(work, sources)
    with Notice("compiling the integrator for scenes of this kind, once ..."):
        objects = toolchain.compile_all(work, [(name, flags) for name in sources], GENERAL_INCLUDES)
    toolchain.link(objects, folder / cache.SHARED_OBJECT)
    shutil.rmtree(work)


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
