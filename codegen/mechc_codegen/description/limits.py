"""The bounds of a joint, as a description gives them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from sympy import Expr

Bound: TypeAlias = "Expr | float | None"


@dataclass(frozen=True)
class Limits:
    """The bounds of a joint: numbers, symbols, or None where there is no bound.

    Attributes
    ----------
    position
        The joint's position, an expression of coordinates.
    lower, upper
        Its bounds, in rad or m.
    velocity, effort
        Of the magnitudes of its rate (rad/s, m/s) and of its motor's torque or force (N m, N).
    """

    position: Expr
    lower: Bound = None
    upper: Bound = None
    velocity: Bound = None
    effort: Bound = None
