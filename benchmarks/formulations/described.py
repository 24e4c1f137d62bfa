"""What mechc reads of an object, before it derives anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest


def read(
    given: Any, *, fix: Mapping[str, float] | None = None, outputs: Sequence[str] = (),
    defaults: Mapping[str, float] | None = None,
) -> tuple[Mechanism, Any]:  # fmt: skip
    """The mechanism that an object describes, and what is asked of it; as ``mechc.compile``."""
    options = CompileOptions(ConversionSettings(defaults=defaults or {}), fix or {}, outputs)
    return CompileRequest(given, options).described()


def described(given: Any, defaults: Mapping[str, float]) -> Mechanism:
    """A mechanism as it is, an object of SymPy's as the mechanism it describes."""
    return given if isinstance(given, Mechanism) else read(given, defaults=defaults)[0]
