"""Stage 5 for machines without a C compiler: Program -> Python over floats or NumPy arrays.

Input: an optimised program.  Output: the text of functions that fill lists, one column of states a
place.  Invariant: every name in the text is made here or in the passes; nothing that a user named
is in it, neither as code nor as words.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sympy import Symbol

from mechc_codegen.derive.equations import Equations, Output, Tree
from mechc_codegen.description.request import EVERYTHING, Wishes
from mechc_codegen.emit.layout import (
    INTERNAL,
    JACOBIANS,
    TREE,
    TREE_MOTION,
    UNLISTED,
    layout,
)
from mechc_codegen.emit.printer import NumpyPrinter
from mechc_codegen.emit.split_functions import Line, Shared, as_soon_as_possible, pieces_of
from mechc_codegen.errors import MechanismError
from mechc_codegen.ir.program import (
    Assign,
    Program,
    SineCosine,
    Statement,
    slice_statements,
    symbols_of,
    targets_of,
)

STATE = ("t", "q", "u", "p", "k")  # what every function of states is given
SOLVED = (*STATE, "a", "l")  # outputs: accelerations and multipliers, where they hold any


@dataclass(frozen=True)
class Listing:
    """What the runtime is given of a scene: the text, and how its functions are called.

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
    program: Program, equations: Equations, metadata: str, wishes: Wishes = EVERYTHING
) -> Listing:
    """The functions of one scene.

    Raises
    ------
    MechanismError
        Where inputs are left open: compiled code alone is given them with a run.
    """
    if program.input_values():
        raise MechanismError(
            "inputs that are given with a run need compiled code: with backend='numpy' say what "
            "each is with inputs={name: expression}"
        )
    return _Emitter(program, equations, wishes).listing(metadata)


class _Emitter:
    def __init__(self, program: Program, equations: Equations, wishes: Wishes) -> None:
        self.program, self.equations, self.wishes = program, equations, wishes
        self.printer = NumpyPrinter()
        self.outputs = {o.name: o for o in program.outputs}
        self.layout = layout(equations, self.outputs)
        self.configuration = self._slice(self.layout.configuration)
        computed = set(targets_of(self.configuration))
        motion = self._slice(self.layout.motion)
        self.motion = [s for s in motion if computed.isdisjoint(s.targets)]
        used = symbols_of(s.value for s in self.motion) | self._used_by(self.layout.motion)
        self.saved = [s for s in targets_of(self.configuration) if s in used]
        running = symbols_of(s.value for s in program.body)
        running |= symbols_of(e for o in program.outputs for e in o.elements)
        self.constants = [s for s in targets_of(program.hoisted) if s in running]

    def listing(self, metadata: str) -> Listing:
        equations, symbols = self.equations, self.program.symbols
        return Listing(
            self.text(), metadata, len(symbols.q), len(symbols.u), equations.holonomic,
            equations.holonomic + equations.nonholonomic, len(symbols.parameters),
            len(self.constants), len(self.saved),
            {label: self.wishes.name_of(label) for label in self.wishes.expressions},
            equations.identity_kinematics,
            self._lengths(self.layout.configuration), self._lengths(self.layout.motion),
            {o.name: (f"output_{k}", len(o.elements)) for k, o in enumerate(self._asked())},
            tuple(o.name for o in self._asked() if o.name not in UNLISTED),
            frozenset(o.name for o in self._asked() if self._needs_motion(o)),
            tuple(self._solved()), equations.tree,
        )  # fmt: skip

    def text(self) -> str:
        functions = [self._complete(), self._hoist(), self._configuration(), self._motion()]
        functions += [self._output(k, output) for k, output in enumerate(self._asked())]
        return "\n".join(functions)

    def _asked(self) -> list[Output]:
        """Outputs that are a function of their own."""
        return [o for o in self.program.outputs if o.name not in (*INTERNAL, *TREE, *TREE_MOTION)]

    def _solved(self) -> list[str]:
        rows = self.equations.holonomic + self.equations.nonholonomic
        multipliers = ["multipliers"] if rows and self.wishes.wants("multipliers") else []
        jacobians = [
            name
            for jacobian, (of_motion, of_own, _) in JACOBIANS.items()
            for part, name in ((of_motion, jacobian), (of_own, f"own_{jacobian}"))
            if part in self.outputs
        ]
        return ["rates", *(name for name, _ in self.layout.solved), *multipliers, *jacobians]

    def _needs_motion(self, output: Output) -> bool:
        """Whether it holds accelerations or multipliers, itself or by statements."""
        statements = self._slice((output.name,))
        used = self._used_by((output.name,)) | symbols_of(s.value for s in statements)
        return not used.isdisjoint(self.program.symbols.motion)

    def _lengths(self, targets: Mapping[str, str]) -> dict[str, int]:
        present = [(name, target) for name, target in targets.items() if name in self.outputs]
        return {target: len(self.outputs[name].elements) for name, target in present}

    # -- functions ---------------------------------------------------------------------------

    def _complete(self) -> str:
        """Parameters not given take their defaults; what these follow comes first."""
        symbols, defaults = self.program.symbols.parameters, self.equations.parameter_defaults
        index = {symbol: i for i, symbol in enumerate(symbols)}
        body, placed = list[str](), set[int]()

        def place(i: int) -> None:
            if i in placed:
                return
            placed.add(i)
            value = defaults[i]
            followed = sorted(index[s] for s in value.free_symbols) if value is not None else []
            for j in followed:
                place(j)
            body.extend(f"{symbols[j].name} = p[{j}]" for j in followed)
            told = "nan" if value is None else self.printer.real(value)
            body.append(f"if not given[{i}]: p[{i}] = {told}")

        for i in range(len(symbols)):
            place(i)
        return _definition("complete", ("given", "p"), body)

    def _hoist(self) -> str:
        lines = self._statements(self.program.hoisted)
        lines += [
            Line((f"k[{i}] = {symbol.name}",), uses=(symbol,))
            for i, symbol in enumerate(self.constants)
        ]
        loads = {s: f"p[{i}]" for i, s in enumerate(self.program.symbols.parameters)}
        return _function("hoist", ("p", "k"), lines, loads)

    def _configuration(self) -> str:
        targets = self.layout.configuration
        lines = self._statements(self.configuration)
        for name, target in targets.items():
            lines += self._assignments(self.outputs.get(name), target)
        lines += [
            Line((f"saved[{i}] = {symbol.name}",), uses=(symbol,))
            for i, symbol in enumerate(self.saved)
        ]
        arguments = (*STATE, "saved", *self._lengths(targets))
        return _function("configuration", arguments, lines, self._loads())

    def _motion(self) -> str:
        targets = self.layout.motion
        lines = self._statements(self.motion)
        for name, target in targets.items():
            lines += self._assignments(self.outputs.get(name), target)
        loads = self._loads() | {s: f"saved[{i}]" for i, s in enumerate(self.saved)}
        arguments = (*STATE, "saved", *self._lengths(targets))
        return _function("motion", arguments, lines, loads)

    def _output(self, number: int, output: Output) -> str:
        lines = self._statements(self._slice((output.name,))) + self._assignments(output, "out")
        return _function(f"output_{number}", (*SOLVED, "out"), lines, self._loads())

    # -- pieces ------------------------------------------------------------------------------

    def _used_by(self, names: Iterable[str]) -> set[Symbol]:
        outputs = [self.outputs[n] for n in names if n in self.outputs]
        return symbols_of(e for o in outputs for e in o.elements)

    def _slice(self, names: Iterable[str]) -> list[Statement]:
        return slice_statements(self.program.body, self._used_by(names))

    def _loads(self) -> dict[Symbol, str]:
        symbols = self.program.symbols
        arrays: list[tuple[str, Sequence[Symbol]]] = [
            ("q", symbols.q),
            ("u", symbols.u),
            ("p", symbols.parameters),
            ("k", self.constants),
            ("a", symbols.accelerations),
            ("l", symbols.multipliers),
        ]
        return {s: f"{array}[{i}]" for array, members in arrays for i, s in enumerate(members)}

    def _statements(self, statements: Iterable[Statement]) -> list[Line]:
        return [self._print(statement) for statement in statements]

    def _print(self, statement: Statement) -> Line:
        value = self.printer.real(statement.value)
        if isinstance(statement, SineCosine):
            sine, cosine = statement.sine.name, statement.cosine.name
            both = (f"{sine} = {value}", f"{cosine} = cos({sine})", f"{sine} = sin({sine})")
            return Line(both, statement.targets, statement.value.free_symbols)
        assert isinstance(statement, Assign)
        text = (f"{statement.target.name} = {value}",)
        return Line(text, statement.targets, statement.value.free_symbols)

    def _assignments(self, output: Output | None, target: str) -> list[Line]:
        """The lists hold zeros before."""
        if output is None:
            return []
        return [
            Line((f"{target}[{i}] = {self.printer.real(e)}",), uses=e.free_symbols)
            for i, e in enumerate(output.elements)
            if e != 0
        ]


def _function(
    name: str, arguments: Sequence[str], lines: Sequence[Line], loads: Mapping[Symbol, str]
) -> str:
    """One function, which hands on to others where it is long."""
    pieces = list(pieces_of(as_soon_as_possible(lines)))
    shared, texts = Shared(pieces), list[str]()
    if len(pieces) <= 1:
        return _definition(name, arguments, _body(lines, loads))
    for number, piece in enumerate(pieces):
        defined = {symbol for line in piece for symbol in line.defines}
        taken = {s: f"shared[{i}]" for s, i in shared.place.items() if s not in defined}
        body = _body(piece, {**loads, **taken})
        given = [s for s in shared.place if s in defined]
        body += [f"shared[{shared.place[symbol]}] = {symbol.name}" for symbol in given]
        texts.append(_definition(f"{name}_{number}", (*arguments, "shared"), body))
    calls = [f"{name}_{k}({', '.join((*arguments, 'shared'))})" for k in range(len(pieces))]
    texts.append(_definition(name, arguments, [f"shared = [None]*{shared.size}", *calls]))
    return "\n".join(texts)


def _body(lines: Sequence[Line], loads: Mapping[Symbol, str]) -> list[str]:
    used = {symbol for line in lines for symbol in line.uses}
    taken = [f"{symbol.name} = {place}" for symbol, place in loads.items() if symbol in used]
    return taken + [text for line in lines for text in line.text]


def _definition(name: str, arguments: Sequence[str], body: Sequence[str]) -> str:
    lines = "".join(f"    {line}\n" for line in body or ["pass"])
    return f"def {name}({', '.join(arguments)}):\n{lines}"
