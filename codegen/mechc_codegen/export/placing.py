"""The points of a drawing as C: each placed from the one before it.

Input: the plan of a drawing, the places of parameters, values of those that are fixed.  Output: the
statements of a function that writes x, y, z of the drawing's points.  Invariant: names in it are
ours alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from sympy import Expr, Float, Symbol

from mechc_codegen.emit.printer import RealPrinter

if TYPE_CHECKING:
    from mechc_codegen.drawing.plan import Plan

_IDENTITY = "{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}"


def placing(plan: Plan, parameters: Sequence[str], fixed: Mapping[str, float]) -> str:
    """Statements that write the points to ``places``, of ``t``, ``y`` and ``p``."""
    return "\n".join(f"    {line}" for line in _Placing(plan, parameters, fixed).lines())


class _Placing:
    def __init__(self, plan: Plan, parameters: Sequence[str], fixed: Mapping[str, float]) -> None:
        self.plan, self.printer = plan, RealPrinter(tables=True)
        time, state, values = plan.arguments
        self.names: dict[Expr, Expr] = {time: Symbol("t")}
        self.loads = list[str]()
        for i, symbol in enumerate(state):
            self._load(symbol, f"x{i}", f"y[{i}]")
        for i, symbol in enumerate(values):
            if symbol.name in fixed:
                self.names[symbol] = Float(fixed[symbol.name])
            else:
                self._load(symbol, f"v{i}", f"p[{parameters.index(symbol.name)}]")

    def _load(self, symbol: Expr, name: str, place: str) -> None:
        self.names[symbol] = Symbol(name)
        self.loads.append(f"const double {name} = {place};")

    def lines(self) -> Iterator[str]:
        frames, points = self.plan.frames, self.plan.points
        yield from self.loads
        used = [str(name) for name in self.names.values() if isinstance(name, Symbol)]
        yield f"{', '.join(f'(void){name}' for name in used)};"
        yield f"double turn[{len(frames) + 1}][9] = {{{_IDENTITY}}};"
        yield f"double point[{len(points) + 1}][3] = {{{{0.0}}}};"
        for i, (before, entries) in enumerate(frames, 1):
            yield f"multiply_turns(turn[{before}], {self._array(entries, 9)}, turn[{i}]);"
        for i, (before, arms) in enumerate(points, 1):
            yield f"memcpy(point[{i}], point[{before}], sizeof point[{i}]);"
            for frame, arm in arms:
                yield f"add_arm(turn[{frame}], {self._array(arm, 3)}, point[{i}]);"
        for i, place in enumerate(self.plan.places):
            yield f"memcpy(places + {3 * i}, point[{place}], sizeof point[{place}]);"

    def _array(self, entries: Sequence[Expr], size: int) -> str:
        printed = (self.printer.real(entry.xreplace(self.names)) for entry in entries)
        return f"(const double[{size}]){{{', '.join(printed)}}}"
