"""A program divided into the functions of a scene.

Input: an optimised program with its equations and request.  Output: for each function the
statements it computes, the outputs it stores and the values it keeps for later calls.  Invariant:
a statement of the configuration is not repeated in the motion; its value is kept between the two.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from sympy import Expr, Symbol

from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.emit.expressions import Value, named
from mechc_codegen.emit.layout import (
    ADJOINT,
    INTERNAL,
    JACOBIANS,
    OWN,
    RESIDUALS,
    TREE,
    TREE_MOTION,
    UNLISTED,
    layout,
)
from mechc_codegen.emit.row_blocks import scene_blocks
from mechc_codegen.ir.program import Program, Statement, slice_statements, symbols_of, targets_of

WIDEST_IN_LANES = 32  # components of a state
LONG = 200  # values of a stage, beyond which its parts are called rather than in line

Kind = Literal["hoist", "configuration", "motion", "output"]


@dataclass(frozen=True)
class SceneFunction:
    """One function of the scene.

    ``stores``: outputs with the array that each is written to.  ``kept``: symbols whose values go
    to ``array``.  ``loads``: where symbols that no statement defines are read from.
    ``of_motion``: whether accelerations or multipliers are needed; ``of_covector``: whether the
    numbers of a covector are.
    """

    kind: Kind
    name: str
    comment: str
    statements: Sequence[Statement]
    loads: Mapping[Symbol, Value]
    stores: Sequence[tuple[Output, str]] = ()
    kept: Sequence[Symbol] = ()
    array: str = ""
    of_motion: bool = False
    of_covector: bool = False


@dataclass
class SceneFunctions:
    """The functions of one program, and the values that they pass to each other."""

    program: Program
    equations: Equations
    request: OutputRequest
    outputs: Mapping[str, Output] = field(init=False)

    def __post_init__(self) -> None:
        program = self.program
        self.outputs = {o.name: o for o in program.outputs}
        self.layout = layout(self.equations, self.outputs)
        self.configuration = self._slice(self.layout.configuration)
        computed = set(targets_of(self.configuration))
        motion = self._slice(self.layout.motion)
        self.motion = [s for s in motion if computed.isdisjoint(s.targets)]
        used = symbols_of(self.motion) | self._used_by(self.layout.motion)
        self.saved = [s for s in targets_of(self.configuration) if s in used]
        running = symbols_of((*program.body, *program.outputs))
        self.constants = [s for s in targets_of(program.hoisted) if s in running]
        self.rows = self.equations.holonomic + self.equations.nonholonomic
        self.blocks = scene_blocks(self.equations, self.layout, self.outputs)

    def __iter__(self) -> Iterator[SceneFunction]:
        """Every function, in the order of the generated text."""
        loads = self._array_places()
        given = {s: named("p")[i] for i, s in enumerate(self.program.symbols.parameters)}
        yield SceneFunction(
            "hoist", "hoist", "Constants: everything that depends on parameters alone.",
            self.program.hoisted, given, (), self.constants, "k",
        )  # fmt: skip
        yield SceneFunction(
            "configuration", self.layout.prefix + "configuration",
            "What depends on the configuration: constraints, their Jacobian, mass matrix.",
            self.configuration, loads, self._stores(self.layout.configuration),
            self.saved, "saved",
        )  # fmt: skip
        yield SceneFunction(
            "motion", self.layout.prefix + "motion",
            "What depends on the speeds too: right-hand sides of the equations of motion.",
            self.motion, loads | {s: named("saved")[i] for i, s in enumerate(self.saved)},
            self._stores(self.layout.motion),
        )  # fmt: skip
        for output in self.own_functions():
            yield SceneFunction(
                "output", output.name, output.equation, self._slice((output.name,)), loads,
                [(output, "out")], of_motion=self.needs_motion(output),
                of_covector=output.name == ADJOINT,
            )  # fmt: skip

    def _stores(self, targets: Mapping[str, str]) -> list[tuple[Output, str]]:
        present = [(name, target) for name, target in targets.items() if name in self.outputs]
        return [(self.outputs[name], target) for name, target in present]

    @property
    def fits_lanes(self) -> bool:
        """Whether several runs fit the lanes: larger states and their stages leave the first cache,
        and conditioning is watched of rows on the configuration alone."""
        symbols, equations = self.program.symbols, self.equations
        watched = not equations.nonholonomic or (equations.holonomic <= 1 and not equations.tree)
        return watched and len(symbols.q) + len(symbols.u) <= WIDEST_IN_LANES

    @property
    def long(self) -> bool:
        """Whether a stage computes so much that the cost of a call is small in comparison."""
        names = (*self.layout.configuration, *self.layout.motion)
        elements = [
            e for name in names if name in self.outputs for e in self.outputs[name].elements
        ]
        stored = sum(1 for e in elements if e != 0)
        return len(self.configuration) + len(self.motion) + stored > LONG

    @property
    def rows_hold_inputs(self) -> bool:
        """Whether the constraints, or another part of the configuration, contain inputs."""
        used = symbols_of(self.configuration) | self._used_by(self.layout.configuration)
        return self.rows > 0 and any(v.symbol in used for v in self.program.input_values())

    @property
    def storage(self) -> str:
        """The storage class of the two functions of a stage."""
        called = self.long and self.layout.storage == "MECHC_INLINE"
        return "MECHC_SINGLE" if called else self.layout.storage

    def own_functions(self) -> list[Output]:
        """The outputs that have a function of their own."""
        return [o for o in self.program.outputs if o.name not in (*INTERNAL, *TREE, *TREE_MOTION)]

    def listed_outputs(self) -> list[Output]:
        """The outputs with a function of their own that a user can evaluate by name."""
        return [o for o in self.own_functions() if o.name not in UNLISTED]

    @property
    def own_rows(self) -> int:
        """Number of rows in Jacobians of outputs: user-defined ones, and those of sensitivities."""
        return next((self.outputs[name].shape[0] for name in OWN if name in self.outputs), 0)

    def by_runtime(self) -> list[tuple[str, int]]:
        """Name and width of the outputs that the runtime computes once the motion is solved."""
        size = len(self.program.symbols.q) + len(self.program.symbols.u)
        multipliers = self.rows and self.request.includes("multipliers")
        return [
            ("rates", size),
            *self.layout.solved,
            *([("multipliers", self.rows)] if multipliers else []),
            *self.jacobians(),
        ]

    def jacobians(self) -> list[tuple[str, int]]:
        """Name and width of the Jacobians of the motion and of the user's own outputs."""
        symbols, own = self.program.symbols, self.own_rows
        size = len(symbols.q) + len(symbols.u)
        columns = (size, len(symbols.parameters), len(self.program.input_values()))
        found = list[tuple[str, int]]()
        for (name, (residual, *_)), width in zip(JACOBIANS.items(), columns, strict=True):
            if residual in self.outputs:
                found.append((name, size * width))
                found += [(f"own_{name}", own * width)] if own else []
        return found

    def needs_motion(self, output: Output) -> bool:
        """Whether an output or a statement it needs contains accelerations or multipliers."""
        if output.name in (*RESIDUALS, *OWN, ADJOINT):
            return True
        statements = self._slice((output.name,))
        used = self._used_by((output.name,)) | symbols_of(statements)
        return not used.isdisjoint(self.program.symbols.motion)

    def defaults(self) -> Iterator[tuple[int, Expr | None, list[int]]]:
        """Triples of a parameter's index, its default, and indices of parameters in the default.

        A parameter comes after those that its default holds.
        """
        symbols, values = self.program.symbols.parameters, self.equations.parameter_defaults
        index = {symbol: i for i, symbol in enumerate(symbols)}
        held = [sorted(index[s] for s in v.free_symbols) if v is not None else [] for v in values]
        placed = set[int]()

        def place(i: int) -> Iterator[int]:
            if i not in placed:
                placed.add(i)
                for j in held[i]:
                    yield from place(j)
                yield i

        for first in range(len(symbols)):
            yield from ((i, values[i], held[i]) for i in place(first))

    def _array_places(self) -> dict[Symbol, Value]:
        symbols = self.program.symbols
        arrays: list[tuple[str, Sequence[Symbol]]] = [
            ("q", symbols.q),
            ("u", symbols.u),
            ("p", symbols.parameters),
            ("k", self.constants),
            ("a", symbols.accelerations),
            ("l", symbols.multipliers),
            ("c", symbols.covector),
        ]
        return {s: named(array)[i] for array, members in arrays for i, s in enumerate(members)}

    def _used_by(self, names: Iterable[str]) -> set[Symbol]:
        return symbols_of(self.outputs[n] for n in names if n in self.outputs)

    def _slice(self, names: Iterable[str]) -> list[Statement]:
        return slice_statements(self.program.body, self._used_by(names))
