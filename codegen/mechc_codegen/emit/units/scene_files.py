"""The files of a scene besides its program: sizes, and the model with its metadata.

Input: the scene's functions.  Output: the texts of ``scene_sizes.h`` and ``scene_model.c``.
Invariant: names of users are only in escaped string literals.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from string import Template
from typing import Any

from mechc_codegen.description.quantity import PURE
from mechc_codegen.emit.expressions import let, named, put, texts
from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.periodic import angles
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.emit.units.instruction_sets import InstructionSet
from mechc_codegen.ir.program import FEATURE, SWITCHING, Knots, SineCosine

VARIATIONAL = {
    "constraint_gradient": "MECHC_GRADIENT",
    "constraints_by_parameters": "MECHC_GAP_BY_PARAMETERS",
    "constraints_by_inputs": "MECHC_GAP_BY_INPUTS",
    "velocity_constraints_by_parameters": "MECHC_GAP_RATE_BY_PARAMETERS",
    "velocity_constraints_by_inputs": "MECHC_GAP_RATE_BY_INPUTS",
}


def sizes_header(functions: SceneFunctions, metadata: Mapping[str, Any]) -> str:
    """The sizes of the scene and the list of its outputs, for the preprocessor."""
    equations, layout, symbols = functions.equations, functions.layout, functions.program.symbols
    jacobians, solved = functions.jacobians(), label_widths(functions, of_motion=True)
    evaluated = [*label_widths(functions, of_motion=False), *functions.by_runtime()]
    widths = [len(o.elements) for o in functions.own_functions()]
    widths += [width for _, width in (*layout.solved, *jacobians)]
    values = {
        "nq": len(symbols.q),
        "nu": len(symbols.u),
        "nh": equations.holonomic,
        "nc": functions.rows,
        "np": len(symbols.parameters),
        "nk": len(functions.constants),
        "saved": layout.kept + len(functions.saved),
        "turns": sum(isinstance(s, SineCosine) for s in functions.configuration),
        "identity": int(equations.identity_kinematics),
        "lockstep": int(functions.fits_lanes),
        **layout.sizes,
        "tables": _sizes_of_few(functions) + _slides(functions, metadata) + _of_tree(layout.tables),
        "widest": max([*widths, len(symbols.q) + len(symbols.u), functions.rows]),
        "outputs": _entries(functions, evaluated),
        "solved": _entries(functions, solved),
        "state_jacobian": int("residual_by_state" in functions.outputs),
        "parameter_jacobian": int("residual_by_parameters" in functions.outputs),
        "input_jacobian": int("residual_by_inputs" in functions.outputs),
        "mass_matrix": int("mass_matrix" in dict(evaluated)),
        "own": functions.own_rows,
        # The motion itself is solved without them.
        "multipliers": int(
            functions.rows > 0
            and bool(jacobians or solved or functions.request.includes("multipliers"))
        ),
    }
    return template("scene_sizes.h.in").substitute(values)


def _sizes_of_few(functions: SceneFunctions) -> str:
    """Sizes that only a few scenes have."""
    states, values = functions.equations.states, len(functions.program.input_values())
    text = f"#define MECHC_STATES {states} /* of the coordinates */\n" if states else ""
    turned, alone = angles(functions)
    if turned:
        text += f"#define MECHC_ANGLES {_comma_list(turned)} /* in sines and cosines */\n"
    if alone:
        text += f"#define MECHC_PERIODIC {_comma_list(alone)} /* in these alone */\n"
    text += "#define MECHC_LONG 1 /* equations: called, not in line */\n" if functions.long else ""
    if SWITCHING in functions.outputs:
        count = len(functions.outputs[SWITCHING].elements)
        text += f"#define MECHC_SWITCHES {count} /* functions at whose zeros equations change */\n"
        labels = functions.outputs[SWITCHING].labels
        features = sum(label.startswith(FEATURE) for label in labels)
        text += f"#define MECHC_FEATURES {features} /* the last of them */\n" if features else ""
        text += _knots(functions.program.knots)
    if functions.program.series:
        text += "#define MECHC_TAYLOR_SERIES 1 /* the motion's recurrences */\n"
    if functions.blocks:
        text += f"#define MECHC_ROW_BLOCKS {len(functions.blocks.blocks)}\n"
        text += f"#define MECHC_BLOCKS_KEPT {BlockElimination(functions.blocks).kept}\n"
    if functions.request.includes("sensitivities"):  # macros for the variational equations
        present = [macro for name, macro in VARIATIONAL.items() if name in functions.outputs]
        text += "".join(f"#define {macro} 1\n" for macro in ("MECHC_VARIATIONAL", *present))
    text += f"#define MECHC_NI {values} /* values of inputs */\n" if values else ""
    return text + ("#define MECHC_ROWS_HOLD_INPUTS 1\n" if functions.rows_hold_inputs else "")


def _of_tree(tables: Mapping[str, Sequence[int]]) -> str:
    """Which link each link of a tree is on, where its columns are, and the like."""
    return "".join(
        f"static const short mechc_{name}[] __attribute__((unused)) = {{{_comma_list(values)}}};\n"
        for name, values in tables.items()
    )


def _knots(knots: Sequence[Knots]) -> str:
    """Knots of the arguments of tables: all values in a row, where each argument's begin."""
    if not knots:
        return ""
    begins = [sum(len(each.values) for each in knots[:n]) for n in range(len(knots) + 1)]
    values = ", ".join(repr(value) for each in knots for value in each.values)
    periods = ", ".join(repr(each.period or 0.0) for each in knots)
    return (
        f"#define MECHC_KNOTTED {len(knots)} /* before these: arguments of tables */\n"
        f"#define MECHC_KNOTS {values}\n#define MECHC_KNOTS_BEGIN {_comma_list(begins)}\n"
        f"#define MECHC_KNOTS_PERIOD {periods}\n"
    )


def _slides(functions: SceneFunctions, metadata: Mapping[str, Any]) -> str:
    """Flags of the state's components that are measured in units of length."""
    states = len(metadata["coordinates"]) - functions.equations.states
    rows = (*metadata["coordinates"], *metadata["speeds"])
    slides = [
        int(row["kind"] not in PURE and not states <= i < len(metadata["coordinates"]))
        for i, row in enumerate(rows)
    ]
    return f"#define MECHC_SLIDES {_comma_list(slides)}\n" if any(slides) else ""


def _comma_list(indices: Sequence[int]) -> str:
    return ", ".join(map(str, indices))


def listed_outputs(functions: SceneFunctions) -> list[tuple[str, int]]:
    """Label and width of every output."""
    explicit, solved = (label_widths(functions, of_motion=which) for which in (False, True))
    return [*explicit, *functions.by_runtime(), *solved]


def label_widths(functions: SceneFunctions, *, of_motion: bool) -> list[tuple[str, int]]:
    """Outputs that contain accelerations or multipliers, or the others."""
    listed = [o for o in functions.listed_outputs() if functions.needs_motion(o) == of_motion]
    return [(o.name, len(o.elements)) for o in listed]


def _entries(functions: SceneFunctions, outputs: Iterable[tuple[str, int]]) -> str:
    """Label, the user's name, width."""
    name_of = functions.request.name_of
    in_lines = ((label, _string_literal(name_of(label)), width) for label, width in outputs)
    whole = ((label, name.replace("\n    ", " "), width) for label, name, width in in_lines)
    return " \\\n".join(f"    X({label}, {name}, {width})" for label, name, width in whole)


def model_source(
    functions: SceneFunctions, metadata: Mapping[str, Any], sets: Sequence[InstructionSet]
) -> str:
    """The model: its data, and the choice among its instruction sets."""
    values = {
        "metadata": _string_literal(json.dumps(metadata, sort_keys=True)),
        "externs": "\n".join(f"extern const mechc_unit mechc_unit_{s.name};" for s in sets),
        "units": "\n".join(_choice(s) for s in reversed(sets)),
        "defaults": "\n".join(default_lines(functions)),
    }
    return template("scene_model.c.in").substitute(values)


def default_lines(functions: SceneFunctions) -> Iterable[str]:
    """Statements that give each parameter its default, unless ``given[i]``."""
    symbols, printer = functions.program.symbols.parameters, RealPrinter()
    for i, value, held in functions.defaults():
        if value is None:
            yield f"    if (!given[{i}]) p[{i}] = NAN;"
            continue
        loads = [let(symbols[j].name, named("p")[j], "const double") for j in held]
        lines = texts([*loads, put(named("p")[i], printer.real(value))])
        yield f"    if (!given[{i}]) {{ {' '.join(lines)} }}"


def _choice(each: InstructionSet) -> str:
    features = [f[2:] for f in each.flags if f.startswith("-m") and "=" not in f]
    asked = [f'wanted(instruction_set, "{each.name}")']
    asked += [f'mechc_processor_has("{feature}")' for feature in features]
    return f"    {' '.join(f'if ({test})' for test in asked)} return &mechc_unit_{each.name};"


def texts_source(first: str, texts: str) -> str:
    """The source of a first unit with the texts that later units are compiled from."""
    return template("first_unit.c.in").substitute(first=first, texts=_string_literal(texts))


def _string_literal(text: str) -> str:
    """A C string literal in lines of bounded length; anything but plain ASCII is escaped."""
    escaped = [
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode("utf-8", "surrogatepass")
    ]
    chunks = ["".join(escaped[i : i + 80]) for i in range(0, len(escaped), 80)] or [""]
    return "\n    ".join(f'"{chunk}"' for chunk in chunks)


def template(name: str) -> Template:
    return Template(files("mechc_codegen.emit").joinpath("templates", name).read_text("utf-8"))
