"""Compile on demand: with the cache, the only module that knows the compiler package."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import platform
import sys
import sysconfig
import time
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from mechc import cache, toolchain
from mechc.errors import MechcError, UnknownNameError
from mechc.load import load
from mechc.model import Model

_compiled: dict[str, Model] = {}
_variants: dict[str, Model] = {}
SOURCES = (".py", ".h", ".in")


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
    """A variant of a shipped mechanism; its options are known to exist.

    What mechanism, options and compiler package decide is looked up before anything is derived.
    """
    told = {key: v if isinstance(v, bool) else str(v) for key, v in options.items()}

    def mechanism() -> Any:
        return _compiler_errors(lambda: _shipped(name, options))

    if not all(map(_is_plain, options.values())):
        same = _reads_again(options, told)
        return _compile(mechanism(), {"options": told} if same else {"custom": True})
    key = _variant_key(name, told)
    if key not in _variants:
        _variants[key] = _stored(key, {"options": told}) or _compile(
            mechanism(), {"options": told}, variant=key
        )
    return _variants[key]


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str))


def _reads_again(options: Mapping[str, Any], told: Mapping[str, Any]) -> bool:
    """Whether the texts of the options, read again, are the options."""
    from mechc_codegen.errors import CodegenError
    from mechc_codegen.expression import parse_expression
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


def _variant_key(name: str, told: Mapping[str, Any]) -> str:
    """Hash of all that decides a variant: the compiler package's text stands for its result."""
    digest = hashlib.sha256()
    parts = [name, repr(sorted(told.items())), repr(_native()), *_told()]
    for part in [*parts, *_compiler_package()]:
        digest.update(f"{len(part)}:".encode() + part.encode())
    return digest.hexdigest()


@lru_cache
def _compiler_package() -> tuple[str, ...]:
    """The texts of the compiler package and the version of its engine."""
    root = Path(str(files("mechc_codegen")))
    texts = [p.read_text("utf-8") for p in sorted(root.rglob("*")) if p.suffix in SOURCES]
    return (version("sympy"), *texts)


def _told() -> tuple[str, str]:
    """Compiler and environment, as far as they decide a binary."""
    command = toolchain.compiler()
    environment = f"{sys.version} {version('mechc')} {version('cython')} {_processor()}"
    return " ".join([*command, toolchain.version(tuple(command))]), environment


def _stored(variant: str, build: dict[str, Any]) -> Model | None:
    """The variant, if an earlier derivation of it is in the cache."""
    key = cache.read_note(variant)
    path = None if key is None else cache.find(key)
    if key is None or path is None:
        return None
    if key not in _compiled:
        _compiled[key] = Model(_import(path).model, build={**build, "seconds": {}, "key": key})
    return _compiled[key]


def compile_mechanism(mechanism: Any) -> Model:
    """A mechanism of the user's own."""
    if not isinstance(mechanism, mechanism_class()):
        raise TypeError(
            f"mechc.compile takes a mechc.Mechanism, not {type(mechanism).__name__}; describe "
            "the bodies, loads and constraints of your system in one"
        )
    return _compile(mechanism, {"custom": True})


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


def _compile(mechanism: Any, build: dict[str, Any], variant: str | None = None) -> Model:
    from mechc_codegen.extension import build_scene, signature

    started = time.perf_counter()
    scene = _compiler_errors(lambda: build_scene(mechanism, (_native(),)))
    key = signature(scene, *_told())
    if key not in _compiled:
        emitted = time.perf_counter()
        path = cache.entry(key, lambda folder: _make(scene, folder))
        if variant is not None:
            cache.write_note(variant, key)
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
