"""Compile on demand: with the cache, the only module that knows the compiler package."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import platform
import sys
import sysconfig
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mechc import cache, toolchain
from mechc.errors import MechcError, UnknownNameError
from mechc.load import load
from mechc.model import Model

_compiled: dict[str, Model] = {}


def mechanism_class() -> Any:
    """``mechc_codegen.Mechanism``."""
    from mechc_codegen import Mechanism

    return Mechanism


def shipped_options(name: str) -> dict[str, str]:
    """Option name -> what it does, of a shipped mechanism."""
    from mechc_codegen import SHIPPED

    return {option.name: option.description for option in SHIPPED[name].options}


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Raise :class:`UnknownNameError` for an option that a shipped mechanism does not have."""
    known = shipped_options(name)
    for option in options:
        if option not in known:
            raise UnknownNameError(f"option of {name}", option, known)


def compile_shipped(name: str, options: Mapping[str, Any]) -> Model:
    """A variant of a shipped mechanism; its options are known to exist."""
    mechanism = _compiler_errors(lambda: _shipped(name, options))
    told = {key: v if isinstance(v, bool) else str(v) for key, v in options.items()}
    return _compile(mechanism, {"options": told})


def compile_mechanism(mechanism: Any) -> Model:
    """A mechanism of the user's own."""
    if not isinstance(mechanism, mechanism_class()):
        raise TypeError(
            f"mechc.compile takes a mechc.Mechanism, not {type(mechanism).__name__}; describe "
            "the bodies, loads and constraints of your system in one"
        )
    return _compile(mechanism, {"custom": True})


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
        path = cache.entry(key, lambda _: _refuse_absent(key, name))
        _compiled[key] = Model(_import(path).model, build={"custom": True, "key": key})
    return _compiled[key]


def _refuse_absent(key: str, name: str) -> None:
    raise MechcError(
        f"{name!r} (cache key {key[:16]}) is not in the cache {cache.cache_folder()} of this "
        "process: compile it here first, or let MECHC_CACHE_DIR name a folder that all share"
    )


def derivation_page(name: str, options: Mapping[str, Any], values: Mapping[str, float] | None,
                    latex: bool) -> str:  # fmt: skip
    """The typeset derivation of a shipped mechanism, as HTML or LaTeX."""
    from mechc_codegen.typeset import derivation, html_page, latex_document

    mechanism = _compiler_errors(lambda: _shipped(name, options))
    written = latex_document if latex else html_page
    return str(written(derivation(mechanism), values))


def derivation_notes(name: str, values: Mapping[str, float]) -> list[tuple[str, str]]:
    """What the mechanism says about parameter values: for the four-bar its Grashof class."""
    mechanism = _shipped(name, {})
    return list(mechanism.notes(values)) if mechanism.notes else []


def generated_texts(name: str, options: Mapping[str, Any]) -> Mapping[str, str]:
    """File name -> text of everything generated for a shipped mechanism."""
    from mechc_codegen import build_scene

    texts: Mapping[str, str] = build_scene(_compiler_errors(lambda: _shipped(name, options))).texts
    return texts


def _shipped(name: str, options: Mapping[str, Any]) -> Any:
    from mechc_codegen import shipped_mechanism

    return shipped_mechanism(name, options)


def _compile(mechanism: Any, build: dict[str, Any]) -> Model:
    from mechc_codegen.extension import build_scene, signature

    started = time.perf_counter()
    scene = _compiler_errors(lambda: build_scene(mechanism, (_native(),)))
    command = toolchain.compiler()
    environment = f"{sys.version} {version('mechc')} {version('cython')} {_processor()}"
    told = " ".join([*command, toolchain.version(tuple(command))])
    key = signature(scene, told, environment)
    if key not in _compiled:
        emitted = time.perf_counter()
        path = cache.entry(key, lambda folder: _make(scene, folder))
        seconds = {"emit": emitted - started, "compile": time.perf_counter() - emitted}
        model = Model(_import(path).model, build={**build, "seconds": seconds, "key": key})
        _compiled[key] = model
    return _compiled[key]


def _compiler_errors(run: Any) -> Any:
    """The compiler's errors, as errors of mechc."""
    from mechc_codegen.errors import CodegenError

    try:
        return run()
    except CodegenError as error:
        raise MechcError(str(error)) from None


def _native() -> Any:
    """This processor's own instruction set; the binary stays in the user's cache."""
    from mechc_codegen.emit_c import InstructionSet

    shipped = load("four_bar")._scene
    flags = ["-march=native"] if shipped.instruction_set != "baseline" else []
    if shipped.lanes == 8:
        flags.append("-mprefer-vector-width=512")
    return InstructionSet("native", shipped.lanes, tuple(flags))


def _processor() -> str:
    """What distinguishes processors: a binary made for one may crash on another."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    told = {line.split(":")[0].strip(): line for line in lines}
    wanted = [told[key] for key in ("model name", "flags", "Features") if key in told]
    return " ".join([platform.machine(), platform.processor(), *wanted])


def _make(scene: Any, folder: Path) -> None:
    """Write, compile and link one scene into ``folder``; only the shared object stays."""
    from mechc_codegen.extension import FLAGS, RUNTIME

    work = folder / "work"
    scene.write(work)
    wrapper = _cythonized(work / "scene.pyx")
    python = sysconfig.get_path("include")
    sources = [(name, (*FLAGS, *flags)) for name, flags in scene.flags.items()]
    objects = toolchain.compile_all(
        work, [*sources, (wrapper, ("-O1", "-w"))], (str(RUNTIME), str(work), python)
    )
    toolchain.link(objects, folder / cache.SHARED_OBJECT)
    for path in work.iterdir():
        path.unlink()
    work.rmdir()


def _cythonized(path: Path) -> str:
    from Cython.Compiler import Main

    main: Any = Main  # without type hints of its own
    result = main.compile(str(path), main.CompilationOptions(main.default_options))
    if result.num_errors:
        raise MechcError(f"Cython could not translate {path}: this is a bug in mechc")
    return Path(result.c_file).name


def _import(path: Path) -> Any:
    loader = importlib.machinery.ExtensionFileLoader("scene", str(path))
    spec = importlib.util.spec_from_loader("scene", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module
