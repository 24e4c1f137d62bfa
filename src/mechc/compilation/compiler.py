"""The compiler package as the runtime uses it: its public names, and its errors."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import MechcError
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.units import in_si


@one_at_a_time
def of_compiler(name: str) -> Any:
    """The public name of the compiler."""
    import mechc_codegen

    errors = errors_of_compiler()
    return errors[name] if name in errors else getattr(mechc_codegen, name)


@cache
def errors_of_compiler() -> dict[str, type[MechcError]]:
    """Name -> error of the compiler that is mechc's too; from now on the compiler raises it, and
    reads values with units and judges mechanisms as the runtime does.

    The compiler imports nothing of the runtime, so these are set from here.
    """
    from mechc_codegen.description.mechanism import judging
    from mechc_codegen.description.quantity import read_values_with
    from mechc_codegen.errors import KINDS, raise_as

    names = {"__module__": "mechc", "__doc__": None}
    found = {
        kind: type(kind.__name__, (MechcError, kind), names | {"__doc__": kind.__doc__})
        for kind in KINDS
    }
    raise_as(found)
    read_values_with(_in_si)
    judging[:] = [lambda *given: import_module("mechc").judge(*given)]
    return {kind.__name__: told for kind, told in found.items()}


def _in_si(value: Any, name: str, quantity: Any) -> Any:
    """A value of a quantity of the compiler; raises as :func:`mechc.system.units.in_si`."""
    bounds = quantity.lower, quantity.upper, quantity.closed
    return in_si(value, NamedQuantity(name, quantity.unit, "", *bounds, Kind(str(quantity.kind))))


def include_folder() -> Path:
    """The folder of the headers for C programs that use a model."""
    import mechc_codegen

    return Path(mechc_codegen.__file__).parent / "runtime" / "abi"
