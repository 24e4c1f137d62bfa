"""A user-defined mechanism or SymPy object, with its options, as a request for a system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from mechc.compilation.build import compile_described, time_stage
from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.from_scene import Seconds, drawn_by
from mechc.compilation.library.defaults import split, with_defaults
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.table import Table
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.inputs.accept import samples_or_signal
from mechc.inputs.sampled import Sampled
from mechc.inputs.signals import Signal
from mechc.progress import Notice
from mechc.system.names import by_name
from mechc.system.reference import ModelReference, Origin
from mechc.system.system import System

LEAST_DERIVATIVES = 2  # of positions, for accelerations


@one_at_a_time
def compile_any(thing: Any, *, drawing: Any = None, ahead: bool = True, **asked: Any) -> System:
    """The system of a request: see :func:`mechc.compile`; for ``ahead`` ``compile_described``."""
    errors_of_compiler()
    seconds: dict[str, float] = {}
    with Notice("reading the mechanism ..."):
        request, numbers = time_stage(seconds, "read", lambda: read_compilable(thing, **asked))
        system = _requested_system(request, seconds, ahead=ahead)
        system = _drawn(system, request, drawing, asked.get("states"))
    return with_defaults(system, numbers, request.symbol_names) if numbers else system


def _requested_system(request: Any, seconds: Seconds, *, ahead: bool = True) -> System:
    """The system of a request without numbers: all requests with its equations share it."""

    def with_outputs(outputs: frozenset[str]) -> System:
        return _requested_system(request.including(outputs), {}, ahead=False)

    def with_laws(laws: Mapping[str, str]) -> System:
        driven, numbers = request.driven_by(laws)
        return _requested_system(driven, {}).with_law_numbers(numbers)

    origin = Origin(request.description, with_outputs, with_laws)
    reference = ModelReference("", custom=True)
    return compile_described(origin, reference, request.digest, seconds, ahead=ahead)


def _drawn(system: System, request: Any, drawing: Any, states: Any) -> System:
    """The system with the picture of this object, which others with its equations need not have.

    One system for objects that look the same, with the same drawing.  Muscles among the ``states``
    are drawn too.
    """
    from mechc_codegen.description.drawing import NO_DRAWING, Drawing, muscles_in

    muscles = muscles_in(states)
    added = (drawing or NO_DRAWING).plus(Drawing(muscles=muscles)) if muscles else drawing
    pictures: dict[Any, System] = system.cache.setdefault(_drawn, {})
    look = request.looks, request.title, added
    if look not in pictures:
        own = system.drawn_by(drawn_by(request.description, added), more=True)
        own.title = request.title  # of these bodies
        if drawing is not None:
            _ = own.picture  # a wrong name is told now
        pictures[look] = own
    return pictures[look]


def read_compilable(
    thing: Any,
    fix: Mapping[Any, Any] | None,
    outputs: Iterable[Any] | None,
    form: str | None = None,
    **settings: Any,
) -> tuple[Any, dict[Any, float]]:
    """The mechanism to compile, and default numbers of parameters."""
    from mechc_codegen.description.mechanism import as_mapping, rates_of_states
    from mechc_codegen.description.source import ConversionSettings
    from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest, compilable
    from mechc_codegen.frontend.read import readable

    if not compilable(thing):
        raise TypeError(
            f"mechc.compile takes a mechc.Mechanism, or a KanesMethod, LagrangesMethod or System "
            f"of sympy.physics.mechanics, not {type(thing).__name__}; of equations that were "
            "derived by hand mechc.from_equations(coordinates, speeds, mass_matrix, forcing) makes "
            "a Mechanism"
        )
    known = [each.name for each in fields(ConversionSettings)]
    for name in settings:
        if name not in known:
            raise UnknownNameError("option of a mechanism", name, known)
    given = {key: value for key, value in settings.items() if value is not None}
    numbers: dict[Any, float] = {}
    if "inputs" in given:
        given["inputs"] = as_mapping(given["inputs"])
    for name in ("inputs", "units"):
        by_name(given.get(name, {}), name)
    by_name(fix or {}, "parameters to fix", "{'g': 9.81}")
    if "inputs" in given:
        given["inputs"] = {key: _curve(key, value) for key, value in given["inputs"].items()}
    if "states" in given:
        given["states"] = rates_of_states(given["states"])
    if "parameters" in given:
        names, values = given["parameters"], {}  # besides those of the equations
        if isinstance(names, Mapping):
            by_name(names, "parameters", "{'mu': 0.3}")
            values = {key: x for key, x in names.items() if x is not None}
        given["parameters"] = tuple([names] if isinstance(names, str) else names)
        given["defaults"] = {**values, **given.get("defaults", {})}
    if "defaults" in given and readable(thing):
        numbers, given["defaults"] = split(given["defaults"], given.get("states", ()))
    single = isinstance(outputs, (str, Mapping))
    chosen = None if outputs is None else tuple([outputs] if single else outputs)
    request = CompileRequest(
        thing, CompileOptions(ConversionSettings(**given), dict(fix or {}), chosen, form)
    )
    return request, numbers or request.numbers


# -- functions of a coordinate, by data -------------------------------------------------------


def _curve(key: Any, value: Any) -> Any:
    """An input; an expression where it is a function of a coordinate given by data.

    A :class:`mechc.Table` is taken of the function's arguments.  ``(positions, values)`` become a
    cubic spline; a :class:`mechc.Signal` and interpolants of SciPy are taken as they are.  Beyond
    their data the first and the last polynomial continue.

    Raises :class:`ValueOutOfBoundsError` for data that are not valid, and data of a function of
    time.
    """
    if isinstance(value, Table):
        return value(*key.args)
    of_time = len(getattr(key, "args", ())) != 1 or getattr(key.args[0], "is_Symbol", False)
    controlled = isinstance(value, (list, tuple, Sampled))
    if of_time and (controlled or samples_or_signal(value, order=0) is not None):
        raise ValueOutOfBoundsError(
            f"inputs: samples and controllers of {key} are given with a run, model.simulate(..., "
            "inputs={...}), or by what calls exported code; mechc.compile takes samples of a "
            "function of a coordinate, sympy.Function('h')(q)"
        )
    signal = samples_or_signal(value, order=LEAST_DERIVATIVES)
    if signal is None:
        return value
    return (
        _steps(key.args[0], signal)
        if signal.kind == "previous"
        else Table.of_signal(signal)(*key.args)
    )


def _steps(x: Any, signal: Signal) -> Any:
    """Values that jump, by choices: a table shows no jumps, at which steps have to end and
    derivatives of the motion jump.  As a tree: SymPy compares all conditions of a Piecewise."""
    from mechc_codegen.description.piecewise import Step, Where
    from sympy import Float

    knots, values = ([Float(float(each)) for each in of] for of in
                     (signal.pieces[0], signal.pieces[1][:, 0]))  # fmt: skip

    def select(first: int, last: int) -> Any:
        middle = (first + last) // 2
        if middle == first:
            return values[first]
        return Where(Step(knots[middle] - x), select(first, middle), select(middle, last))

    return select(0, len(values))
