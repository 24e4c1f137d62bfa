"""Getting a model: shipped, a variant of a shipped one, or one's own mechanism."""

from __future__ import annotations

import hashlib
import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

from mechc import _scenes
from mechc.errors import UnknownNameError
from mechc.model import Model

_loaded: dict[tuple[str, str | None], Model] = {}


def mechanisms() -> tuple[str, ...]:
    """Names of the shipped mechanisms."""
    return _scenes.NAMES


def load(name: str, *, instruction_set: str | None = None, **options: Any) -> Model:
    """A shipped mechanism.

    Parameters
    ----------
    name
        One of :func:`mechanisms`.
    instruction_set
        ``"baseline"``, ``"avx2"`` or ``"avx512"``; the widest of this processor when None.
    options
        What the scene asks for beyond the shipped default, for instance ``friction=True`` or
        ``crank_torque="2*sin(3*t)"`` (``mechc show NAME`` lists them).  Such a variant is
        compiled on demand and cached, which needs a C compiler.

    Raises
    ------
    UnknownNameError
        If there is no such mechanism or option; the nearest known names are offered.
    ValueError
        If this processor or build lacks the instruction set.
    CompilerError
        If a variant has to be compiled and cannot be.
    """
    if name not in _scenes.NAMES:
        raise UnknownNameError("mechanism", name, _scenes.NAMES)
    if options:
        from mechc.jit import check_options, compile_shipped

        check_options(name, options)
        asked = {key: value for key, value in options.items() if value is not False}
        if asked and instruction_set is not None:
            raise ValueError(
                "a variant is compiled for this processor alone: leave instruction_set out"
            )
        if asked:
            return compile_shipped(name, asked)
    key = (name, instruction_set)
    if key not in _loaded:
        _loaded[key] = Model(_scene_module(name).model, instruction_set=instruction_set)
    return _loaded[key]


def reload(name: str, options: dict[str, Any], instruction_set: str | None) -> Model:
    """What unpickles a model."""
    return load(name, instruction_set=instruction_set, **options)


def compile(mechanism: Any) -> Model:
    """Compile a :class:`mechc.Mechanism` of one's own; cached, needs a C compiler.

    Raises
    ------
    TypeError
        If it is something else.
    CompilerError
        If there is no C compiler or it failed; the message holds its command and output.
    """
    from mechc.jit import compile_mechanism

    return compile_mechanism(mechanism)


def fingerprint(model: Model) -> str:
    """What tells this compiled scene from any other: its cache key, or its file's hash."""
    if "key" in model.build:
        return str(model.build["key"])
    path = _scene_module(model.name).__file__
    assert path is not None
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _scene_module(name: str) -> ModuleType:
    return importlib.import_module(f"mechc._scenes.{name}")
