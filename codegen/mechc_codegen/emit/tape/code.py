"""Functions as tapes, and what they have in common.

Input: the statements of each.  Output: the numbers that ``mechc_tape_code`` points to.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import NamedTuple

from mechc_codegen.description.tables import Lookup
from mechc_codegen.emit.expressions import Line
from mechc_codegen.emit.tables import table_rows
from mechc_codegen.emit.tape.assembler import MOST, MOST_REGISTERS, Assembler, NoTapeError


class CodeParts(NamedTuple):
    """The bytes of what functions have in common, in the order of ``mechc_tape_code``."""

    operations: bytes
    tapes: bytes
    tables: bytes
    numbers: bytes
    of_tables: bytes


class Code:
    """Functions as tapes, numbered as they are added."""

    def __init__(self, lookups: Iterable[type[Lookup]] = ()) -> None:
        self.lookups = {each.__name__: each for each in lookups}
        self._numbers: dict[str, int] = {}
        self._rows = list[tuple[int, int, int, int, int]]()
        self._places = list[tuple[int, int, int]]()  # of each function: first, count, registers

    def add(
        self, lines: Iterable[Line], arrays: Sequence[str],
        macros: Mapping[str, float] | None = None, scalars: Sequence[str] = ("t",),
    ) -> int:  # fmt: skip
        """The number of a function with these arguments: see :class:`Assembler`.

        Raises
        ------
        NoTapeError
            If no tape holds it.
        """
        assembler = Assembler(self._numbers, arrays, macros or {}, scalars, [*self.lookups])
        registers, rows = assembler.take(lines).rows()
        beyond = max(max(row) for row in rows) >= MOST or len(self._numbers) > MOST
        if registers > MOST_REGISTERS or beyond:
            raise NoTapeError
        self._places.append((len(self._rows), len(rows), registers))
        self._rows += rows
        return len(self._places) - 1

    def parts(self) -> CodeParts:
        """The bytes of all that was added."""
        tables, of_tables = table_rows([*self.lookups.values()])
        return CodeParts(
            array("H", chain.from_iterable(self._rows)).tobytes(),
            integers(chain.from_iterable(self._places)),
            integers(chain.from_iterable(tables)),
            doubles(map(float.fromhex, self._numbers)),
            doubles(of_tables),
        )


def integers(values: Iterable[int]) -> bytes:
    """Whole numbers of 32 bits."""
    return array("i", values).tobytes()


def doubles(values: Iterable[float]) -> bytes:
    """Numbers of 64 bits."""
    return array("d", values).tobytes()
