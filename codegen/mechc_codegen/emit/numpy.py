"""Stage 5 for machines without a C compiler: Program -> Python over floats or NumPy arrays.

Input: an optimised program.  Output: the text of functions that fill lists, one column of states a
place.  Invariant: every name in the text is made here or in the passes; no text of a user is in it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sympy import Symbol

from mechc_codegen.derive.equations import Equations, Output, Tree
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest
from mechc_codegen.emit.functions import SceneFunction, SceneFunctions
from mechc_codegen.emit.printer import NumpyPrinter
from mechc_codegen.emit.tables import lookups
from mechc_codegen.emit.units.split_functions import PIECE, Line
from mechc_codegen.emit.writer import FunctionWriter
from mechc_codegen.errors import MechanismError
from mechc_codegen.ir.program import Assign, Program, SineCosine, Statement

STATE = ("t", "w", "q", "u", "p", "k")  # what every function of states is given; w: the inputs
SOLVED = (*STATE, "a", "l")  # outputs: accelerations and multipliers, where they hold any


@dataclass(frozen=True)
class Listing:
    """A scene for the runtime: the text, and how its functions are called.

    ``configuration`` and ``motion``: array -> its length, of what the functions of these names
    fill.  ``written``: what is a function of its own -> its name and length; ``outputs`` of these;
    ``of_motion`` of these: what holds accelerations or multipliers; ``solved``: outputs that the
    runtime makes itself; ``names``: of outputs of the user's own, what the user calls them.
    """

    text: str
    metadata: str
    coordinates: int
    speeds: int
    holonomic: int
    rows: int
    parameters: int
    constants: int
    saved: int
    names: Mapping[str, str]
    identity_kinematics: bool
    configuration: Mapping[str, int]
    motion: Mapping[str, int]
    written: Mapping[str, tuple[str, int]]
    outputs: tuple[str, ...]
    of_motion: frozenset[str]
    solved: tuple[str, ...]
    tree: Tree | None


def emit_numpy(
    program: Program,
    equations: Equations,
    metadata: Mapping[str, Any],
    request: OutputRequest = DEFAULT_REQUEST,
) -> Listing:
    """The functions of one scene.

    Raises
    ------
    MechanismError
        Where sensitivities are requested, which only compiled code has.
    """
    if request.includes("sensitivities"):
        raise MechanismError("sensitivities need compiled code: compile without backend='numpy'")
    return _listing(SceneFunctions(program, equations, request), metadata)


def _listing(functions: SceneFunctions, metadata: Mapping[str, Any]) -> Listing:
    equations, layout, symbols = functions.equations, functions.layout, functions.program.symbols
    own, request, writer = functions.own_functions(), functions.request, NumpyWriter(functions)
    return Listing(
        "\n".join([_tables(functions), _complete(functions), *map(writer.text, functions)]),
        json.dumps(metadata, sort_keys=True),
        len(symbols.q), len(symbols.u), equations.holonomic, functions.rows,
        len(symbols.parameters), len(functions.constants), len(functions.saved),
        {label: request.name_of(label) for label in request.expressions},
        equations.identity_kinematics,
        writer.lengths(layout.configuration), writer.lengths(layout.motion),
        {o.name: (writer.names[o.name], len(o.elements)) for o in own},
        tuple(o.name for o in functions.listed()),
        frozenset(o.name for o in own if functions.needs_motion(o)),
        tuple(name for name, _ in functions.solved()), equations.tree,
    )  # fmt: skip


class NumpyWriter(FunctionWriter):
    """Python over lists, which hold zeros before they are filled."""

    most_lines = PIECE

    def __init__(self, functions: SceneFunctions) -> None:
        self.functions, self.printer = functions, NumpyPrinter(tables=True)
        outputs = enumerate(functions.own_functions())
        self.names = {output.name: f"output_{number}" for number, output in outputs}
        values = enumerate(functions.program.input_values())
        self.inputs = {value.symbol: f"w[{place}]" for place, value in values}

    def text(self, function: SceneFunction) -> str:
        return super().text(replace(function, loads={**function.loads, **self.inputs}))

    def lengths(self, targets: Mapping[str, str]) -> dict[str, int]:
        """Array -> its length, of the outputs that the scene has."""
        outputs = self.functions.outputs
        return {a: len(outputs[name].elements) for name, a in targets.items() if name in outputs}

    def statements(self, function: SceneFunction) -> list[Line]:
        return [self._print(statement) for statement in function.statements]

    def _print(self, statement: Statement) -> Line:
        value = self.printer.real(statement.value)
        used = statement.value.free_symbols
        if isinstance(statement, SineCosine):
            sine, cosine = statement.sine.name, statement.cosine.name
            both = (f"{sine} = {value}", f"{cosine} = cos({sine})", f"{sine} = sin({sine})")
            return Line(both, statement.targets, used)
        assert isinstance(statement, Assign)
        return Line((f"{statement.target.name} = {value}",), statement.targets, used)

    def store(self, output: Output, target: str) -> list[Line]:
        return [
            Line((f"{target}[{i}] = {self.printer.real(e)}",), uses=e.free_symbols)
            for i, e in enumerate(output.elements)
            if e != 0
        ]

    def keep(self, array: str, index: int, symbol: Symbol) -> Line:
        return Line((f"{array}[{index}] = {symbol.name}",), uses=(symbol,))

    def load(self, symbol: Symbol, place: str) -> str:
        return f"{symbol.name} = {place}"

    def whole(self, function: SceneFunction, body: Sequence[str]) -> str:
        return _definition(*self._head(function), body)

    def piece(self, function: SceneFunction, number: int, body: Sequence[str]) -> str:
        name, arguments = self._head(function)
        return _definition(f"{name}_{number}", (*arguments, "shared"), body)

    def caller(self, function: SceneFunction, count: int, size: int) -> str:
        name, arguments = self._head(function)
        given = ", ".join((*arguments, "shared"))
        calls = [f"{name}_{number}({given})" for number in range(count)]
        return _definition(name, arguments, [f"shared = [None]*{size}", *calls])

    def _head(self, function: SceneFunction) -> tuple[str, tuple[str, ...]]:
        """Name and arguments of a function."""
        if function.kind == "output":
            return self.names[function.name], (*SOLVED, "out")
        if function.kind == "hoist":
            return "hoist", ("p", "k")
        targets = getattr(self.functions.layout, function.kind)
        return function.kind, (*STATE, "saved", *self.lengths(targets))


def _tables(functions: SceneFunctions) -> str:
    """The functions of tables, which the runtime makes of their data."""
    return "".join(
        f"{each.__name__} = table({each.orders}, {each.table.starts}, {each.table.degree}, "
        f"{each.table.coefficients}, {each.table.periods})\n"
        for each in lookups(functions.program.values())
    )


def _complete(functions: SceneFunctions) -> str:
    """Parameters that are not given take their defaults."""
    symbols, printer, body = functions.program.symbols.parameters, NumpyPrinter(), list[str]()
    for i, value, held in functions.defaults():
        body += [f"{symbols[j].name} = p[{j}]" for j in held]
        default = "nan" if value is None else printer.real(value)
        body.append(f"if not given[{i}]: p[{i}] = {default}")
    return _definition("complete", ("given", "p"), body)


def _definition(name: str, arguments: Sequence[str], body: Sequence[str]) -> str:
    lines = "".join(f"    {line}\n" for line in body or ["pass"])
    return f"def {name}({', '.join(arguments)}):\n{lines}"
