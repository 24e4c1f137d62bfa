"""Lines of C -> functions of bounded size.

A compiler's time grows faster than the length of a function.  Long ones are cut into pieces that
hand values on through an array, whose places are taken again once their value is used up.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from sympy import Symbol

MOST_LINES = 600  # longer functions are cut
PIECE = 200


@dataclass(frozen=True)
class Line:
    """A statement in C, with the symbols that it defines and uses."""

    text: tuple[str, ...]
    defines: tuple[Symbol, ...] = ()
    uses: Collection[Symbol] = ()


@dataclass(frozen=True)
class Function:
    """``loads``: where the values of symbols that no line defines come from, in order."""

    comment: str
    name: str
    signature: str
    lines: Sequence[Line]
    loads: Mapping[Symbol, str]
    storage: str = "MECHC_INLINE"

    def text(self) -> str:
        if len(self.lines) <= MOST_LINES:
            return self._whole(self.name, self.lines, self.storage, self.comment)
        return self._cut()

    def _whole(self, name: str, lines: Sequence[Line], storage: str, comment: str) -> str:
        used = {symbol for line in lines for symbol in line.uses}
        body = [_load(symbol, place) for symbol, place in self.loads.items() if symbol in used]
        body += [text for line in lines for text in line.text]
        return _definition(comment, name, self.signature, body, storage)

    def _cut(self) -> str:
        pieces = list(pieces_of(as_soon_as_possible(self.lines)))
        shared = Shared(pieces)
        texts, calls = list[str](), list[str]()
        arguments = ", ".join(argument_names(self.signature))
        for number, piece in enumerate(pieces):
            name = f"{self.name}_{number}"
            texts.append(self._piece(name, piece, shared, number))
            calls.append(f"FN({name})({arguments}, shared);")
        body = [f"real shared[{max(shared.size, 1)}];", *calls]
        texts.append(_definition(self.comment, self.name, self.signature, body, "MECHC_ONCE"))
        return "\n".join(texts)

    def _piece(self, name: str, piece: Sequence[Line], shared: Shared, number: int) -> str:
        used = {symbol for line in piece for symbol in line.uses}
        defined = {symbol for line in piece for symbol in line.defines}
        body = [_load(symbol, place) for symbol, place in self.loads.items() if symbol in used]
        taken = [s for s in shared.place if s in used and s not in defined]
        body += [_load(symbol, f"shared[{shared.place[symbol]}]") for symbol in taken]
        body += [text for line in piece for text in line.text]
        given = [s for s in shared.place if s in defined]
        body += [f"shared[{shared.place[symbol]}] = {symbol.name};" for symbol in given]
        signature = f"{self.signature}, real *shared"
        return _definition(f"{self.comment} Piece {number}.", name, signature, body, "MECHC_ONCE")


class Shared:
    """Places for the values that one piece hands to later ones."""

    def __init__(self, pieces: Sequence[Sequence[Line]]) -> None:
        last = {s: n for n, piece in enumerate(pieces) for line in piece for s in line.uses}
        self.place: dict[Symbol, int] = {}
        self.size = 0
        free, ends = list[int](), dict[int, list[int]]()
        for number, piece in enumerate(pieces):
            for line in piece:
                for symbol in line.defines:
                    if last.get(symbol, -1) > number:
                        self.place[symbol] = free.pop() if free else self._new()
                        ends.setdefault(last[symbol], []).append(self.place[symbol])
            free += ends.pop(number, [])

    def _new(self) -> int:
        self.size += 1
        return self.size - 1


def as_soon_as_possible(lines: Sequence[Line]) -> Iterator[Line]:
    """Lines that define nothing right after the last value they use."""
    defined = {symbol for line in lines for symbol in line.defines}
    order = {s: n for n, line in enumerate(lines) for s in line.defines}
    after: dict[int, list[Line]] = {}
    for line in lines:
        if not line.defines:
            after.setdefault(max((order[s] for s in line.uses if s in defined), default=-1), [])
            after[max((order[s] for s in line.uses if s in defined), default=-1)].append(line)
    yield from after.get(-1, ())
    for number, line in enumerate(lines):
        if line.defines:
            yield line
            yield from after.get(number, ())


def pieces_of(lines: Iterable[Line]) -> Iterator[list[Line]]:
    piece: list[Line] = []
    for line in lines:
        piece.append(line)
        if len(piece) == PIECE:
            yield piece
            piece = []
    if piece:
        yield piece


def _load(symbol: Symbol, place: str) -> str:
    return f"const real {symbol.name} = {place};"


def _definition(comment: str, name: str, signature: str, body: Sequence[str], storage: str) -> str:
    unused = ", ".join(f"(void){argument}" for argument in argument_names(signature))
    lines = "\n".join(f"    {line}" for line in [f"{unused};", *body])
    head = f"{storage} void FN({name})({signature})"
    return f"/* {plain_words(comment)} */\n{_wrapped(head)}\n{{\n{lines}\n}}\n"


def argument_names(signature: str) -> list[str]:
    """Of a C function's parameters, in order."""
    return re.findall(r"(\w+)(?:,|$)", signature)


def plain_words(text: str) -> str:
    """For a comment: whatever could end it or start a line is replaced."""
    return re.sub(r"[^A-Za-z0-9_ .,:;()\[\]=+'^-]", "?", text).replace("* /", "")


def _wrapped(head: str) -> str:
    return "\n".join(wrap(head, 98, subsequent_indent="    ", break_long_words=False))
