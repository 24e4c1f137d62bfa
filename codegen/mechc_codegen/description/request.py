"""The request for a mechanism: which outputs, and which parameters are fixed.

Mechanism and request define the scene; outputs that are not requested are not derived or emitted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from sympy import Expr, Symbol

from mechc_codegen.errors import InternalError

USUAL = ("energy", "momenta", "points", "multipliers")
JACOBIANS = ("state_jacobian", "parameter_jacobian")
OPTIONAL = (*USUAL, "accelerations", "reactions", *JACOBIANS, "sensitivities")
DIFFERENTIATED = (  # with the motion, for sensitivities
    *("kinetic_energy", "potential_energy", "linear_momenta", "angular_momenta", "points"),
    *("point_velocities", "point_accelerations", "reaction_forces", "reaction_torques"),
    "multipliers",
)
_LABEL = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def default_outputs(*, of_object: bool) -> tuple[str, ...]:
    """The outputs where none are requested; ``of_object``: of an object of SymPy, or of equations
    without bodies."""
    return ("energy",) if of_object else USUAL


@dataclass(frozen=True)
class OutputRequest:
    """The requested outputs, and the parameters that become numbers.

    Attributes
    ----------
    outputs
        The requested ones of :data:`OPTIONAL`.
    fixed
        Parameters that become numbers and are not parameters any more.
    expressions
        User-defined outputs: label -> expression of time, coordinates, speeds, parameters,
        accelerations and multipliers.  Labels are identifiers that no other output has.
    names
        Label -> the user's name, any text; the label itself by default.
    shapes
        Name -> shape of user-defined outputs that are arrays; their elements are ``expressions``
        named ``name[0,1]``.
    """

    outputs: frozenset[str] = frozenset(USUAL)
    fixed: Mapping[Symbol, Expr] = field(default_factory=dict)
    expressions: Mapping[str, Expr] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    shapes: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if "sensitivities" in self.outputs:  # which are made of them
            object.__setattr__(self, "outputs", self.outputs | frozenset(JACOBIANS))
        for label in self.expressions:
            if not _LABEL.fullmatch(label):
                raise InternalError(f"an output has the label {label!r}")

    def joined(self, more: OutputRequest) -> OutputRequest:
        """Both requests in one; an expression of ``more`` takes the place of one of its name."""
        expressions = {
            each.name_of(label): expression
            for each in (self, more)
            for label, expression in each.expressions.items()
        }
        names = {f"own_{k}": name for k, name in enumerate(expressions)}
        labelled = {label: expressions[name] for label, name in names.items()}
        fixed, shapes = {**self.fixed, **more.fixed}, {**self.shapes, **more.shapes}
        return OutputRequest(self.outputs | more.outputs, fixed, labelled, names, shapes)

    def name_of(self, output: str) -> str:
        """The user's name of an output."""
        return self.names.get(output, output)

    def includes(self, output: str) -> bool:
        return output in self.outputs

    def differentiated_outputs(self, present: Iterable[str]) -> tuple[str, ...]:
        """The present outputs whose sensitivities are requested, besides user-defined ones."""
        return self.of_mechanism(present) if self.includes("sensitivities") else ()

    def of_mechanism(self, present: Iterable[str]) -> tuple[str, ...]:
        """The present outputs that can be differentiated, besides user-defined ones."""
        found = {*present} - {*self.expressions}
        found -= set() if self.includes("multipliers") else {"multipliers"}
        return tuple(name for name in DIFFERENTIATED if name in found)

    @property
    def includes_jacobian(self) -> bool:
        return self.includes("state_jacobian") or self.includes("parameter_jacobian")


DEFAULT_REQUEST = OutputRequest()
