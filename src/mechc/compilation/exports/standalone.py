"""The C of a mechanism for other programs: derived and emitted, not compiled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.library.library import described_as_asked
from mechc.compilation.request import read_compilable
from mechc.errors import UnknownNameError, ValueOutOfBoundsError


def standalone_texts(
    mechanism: Any,
    name: str | None,
    y0: Sequence[float] | None,
    params: Mapping[str, float],
    t_end: float,
    *,
    fix: Mapping[Any, float] | None,
    outputs: Iterable[Any] | None,
    real: str,
    **options: Any,
) -> dict[str, str]:
    """File name -> text; see :func:`mechc.export_c`."""
    from mechc_codegen.compiler import build_standalone

    asked = read_export(mechanism, y0, params, fix=fix, outputs=outputs, **options)
    found = asked.mechanism
    texts: dict[str, str] = build_standalone(
        found, name or found.name, asked.start, asked.values, t_end, asked.request, real
    )
    return texts


@dataclass(frozen=True)
class ExportRequest:
    """A mechanism to export: its request, its start, the values of parameters."""

    mechanism: Any
    request: Any
    start: list[float]
    values: dict[str, float]


def read_export(
    mechanism: Any,
    y0: Sequence[float] | None,
    params: Mapping[str, float],
    *,
    fix: Mapping[Any, float] | None,
    outputs: Iterable[Any] | None,
    **options: Any,
) -> ExportRequest:
    """A checked request for an export; arguments as those of :func:`mechc.export_c`."""
    errors_of_compiler()
    (found, request), numbers = _describe(mechanism, fix, outputs, options)
    states = len(found.coordinates) + len(found.states) + len(found.speeds)
    if isinstance(y0, Mapping):
        raise ValueOutOfBoundsError(
            "y0 is a state, coordinates and then speeds: model.assemble({...}) makes one of names"
        )
    start = [0.0] * states if y0 is None else [float(value) for value in y0]
    if len(start) != states:
        raise ValueOutOfBoundsError(f"y0 has {len(start)} values; a state has {states}")
    known = {str(parameter.symbol) for parameter in found.parameters}
    for given in params:
        if given not in known:
            raise UnknownNameError("parameter", given, sorted(known))
    values = {key: value for key, value in numbers.items() if key in known} | dict(params)
    return ExportRequest(found, request, start, values)


def _describe(
    mechanism: Any,
    fix: Mapping[Any, float] | None,
    outputs: Iterable[Any] | None,
    options: Mapping[str, Any],
) -> tuple[tuple[Any, Any], dict[str, float]]:
    """The mechanism with its request, and default values that are not part of it."""
    if not isinstance(mechanism, str):
        request, numbers = read_compilable(mechanism, fix, outputs, **options)
        return request.description(), {str(key): float(value) for key, value in numbers.items()}
    asked: dict[str, Any] = {} if outputs is None else {"outputs": tuple(outputs)}
    asked |= {"fix": dict(fix)} if fix else {}
    return described_as_asked(mechanism, options, asked), {}


def described_mechanism(thing: Any) -> Any:
    """A mechanism or SymPy object as the compiler describes it."""
    errors_of_compiler()
    return read_compilable(thing, None, None)[0].description()[0]
