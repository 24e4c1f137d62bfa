"""Stage 6: C -> files to compile.

Input: a mechanism.  Output: a folder's worth of texts and how to compile each of them.
Invariant: everything that decides the binary is in :class:`Build` (:func:`signature` lists it).
"""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.recursion import derive_tree
from mechc_codegen.description.mechanism import Mechanism, Parameter
from mechc_codegen.description.request import EVERYTHING, USUAL, Wishes
from mechc_codegen.emit.c import BASELINE, WIDER, InstructionSet, emit
from mechc_codegen.emit.metadata import scene_metadata
from mechc_codegen.emit.numpy import Listing, emit_numpy
from mechc_codegen.errors import CodegenError
from mechc_codegen.ir.lower import lower
from mechc_codegen.ir.optimize import optimize
from mechc_codegen.ir.program import Program, symbols_of
from mechc_codegen.ir.sensitivity import add_sensitivities

# -ffast-math would let a loaded extension flush denormals for the whole process.
# gcc's vectorisers gather the scalar code's numbers into vectors at twice the time; where vectors
# pay, the code is written in lanes.
FLAGS = (
    "-std=gnu11",
    "-O3",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=fast",
    "-fno-tree-vectorize",
    "-fvisibility=hidden",
)
# Soon there rather than fast: it serves until the whole is compiled.
FIRST_FLAGS = ("-std=gnu11", "-O1", *FLAGS[2:], "-DMECHC_SHARED")
SHARED = ("-DMECHC_SHARED",)  # the model is found by name
STRICT = ("-Wall", "-Wextra", "-Werror")  # for our tests; a user's compiler may warn of more
# Of rows solved together: beyond it, the factors of all lanes would overflow a stack of 8 MB.
MOST_SQUARES = 65536  # squares of the speeds, times lanes
LEAST_TREE = 7  # fewer speeds: straight-line code for M and F is faster (docs/growth.md)
T = TypeVar("T")
RUNTIME = Path(str(files("mechc_codegen"))) / "runtime"


@dataclass(frozen=True)
class Build:
    """The texts of one scene, and per source file the compiler flags beyond ``FLAGS``."""

    name: str
    texts: Mapping[str, str]
    flags: Mapping[str, tuple[str, ...]]
    seconds: Mapping[str, float] = field(default_factory=dict)  # that each stage took

    @property
    def first_flags(self) -> tuple[str, ...]:
        """Those of the widest instruction set, which the first unit is compiled for."""
        return max(self.flags.values(), key=len)

    @property
    def sources(self) -> tuple[str, ...]:
        return tuple(self.flags)

    def write(self, folder: Path) -> None:
        """Write the texts; an unchanged file keeps its time stamp."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.texts.items():
            path = folder / name
            if not path.exists() or path.read_text("utf-8") != text:
                path.write_text(text, "utf-8")


@dataclass(frozen=True)
class Optimised:
    """What both ways of emitting begin with."""

    equations: Equations
    program: Program
    metadata: str


def build_scene(
    mechanism: Mechanism,
    sets: tuple[InstructionSet, ...] | None = None,
    wishes: Wishes = EVERYTHING,
) -> Build:
    """Derive, optimise and emit a mechanism; nothing is compiled yet."""
    sets = instruction_sets() if sets is None else sets
    seconds: dict[str, float] = {}
    made = optimised(mechanism, wishes, seconds)
    told = (made.program, made.equations, made.metadata)
    sets = tuple(_fitting(each, made.equations) for each in sets)
    texts = _timed(seconds, "emit", lambda: emit(*told, sets, wishes))
    texts["scene.pyx"] = (files("mechc_codegen.emit") / "templates" / "scene.pyx.in").read_text(
        "utf-8"
    )
    flags = {f"scene_{each.name}.c": each.flags for each in sets} | {"scene_model.c": ()}
    return Build(mechanism.name, texts, flags, seconds)


def _fitting(chosen: InstructionSet, equations: Equations) -> InstructionSet:
    """With fewer lanes, down to two, where a scene with loops has very many speeds."""
    if not equations.holonomic + equations.nonholonomic:
        return chosen
    lanes = chosen.lanes
    while lanes > BASELINE.lanes and lanes * len(equations.symbols.u) ** 2 > MOST_SQUARES:
        lanes //= 2
    return replace(chosen, lanes=lanes)


def build_listing(
    mechanism: Mechanism, wishes: Wishes = EVERYTHING
) -> tuple[Listing, dict[str, float]]:
    """The same for machines without a C compiler; with the seconds that each stage took."""
    seconds: dict[str, float] = {}
    made = optimised(mechanism, wishes, seconds)
    told = (made.program, made.equations, made.metadata)
    return _timed(seconds, "emit", lambda: emit_numpy(*told, wishes)), seconds


def optimised(mechanism: Mechanism, wishes: Wishes, seconds: dict[str, float]) -> Optimised:
    """Derive, differentiate, lower and optimise."""
    equations = _timed(seconds, "derive", lambda: equations_of(mechanism, wishes))
    equations = _timed(seconds, "differentiate", lambda: differentiate(equations))
    parameters, equations = drop_parameters(mechanism, equations, wishes)
    lowered = lower(equations)
    optimized = _timed(seconds, "optimize", lambda: optimize(lowered))
    program = _timed(seconds, "sensitivity", lambda: add_sensitivities(optimized, wishes))
    told = scene_metadata(mechanism, parameters, (lowered, program), equations, wishes)
    return Optimised(equations, program, json.dumps(told, sort_keys=True))


def operations_of_all(mechanism: Mechanism, wishes: Wishes) -> dict[str, Any]:
    """What :func:`operation_counts` says with nothing fixed and every usual output.

    As a whole derivation takes; outputs that the mechanism cannot give are left out.
    """
    everything = Wishes(wishes.outputs | frozenset(USUAL), {}, wishes.expressions)
    try:
        made = optimised(mechanism, everything, {})
    except (CodegenError, ValueError):  # positions that are not known
        made = optimised(mechanism, replace(wishes, fixed={}), {})
    found: dict[str, Any] = json.loads(made.metadata)["operations"]
    return found


def equations_of(mechanism: Mechanism, wishes: Wishes = EVERYTHING) -> Equations:
    """Link by link where that pays and the description allows it; else written out."""
    if len(mechanism.speeds) >= LEAST_TREE:
        try:
            return derive_tree(mechanism, wishes)
        except NotATreeError:
            pass
    return derive(mechanism, wishes)


def drop_parameters(
    mechanism: Mechanism, equations: Equations, wishes: Wishes
) -> tuple[tuple[Parameter, ...], Equations]:
    """The parameters less those that are fixed, and those without a value that nothing uses."""
    symbols = equations.symbols.parameters
    used = symbols_of(e for o in equations.outputs.values() for e in o.elements)
    used |= symbols_of(value for _, value in equations.intermediates)
    defaults = equations.parameter_defaults
    used |= symbols_of(e for e in defaults if e is not None)
    kept = [
        i
        for i, parameter in enumerate(mechanism.parameters)
        if parameter.symbol not in wishes.fixed
        and (parameter.default is not None or symbols[i] in used)
    ]
    left = replace(
        equations,
        symbols=replace(equations.symbols, parameters=tuple(symbols[i] for i in kept)),
        parameter_defaults=tuple(defaults[i] for i in kept),
    )
    return tuple(mechanism.parameters[i] for i in kept), left


def instruction_sets() -> tuple[InstructionSet, ...]:
    """Baseline, and on x86-64 the wider ones that are chosen at run time."""
    return (BASELINE, *WIDER) if platform.machine() in {"x86_64", "AMD64"} else (BASELINE,)


def runtime_headers() -> list[str]:
    """Every header that generated code includes: what a build depends on."""
    return sorted(str(path) for path in RUNTIME.rglob("*.h"))


def signature(build: Build, compiler: str, python: str) -> str:
    """Hash of all that decides a binary."""
    digest = hashlib.sha256()
    parts = [*(f"{name}\n{text}" for name, text in sorted(build.texts.items()))]
    parts += [f"{name} {flags}" for name, flags in sorted(build.flags.items())]
    parts += [Path(header).read_text("utf-8") for header in runtime_headers()]
    parts += [" ".join(FLAGS), compiler, python, platform.machine()]
    for part in parts:
        digest.update(f"{len(part)}:".encode() + part.encode())
    return digest.hexdigest()


def _timed(seconds: dict[str, float], stage: str, run: Callable[[], T]) -> T:
    start = time.perf_counter()
    result = run()
    seconds[stage] = time.perf_counter() - start
    return result
