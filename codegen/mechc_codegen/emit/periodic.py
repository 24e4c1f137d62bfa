"""Which coordinates are angles, and which of these appear in sines and cosines alone: a whole turn
of them changes nothing.

Input: the scene's functions.  Output: their indices.  Invariant: what is not recognised is no
angle.
"""

from __future__ import annotations

from collections.abc import Mapping

from sympy import Add, Expr, Integer, Symbol

from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.ir.program import SWITCHING, SineCosine, slice_statements, symbols_of

Sum = Mapping[Symbol, int]  # of coordinates, by their whole multiples

BESIDE = (
    "coordinate_rates",
    "kinematic_matrix",
    SWITCHING,
)  # functions of their own that runs call


def angles(functions: SceneFunctions) -> tuple[list[int], list[int]]:
    """Coordinates that occur in sines and cosines of the configuration and the motion; and those
    that occur in nothing else that a run evaluates, none where inputs read coordinates."""
    turned, used = _uses(functions)
    alone = set[Symbol]() if functions.program.input_values() else turned - used
    coordinates = list(enumerate(functions.program.symbols.q))
    return [i for i, q in coordinates if q in turned], [i for i, q in coordinates if q in alone]


def _uses(functions: SceneFunctions) -> tuple[set[Symbol], set[Symbol]]:
    """Coordinates in sines and cosines, and those used in other ways."""
    program = functions.program
    sums: dict[Symbol, Sum] = {q: {q: 1} for q in program.symbols.q}
    turned = set[Symbol]()
    used = set[Symbol]()  # other than in a sine or a cosine of a sum of whole multiples
    beside = [functions.outputs[name] for name in BESIDE if name in functions.outputs]
    of_motion = (*functions.configuration, *functions.motion)
    for statement in (*of_motion, *slice_statements(functions.program.body, symbols_of(beside))):
        angle = _sum_of(statement.value, sums)
        if angle is None:
            used |= _plain_coordinates(statement.value, sums)
        elif isinstance(statement, SineCosine):
            turned |= angle.keys()
        else:
            sums[statement.target] = angle
    layout = functions.layout
    stored = [
        functions.outputs[n]
        for n in (*layout.configuration, *layout.motion)
        if n in functions.outputs
    ]
    for output in (*stored, *beside):
        for element in output.elements:
            used |= _plain_coordinates(element, sums)
    return turned, used


def _sum_of(value: Expr, sums: Mapping[Symbol, Sum]) -> Sum | None:
    """The integer factors of coordinates in a sum; None if a coordinate occurs in another way."""
    found: dict[Symbol, int] = {}
    for term in Add.make_args(value):
        if not _plain_coordinates(term, sums):
            continue
        factor, symbol = term.as_coeff_Mul()
        if not isinstance(factor, Integer) or symbol not in sums:
            return None
        for q, count in sums[symbol].items():
            found[q] = found.get(q, 0) + int(factor) * count
    return found


def _plain_coordinates(value: Expr, sums: Mapping[Symbol, Sum]) -> set[Symbol]:
    """The coordinates that occur in a value, directly or through such sums."""
    return {q for symbol in value.free_symbols & sums.keys() for q in sums[symbol]}
