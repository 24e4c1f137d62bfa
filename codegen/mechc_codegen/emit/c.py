"""Stage 5: Program -> C.

Input: an optimised program and its metadata.  Output: the text of the scene's files.  Invariant:
C identifiers are made here; what a user named appears only inside escaped string literals and as
plain words in comments.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template

from sympy import Symbol

from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.description.request import EVERYTHING, Wishes
from mechc_codegen.emit.layout import (
    INTERNAL,
    JACOBIANS,
    OWN,
    RESIDUALS,
    TREE,
    TREE_MOTION,
    UNLISTED,
    layout,
)
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.split_functions import Function, Line, plain_words
from mechc_codegen.ir.program import (
    Assign,
    Program,
    SineCosine,
    Statement,
    slice_statements,
    symbols_of,
    targets_of,
)

_SPARSE = 64  # elements
_SOLVED = ", const real *a, const real *l"  # accelerations and multipliers


@dataclass(frozen=True)
class InstructionSet:
    """A compilation of the scene: its lanes and the compiler flags that allow them."""

    name: str
    lanes: int
    flags: tuple[str, ...]


BASELINE = InstructionSet("baseline", 2, ())
WIDER = (
    InstructionSet("avx2", 4, ("-mavx2", "-mfma")),
    InstructionSet(
        "avx512",
        8,
        ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mavx2", "-mfma", "-mprefer-vector-width=512"),
    ),
)


def emit(
    program: Program,
    equations: Equations,
    metadata: str,
    sets: Sequence[InstructionSet],
    wishes: Wishes = EVERYTHING,
) -> dict[str, str]:
    """File name -> text of everything that is compiled for one scene."""
    emitter = _Emitter(program, equations, wishes)
    texts = {
        "scene_sizes.h": emitter.sizes(),
        "scene_program.h": emitter.program_text(),
        "scene_model.c": emitter.model(metadata, sets),
    }
    texts["scene_first.c"] = _template("first.c.in").substitute(unit=sets[-1].name)
    for each in sets:
        values = {"lanes": each.lanes, "unit": each.name}
        texts[f"scene_{each.name}.c"] = _template("unit.c.in").substitute(values)
    return texts


class _Emitter:
    """The texts of one program."""

    def __init__(self, program: Program, equations: Equations, wishes: Wishes) -> None:
        self.program, self.equations, self.wishes = program, equations, wishes
        self.printer = RealPrinter()
        self.printed: dict[tuple[Symbol, ...], Line] = {}
        self.outputs = {o.name: o for o in program.outputs}
        self.layout = layout(equations, self.outputs)
        self.of_configuration = tuple(self.layout.configuration)
        self.of_motion = tuple(self.layout.motion)
        configuration = self._slice(self.of_configuration)
        motion = self._slice(self.of_motion)
        computed = set(targets_of(configuration))
        self.motion_statements = [s for s in motion if computed.isdisjoint(s.targets)]
        used = symbols_of(s.value for s in self.motion_statements) | self._used_by(self.of_motion)
        self.saved = [symbol for symbol in targets_of(configuration) if symbol in used & computed]
        self.configuration_statements = configuration
        hoisted = set(targets_of(program.hoisted))
        running = symbols_of(s.value for s in program.body)
        running |= symbols_of(e for o in program.outputs for e in o.elements)
        self.constants = [symbol for symbol in targets_of(program.hoisted) if symbol in running]
        self.hoisted = hoisted
        self.loads = self._array_places()
        self.inputs = [value.symbol for value in program.input_values()]

    # -- sizes ------------------------------------------------------------------------------

    def sizes(self) -> str:
        equations, symbols = self.equations, self.program.symbols
        rows = equations.holonomic + equations.nonholonomic
        widths = [len(o.elements) for o in self._asked()]
        widths += [width for _, width in self.layout.solved]
        jacobians = self._jacobians(len(symbols.q) + len(symbols.u))
        widths += [width for _, width in jacobians]
        values = {
            "nq": len(symbols.q),
            "nu": len(symbols.u),
            "nh": equations.holonomic,
            "nc": rows,
            "np": len(symbols.parameters),
            "nk": len(self.constants),
            "saved": self.layout.kept + len(self.saved),
            "turns": sum(isinstance(s, SineCosine) for s in self.configuration_statements),
            "identity": int(equations.identity_kinematics),
            **self.layout.sizes,
            "tables": self._extents() + self.layout.tables,
            "widest": max([*widths, len(symbols.q) + len(symbols.u), rows]),
            "outputs": self._output_list(rows),
            "solved": self._solved_list(),
            "state_jacobian": int("residual_by_state" in self.outputs),
            "parameter_jacobian": int("residual_by_parameters" in self.outputs),
            "input_jacobian": int("residual_by_inputs" in self.outputs),
            "own": len(self.wishes.expressions),
            "multipliers": int(rows > 0 and self._uses_multipliers(bool(jacobians))),
        }
        return _template("scene_sizes.h.in").substitute(values)

    def _extents(self) -> str:
        """Sizes of what few scenes have."""
        states, values = self.equations.states, len(self.inputs)
        text = f"#define MECHC_STATES {states} /* of the coordinates */\n" if states else ""
        return text + (f"#define MECHC_NI {values} /* values of inputs */\n" if values else "")

    def _uses_multipliers(self, jacobians: bool) -> bool:
        """Whether any output is made of them; the motion itself is solved without."""
        solved = any(self._needs_motion(o) for o in self._listed())
        return jacobians or solved or self.wishes.wants("multipliers")

    def _output_list(self, rows: int) -> str:
        size = len(self.program.symbols.q) + len(self.program.symbols.u)
        explicit = [o for o in self._listed() if not self._needs_motion(o)]
        entries = [(o.name, len(o.elements)) for o in explicit] + [("rates", size)]
        entries += self.layout.solved
        if rows and self.wishes.wants("multipliers"):
            entries.append(("multipliers", rows))
        entries += self._jacobians(size)
        return self._entries(entries)

    def _jacobians(self, size: int) -> list[tuple[str, int]]:
        found, own = list[tuple[str, int]](), len(self.wishes.expressions)
        columns = (size, len(self.program.symbols.parameters), len(self.inputs))
        for (name, (residual, *_)), width in zip(JACOBIANS.items(), columns, strict=True):
            if residual in self.outputs:
                found.append((name, size * width))
                found += [(f"own_{name}", own * width)] if own else []
        return found

    def _solved_list(self) -> str:
        """Outputs that hold accelerations or multipliers."""
        solved = [o for o in self._listed() if self._needs_motion(o)]
        return self._entries((o.name, len(o.elements)) for o in solved)

    def _entries(self, outputs: Iterable[tuple[str, int]]) -> str:
        """Label, what the user calls it, width."""
        return " \\\n".join(
            f"    X({label}, {_in_one_line(self.wishes.name_of(label))}, {width})"
            for label, width in outputs
        )

    def _needs_motion(self, output: Output) -> bool:
        """Whether it holds accelerations or multipliers, itself or by statements."""
        if output.name in (*RESIDUALS, *OWN):
            return True
        statements = self._slice((output.name,))
        used = self._used_by((output.name,)) | symbols_of(s.value for s in statements)
        return not used.isdisjoint(self.program.symbols.motion)

    def _listed(self) -> list[Output]:
        return [o for o in self._asked() if o.name not in UNLISTED]

    def _asked(self) -> list[Output]:
        """Outputs that are a function of their own."""
        return [o for o in self.program.outputs if o.name not in (*INTERNAL, *TREE, *TREE_MOTION)]

    # -- the program ------------------------------------------------------------------------

    def program_text(self) -> str:
        functions = [self._hoist(), self._configuration(), self._motion()]
        functions += [self._output(output) for output in self._asked()]
        values = {"functions": "\n".join(functions)}
        return _template("scene_program.h.in").substitute(values)

    def _hoist(self) -> str:
        lines = self._statements(self.program.hoisted)
        lines += [
            Line((f"k[{i}] = {symbol.name};",), uses=(symbol,))
            for i, symbol in enumerate(self.constants)
        ]
        comment = "Constants: everything that depends on parameters alone."
        loads = {s: f"p[{i}]" for i, s in enumerate(self.program.symbols.parameters)}
        signature = "const real *p, real *k"
        return Function(comment, "hoist", signature, lines, loads, "MECHC_ONCE").text()

    def _configuration(self) -> str:
        targets = self.layout.configuration
        body = self._turning(self.configuration_statements)
        for name, target in targets.items():
            body += self._assignments(self._get(name), target)
        body += [
            Line((f"saved[{i}] = {symbol.name};",), uses=(symbol,))
            for i, symbol in enumerate(self.saved)
        ]
        body += self._zero_bias()
        signature = (
            "real t, const real *q, const real *p, const real *k,"
            f"{_pointers(targets)} real *saved, real *turns, int near"
        )
        comment = "What depends on the configuration: constraints, their Jacobian, mass matrix."
        return self._stage(comment, "configuration", signature, body, self.loads)

    def _turning(self, statements: Iterable[Statement]) -> list[Line]:
        """Statements whose sines and cosines are kept in `turns`, or taken from there."""
        lines, turns = list[Line](), 0
        for statement in statements:
            if isinstance(statement, SineCosine):
                memory, turns = f"turns ? turns + {3 * turns} : 0, near", turns + 1
                lines.append(self._sine_cosine(statement, "turn", f", {memory}"))
            else:
                lines += self._statements([statement])
        return lines

    def _zero_bias(self) -> list[Line]:
        rows = self.equations.holonomic + self.equations.nonholonomic
        if "velocity_bias" in self.outputs or "velocity_bias" not in self.layout.configuration:
            return []
        return [Line((f"bias[{i}] = R(0.0);",)) for i in range(rows)]

    def _motion(self) -> str:
        body = self._statements(self.motion_statements)
        for name, target in self.layout.motion.items():
            body += self._assignments(self._get(name), target)
        signature = (
            "real t, const real *q, const real *u, const real *p, const real *k,"
            f" const real *saved,{_pointers(self.layout.motion)}"
        ).rstrip(",")
        comment = "What depends on the speeds too: right-hand sides of the equations of motion."
        loads = self.loads | {s: f"saved[{i}]" for i, s in enumerate(self.saved)}
        return self._stage(comment, "motion", signature, body, loads)

    def _stage(
        self,
        comment: str,
        name: str,
        signature: str,
        body: Sequence[Line],
        loads: Mapping[Symbol, str],
    ) -> str:
        """A function that the runtime calls at every stage of a step."""
        own, storage = self.layout.prefix + name, self.layout.storage
        body = self._with_inputs(body, "u" if name == "motion" else "0")
        return Function(comment, own, signature, body, loads, storage).text()

    def _output(self, output: Output) -> str:
        body = self._statements(self._slice((output.name,)))
        body += self._assignments(output, "out")
        body = self._with_inputs(body, "u")
        state = "real t, const real *q, const real *u, const real *p, const real *k"
        signature, name = f"{state}, real *out", f"output_{output.name}"
        if self._needs_motion(output):
            signature, name = f"{state}{_SOLVED}, real *out", f"solved_{output.name}"
        return Function(output.equation, name, signature, body, self.loads).text()

    def _with_inputs(self, body: Sequence[Line], speeds: str) -> list[Line]:
        """The lines, and before them one that reads the inputs they use."""
        used = {symbol for line in body for symbol in line.uses}
        places = [i for i, symbol in enumerate(self.inputs) if symbol in used]
        if not places:
            return list(body)
        first, last = places[0], places[-1] + 1
        read = [f"real inputs[{last - first}];"]
        read.append(f"FN(read_inputs)(t, q, {speeds}, p, {first}, {last}, inputs);")
        taken = [self.inputs[i] for i in places]
        for i, symbol in zip(places, taken, strict=True):
            read.append(f"const real {symbol.name} = inputs[{i - first}];")
        return [Line(tuple(read), tuple(taken)), *body]

    # -- pieces -----------------------------------------------------------------------------

    def _get(self, name: str) -> Output | None:
        return self.outputs.get(name)

    def _used_by(self, names: Iterable[str]) -> set[Symbol]:
        outputs = [self.outputs[n] for n in names if n in self.outputs]
        return symbols_of(e for o in outputs for e in o.elements)

    def _slice(self, names: Iterable[str]) -> list[Statement]:
        return slice_statements(self.program.body, self._used_by(names))

    def _array_places(self) -> dict[Symbol, str]:
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
        """Each printed once, though several functions compute it."""
        lines = []
        for statement in statements:
            if statement.targets not in self.printed:
                self.printed[statement.targets] = self._print(statement)
            lines.append(self.printed[statement.targets])
        return lines

    def _print(self, statement: Statement) -> Line:
        if isinstance(statement, SineCosine):
            return self._sine_cosine(statement, "sincos", "")
        assert isinstance(statement, Assign)
        text = f"const real {statement.target.name} = {self.printer.real(statement.value)};"
        return Line((text,), statement.targets, statement.value.free_symbols)

    def _sine_cosine(self, statement: SineCosine, function: str, more: str) -> Line:
        sine, cosine = statement.sine.name, statement.cosine.name
        value = self.printer.real(statement.value)
        call = f"FN({function})({value}{more}, &{sine}, &{cosine});"
        text = (f"real {sine}, {cosine};", call)
        return Line(text, statement.targets, statement.value.free_symbols)

    def _assignments(self, output: Output | None, target: str) -> list[Line]:
        """Large arrays that are mostly zero are cleared first."""
        if output is None:
            return []
        elements, told = output.elements, f"/* {plain_words(output.equation)} */"
        cleared = len(elements) > _SPARSE and 2 * sum(e == 0 for e in elements) > len(elements)
        lines = [Line((told,))]
        if cleared:
            loop = f"for (int i = 0; i < {len(elements)}; i++) {target}[i] = R(0.0);"
            lines = [Line((told, loop))]
        for i, (element, label) in enumerate(zip(elements, output.labels, strict=True)):
            if not (cleared and element == 0):
                text = f"{target}[{i}] = {self.printer.real(element)}; /* {plain_words(label)} */"
                lines.append(Line((text,), uses=element.free_symbols))
        return lines

    # -- the model --------------------------------------------------------------------------

    def model(self, metadata: str, sets: Sequence[InstructionSet]) -> str:
        values = {
            "metadata": _string_literal(metadata),
            "externs": "\n".join(f"extern const mechc_unit mechc_unit_{s.name};" for s in sets),
            "units": "\n".join(_choice(s) for s in reversed(sets)),
            "defaults": "\n".join(self._default_lines()),
        }
        return _template("scene_model.c.in").substitute(values)

    def _default_lines(self) -> list[str]:
        """Defaults in an order in which what they follow comes first."""
        symbols = self.program.symbols.parameters
        index = {symbol: i for i, symbol in enumerate(symbols)}
        lines, placed = [], set()

        def place(i: int) -> None:
            if i in placed:
                return
            placed.add(i)
            value = self.equations.parameter_defaults[i]
            if value is None:
                lines.append(f"    if (!given[{i}]) p[{i}] = NAN;")
                return
            followed = sorted(index[s] for s in value.free_symbols)
            for j in followed:
                place(j)
            loads = " ".join(f"const double {symbols[j].name} = p[{j}];" for j in followed)
            text = self.printer.real(value)
            lines.append(
                f"    if (!given[{i}]) {{ {loads} p[{i}] = {text}; }}".replace("{  ", "{ ")
            )

        for i in range(len(symbols)):
            place(i)
        return lines


def _choice(each: InstructionSet) -> str:
    wanted = f'!strcmp(instruction_set, "{each.name}")'
    features = [f[2:] for f in each.flags if f.startswith("-m") and "=" not in f]
    supported = " && ".join(f'__builtin_cpu_supports("{f}")' for f in features) or "1"
    return (
        f"    if ((!instruction_set || {wanted})\n        && {supported})\n"
        f"        return &mechc_unit_{each.name};"
    )


def _pointers(targets: Mapping[str, str]) -> str:
    return "".join(f" real *{target}," for target in targets.values())


def _in_one_line(name: str) -> str:
    return _string_literal(name).replace("\n    ", " ")


def _string_literal(text: str) -> str:
    """A C string literal in lines of bounded length; anything but plain ASCII is escaped."""
    escaped = [
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode("utf-8", "surrogatepass")
    ]
    chunks = ["".join(escaped[i : i + 80]) for i in range(0, len(escaped), 80)] or [""]
    return "\n    ".join(f'"{chunk}"' for chunk in chunks)


def _template(name: str) -> Template:
    return Template(files("mechc_codegen.emit").joinpath("templates", name).read_text("utf-8"))
