"""A user-defined mechanism or SymPy object, with its options, as a request for a system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mechc.compilation.build import compile_described, compile_known, timed, without_c
from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.defaults import split, with_defaults
from mechc.system.reference import ModelReference
from mechc.system.system import System


def compile_any(thing: Any, *, backend: str = "c", **asked: Any) -> System:
    """The system of a request; see :func:`mechc.compile`."""
    errors_of_compiler()
    seconds: dict[str, float] = {}
    request, numbers = timed(seconds, "read", lambda: read_compilable(thing, **asked))
    system = _compiled(request, ModelReference("", custom=True, backend=backend), seconds)
    return with_defaults(system, numbers, request.symbol_names) if numbers else system


def _compiled(request: Any, reference: ModelReference, seconds: dict[str, float]) -> System:
    if reference.backend == "numpy":
        return without_c(request.described, reference, seconds)
    known = request.digest
    if known is None:
        return compile_described(request.described, reference, seconds)
    return compile_known(known, request.described, reference, seconds)


def read_compilable(
    thing: Any,
    fix: Mapping[Any, Any] | None,
    outputs: Iterable[Any] | None,
    **settings: Any,
) -> tuple[Any, dict[Any, float]]:
    """The mechanism to compile, and default numbers of parameters."""
    from mechc_codegen.description.source import ConversionSettings
    from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest, compilable
    from mechc_codegen.frontend.read import readable

    if not compilable(thing):
        raise TypeError(
            f"mechc.compile takes a mechc.Mechanism, or a KanesMethod, LagrangesMethod or System "
            f"of sympy.physics.mechanics, not {type(thing).__name__}"
        )
    given = {key: value for key, value in settings.items() if value is not None}
    numbers: dict[Any, float] = {}
    if "states" in given:
        given["states"] = _rates(given["states"])
    if "defaults" in given and readable(thing):
        numbers, given["defaults"] = split(given["defaults"], given.get("states", ()))
    chosen = None if outputs is None else tuple([outputs] if _single(outputs) else outputs)
    options = CompileOptions(ConversionSettings(**given), dict(fix or {}), chosen)
    return CompileRequest(thing, options), numbers


def _rates(states: Any) -> dict[Any, Any]:
    """State -> rate, also from objects that have both."""
    if isinstance(states, Mapping):
        return dict(states)
    several = [states] if hasattr(states, "rhs") else list(states)
    return {x: rate for one in several for x, rate in zip(one.x, one.rhs(), strict=True)}


def _single(outputs: Any) -> bool:
    return isinstance(outputs, (str, Mapping))
