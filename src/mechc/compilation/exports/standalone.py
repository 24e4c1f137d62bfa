"""The C of a mechanism for other programs: derived and emitted, not compiled."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.library.library import described_as_asked
from mechc.compilation.request import read_compilable
from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.progress import Notice
from mechc.system.names import by_name
from mechc.system.parameters import one_double
from mechc.system.quantity import NamedQuantity
from mechc.system.system import System
from mechc.system.units import in_si


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
    with Notice(f"deriving the equations of {name} ..."):
        texts: dict[str, str] = build_standalone(*given)
    return texts


def warn_of_contacts(mechanism: Any) -> None:
    """Warn that what is exported has none of the mechanism's own stops and dry friction."""
    from mechc_codegen.errors import SkippedPartWarning

    if mechanism.contacts:
        warnings.warn(
            f"{mechanism.name}: exported without its {len(mechanism.contacts)} stops and places of "
            "dry friction; a unit of mechc.export_fmu has them",
            SkippedPartWarning, stacklevel=4,
        )  # fmt: skip


def read_export(
    mechanism: Any,
    y0: Sequence[float] | Mapping[Any, float] | None,
    params: Mapping[str, float],
    *,
    fix: Mapping[Any, float] | None,
    outputs: Iterable[Any] | None,
    **options: Any,
) -> ExportRequest:
    """A checked request for an export; arguments as those of :func:`mechc.export_c`."""
    errors_of_compiler()
    from mechc_codegen.frontend.compile_request import with_numbers

    if "events" in options:
        raise ValueOutOfBoundsError(
            "exported C and pages have no events, stops or dry friction: a unit of "
            "mechc.export_fmu(..., events=...) has them"
        )
    params, fix = by_name(params, "params"), by_name(fix or {}, "parameters to fix")
    numbers: Mapping[Any, Any] = {}  # default values that are not part of the request
    if isinstance(system := getattr(mechanism, "system", None), System):
        _refuse_options(options)
        _refuse_inputs(system)
        found, request = _described_again(system, fix, tuple(outputs or ()))
        numbers = system.given_defaults
        if isinstance(y0, Mapping):
            y0 = mechanism.assemble(
                *mechanism.coordinates_and_speeds(by_name(y0, "y0")),
                params={n: x for n, x in {**fix, **params}.items() if n in system.parameters},
            )
    elif isinstance(mechanism, str):
        asked: dict[str, Any] = {} if outputs is None else {"outputs": tuple(outputs)}
        asked |= {"fix": fix} if fix else {}
        found, request = described_as_asked(mechanism, options, asked)
    else:
        read, numbers = read_compilable(mechanism, fix, outputs, **options)
        found, request = read.description()
    states = len(found.coordinates) + len(found.states) + len(found.speeds)
    if isinstance(y0, Mapping):
        raise ValueOutOfBoundsError(
            "y0 by names needs the compiled model, which closes the loops: give it in place of the "
            "description; else y0 is a state, coordinates and then speeds"
        )
    start = [0.0] * states if y0 is None else [float(value) for value in y0]
    if len(start) != states:
        raise ValueOutOfBoundsError(f"y0 has {len(start)} values; a state has {states}")
    if not np.isfinite(start).all():
        raise ValueOutOfBoundsError("the values of y0 must be finite")
    known = _open_parameters(found, request)
    for given in params:
        if given not in known:
            raise UnknownNameError("parameter", given, sorted(known))
    defaults, values = (
        {n: _number(value, known[n]) for n, value in each.items() if n in known}
        for each in (by_name(numbers, "defaults"), params)
    )
    found = with_numbers(found, defaults)
    return ExportRequest(found, request, start, values)


def _number(value: Any, of: NamedQuantity) -> float:
    """The value of a parameter, in SI units and within its bounds."""
    number = one_double(in_si(value, of), of.name)
    of.check(np.asarray(number))
    return number


def _open_parameters(described: Any, request: Any) -> dict[str, NamedQuantity]:
    """The parameters that are not fixed, by name."""
    from mechc_codegen.emit.metadata import described_quantities

    left = [p for p in described.parameters if p.symbol not in request.fixed]
    found = map(NamedQuantity.from_metadata, described_quantities(left))
    return {quantity.name: quantity for quantity in found}


def _refuse_options(options: Mapping[str, Any]) -> None:
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise MechcError(
            f"a model is exported as it was compiled: {', '.join(given)} cannot be changed; give "
            "the description in place of the model, or fix= and outputs="
        )


def _refuse_inputs(system: System) -> None:
    given = {} if system.driven is None else system.driven.given
    if given:
        raise MechcError(
            f"exported code has no values of inputs, and the model has of {', '.join(given)}: "
            "export the model without them, and give them there"
        )


def _described_again(
    system: System, fix: Mapping[Any, Any], outputs: tuple[Any, ...]
) -> tuple[Any, Any]:
    """The mechanism of a compiled model and its request, joined with a further one."""
    from mechc_codegen.frontend.read_request import read_request

    if system.origin is None:
        raise MechcError(
            f"the description of {system.name} is not at hand in this process, only the compiled "
            "model: give the description in place of the model"
        )
    found, request = system.origin.description()
    return found, request.joined(read_request(found, fix, outputs, of_object=True))


def described(system: System) -> tuple[Any, Any]:
    """The mechanism of a system as the compiler describes it, and the request for its outputs."""
    errors_of_compiler()
    return _described_again(system, {}, ())
