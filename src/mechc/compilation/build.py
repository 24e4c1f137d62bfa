"""Systems from descriptions: found in the cache, or derived, compiled and cached."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from mechc.compilation import cache, entries
from mechc.compilation.from_scene import Seconds, system_with
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.parts import FIRST, Parts
from mechc.compilation.picture import Described
from mechc.compilation.toolchain.processor import environment, native
from mechc.errors import MechcError
from mechc.progress import Notice
from mechc.system.reference import ModelReference, Origin
from mechc.system.system import System

FIRST_UNIT = "first unit"  # a stage of the build
_compiled: dict[str, System] = {}


def compile_described(
    origin: Origin, reference: ModelReference, digest: str | None, seconds: Seconds | None = None,
    *, ahead: bool = True,
) -> System:  # fmt: skip
    """The system of a description, from the cache or derived and compiled.

    Its first unit is there; other parts are compiled when they are needed, those of most runs
    ``ahead``, in the background.  With a digest the key in the cache is known before anything is
    derived, else the texts that are emitted are the key.
    """
    started, described = time.perf_counter(), lru_cache(origin.description)
    build = lru_cache(lambda: _built(described))
    if digest is None:
        from mechc_codegen.extension.build import signature

        key = signature(build(), *environment())
    else:
        key = key_of(digest)
    if key not in _compiled:
        seconds = dict(seconds or {})
        parts = Parts(key, seconds)
        kept = entries.load(cache.part_key(key, FIRST))
        scene = parts.scene(kept or _first(parts, build, ahead=ahead))
        if FIRST_UNIT not in seconds:
            seconds["load"] = time.perf_counter() - started
        origin = replace(origin, description=described)
        system = system_with(scene, replace(reference, key=key), seconds, origin)
        if ahead and FIRST_UNIT in seconds and not scene.serves_runs:
            parts.begin("taylor" if system.prefers_series else "collocation")
        _compiled[key] = system
    found = _compiled[key]
    found.origin = found.origin or origin  # one that was found by its key has none
    return found


def key_of(digest: str) -> str:
    """The key in the cache of a request with this digest."""
    from mechc_codegen.frontend.cache_key import compiler_signature, files_digest, files_stamp

    files = cache.cached_hash("compiler", files_stamp(), files_digest)
    return compiler_signature(digest, *environment(), files)


@one_at_a_time
def compiled_before(reference: ModelReference) -> System:
    """A scene that is in this user's cache, by its key.

    Raises :class:`MechcError` if it is not in the cache.
    """
    key = reference.key
    if key not in _compiled:
        if not cache.is_key(key):
            raise MechcError(f"{key!r} is not the key of a compiled scene")
        first = entries.load(cache.part_key(key, FIRST))
        if first is None:
            raise MechcError(
                f"the mechanism {reference.mechanism!r} (cache key {key[:16]}) is not a shipped "
                f"one and not in the cache {cache.cache_folder()} of this process: compile it "
                "again (mechc.open(path, model) takes it), or set MECHC_CACHE_DIR to a "
                "shared folder"
            )
        scene = Parts(key, {}).scene(first)
        _compiled[key] = system_with(scene, ModelReference("", custom=True, key=key))
    found = _compiled[key]
    return found.with_defaults(reference.defaults) if reference.defaults else found


def time_stage(seconds: Seconds, stage: str, run: Callable[[], Any]) -> Any:
    """The result of ``run()``, whose time in seconds is recorded."""
    started = time.perf_counter()
    done = run()
    seconds[stage] = time.perf_counter() - started
    return done


@one_at_a_time
def _built(described: Described) -> Any:
    """The texts of a mechanism, described, derived and emitted, with the seconds of each stage."""
    seconds: Seconds = {}
    with Notice("reading the mechanism ..."):
        from mechc_codegen.compiler import build_scene

        mechanism, requested = time_stage(seconds, "describe", described)
    with Notice(f"deriving the equations of {mechanism.name} ..."):
        scene = build_scene(mechanism, (native(),), requested)
    return replace(scene, seconds={**seconds, **scene.seconds})


def _first(parts: Parts, built: Callable[[], Any], *, ahead: bool) -> Any:
    """The first unit, compiled while the parts that most runs begin with are begun, if ``ahead``.

    Of processes that need the same scene, one derives and compiles it, and the others wait.
    """
    seconds = parts.seconds

    def make(folder: Path) -> None:
        parts.build = scene = built()
        seconds.update(scene.seconds)
        if ahead and not scene.kind:
            parts.begin("driver")
        doing = "writing the tape" if scene.tape else "compiling rates and outputs"
        with Notice(f"{doing} of {scene.name} ..."):
            time_stage(seconds, FIRST_UNIT, lambda: entries.make_first(scene, folder))

    with Notice("looking for the compiled model ..."):  # another process may be making it
        return entries.load_or_make(cache.part_key(parts.key, FIRST), make)
