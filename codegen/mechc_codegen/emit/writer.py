"""The traversal of a scene's functions, the same for every language.

Input: one :class:`SceneFunction`.  Output: its text.  A language defines how a statement, a stored
output, a kept value and a definition are written; their order, and how long functions are split,
is decided here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from sympy import Symbol

from mechc_codegen.derive.equations import Output
from mechc_codegen.emit.functions import SceneFunction
from mechc_codegen.emit.units.split_functions import Line, cut


class FunctionWriter(ABC):
    """The functions of one scene in one language."""

    most_lines: int  # longer functions are cut

    def text(self, function: SceneFunction) -> str:
        """The function's text, in pieces where it is long."""
        lines = self.lines(function)
        if len(lines) <= self.most_lines:
            return self.whole(function, self._body(lines, function.loads))
        pieces, size = cut(lines)
        texts = list[str]()
        for number, piece in enumerate(pieces):
            received = {s: f"shared[{i}]" for s, i in piece.received.items()}
            body = self._body(piece.lines, {**function.loads, **received})
            handed_on = (self.keep("shared", i, s) for s, i in piece.handed_on.items())
            body += [text for line in handed_on for text in line.text]
            texts.append(self.piece(function, number, body))
        return "\n".join([*texts, self.caller(function, len(pieces), size)])

    def lines(self, function: SceneFunction) -> list[Line]:
        """Statements, then stored outputs, then kept values."""
        lines = self.statements(function)
        for output, target in function.stores:
            lines += self.store(output, target)
        return lines + [self.keep(function.array, i, s) for i, s in enumerate(function.kept)]

    def _body(self, lines: Sequence[Line], loads: Mapping[Symbol, str]) -> list[str]:
        used = {symbol for line in lines for symbol in line.uses}
        body = [self.load(symbol, place) for symbol, place in loads.items() if symbol in used]
        return body + [text for line in lines for text in line.text]

    @abstractmethod
    def statements(self, function: SceneFunction) -> list[Line]:
        """The statements of a function."""

    @abstractmethod
    def store(self, output: Output, target: str) -> list[Line]:
        """Assignments of an output's elements to an array."""

    @abstractmethod
    def keep(self, array: str, index: int, symbol: Symbol) -> Line:
        """A value that goes to an array."""

    @abstractmethod
    def load(self, symbol: Symbol, place: str) -> str:
        """A value that comes from an array."""

    @abstractmethod
    def whole(self, function: SceneFunction, body: Sequence[str]) -> str:
        """A function that is not cut."""

    @abstractmethod
    def piece(self, function: SceneFunction, number: int, body: Sequence[str]) -> str:
        """One piece of a function that is cut."""

    @abstractmethod
    def caller(self, function: SceneFunction, count: int, size: int) -> str:
        """The function that calls its pieces; ``size`` of the array that they share."""
