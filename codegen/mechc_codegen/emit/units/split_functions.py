"""Lines -> pieces of bounded length.

The time of a compiler grows faster than the length of a function.  Long functions are cut into
pieces, which pass values on through an array; a place in it is used again after the last use of its
value.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mechc_codegen.emit.expressions import Line

PIECE = 200  # lines


@dataclass(frozen=True)
class FunctionPiece:
    """Lines, and the places in the shared array of the values that they read and write."""

    lines: Sequence[Line]
    received: Mapping[str, int]
    handed_on: Mapping[str, int]


def cut(lines: Sequence[Line]) -> tuple[list[FunctionPiece], int]:
    """The pieces, and the size of the array that they share."""
    parts = list(_parts(_as_soon_as_possible(lines)))
    places, size = _places(parts)
    pieces = list[FunctionPiece]()
    for part in parts:
        used = {name for line in part for name in line.uses}
        defined = {name for line in part for name in line.defines}
        received = {s: i for s, i in places.items() if s in used and s not in defined}
        handed_on = {s: i for s, i in places.items() if s in defined}
        pieces.append(FunctionPiece(part, received, handed_on))
    return pieces, size


def _places(parts: Sequence[Sequence[Line]]) -> tuple[dict[str, int], int]:
    """Places for the values that one part passes to later parts, and their number."""
    last = {s: n for n, part in enumerate(parts) for line in part for s in line.uses}
    places, size = dict[str, int](), 0
    free, ends = list[int](), dict[int, list[int]]()
    for number, part in enumerate(parts):
        for name in (s for line in part for s in line.defines if last.get(s, -1) > number):
            if not free:
                free, size = [size], size + 1
            places[name] = free.pop()
            ends.setdefault(last[name], []).append(places[name])
        free += ends.pop(number, [])
    return places, size


def _as_soon_as_possible(lines: Sequence[Line]) -> Iterator[Line]:
    """Move lines that define nothing directly behind the last value they use."""
    order = {s: n for n, line in enumerate(lines) for s in line.defines}
    after: dict[int, list[Line]] = {}
    for line in lines:
        if not line.defines:
            last = max((order[s] for s in line.uses if s in order), default=-1)
            after.setdefault(last, []).append(line)
    yield from after.get(-1, ())
    for number, line in enumerate(lines):
        if line.defines:
            yield line
            yield from after.get(number, ())


def _parts(lines: Iterable[Line]) -> Iterator[list[Line]]:
    part: list[Line] = []
    for line in lines:
        part.append(line)
        if len(part) == PIECE:
            yield part
            part = []
    if part:
        yield part
