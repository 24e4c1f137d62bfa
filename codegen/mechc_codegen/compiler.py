"""The compiler: mechanism -> equations -> program -> C.

:func:`build_scene` and :func:`optimised_scene` read as a table of contents; each stage is a folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from mechc_codegen.derive.derive_equations import derive_equations, drop_parameters
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.description.derivatives import Derivatives, slope
from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.request import DEFAULT_REQUEST, USUAL, OutputRequest
from mechc_codegen.drawing.plan import picture_plan
from mechc_codegen.emit.c import CWriter, emit
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.metadata import scene_metadata
from mechc_codegen.emit.tape.scene_tape import scene_tape
from mechc_codegen.emit.units.general import kind_of
from mechc_codegen.emit.units.instruction_sets import (
    InstructionSet,
    instruction_sets,
    with_fitting_lanes,
)
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.fmu import FmuOptions, fmu_files, fmu_request
from mechc_codegen.export.standalone import standalone
from mechc_codegen.export.web import web_scene
from mechc_codegen.extension.build import Build, extension
from mechc_codegen.ir.adjoint import add_adjoint
from mechc_codegen.ir.lower import lower
from mechc_codegen.ir.passes.optimize import optimize
from mechc_codegen.ir.sensitivity import add_sensitivities
from mechc_codegen.ir.series import add_series
from mechc_codegen.ir.switching import add_switching

T = TypeVar("T")


def build_scene(
    mechanism: Mechanism,
    sets: tuple[InstructionSet, ...] | None = None,
    request: OutputRequest = DEFAULT_REQUEST,
) -> Build:
    """The C sources of a mechanism's extension; nothing is compiled yet.

    ``sets``: the instruction sets to compile for; by default those of this machine's family.
    """
    clock = Stopwatch()
    made = optimised_scene(mechanism, request, clock)
    sets = instruction_sets() if sets is None else sets
    sets = tuple(with_fitting_lanes(each, made.functions.equations) for each in sets)
    writer = CWriter(made.functions, made.metadata)
    texts = clock.time("emit", lambda: emit(writer, made.metadata, sets))
    kind, tape = kind_of(made.functions), b""
    if kind:
        sizes = texts["scene_sizes.h"]
        tape = clock.time("tape", lambda: scene_tape(writer, made.metadata, sizes))
    return extension(mechanism.name, texts, sets, clock.seconds, kind if tape else "", tape)


def build_standalone(
    mechanism: Mechanism,
    name: str,
    start: Sequence[float],
    values: Mapping[str, float],
    end: float,
    request: OutputRequest = DEFAULT_REQUEST,
    real: str = "double",
) -> dict[str, str]:
    """The mechanism as C99 for other programs; see :func:`export.standalone.standalone`."""
    made = optimised_scene(mechanism, request, Stopwatch())
    return standalone(made.functions, made.metadata, name, start, values, end, real)


def build_web(
    mechanism: Mechanism, options: FmuOptions, request: OutputRequest = DEFAULT_REQUEST
) -> tuple[dict[str, str], dict[str, Any]]:
    """The mechanism for pages; see :func:`export.web.web_scene`."""
    made = optimised_scene(mechanism, request, Stopwatch(), adjoint=False)
    known = {each["name"] for each in made.metadata["parameters"]} | {*made.metadata["fixed"]}
    plan = picture_plan(mechanism, Drawing(), known)
    return web_scene(made.functions, made.metadata, plan, options)


def build_fmu(
    mechanism: Mechanism, options: FmuOptions, request: OutputRequest = DEFAULT_REQUEST
) -> dict[str, bytes]:
    """The mechanism as a functional mock-up unit; see :func:`export.fmu.fmu_files`."""
    request = fmu_request(request, options.derivatives)
    made = optimised_scene(mechanism, request, Stopwatch(), adjoint=False)
    return fmu_files(made.functions, made.metadata, options)


def optimised_scene(
    mechanism: Mechanism, request: OutputRequest, clock: Stopwatch, *, adjoint: bool = True
) -> OptimisedScene:
    """The scene after deriving, differentiating and optimising; ``adjoint``: with reverse mode."""
    equations = clock.time("derive", lambda: derive_equations(mechanism, request))
    equations = clock.time("differentiate", lambda: differentiate(equations))
    parameters, equations = drop_parameters(mechanism, equations, request)
    lowered = lower(equations)
    program = clock.time("optimize", lambda: add_switching(optimize(lowered), request))
    defaults, slopes = equations.parameter_defaults, Derivatives(other=slope)
    program = clock.time(
        "sensitivity", lambda: add_sensitivities(program, request, defaults, slopes)
    )
    if adjoint and request.includes("sensitivities"):
        program = clock.time("adjoint", lambda: add_adjoint(program, slopes))
    program = clock.time("series", lambda: add_series(program, equations))
    functions = SceneFunctions(program, equations, request)
    return OptimisedScene(functions, scene_metadata(mechanism, parameters, lowered, functions))


def operations_of_all(mechanism: Mechanism, request: OutputRequest) -> dict[str, Any] | None:
    """Operation counts with no parameter fixed and all default outputs; None if this is so.

    Takes as long as a whole derivation.  Outputs that the mechanism does not determine are omitted.
    """
    if not request.fixed and request.outputs.issuperset(USUAL):
        return None
    everything = OutputRequest(request.outputs | frozenset(USUAL), {}, request.expressions)
    try:
        made = optimised_scene(mechanism, everything, Stopwatch())
    except (CodegenError, ValueError):  # positions that are not known
        made = optimised_scene(mechanism, replace(request, fixed={}), Stopwatch())
    counts: dict[str, Any] = made.metadata["operations"]
    return counts


@dataclass(frozen=True)
class OptimisedScene:
    """The input of every emitter; ``metadata`` is data for JSON."""

    functions: SceneFunctions
    metadata: dict[str, Any]


@dataclass
class Stopwatch:
    """The seconds that each stage takes."""

    seconds: dict[str, float] = field(default_factory=dict)

    def time(self, stage: str, run: Callable[[], T]) -> T:
        start = time.perf_counter()
        result = run()
        self.seconds[stage] = time.perf_counter() - start
        return result
