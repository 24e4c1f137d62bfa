"""Models in a Python file of the user: FILE.py:NAME."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import mechc
from mechc.errors import MechcError


def is_own(name: str) -> bool:
    """Whether a text names a model in a file, not a mechanism of the library."""
    return name.rpartition(":")[0].endswith(".py")


def own_name(name: str) -> str:
    """NAME of FILE.py:NAME."""
    return name.rpartition(":")[2]


@cache
def own_object(name: str) -> Any:
    """The object that FILE.py:NAME names: the file is run, a function without arguments is called.

    Raises :class:`MechcError` if there is no such file or name, or nothing that can be compiled.
    """
    path, _, attribute = name.rpartition(":")
    if not Path(path).is_file():
        raise MechcError(f"there is no file {path}")
    spec = importlib.util.spec_from_file_location("mechc_own_model", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(Path(path).resolve().parent))  # as where Python runs the file itself
    spec.loader.exec_module(module)
    found = getattr(module, attribute, None)
    if found is None:
        raise MechcError(f"{path} defines no {attribute!r}")
    return found() if callable(found) and not isinstance(found, mechc.Model) else found


def own_model(name: str, outputs: Sequence[str] | None = None) -> mechc.Model:
    """The model of FILE.py:NAME, compiled with these outputs unless it is a model already."""
    found = own_object(name)
    if isinstance(found, mechc.Model):
        return found
    try:
        return mechc.compile(found, outputs=outputs)
    except TypeError:
        raise MechcError(
            f"{name} is of type {type(found).__name__}: it has to be a mechc.Model, a "
            "mechc.Mechanism, a KanesMethod, LagrangesMethod or System of SymPy, or a function "
            "that returns one"
        ) from None
