"""Compile on demand: with the cache, the only module that knows the compiler package."""

from __future__ import annotations

import hashlib
import platform
import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from threading import Event
from typing import Any

from mechc.compilation import cache, toolchain
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.pending import FirstScene, Pending
from mechc.errors import CacheError, MechcError, UnknownNameError
from mechc.load import load
from mechc.model import Model
from mechc.native._driver import Scene, capsule_of

Described = Callable[[], tuple[Any, Any]]  # the mechanism, and what is wished of it
_compiled: dict[str, Model] = {}


def of_compiler(name: str) -> Any:
    """What the compiler offers its users under this name."""
    import mechc_codegen

    return getattr(mechc_codegen, name)


def include_folder() -> Path:
    """Where the headers of compiled scenes lie."""
    import mechc_codegen

    return Path(mechc_codegen.__file__).parent / "runtime" / "abi"


def shipped_options(name: str) -> dict[str, str]:
    """Option name -> what it does, of a mechanism of the library."""
    from mechc_codegen import SHIPPED

    return {option.name: option.about for option in SHIPPED[name].options}


def beyond_default(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that ask for more than a mechanism's default scene, counts as numbers.

    Raises :class:`UnknownNameError` for an option that it does not have.
    """
    from mechc_codegen.library.catalogue import beyond_default

    known = shipped_options(name)
    for option in options:
        if option not in known:
            raise UnknownNameError(f"option of {name}", option, known)
    found: dict[str, Any] = _compiler_errors(lambda: beyond_default(name, options))
    return found


def compile_shipped(name: str, options: Mapping[str, Any], asked: Mapping[str, Any]) -> Model:
    """A variant of a shipped mechanism; its options are known to exist.

    ``asked``: parameters to ``fix`` and ``outputs``, by name.  What mechanism, options and
    compiler package decide is looked up before anything is derived.
    """
    told = _told(options, asked)

    def described() -> tuple[Any, Any]:
        return _shipped_as_asked(name, options, asked)

    if all(map(_is_plain, options.values())):
        return _compile_known(_variant_digest(name, told), described, {"options": told})
    same = _reads_again(options, told)
    return _compile(described, {"options": told} if same else {"custom": True})


def _shipped_as_asked(
    name: str, options: Mapping[str, Any], asked: Mapping[str, Any]
) -> tuple[Any, Any]:
    from mechc_codegen.frontend.read_request import read_request

    mechanism = _shipped(name, options)
    outputs = tuple(asked["outputs"]) if "outputs" in asked else None
    return mechanism, read_request(mechanism, asked.get("fix", {}), outputs, of_object=False)


def shipped_without_c(name: str, options: Mapping[str, Any], asked: Mapping[str, Any]) -> Model:
    """A shipped mechanism, or a variant, with NumPy in place of compiled code."""
    told = _told(options, asked)
    same = all(map(_is_plain, options.values())) or _reads_again(options, told)
    return _without_c(
        lambda: _shipped_as_asked(name, options, asked),
        {"options": told} if same else {"custom": True},
    )


def _without_c(described: Described, build: dict[str, Any]) -> Model:
    """Derived in this process, and kept nowhere: what is executed was written here."""
    from mechc_codegen.compiler import build_listing

    from mechc.numpy_backend.scene import NumpyScene

    seconds: dict[str, float] = dict(build.get("seconds", {}))
    described = lru_cache(described)
    mechanism, request = _timed(seconds, "describe", lambda: _compiler_errors(described))
    listing, stages = _compiler_errors(lambda: build_listing(mechanism, request))
    scene = _timed(seconds, "load", lambda: NumpyScene(listing))
    told = {**build, "backend": "numpy", "seconds": seconds | stages}
    return Model(None, build=told, scene=scene, whole=lambda: _operations_of_all(described))


@one_at_a_time
def _operations_of_all(described: Described) -> dict[str, Any]:
    """Operation counts with nothing fixed and every usual output."""
    from mechc_codegen.compiler import operations_of_all

    found: dict[str, Any] = _compiler_errors(lambda: operations_of_all(*described()))
    return found


def _told(options: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, Any]:
    """What says the same to another process."""
    kept = (bool, int)
    return {k: v if isinstance(v, kept) else str(v) for k, v in options.items()} | dict(asked)


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str))


def _reads_again(options: Mapping[str, Any], told: Mapping[str, Any]) -> bool:
    """Whether the texts of the options, read again, are the options."""
    from mechc_codegen.description.parser import parse_expression
    from mechc_codegen.errors import CodegenError
    from sympy.physics.mechanics import dynamicsymbols

    try:
        again = [
            parse_expression(told[key], {"t": dynamicsymbols._t}) == value
            for key, value in options.items()
            if not _is_plain(value)
        ]
    except CodegenError:
        return False
    return all(again)


def _variant_digest(name: str, told: Mapping[str, Any]) -> str:
    parts = ["shipped", name, repr(sorted(told.items()))]
    return hashlib.sha256("".join(f"{len(p)}:{p}" for p in parts).encode()).hexdigest()


def compile_any(thing: Any, *, backend: str = "c", **asked: Any) -> Model:
    """A mechanism of the user's own, or an object of SymPy's; see :func:`mechc.compile`."""
    seconds: dict[str, float] = {}
    scene = _timed(seconds, "read", lambda: _compiler_errors(lambda: _scene(thing, **asked)))
    build = {"custom": True, "seconds": seconds}
    if backend == "numpy":
        return _without_c(scene.described, build)
    known = scene.digest
    if known is None:
        return _compile(scene.described, build)
    return _compile_known(known, scene.described, build)


def _scene(
    thing: Any,
    fix: Mapping[Any, Any] | None,
    outputs: Iterable[Any] | None,
    **settings: Any,
) -> Any:
    from mechc_codegen.description.source import ConversionSettings
    from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest, compilable

    if not compilable(thing):
        raise TypeError(
            f"mechc.compile takes a mechc.Mechanism, or a KanesMethod, LagrangesMethod or System "
            f"of sympy.physics.mechanics, not {type(thing).__name__}"
        )
    given = {key: value for key, value in settings.items() if value is not None}
    if "states" in given:
        given["states"] = _rates(given["states"])
    chosen = None if outputs is None else tuple([outputs] if _single(outputs) else outputs)
    return CompileRequest(
        thing, CompileOptions(ConversionSettings(**given), dict(fix or {}), chosen)
    )


def _rates(states: Any) -> dict[Any, Any]:
    """State -> rate, also of objects that know both."""
    if isinstance(states, Mapping):
        return dict(states)
    several = [states] if hasattr(states, "rhs") else list(states)
    return {x: rate for one in several for x, rate in zip(one.x, one.rhs(), strict=True)}


def _single(outputs: Any) -> bool:
    return isinstance(outputs, (str, Mapping))


def compiled_before(key: str, name: str) -> Model:
    """A scene that is in this user's cache already, by its key.

    Raises
    ------
    MechcError
        If it is not there.
    """
    if key not in _compiled:
        if not cache.is_key(key):
            raise MechcError(f"{key!r} is not the key of a compiled scene")
        scene = _found(key)
        if scene is None:
            raise MechcError(
                f"{name!r} (cache key {key[:16]}) is not in the cache {cache.cache_folder()} of "
                "this process: compile it here first, or let MECHC_CACHE_DIR name a folder that "
                "all share"
            )
        _compiled[key] = Model(None, build={"custom": True, "key": key}, scene=scene)
    return _compiled[key]


def derivation_page(name: str, options: Mapping[str, Any], values: Mapping[str, float] | None,
                    latex: bool) -> str:  # fmt: skip
    """The typeset derivation of a shipped mechanism, as HTML or LaTeX."""
    from mechc_codegen.typeset.page import derivation, html_page, latex_document

    mechanism = _compiler_errors(lambda: _shipped(name, options))
    written = latex_document if latex else html_page
    return str(written(derivation(mechanism), values))


def derivation_notes(
    name: str, options: Mapping[str, Any], values: Mapping[str, float]
) -> list[tuple[str, str]]:
    """What the mechanism says about parameter values: for the four-bar its Grashof class."""
    mechanism = _compiler_errors(lambda: _shipped(name, options))
    return list(mechanism.notes(values)) if mechanism.notes else []


def generated_texts(name: str, options: Mapping[str, Any]) -> Mapping[str, str]:
    """File name -> text of everything generated for a shipped mechanism."""
    from mechc_codegen import build_scene

    texts: Mapping[str, str] = build_scene(_compiler_errors(lambda: _shipped(name, options))).texts
    return texts


def _shipped(name: str, options: Mapping[str, Any]) -> Any:
    from mechc_codegen import shipped_mechanism

    return shipped_mechanism(name, options)


def _compile(described: Described, build: dict[str, Any]) -> Model:
    """Derive and emit; the texts name the cache entry."""
    from mechc_codegen.extension.build import signature

    started, described = time.perf_counter(), lru_cache(described)
    scene = _built(described)
    key = signature(scene, *_environment())
    return _model(key, lambda: scene, described, build, started)


def _compile_known(digest: str, described: Described, build: dict[str, Any]) -> Model:
    """What is named without deriving is looked up before anything is derived."""
    from mechc_codegen.frontend.cache_key import compiler_signature, files_digest, files_stamp

    started, described = time.perf_counter(), lru_cache(described)
    files = cache.remembered("compiler", files_stamp(), files_digest)
    key = compiler_signature(digest, *_environment(), files)
    return _model(key, lambda: _built(described), described, build, started)


@one_at_a_time
def _built(described: Described) -> Any:
    """Described, derived and emitted, with the seconds that each stage took."""
    from mechc_codegen.compiler import build_scene

    seconds: dict[str, float] = {}
    mechanism, request = _timed(seconds, "describe", lambda: _compiler_errors(described))
    scene = _compiler_errors(lambda: build_scene(mechanism, (_native(),), request))
    return replace(scene, seconds=seconds | scene.seconds)


def _environment() -> tuple[str, str]:
    """The compiler and the processor that a binary is made by and for."""
    from mechc import __version__

    return toolchain.identity(toolchain.compiler()), f"{__version__} {_processor()}"


def _model(
    key: str,
    built: Callable[[], Any],
    described: Described,
    build: dict[str, Any],
    started: float,
) -> Model:
    """From the cache, or compiled: what it takes to begin with at once, the rest behind it."""
    if key in _compiled:
        return _compiled[key]
    seconds: dict[str, float] = dict(build.get("seconds", {}))
    told = {**build, "seconds": seconds, "key": key}
    scene = _found(key)
    if scene is not None:
        model = Model(None, build=told, scene=scene)
        seconds["load"] = time.perf_counter() - started
    else:
        model = _begun(key, lru_cache(built), told, started)
    model._whole = lambda: _operations_of_all(described)
    _compiled[key] = model
    return model


def _begun(key: str, built: Callable[[], Any], told: dict[str, Any], started: float) -> Model:
    """A model with its first unit, and the whole of it on the way.

    The first unit is kept too: a program that never integrates never waits for the whole.  Of
    processes that want the same at once, one derives and compiles it, and the others wait.
    """
    seconds: dict[str, float] = told["seconds"]

    def make_first(folder: Path) -> None:
        scene = built()
        seconds.update(scene.seconds)
        _timed(seconds, "first unit", lambda: _make_first(scene, folder))

    def make(folder: Path) -> None:
        scene = built()
        seconds.update(scene.seconds)
        _timed(seconds, "compile", lambda: _make(scene, folder))

    def whole() -> Scene:
        finished = _entry(key, make)
        ready.wait()
        model._use(finished)
        return finished

    beside = cache.first_key(key)
    first = _found(beside) or _entry(beside, make_first)
    made = "first unit" in seconds
    if not made:
        seconds["load"] = time.perf_counter() - started
    ready = Event()
    model = Model(None, build=told, scene=FirstScene(first, Pending(whole, at_once=made)))
    ready.set()
    return model


def _found(key: str) -> Scene | None:
    """The scene of an entry that is there and can be loaded."""
    path = cache.find(key)
    try:
        return None if path is None else _scene_in(path)
    except ImportError:
        cache.discard(key)
        return None


def _entry(key: str, make: Callable[[Path], None]) -> Scene:
    """The scene of an entry, made if need be; once more if it is gone again before it is loaded."""
    try:
        return _scene_in(cache.entry(key, make))
    except ImportError:
        cache.discard(key)
    path = cache.entry(key, make)
    try:
        return _scene_in(path)
    except ImportError as error:
        raise CacheError(
            f"what was just compiled cannot be loaded: {error}. If programs may not run from "
            f"{path.parents[1]} (a file system mounted noexec), set MECHC_CACHE_DIR to a folder "
            "elsewhere; else it is the compiler that does not work for this machine"
        ) from None


def _scene_in(path: Path) -> Scene:
    return Scene(capsule_of(str(path)), None)


def _timed(seconds: dict[str, float], stage: str, run: Callable[[], Any]) -> Any:
    started = time.perf_counter()
    done = run()
    seconds[stage] = time.perf_counter() - started
    return done


def _compiler_errors(run: Any) -> Any:
    """The compiler's errors, as errors of mechc."""
    from mechc_codegen.errors import CodegenError

    try:
        return run()
    except CodegenError as error:
        raise MechcError(str(error)) from None


def _native() -> Any:
    """This processor's own instruction set; the binary stays in the user's cache."""
    from mechc_codegen.emit.instruction_sets import InstructionSet

    shipped = load("four_bar")._scene
    flags = ["-march=native"] if shipped.instruction_set != "baseline" else []
    if shipped.lanes == 8:
        flags.append("-mprefer-vector-width=512")
    return InstructionSet("native", shipped.lanes, tuple(flags))


def _processor() -> str:
    """What distinguishes processors: a binary made for one may crash on another."""
    told: dict[str, str] = {}
    info = Path("/proc/cpuinfo")
    if info.exists():
        with info.open() as lines:  # the first of many that are alike
            for line in iter(lines.readline, ""):
                if not line.strip():
                    break
                told[line.split(":")[0].strip()] = line
    wanted = [told[key] for key in ("model name", "flags", "Features") if key in told]
    return " ".join([platform.machine(), *wanted])


def _make_first(scene: Any, folder: Path) -> None:
    """Compile the scene's first unit into ``folder``; only the shared object stays."""
    from mechc_codegen.extension.flags import FIRST_FLAGS, RUNTIME

    work = folder / "work"
    scene.write(work)
    flags, includes = [*FIRST_FLAGS, *scene.first_flags], (str(RUNTIME), str(work))
    target = folder / cache.SHARED_OBJECT
    toolchain.compile_shared(work, "scene_first.c", flags, includes, target)
    shutil.rmtree(work)


def _make(scene: Any, folder: Path) -> None:
    """Write, compile and link one scene into ``folder``; only the shared object stays."""
    from mechc_codegen.extension.flags import FLAGS, RUNTIME, SHARED

    work = folder / "work"
    scene.write(work)
    sources = [(name, (*FLAGS, *SHARED, *flags)) for name, flags in scene.flags.items()]
    includes = (str(RUNTIME), str(work))
    objects = toolchain.compile_all(work, sources, includes, side_by_side=False)
    toolchain.link(objects, folder / cache.SHARED_OBJECT)
    shutil.rmtree(work)
