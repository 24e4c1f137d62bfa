"""The C of a mechanism for other programs: derived and emitted, not compiled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.library.library import described_as_asked
from mechc.compilation.request import read_compilable
from mechc.errors import UnknownNameError, ValueOutOfBoundsError


@dataclass(frozen=True)
class ExportRequest:
    """A mechanism to export: its request, its start, the values of parameters."""

    mechanism: Any
    request: Any
    start: list[float]
    values: dict[str, float]


def standalone_texts(asked: ExportRequest, name: str, t_end: float, real: str) -> dict[str, str]:
    """File name -> text; see :func:`mechc.export_c`."""
    from mechc_codegen.compiler import build_standalone

    given = (asked.mechanism, name, asked.start, asked.values, t_end, asked.request, real)
    texts: dict[str, str] = build_standalone(*given)
    return texts


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
    if "events" in options:
        raise ValueOutOfBoundsError(
            "exported C and pages have no events, stops or dry friction: a unit of "
            "mechc.export_fmu(..., events=...) has them"
        )
    numbers: dict[str, float] = {}  # default values that are not part of the request
    if isinstance(mechanism, str):
        asked: dict[str, Any] = {} if outputs is None else {"outputs": tuple(outputs)}
        asked |= {"fix": dict(fix)} if fix else {}
        found, request = described_as_asked(mechanism, options, asked)
    else:
        read, given_numbers = read_compilable(mechanism, fix, outputs, **options)
        found, request = read.description()
        numbers = {str(key): float(value) for key, value in given_numbers.items()}
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


def described_mechanism(thing: Any) -> Any:
    """A mechanism or SymPy object as the compiler describes it."""
    errors_of_compiler()
    return read_compilable(thing, None, None)[0].description()[0]
