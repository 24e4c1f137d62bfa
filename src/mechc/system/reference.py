"""References by which other processes, saved files and workers find a compiled scene."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from mechc.errors import MechcError


@dataclass(frozen=True)
class ModelReference:
    """A mechanism of the library with its options, or an entry of the cache.

    Attributes
    ----------
    mechanism
        Its name.
    options
        Of a mechanism of the library: its options, parameters to ``fix`` and ``outputs``.
    custom
        Whether it was compiled from a user-defined mechanism: then it is found by its key only.
    key
        Of its entry in the cache; empty for a scene compiled when mechc was installed.
    state
        Names of the coordinates and speeds, in order.
    defaults
        Of a user-defined mechanism: default values of parameters.
    instruction_set
        The instruction set of a scene compiled when mechc was installed; None for the widest.
    library_file
        The file of a scene compiled when mechc was installed, else empty.
    """

    mechanism: str
    options: Mapping[str, Any] = field(default_factory=dict)
    custom: bool = False
    key: str = ""
    state: tuple[str, ...] = ()
    instruction_set: str | None = None
    library_file: str = ""
    defaults: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def binary_identity(self) -> str:
        """The identity of this binary: its key, or the hash of its file."""
        if self.key or not self.library_file:
            return self.key
        return hashlib.sha256(Path(self.library_file).read_bytes()).hexdigest()

    def exactly(self, instruction_set: str) -> ModelReference:
        """A reference to the same binary, whatever processor a worker has."""
        return replace(self, instruction_set=instruction_set if self.library_file else None)

    def to_json(self) -> dict[str, Any]:
        """The reference as JSON data, for files."""
        told: dict[str, Any] = {
            "mechanism": self.mechanism,
            "options": dict(self.options),
            "custom": self.custom,
            "compiled": self.binary_identity,
            "state": list(self.state),
        }
        return told | ({"defaults": dict(self.defaults)} if self.defaults else {})

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ModelReference:
        """A reference from an untrusted file.

        Raises :class:`MechcError` if it contains no reference.
        """
        options, state, custom = data.get("options"), data.get("state"), data.get("custom")
        mechanism, key = data.get("mechanism"), data.get("compiled") or ""
        lists = isinstance(options, dict) and isinstance(state, list) and isinstance(custom, bool)
        texts = [mechanism, key, *(state or ())]
        if not (lists and all(isinstance(text, str) for text in texts)):
            raise MechcError("it does not name its mechanism")
        return cls(
            str(mechanism), dict(options or {}), bool(custom), key if custom else "",
            tuple(state or ()), defaults=_numbers(data.get("defaults", {})),
        )  # fmt: skip


@dataclass(frozen=True)
class Origin:
    """The origin of a system: the description that it was compiled from, while that is at hand.

    Attributes
    ----------
    description
        Gives the mechanism, as the compiler has it, and the outputs and fixed parameters requested.
    with_outputs
        Compiles the same with further outputs, by the names of a request.
    with_laws
        Compiles the same with inputs that are expressions, as texts by name; None where a mechanism
        has no inputs.
    """

    description: Callable[[], tuple[Any, Any]]
    with_outputs: Callable[[frozenset[str]], Any]
    with_laws: Callable[[Mapping[str, str]], Any] | None = None


def _numbers(data: Any) -> dict[str, float]:
    """Name -> finite number, from a file."""
    if not isinstance(data, dict) or not all(type(value) is float for value in data.values()):
        raise MechcError("its default values are not numbers")
    if not all(map(math.isfinite, data.values())):
        raise MechcError("its default values are not finite")
    return {str(name): value for name, value in data.items()}
