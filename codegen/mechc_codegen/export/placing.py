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
    from mechc_codegen.drawing.plan import PicturePlan

_IDENTITY = "{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}"


def placing(plan: PicturePlan, parameters: Sequence[str], fixed: Mapping[str, float]) -> str:
    """Statements that write the points to ``places``, of ``t``, ``y`` and ``p``."""
    return "\n".join(f"    {line}" for line in _lines(plan, parameters, fixed))


def _lines(
    plan: PicturePlan, parameters: Sequence[str], fixed: Mapping[str, float]
) -> Iterator[str]:
    time, state, values = plan.arguments
    names: dict[Expr, Expr] = {time: Symbol("t")}
    printer = RealPrinter(tables=True)

    def array(entries: Sequence[Expr], size: int) -> str:
        printed = (printer.real(entry.xreplace(names)) for entry in entries)
        return f"(const double[{size}]){{{', '.join(printed)}}}"

    for i, symbol in enumerate(state):
        names[symbol] = Symbol(f"x{i}")
        yield f"const double x{i} = y[{i}];"
    for i, symbol in enumerate(values):
        if symbol.name in fixed:
            names[symbol] = Float(fixed[symbol.name])
        else:
            names[symbol] = Symbol(f"v{i}")
            yield f"const double v{i} = p[{parameters.index(symbol.name)}];"
    used = [str(name) for name in names.values() if isinstance(name, Symbol)]
    yield f"{', '.join(f'(void){name}' for name in used)};"
    yield f"double turn[{len(plan.frames) + 1}][9] = {{{_IDENTITY}}};"
    yield f"double point[{len(plan.points) + 1}][3] = {{{{0.0}}}};"
    for i, (before, entries) in enumerate(plan.frames, 1):
        yield f"multiply_turns(turn[{before}], {array(entries, 9)}, turn[{i}]);"
    for i, (before, arms) in enumerate(plan.points, 1):
        yield f"memcpy(point[{i}], point[{before}], sizeof point[{i}]);"
        for frame, arm in arms:
            yield f"add_arm(turn[{frame}], {array(arm, 3)}, point[{i}]);"
    for i, place in enumerate(plan.places):
        yield f"memcpy(places + {3 * i}, point[{place}], sizeof point[{place}]);"
