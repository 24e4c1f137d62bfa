"""What is asked of a mechanism: which outputs, and which parameters are fixed.

With the mechanism it makes the scene; nothing that is not asked for is derived or emitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sympy import Expr, Symbol

USUAL = ("energy", "momenta", "points", "multipliers")
OPTIONAL = (*USUAL, "accelerations", "state_jacobian", "parameter_jacobian")


@dataclass(frozen=True)
class Wishes:
    """Attributes
    ----------
    outputs
        Of :data:`OPTIONAL` those wanted.
    fixed
        Parameters that become numbers and are no parameters any more.
    expressions
        Outputs of the user's own: name -> expression of time, coordinates, speeds, parameters,
        accelerations and multipliers.
    """

    outputs: frozenset[str] = frozenset(USUAL)
    fixed: Mapping[Symbol, Expr] = field(default_factory=dict)
    expressions: Mapping[str, Expr] = field(default_factory=dict)

    def wants(self, output: str) -> bool:
        return output in self.outputs


EVERYTHING = Wishes()
