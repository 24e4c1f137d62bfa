"""Couplings: a constraint between the coordinates of two joints, and the forces that hold it."""

from __future__ import annotations

from dataclasses import dataclass, field

from sympy import S
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.drawing import NO_DRAWING, Drawing
from mechc_codegen.description.joints.tree import Joint


@dataclass(frozen=True, eq=False)
class CoupledPair(Joint):
    """Two bodies of the tree whose joints move together, by one constraint.

    Attributes
    ----------
    constraint
        Its expression contains the coordinates of the two joints alone, and those between them.
    force, torque
        By the parent on the child at ``child_point``, per unit of the constraint's multiplier.
    drawing
        Rims, strands and profiles.
    """

    constraint: Constraint = field(default_factory=lambda: Constraint("", S.Zero, ""))
    force: Vector = field(default_factory=lambda: Vector(0))
    torque: Vector = field(default_factory=lambda: Vector(0))
    drawing: Drawing = NO_DRAWING

    @property
    def is_cut(self) -> bool:
        return True
