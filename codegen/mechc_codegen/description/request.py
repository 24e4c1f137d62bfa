"""What is asked of a mechanism: which outputs, and which parameters are fixed.

With the mechanism it makes the scene; nothing that is not asked for is derived or emitted.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from sympy import Expr, Symbol

from mechc_codegen.errors import InternalError

USUAL = ("energy", "momenta", "points", "multipliers")
OPTIONAL = (*USUAL, "accelerations", "reactions", "state_jacobian", "parameter_jacobian")
_LABEL = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class OutputRequest:
    """Attributes
    ----------
    outputs
        Of :data:`OPTIONAL` those wanted.
    fixed
        Parameters that become numbers and are no parameters any more.
    expressions
        Outputs of the user's own: label -> expression of time, coordinates, speeds, parameters,
        accelerations and multipliers.  Labels are identifiers that no other output has.
    names
        Label -> what the user calls it, any text; the label itself where there is none.
    """

    outputs: frozenset[str] = frozenset(USUAL)
    fixed: Mapping[Symbol, Expr] = field(default_factory=dict)
    expressions: Mapping[str, Expr] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for label in self.expressions:
            if not _LABEL.fullmatch(label):
                raise InternalError(f"an output has the label {label!r}")

    def name_of(self, output: str) -> str:
        """What users call an output."""
        return self.names.get(output, output)

    def includes(self, output: str) -> bool:
        return output in self.outputs

    @property
    def includes_jacobian(self) -> bool:
        return self.includes("state_jacobian") or self.includes("parameter_jacobian")


DEFAULT_REQUEST = OutputRequest()
