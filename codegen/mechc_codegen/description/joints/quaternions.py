"""Quaternions that have to have length one: those of SymPy's ``orient_quaternion``.

Their direction cosines are quadratic in the components: a rotation times the square of the length.
"""

from __future__ import annotations

from collections.abc import Sequence

from sympy import MatrixBase, expand
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import ReferenceFrame

from mechc_codegen.description.placement import steps_from


def unit_quaternions(
    inertial: ReferenceFrame, coordinates: Sequence[AppliedUndef]
) -> list[list[int]]:
    """The places among ``coordinates`` of every such quaternion, the scalar component first."""
    before = steps_from(inertial, lambda f: f._dcm_dict)
    turns = (frame._dcm_dict[last] for frame, last in before.items())
    found = dict.fromkeys(tuple(_components(turn, coordinates)) for turn in turns)
    return [[coordinates.index(x) for x in quaternion] for quaternion in found if quaternion]


def _components(turn: MatrixBase, coordinates: Sequence[AppliedUndef]) -> list[AppliedUndef]:
    """The four coordinates in which these direction cosines are those of a quaternion."""
    row = list(turn)[:3]
    held = set().union(*(entry.atoms(AppliedUndef) for entry in row)) & set(coordinates)
    if len(held) != 4 or not all(entry.is_polynomial(*held) for entry in turn):
        return []
    length = sum(x**2 for x in held)
    if expand(sum(entry**2 for entry in row) - length**2) != 0:
        return []
    trace = expand(turn.trace())  # 3 e_0^2 - e_1^2 - e_2^2 - e_3^2
    return sorted(held, key=lambda x: (-trace.coeff(x, 2), coordinates.index(x)))
