"""A whole scene as data for the unit that runs tapes, ``runtime/tape/``.

Input: the scene's functions, and the texts that are compiled for it.  Output: bytes.  Invariant:
what they hold is checked where they are read, so that no bytes lead beyond an array.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable, Mapping
from importlib.resources import files
from itertools import chain
from typing import Any

from mechc_codegen.emit.c import CWriter
from mechc_codegen.emit.expressions import Line, let, named, put
from mechc_codegen.emit.layout import ADJOINT, JACOBIANS
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.tables import lookups
from mechc_codegen.emit.tape.assembler import FUNCTIONS, MOST_OUTPUTS, NAMED, WIDEST, NoTapeError
from mechc_codegen.emit.tape.code import Code, doubles, integers
from mechc_codegen.emit.taylor.series import SeriesWriter
from mechc_codegen.emit.taylor.sums import are_few, arrange
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.emit.units.scene_files import label_widths

MAGIC = b"mechc tape 6\0\0\0\0"
COUNTS = (
    *("NQ", "NU", "NH", "NC", "NP", "NK", "SAVED", "TURNS", "NI", "STATES", "SWITCHES"),
    *("FEATURES", "KNOTTED", "MULTIPLIERS", "LOCKSTEP", "BLOCKS_KEPT"),
    *("ROW_BLOCKS", "IDENTITY_KINEMATICS", "OWN"),
    *("LINKS", "PLANAR", "COLUMNS", "SPEEDS_SHARED", "CARRIED", "FACTORS", "MOVING_CUTS"),
    *("PAIRS", "MOMENTS", "SEVERAL_LOOPS"),
)
OUTPUT, DEFAULT, COVECTOR = "solved", "default", "adjoint"
_OF_STATES = ("plain", OUTPUT, DEFAULT, COVECTOR)
PLAIN, SOLVED, RATES, MULTIPLIERS, JACOBIAN, OWN_JACOBIAN, OF_TREE = range(
    7
)  # how outputs are evaluated
_BY_RUNTIME = {"rates": RATES, "multipliers": MULTIPLIERS}
_BY_RUNTIME |= dict.fromkeys(JACOBIANS, JACOBIAN)
_BY_RUNTIME |= {f"own_{name}": OWN_JACOBIAN for name in JACOBIANS}
_OF_TREE = {"mass_matrix": 0, "forcing": 1, "constraint_jacobian": 2}
_TABLES_OF_TREE = (  # in the order in which they are read
    *("parent", "first_column", "column_speed", "cut", "first_pair"),
    *("first_row", "cut_place", "handed_to", "row_taken", "first_factor"),
)
_RUNTIME = files("mechc_codegen") / "runtime"
_LIMITS = {
    name: float(value)
    for name, value in re.findall(
        r"#define (MECHC_\w+) ([\d.]+)\b",
        (_RUNTIME / "dynamics" / "sizes.h").read_text("utf-8"),
    )
}
_OF_SERIES = ("", "_SUMS", "_KEPT", "_INTEGRATED", "_HIDES", "_ROOTS", "_FEW", "_MOMENTA")
_BOUNDS = {
    name: int(value)
    for name, value in re.findall(
        r"#define MECHC_SERIES(\w*)_MAX (\d+)\b",
        (_RUNTIME / "general" / "in_place_of_scene" / "scene_sizes.h").read_text("utf-8"),
    )
} | {"_HIDES": 1, "_FEW": 1, "_MOMENTA": 1}
_SCALARS = {"series_next": ("order", "inverse", "time")}
_COUNT = re.compile(r"(?m)^#define MECHC_(\w+) (\d+)\b")
_TABLE = re.compile(r"(?m)^#define MECHC_(\w+) ([-+\d.e]+(?:, [-+\d.e]+)*+)")


def scene_tape(writer: CWriter, metadata: Mapping[str, Any], sizes: str) -> bytes:
    """The tape of a writer's scene, without its first and last parts; empty: no tape holds it.

    ``sizes``: the text of ``scene_sizes.h``.
    """
    try:
        return _Writer(writer, metadata, sizes).content()
    except (NoTapeError, RecursionError, ZeroDivisionError):  # expressions of many levels
        return b""


def whole_tape(scene: bytes, unit: str, texts: str) -> bytes:
    """The bytes of a scene for the unit with this name, with what its parts are compiled from."""
    return MAGIC + _section(unit.encode()) + scene + _section(texts.encode("utf-8"))


class _Writer:
    def __init__(self, writer: CWriter, metadata: Mapping[str, Any], sizes: str) -> None:
        self.writer, self.functions, self.metadata = writer, writer.functions, metadata
        self.counts = dict.fromkeys(COUNTS, 0) | {n: int(v) for n, v in _COUNT.findall(sizes)}
        self.tables: dict[str, list[str]] = {
            name: text.split(", ") for name, text in _TABLE.findall(sizes)
        }
        self.code = Code(lookups(self.functions.program.values()))

    def content(self) -> bytes:
        functions = self.functions
        index = {f.name: self._function(f.name, self.writer.lines(f)) for f in functions}
        if functions.blocks:
            bodies = BlockElimination(functions.blocks).bodies()
            for name, lines in bodies.items():
                if name in FUNCTIONS:
                    index[name] = self._function(name, lines)
        series = self._series(index)
        jacobians = dict(self._jacobians(index))
        for number, name in enumerate(jacobians):  # outputs that name it, not a function
            index[name] = index[f"own_{name}"] = number
        outputs, names = self._outputs(index)
        defaults = list(self._defaults())
        code = self.code.parts()
        tables = functions.layout.tables
        metadata = json.dumps(self.metadata, sort_keys=True)
        parts = [
            metadata.encode("utf-8", "surrogatepass"),
            integers(self.counts[name] for name in COUNTS),
            integers(map(int, self._table("SLIDES"))),
            integers(chain.from_iterable(tables.get(name, ()) for name in _TABLES_OF_TREE)),
            integers(map(int, self._table("ANGLES"))),
            integers(map(int, self._table("PERIODIC"))),
            doubles(map(float, self._table("KNOTS"))),
            integers(map(int, self._table("KNOTS_BEGIN"))),
            doubles(map(float, self._table("KNOTS_PERIOD"))),
            code.numbers,
            code.tapes,
            code.operations,
            integers(index.get(name, -1) for name in FUNCTIONS if name not in _OF_STATES),
            integers(index.get(name, -1) for name in NAMED),
            integers(chain.from_iterable(outputs)),
            names,
            integers(chain.from_iterable(defaults)),
            *map(integers, series),
            integers(chain.from_iterable(jacobians.values())),
            code.tables,
            code.of_tables,
        ]
        return b"".join(map(_section, parts))

    def _series(self, index: dict[str, int]) -> list[list[int]]:
        """The counts of the Taylor series, its roots, and the factors of its sums."""
        series = self.functions.program.series
        if series is None:
            return [[], [], [], []]
        own = SeriesWriter(self.functions, series)
        own.text()
        for name, lines in own.bodies.items():
            index[name] = self._function(name, lines)
        pairs = sorted(arrange(own.sums), key=lambda pair: own.sums[min(pair), max(pair)])
        roots = own.roots
        counts = [len(own.rows), len(pairs), len(own.kept), own.integrated, int(own.hides)]
        counts += [len(roots), int(are_few(own.sums)), int(series.momenta)]
        if any(count > _BOUNDS[name] for name, count in zip(_OF_SERIES, counts, strict=True)):
            raise NoTapeError
        return [counts, roots, [left for left, _ in pairs], [right for _, right in pairs]]

    def _table(self, name: str) -> list[str]:
        return self.tables.get(name, [])

    def _function(self, name: str, lines: Iterable[Line]) -> int:
        arrays = FUNCTIONS.get(name, FUNCTIONS[COVECTOR if name == ADJOINT else OUTPUT])
        scalars = _SCALARS.get(name, ("t",))
        return self.code.add(lines, arrays, _LIMITS, scalars)

    def _jacobians(self, index: Mapping[str, int]) -> Iterable[tuple[str, tuple[int, ...]]]:
        """Each Jacobian: its columns, from which on they are the speeds, and its functions."""
        states = self.counts["NQ"] + self.counts["NU"]
        columns = (states, self.counts["NP"], self.counts["NI"])
        firsts = (self.counts["NQ"], *columns[1:])
        for (name, parts), count, first in zip(JACOBIANS.items(), columns, firsts, strict=True):
            residual, own, rates = (index.get(part, -1) for part in parts)
            if residual >= 0:
                yield name, (count, first, rates, residual, own)

    def _outputs(self, index: Mapping[str, int]) -> tuple[list[tuple[int, int, int, int]], bytes]:
        """Of each output its way, its function, its width, and where its name begins."""
        functions = self.functions
        ways = _BY_RUNTIME | dict.fromkeys(_OF_TREE, OF_TREE)
        rows = [(label, width, PLAIN) for label, width in label_widths(functions, of_motion=False)]
        rows += [(label, width, ways[label]) for label, width in functions.by_runtime()]
        rows += [(label, width, SOLVED) for label, width in label_widths(functions, of_motion=True)]
        found, names = list[tuple[int, int, int, int]](), b""
        if len(rows) > MOST_OUTPUTS or max(width for _, width, _ in rows) > WIDEST:
            raise NoTapeError
        for label, width, how in rows:
            number = _OF_TREE[label] if how == OF_TREE else index.get(label, -1)
            found.append((how, number, width, len(names)))
            name = functions.request.name_of(label)
            names += name.encode("utf-8", "surrogatepass") + b"\0"
        return found, names

    def _defaults(self) -> Iterable[tuple[int, int]]:
        """Each parameter with the function that writes its default, or -1."""
        symbols, printer = self.functions.program.symbols.parameters, RealPrinter()
        for i, value, held in self.functions.defaults():
            if value is None:
                yield i, -1
                continue
            loads = [let(symbols[j].name, named("p")[j]) for j in held]
            yield i, self._function(DEFAULT, [*loads, put(named("out")[0], printer.real(value))])


def _section(content: bytes) -> bytes:
    """A part of the tape: its length, its content, and zeros up to a multiple of eight."""
    return struct.pack("Q", len(content)) + content + bytes(8 - len(content) % 8)
