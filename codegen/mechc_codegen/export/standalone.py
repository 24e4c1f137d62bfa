"""A scene as C99 that needs nothing but its compiler: header, source, example, CMake.

Input: an optimised program, its metadata.  Output: the texts of the files.  Invariant: of the names
that users give only identifiers become code, other text is in comments without signs that end them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import Any

from mechc_codegen.emit.c import CWriter, program_texts
from mechc_codegen.emit.definition import plain_words
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.units.scene_files import default_lines, listed_outputs
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.amalgamate import amalgamate
from mechc_codegen.export.single import LEAST, refuse_beyond, single
from mechc_codegen.export.single import headers as single_headers
from mechc_codegen.extension.flags import RUNTIME

# Not a header of C's library, the example's file, or a beginning of names that the file keeps.
_NAME = re.compile(
    r"(?!(?:assert|complex|ctype|errno|fenv|float|inttypes|iso646|limits|locale|main|math|setjmp|"
    r"signal|stdarg|stdbool|stddef|stdint|stdio|stdlib|string|tgmath|time|wchar|wctype)\Z|mechc)"
    r"[A-Za-z][A-Za-z0-9_]{0,50}",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Precision:
    """The conversion of C over doubles to C over another type.

    ``least``: the numbers below are none of it.
    """

    digits: int
    least: float
    text: Callable[[str], str]
    headers: Callable[[], Mapping[str, str]]
    check: Callable[[str], None]


PRECISIONS = {
    "double": Precision(17, 0.0, str, dict, lambda text: None),
    "float": Precision(9, LEAST, single, single_headers, refuse_beyond),
}


def standalone(
    functions: SceneFunctions,
    metadata: Mapping[str, Any],
    name: str,
    start: Sequence[float],
    values: Mapping[str, float],
    end: float,
    real: str = "double",
) -> dict[str, str]:
    """A dict from file names to texts.

    ``name`` is the prefix of all public names; the example starts at the state ``start`` with these
    values of parameters, and ends after ``end`` seconds.  ``real``: ``"double"`` or ``"float"``.

    Raises
    ------
    CodegenError
        If ``name`` is no identifier of C, or reserved, or ``real`` is another type.
    """
    checked_name(name)
    if real not in PRECISIONS:
        raise CodegenError(f"numbers are {' or '.join(PRECISIONS)}, not {plain_words(real)!r}")
    precision = PRECISIONS[real]
    generated = program_texts(CWriter(functions, metadata), metadata)
    parameters = [quantity["name"] for quantity in metadata["parameters"]]
    states = [q["name"] for kind in ("coordinates", "speeds") for q in metadata[kind]]
    common = {
        "name": name,
        "prefix": name.upper(),
        "guard": f"{name.upper()}_H",
        "title": plain_words(metadata["title"] or metadata["name"]),
    }
    symbols, inputs = functions.program.symbols, len(functions.program.input_values())
    q, u, p = (len(each) for each in (symbols.q, symbols.u, symbols.parameters))
    tables = {
        "coordinates": q,
        "speeds": u,
        "states": q + u,
        "parameters": p,
        "room": max(p, 1),
        "constants": len(functions.constants) + of_rows(),
        "inputs": inputs,
        "inputs_room": max(inputs, 1),
        "not_closed": code("MECHC_NOT_CLOSED"),
        "not_finite": code("MECHC_NOT_FINITE"),
        "state_table": _table([*metadata["coordinates"], *metadata["speeds"]], "y"),
        "parameter_table": _table(_parameters(functions, metadata), "p"),
        "input_table": _input_table(metadata),
        "outputs": "\n".join(_declarations(functions, metadata, name)),
    }

    def number(value: float) -> str:
        precision.check(repr(value))
        return precision.text(repr(value))

    defaults = "\n".join(default_lines(functions))
    precision.check(generated["scene_program.h"] + defaults)
    run = {
        "real": real,
        "digits": precision.digits,
        "zero": number(0.0),
        "step": number(0.001),
        "start": ", ".join(number(x if abs(x) >= precision.least else 0.0) for x in start),
        "end": number(float(end)),
        "columns": "".join(f",{csv_cell(state)}" for state in states),
        "values": "\n".join(
            f"    p[{parameters.index(p)}] = {number(float(value))}; /* {plain_words(p)} */"
            for p, value in values.items()
        ),
    }
    source = {
        "code": amalgamate("unit/standalone.h", {**generated, **precision.headers()}, RUNTIME),
        "defaults": defaults,
        "followers": "\n".join(f"    p[{i}] = NAN;" for i, _, held in functions.defaults() if held),
    }
    return {
        f"{name}.h": precision.text(fill_template("header.h.in", common, tables)),
        f"{name}.c": precision.text(fill_template("source.c.in", common, source)),
        "main.c": fill_template("main.c.in", common, run),
        "CMakeLists.txt": fill_template("CMakeLists.txt.in", common),
    }


def checked_name(name: str) -> str:
    """The name, if it is a valid prefix of functions and files; see :func:`standalone`."""
    if not _NAME.fullmatch(name):
        raise CodegenError(
            f"{plain_words(name)!r} cannot begin the names of C functions: give a name of at most "
            "51 letters, digits and _ that begins with a letter, not with mechc, and is no header "
            "of C's library"
        )
    return name


def csv_cell(name: str) -> str:
    """A name as a cell of a CSV file within a string of C: no second cell, and no formula."""
    text = plain_words(name)
    text = f"'{text}" if text.lstrip().startswith(("=", "+", "-")) else text
    return f'\\"{text}\\"' if "," in text else text


def fill_template(template: str, *values: Mapping[str, Any]) -> str:
    """The text of an export's template with these values."""
    text = files("mechc_codegen.export").joinpath("templates", template).read_text("utf-8")
    return Template(text).substitute({key: x for each in values for key, x in each.items()})


def code(name: str) -> str:
    """The value of an enumerator of the runtime's ``abi/codes.h``."""
    return _number(re.search(rf"{name} = (\d+)", _header("abi/codes.h")))


def of_rows() -> int:
    """How many constants the runtime makes of the rows, after those made of parameters."""
    sizes = _header("dynamics/sizes.h")
    return int(_number(re.search(r"MECHC_CONSTANTS \(MECHC_NK \+ (\d+)\)", sizes)))


def _header(name: str) -> str:
    return (RUNTIME / name).read_text("utf-8")


def _number(found: re.Match[str] | None) -> str:
    assert found is not None
    return found[1]


def _parameters(functions: SceneFunctions, metadata: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The parameters, each with those that it follows in its description."""
    listed = [dict(quantity) for quantity in metadata["parameters"]]
    for i, _, held in functions.defaults():
        followed = "follows " + ", ".join(listed[j]["name"] for j in held) if held else ""
        listed[i]["description"] = ", ".join(filter(None, (listed[i]["description"], followed)))
    return listed


def _table(quantities: Iterable[Mapping[str, Any]], array: str) -> str:
    lines = []
    for i, quantity in enumerate(quantities):
        parts = (quantity["name"], quantity["unit"], quantity["description"])
        lines.append(f" *   {array}[{i}] {plain_words(', '.join(filter(None, parts)))}")
    return "\n".join(lines or [" *   none"])


def _input_table(metadata: Mapping[str, Any]) -> str:
    """The places of inputs and of their rates."""
    names = [
        f"{each['name']}{', rate' * order}"
        for each in metadata.get("inputs", ())
        for order in each["orders"]
    ]
    if not names:
        return ""
    lines = [f" *   inputs[{i}] {plain_words(text)}" for i, text in enumerate(names)]
    head = " * Inputs, which keep their values during a step, or which `drive` gives:"
    return "\n".join([" *", head, *lines, ""])


def _declarations(
    functions: SceneFunctions, metadata: Mapping[str, Any], name: str
) -> Iterable[str]:
    arguments = f"const {name}_model *model, double t, const double *y, double *out"
    shapes, name_of = metadata["shapes"], functions.request.name_of
    for label, width in listed_outputs(functions):
        shape = shapes.get(name_of(label), [width])
        told = f"{plain_words(name_of(label))}, {' x '.join(map(str, shape)) or 'one number'}"
        yield f"/* {told} */\nvoid {name}_{label}({arguments});"
