"""Stage 5: Program -> C.

Input: an optimised program and its metadata.  Output: the text of the scene's files.  Invariant:
C identifiers are made here; names of users appear only inside escaped string literals and, as
letters, digits and a few signs, in comments.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sympy import Symbol

from mechc_codegen.derive.equations import Output
from mechc_codegen.emit.definition import argument_names, definition, plain_words
from mechc_codegen.emit.expressions import Line, Value, let, loop, named, put, real, sine_cosine
from mechc_codegen.emit.functions import SceneFunction, SceneFunctions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups, table_text
from mechc_codegen.emit.taylor.series import series_text
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.emit.units.instruction_sets import InstructionSet
from mechc_codegen.emit.units.scene_files import model_source, sizes_header, template
from mechc_codegen.emit.units.split_functions import cut
from mechc_codegen.ir.program import Assign, SineCosine, Statement

MOST_LINES = 600  # longer functions are cut
_SPARSE = 64  # elements
_OF_GAPS = ("hoist", "constraints")  # functions that the gaps of the loops are computed by
_STATE = "real t, const real *q, const real *u, const FN(given) *given"
_SOLVED = ", const real *a, const real *l"  # accelerations and multipliers


def emit(
    writer: CWriter, metadata: Mapping[str, Any], sets: Sequence[InstructionSet]
) -> dict[str, str]:
    """A dict from file names to texts of everything that is compiled for one scene."""
    functions = writer.functions
    texts = {
        **program_texts(writer, metadata),
        "scene_model.c": model_source(functions, metadata, sets),
        "scene_outputs_only.c": template("outputs_only.c.in").substitute(
            unit=sets[-1].name, lanes=sets[-1].lanes
        ),
    }
    for each in sets:
        values = {"lanes": each.lanes, "unit": each.name}
        texts[f"scene_{each.name}.c"] = template("unit.c.in").substitute(values)
    return texts


def program_texts(writer: CWriter, metadata: Mapping[str, Any]) -> dict[str, str]:
    """The headers of a scene: its sizes and its program."""
    functions = writer.functions
    gaps = [table_text(lookups(functions.program.values()))]
    others = list[str]()
    for function in functions:
        (gaps if function.name in _OF_GAPS else others).append(writer.text(function))
    if functions.blocks:
        others.append(BlockElimination(functions.blocks).text())
    return {
        "scene_sizes.h": sizes_header(functions, metadata),
        "scene_program.h": template("scene_program.h.in").substitute(
            gaps="\n".join(gaps), functions="\n".join(others)
        ),
        "scene_series.h": series_text(functions),
    }


class CWriter:
    """The functions of one scene in C over ``real``, which is a double or a vector of them."""

    def __init__(self, functions: SceneFunctions, metadata: Mapping[str, Any]) -> None:
        self.functions, self.layout = functions, functions.layout
        self.meanings = _meanings(functions, metadata)
        self.printer = RealPrinter(tables=True)
        self.inputs = [value.symbol.name for value in functions.program.input_values()]
        self._printed: dict[tuple[Symbol, ...], Line] = {}
        self._bodies: dict[str, list[Line]] = {}

    def text(self, function: SceneFunction) -> str:
        """The function's text, in pieces where it is long."""
        (name, signature), comment = self._head(function), function.comment
        lines = self._lines(function)
        loads = {symbol.name: place for symbol, place in function.loads.items()}
        if len(lines) <= MOST_LINES:
            storages = {"hoist": "MECHC_ONCE", "output": "MECHC_INLINE"}
            storage = storages.get(function.kind, self.functions.storage)
            return definition(comment, name, signature, self._body(lines, loads), storage)
        pieces, size = cut(lines)
        texts, body = list[str](), [Line((f"real shared[{max(size, 1)}];",))]
        arguments = ", ".join((*argument_names(signature), "shared"))
        for number, piece in enumerate(pieces):
            received = {own: named("shared")[i] for own, i in piece.received.items()}
            handed_on = [put(named("shared")[i], named(own)) for own, i in piece.handed_on.items()]
            own = self._body([*piece.lines, *handed_on], loads | received)
            texts.append(
                definition(
                    f"{comment} Piece {number}.", f"{name}_{number}", f"{signature}, real *shared",
                    own, "MECHC_ONCE",
                )
            )  # fmt: skip
            body.append(Line((f"FN({name}_{number})({arguments});",)))
        return "\n".join([*texts, definition(comment, name, signature, body, "MECHC_ONCE")])

    def lines(self, function: SceneFunction) -> list[Line]:
        """The whole body of the function."""
        loads = {symbol.name: place for symbol, place in function.loads.items()}
        return self._body(self._lines(function), loads)

    def _lines(self, function: SceneFunction) -> list[Line]:
        """Inputs, statements, stored outputs, values kept for later calls; printed once."""
        if function.name not in self._bodies:
            self._bodies[function.name] = self._printed_lines(function)
        return self._bodies[function.name]

    def _printed_lines(self, function: SceneFunction) -> list[Line]:
        lines = self._statements(function)
        for output, target in function.stores:
            lines += self._store(output, target)
        for i, symbol in enumerate(function.kept):
            lines.append(put(named(function.array)[i], named(symbol.name)))
        if function.kind == "configuration":
            return self._with_inputs([*lines, *self._zero_bias()], "0")
        return self._with_inputs(lines, "u")

    def _body(self, lines: Sequence[Line], loads: Mapping[str, Value]) -> list[Line]:
        used = {name for line in lines for name in line.uses}
        loaded = (self._load(name, place) for name, place in loads.items() if name in used)
        return [*loaded, *lines]

    def _zero_bias(self) -> list[Line]:
        functions = self.functions
        written = "velocity_bias" in functions.outputs
        if written or "velocity_bias" not in self.layout.configuration:
            return []
        return [put(named("bias")[i], real(0.0)) for i in range(functions.rows)]

    def _with_inputs(self, body: list[Line], speeds: str) -> list[Line]:
        """The lines, preceded by one that reads the inputs that they use."""
        used = {name for line in body for name in line.uses}
        places = [i for i, name in enumerate(self.inputs) if name in used]
        if not places:
            return body
        first, last = places[0], places[-1] + 1
        read = [f"real inputs[{last - first}];"]
        read.append(f"FN(read_inputs)(t, q, {speeds}, given, {first}, {last}, inputs);")
        names = [self.inputs[i] for i in places]
        for i, name in zip(places, names, strict=True):
            read += self._load(name, named("inputs")[i - first]).text
        return [Line(tuple(read), tuple(names)), *body]

    # -- statements -------------------------------------------------------------------------

    def _statements(self, function: SceneFunction) -> list[Line]:
        """Statements in C; in the configuration ``turns`` stores or supplies sines and cosines."""
        if function.kind != "configuration":
            return [self._once(statement) for statement in function.statements]
        lines, turns = list[Line](), 0
        for statement in function.statements:
            if isinstance(statement, SineCosine):
                saved = named("turns").choose(named("turns") + 3 * turns, 0)
                lines.append(self._sine_cosine(statement, saved, named("near"), by="turn"))
                turns += 1
            else:
                lines.append(self._once(statement))
        return lines

    def _once(self, statement: Statement) -> Line:
        """Print each statement only once, although several functions compute it."""
        if statement.targets not in self._printed:
            self._printed[statement.targets] = self._print(statement)
        return self._printed[statement.targets]

    def _print(self, statement: Statement) -> Line:
        if isinstance(statement, SineCosine):
            return self._sine_cosine(statement)
        assert isinstance(statement, Assign)
        return let(statement.target.name, self.printer.real(statement.value))

    def _sine_cosine(self, statement: SineCosine, *more: Value, by: str = "sincos") -> Line:
        targets = statement.sine.name, statement.cosine.name
        return sine_cosine(self.printer.real(statement.value), targets, *more, by=by)

    def _store(self, output: Output, target: str) -> list[Line]:
        """Assignments to an output array; a large array that is mostly zero is cleared first."""
        elements, comment = output.elements, f"/* {plain_words(output.equation)} */"
        cleared = len(elements) > _SPARSE and 2 * sum(e == 0 for e in elements) > len(elements)
        lines = [Line((comment,))]
        if cleared:
            lines.append(loop(len(elements), [put(named(target)[named("i")], real(0.0))]))
        for i, (element, label) in enumerate(zip(elements, output.labels, strict=True)):
            if not (cleared and element == 0):
                comment = f" /* {plain_words(label)} */"
                lines.append(put(named(target)[i], self.printer.real(element), comment=comment))
        return lines

    def _load(self, name: str, place: Value) -> Line:
        comment = f" /* {self.meanings[name]} */" if name in self.meanings else ""
        return let(name, place, comment=comment)

    def _head(self, function: SceneFunction) -> tuple[str, str]:
        """Name and parameters of a function."""
        if function.kind == "hoist":
            return function.name, "const real *p, real *k"
        if function.kind == "configuration":
            state = "real t, const real *q, const FN(given) *given"
            arrays = _pointers(self.layout.configuration)
            return function.name, f"{state},{arrays} real *saved, real *turns, int near"
        if function.kind == "motion":
            arrays = _pointers(self.layout.motion)
            return function.name, f"{_STATE}, const real *saved,{arrays}".rstrip(",")
        if function.of_motion:
            covector = ", const real *c" if function.of_covector else ""
            return f"solved_{function.name}", f"{_STATE}{_SOLVED}{covector}, real *out"
        return f"output_{function.name}", f"{_STATE}, real *out"


def _meanings(functions: SceneFunctions, metadata: Mapping[str, Any]) -> dict[str, str]:
    """Name and unit of each coordinate, speed and parameter, for comments."""
    symbols, names = functions.program.symbols, ("coordinates", "speeds", "parameters")
    quantities = [quantity for name in names for quantity in metadata[name]]
    described = [", ".join(filter(None, (q["name"], q["unit"]))) for q in quantities]
    state = (*symbols.q, *symbols.u, *symbols.parameters)
    return {s.name: plain_words(text) for s, text in zip(state, described, strict=True)}


def _pointers(targets: Mapping[str, str]) -> str:
    return "".join(f" real *{target}," for target in targets.values())
