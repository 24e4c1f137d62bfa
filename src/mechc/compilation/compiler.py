"""The compiler package as the runtime meets it: what it offers to users, and its errors."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from mechc.errors import MechcError


def of_compiler(name: str) -> Any:
    """What the compiler offers its users under this name."""
    import mechc_codegen

    errors = errors_of_compiler()
    return errors[name] if name in errors else getattr(mechc_codegen, name)


@cache
def errors_of_compiler() -> dict[str, type[MechcError]]:
    """Name -> error of the compiler that is an error of mechc too; from now on it raises these.

    The compiler imports nothing of the runtime, so it is told.
    """
    from mechc_codegen.errors import KINDS, raise_as

    names = {"__module__": "mechc", "__doc__": None}
    found = {
        kind: type(kind.__name__, (MechcError, kind), names | {"__doc__": kind.__doc__})
        for kind in KINDS
    }
    raise_as(found)
    return {kind.__name__: told for kind, told in found.items()}


def include_folder() -> Path:
    """Where the headers lie that C programs which use a model include."""
    import mechc_codegen

    return Path(mechc_codegen.__file__).parent / "runtime" / "abi"
