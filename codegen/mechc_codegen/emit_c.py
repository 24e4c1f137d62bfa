"""Stage 5: Program -> C.

Input: an optimised program and its metadata.  Output: the text of the scene's files.  Invariant:
C identifiers are made here; what a user named appears only inside escaped string literals and as
plain words in comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from textwrap import wrap

from sympy import Symbol

from mechc_codegen.equations import Equations, Output
from mechc_codegen.printer import RealPrinter
from mechc_codegen.program import (
    Assign,
    Program,
    SineCosine,
    Statement,
    slice_statements,
    symbols_of,
    targets_of,
)
from mechc_codegen.wishes import EVERYTHING, Wishes

CONFIGURATION = ("constraints", "constraint_jacobian", "velocity_bias", "mass_matrix")
MOTION = ("forcing", "gamma")
ARGUMENTS = ("gap", "jacobian", "bias", "mass")
INTERNAL = ("velocity_bias", "gamma", "augmented_mass_matrix", "augmented_forcing")


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
        self.outputs = {o.name: o for o in program.outputs}
        self.of_configuration = tuple(map(self._solved_with, CONFIGURATION))
        self.of_motion = tuple(map(self._solved_with, MOTION))
        configuration = self._slice(self.of_configuration)
        motion = self._slice(self.of_motion)
        computed = set(targets_of(configuration))
        self.motion_statements = [s for s in motion if s not in configuration]
        used = symbols_of(s.value for s in self.motion_statements) | self._used_by(self.of_motion)
        self.saved = [symbol for symbol in targets_of(configuration) if symbol in used & computed]
        self.configuration_statements = configuration
        hoisted = set(targets_of(program.hoisted))
        running = symbols_of(s.value for s in program.body)
        running |= symbols_of(e for o in program.outputs for e in o.elements)
        self.constants = [symbol for symbol in targets_of(program.hoisted) if symbol in running]
        self.hoisted = hoisted

    # -- sizes ------------------------------------------------------------------------------

    def sizes(self) -> str:
        equations, symbols = self.equations, self.program.symbols
        rows = equations.holonomic + equations.nonholonomic
        widths = [len(o.elements) for o in self._asked()]
        values = {
            "nq": len(symbols.q),
            "nu": len(symbols.u),
            "nh": equations.holonomic,
            "nc": rows,
            "np": len(symbols.parameters),
            "nk": len(self.constants),
            "saved": len(self.saved),
            "turns": sum(isinstance(s, SineCosine) for s in self.configuration_statements),
            "identity": int(equations.identity_kinematics),
            "widest": max([*widths, len(symbols.q) + len(symbols.u), rows]),
            "outputs": self._output_list(rows),
        }
        return _template("scene_sizes.h.in").substitute(values)

    def _output_list(self, rows: int) -> str:
        size = len(self.program.symbols.q) + len(self.program.symbols.u)
        entries = [(o.name, len(o.elements)) for o in self._asked()] + [("rates", size)]
        if rows and self.wishes.wants("multipliers"):
            entries.append(("multipliers", rows))
        return " \\\n".join(f"    X({name}, {width})" for name, width in entries)

    def _asked(self) -> list[Output]:
        """Outputs that are a function of their own."""
        return [o for o in self.program.outputs if o.name not in INTERNAL]

    # -- the program ------------------------------------------------------------------------

    def program_text(self) -> str:
        functions = [self._hoist(), self._configuration(), self._motion()]
        functions += [self._output(output) for output in self._asked()]
        values = {"functions": "\n".join(functions)}
        return _template("scene_program.h.in").substitute(values)

    def _hoist(self) -> str:
        lines = self._statements(self.program.hoisted)
        lines += [f"k[{i}] = {symbol.name};" for i, symbol in enumerate(self.constants)]
        loaded = self._loads(symbols_of(s.value for s in self.program.hoisted))
        comment = "Constants: everything that depends on parameters alone."
        signature = "const real *p, real *k"
        return _function(comment, "hoist", signature, [*loaded, *lines], "p k", "MECHC_ONCE")

    def _configuration(self) -> str:
        outputs = [(self._get(n), a) for n, a in zip(self.of_configuration, ARGUMENTS, strict=True)]
        statements = self.configuration_statements
        body = self._loads(self._reads(statements, self.of_configuration))
        body += self._turning(statements)
        for output, target in outputs:
            body += self._assignments(output, target)
        body += [f"saved[{i}] = {symbol.name};" for i, symbol in enumerate(self.saved)]
        body += self._zero_bias()
        signature = (
            "real t, const real *q, const real *p, const real *k, real *gap, real *jacobian,"
            " real *bias, real *mass, real *saved, real *turns, int near"
        )
        comment = "What depends on the configuration: constraints, their Jacobian, mass matrix."
        return _function(comment, "configuration", signature, body, _used_names(signature))

    def _turning(self, statements: Iterable[Statement]) -> list[str]:
        """Statements whose sines and cosines are kept in `turns`, or taken from there."""
        lines, turns = list[str](), 0
        for statement in statements:
            if isinstance(statement, SineCosine):
                memory, turns = f"turns ? turns + {3 * turns} : 0, near", turns + 1
                lines += self._sine_cosine(statement, "turn", f", {memory}")
            else:
                lines += self._statement(statement)
        return lines

    def _zero_bias(self) -> list[str]:
        rows = self.equations.holonomic + self.equations.nonholonomic
        if "velocity_bias" in self.outputs:
            return []
        return [f"bias[{i}] = R(0.0);" for i in range(rows)]

    def _motion(self) -> str:
        statements = self.motion_statements
        reads = self._reads(statements, self.of_motion)
        body = self._loads(reads)
        body += [f"const real {s.name} = saved[{i}];" for i, s in enumerate(self.saved)]
        body += self._statements(statements)
        for name, target in zip(self.of_motion, MOTION, strict=True):
            body += self._assignments(self._get(name), target)
        signature = (
            "real t, const real *q, const real *u, const real *p, const real *k,"
            " const real *saved, real *forcing, real *gamma"
        )
        comment = "What depends on the speeds too: right-hand sides of the equations of motion."
        return _function(comment, "motion", signature, body, _used_names(signature))

    def _output(self, output: Output) -> str:
        statements = self._slice((output.name,))
        body = [
            *self._loads(self._reads(statements, (output.name,))),
            *self._statements(statements),
        ]
        body += self._assignments(output, "out")
        signature = "real t, const real *q, const real *u, const real *p, const real *k, real *out"
        name = f"output_{output.name}"
        return _function(output.equation, name, signature, body, _used_names(signature))

    # -- pieces -----------------------------------------------------------------------------

    def _solved_with(self, name: str) -> str:
        """The form of M or F that the motion is solved with."""
        augmented = f"augmented_{name}"
        return augmented if augmented in self.outputs else name

    def _get(self, name: str) -> Output | None:
        return self.outputs.get(name)

    def _used_by(self, names: Iterable[str]) -> set[Symbol]:
        outputs = [self.outputs[n] for n in names if n in self.outputs]
        return symbols_of(e for o in outputs for e in o.elements)

    def _slice(self, names: Iterable[str]) -> list[Statement]:
        return slice_statements(self.program.body, self._used_by(names))

    def _reads(self, statements: Iterable[Statement], names: Iterable[str]) -> set[Symbol]:
        return symbols_of(s.value for s in statements) | self._used_by(names)

    def _loads(self, used: set[Symbol]) -> list[str]:
        symbols = self.program.symbols
        arrays: list[tuple[str, Sequence[Symbol]]] = [
            ("q", symbols.q),
            ("u", symbols.u),
            ("p", symbols.parameters),
            ("k", self.constants),
        ]
        return [
            f"const real {symbol.name} = {array}[{i}];"
            for array, members in arrays
            for i, symbol in enumerate(members)
            if symbol in used
        ]

    def _statements(self, statements: Iterable[Statement]) -> list[str]:
        return [line for s in statements for line in self._statement(s)]

    def _statement(self, statement: Statement) -> list[str]:
        if isinstance(statement, SineCosine):
            return self._sine_cosine(statement, "sincos", "")
        assert isinstance(statement, Assign)
        return [f"const real {statement.target.name} = {self.printer.real(statement.value)};"]

    def _sine_cosine(self, statement: SineCosine, function: str, more: str) -> list[str]:
        sine, cosine = statement.sine.name, statement.cosine.name
        value = self.printer.real(statement.value)
        call = f"FN({function})({value}{more}, &{sine}, &{cosine});"
        return [f"real {sine}, {cosine};", call]

    def _assignments(self, output: Output | None, target: str) -> list[str]:
        if output is None:
            return []
        lines = [f"/* {_comment(output.equation)} */"]
        for i, (element, label) in enumerate(zip(output.elements, output.labels, strict=True)):
            lines.append(f"{target}[{i}] = {self.printer.real(element)}; /* {_comment(label)} */")
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


def _function(
    comment: str,
    name: str,
    signature: str,
    body: Sequence[str],
    arguments: str,
    storage: str = "MECHC_INLINE",
) -> str:
    unused = ", ".join(f"(void){argument}" for argument in arguments.split())
    lines = "\n".join(f"    {line}" for line in [f"{unused};", *body])
    head = f"{storage} void FN({name})({signature})"
    return f"/* {_comment(comment)} */\n{_wrapped(head)}\n{{\n{lines}\n}}\n"


def _used_names(signature: str) -> str:
    return " ".join(re.findall(r"(\w+)(?:,|$)", signature))


def _wrapped(head: str) -> str:
    return "\n".join(wrap(head, 98, subsequent_indent="    ", break_long_words=False))


def _comment(text: str) -> str:
    """Plain words for a comment: whatever could end it or start a line is replaced."""
    return re.sub(r"[^A-Za-z0-9_ .,:;()\[\]=+'^-]", "?", text).replace("* /", "")


def _string_literal(text: str) -> str:
    """A C string literal in lines of bounded length; anything but plain ASCII is escaped."""
    escaped = [
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    ]
    chunks = ["".join(escaped[i : i + 80]) for i in range(0, len(escaped), 80)] or [""]
    return "\n    ".join(f'"{chunk}"' for chunk in chunks)


def _template(name: str) -> Template:
    return Template(files("mechc_codegen").joinpath("templates", name).read_text("utf-8"))
