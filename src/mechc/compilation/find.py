"""Systems by name from the library, and systems that a reference describes."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from mechc.compilation.from_scene import drawn_by, system_with
from mechc.compilation.library.catalogue import COMPILED_AT_INSTALL, LIBRARY
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import MechcError, ValueOutOfBoundsError, brief
from mechc.native._driver import Scene
from mechc.system.names import by_name, checked_word
from mechc.system.reference import ModelReference
from mechc.system.system import System


def library_system(
    name: str,
    *,
    instruction_set: str | None = None,
    fix: Mapping[str, float] | None = None,
    outputs: Iterable[str] | None = None,
    **options: Any,
) -> System:
    """A mechanism of the library or a variant of one; see :func:`mechc.load`."""
    checked_word("mechanism", name, LIBRARY)
    given = instruction_set
    if given is not None and not (isinstance(given, str) and given.isascii() and given.isalnum()):
        raise ValueError(f"no instruction set is called {brief(instruction_set)}")
    asked = _as_names_and_numbers(fix, outputs)
    if not (options or asked) and name in COMPILED_AT_INSTALL:
        return _load_installed(name, instruction_set)
    return _variant(name, instruction_set, asked, options)


@one_at_a_time
def _variant(
    name: str,
    instruction_set: str | None,
    asked: Mapping[str, Any],
    options: Mapping[str, Any],
) -> System:
    from mechc.compilation.library.library import beyond_default, variant

    options = beyond_default(name, options) if options else options
    if not (options or asked) and name in COMPILED_AT_INSTALL:
        return _load_installed(name, instruction_set)
    if instruction_set is not None:
        raise ValueError(
            "scenes compiled on demand are for this processor only: omit instruction_set"
        )
    return variant(name, options, asked)


def system_of(reference: ModelReference, given: System | None = None) -> System:
    """The system that a reference describes: the one given, of the library, or in the cache.

    Raises :class:`MechcError` if it is not found, or the one given or found has other states.
    """
    if given is None and not reference.custom:
        return library_system(
            reference.mechanism,
            instruction_set=reference.instruction_set,
            **reference.options,
        )
    if given is None:
        from mechc.compilation.build import compiled_before

        given = compiled_before(reference)
    system = given
    if reference.state and (*system.coordinates, *system.speeds) != reference.state:
        raise MechcError(
            f"it is of a mechanism with the states {', '.join(reference.state)}; the model "
            f"{system.name!r} has others"
        )
    return system


def _number(name: object, value: Any) -> float | str:
    if isinstance(value, str):  # with a unit, which the mechanism knows
        return value
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None


@cache
@one_at_a_time
def _load_installed(name: str, instruction_set: str | None) -> System:
    from mechc.compilation.library.library import origin_of

    module = importlib.import_module(f"mechc._scenes.{name}")
    reference = ModelReference(
        name, instruction_set=instruction_set, library_file=str(module.__file__)
    )
    system = system_with(Scene(module.model, instruction_set), reference)
    system.origin = origin_of(name, {}, {})
    return system.drawn_by(drawn_by(system.origin.description))


def _as_names_and_numbers(
    fix: Mapping[str, float] | None, outputs: Iterable[str] | None
) -> dict[str, Any]:
    """The ``fix`` and ``outputs`` of a variant, as names and numbers."""
    asked: dict[str, Any] = {}
    if fix:
        given = by_name(fix, "parameters to fix", "{'g': 9.81}")
        asked["fix"] = {str(k): _number(k, given[k]) for k in sorted(given, key=str)}
    if outputs is not None:
        one = isinstance(outputs, str) or not isinstance(outputs, Iterable)
        names = [outputs] if one or getattr(outputs, "ndim", 1) == 0 else list(outputs)
        if not all(isinstance(each, str) for each in names):
            raise TypeError(
                "outputs of a shipped mechanism are requested by name; user-defined expressions "
                "are for mechc.compile"
            )
        asked["outputs"] = sorted(set(names))
    return asked
