"""A description as text for a cache key: dataclasses, their fields, and what SymPy gives these.

Input: a mechanism.  Output: its lines in a fingerprint.  Invariant: a value whose text does not
determine it is refused, so that two mechanisms with one text are one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from sympy import Expr
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.convert.fingerprint import Fingerprint

if TYPE_CHECKING:
    from mechc_codegen.description.mechanism import Mechanism

UNCOMPILED = ("notes", "limits")  # what decides nothing that is compiled


class NotWritableError(Exception):
    """An error for a value whose text does not determine it, such as a long array."""


class DescribedText:
    """The text of one description, in which each SymPy object is written once."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.fingerprint = Fingerprint(mechanism.frame)
        self._bodies: dict[int, int] = {}
        for body in mechanism.bodies:
            self._bodies[id(body)] = len(self._bodies)
            self.fingerprint.body(body)
        for field in fields(mechanism):
            if field.name not in (*UNCOMPILED, "bodies"):
                self.fingerprint.write(field.name, [self.of(getattr(mechanism, field.name))])

    def of(self, value: Any) -> str:
        """The text of a part.

        Raises
        ------
        NotWritableError
            For anything of which a mechanism does not consist.
        """
        if isinstance(value, (RigidBody, Particle)) and id(value) in self._bodies:
            return f"body {self._bodies[id(value)]}"
        if isinstance(value, Point):
            return self.fingerprint.point(value)
        if isinstance(value, ReferenceFrame):
            return self.fingerprint.frame(value)
        if isinstance(value, Vector):
            return self.fingerprint.vector(value)
        if isinstance(value, Dyadic):
            return self.fingerprint.dyadic(value)
        if isinstance(value, (tuple, list)):
            return f"({','.join(map(self.of, value))})"
        if isinstance(value, Mapping):
            return f"{{{','.join(f'{self.of(k)}:{self.of(x)}' for k, x in value.items())}}}"
        if is_dataclass(value) and not isinstance(value, type):
            parts = (self.of(getattr(value, field.name)) for field in fields(value))
            return f"{type(value).__name__}({','.join(parts)})"
        return plain_text(self.fingerprint, value)


def plain_text(fingerprint: Fingerprint, value: Any) -> str:
    """The text of an expression, of a text, of a number or of nothing."""
    if isinstance(value, Expr):
        return fingerprint.expression(value)
    if isinstance(value, Enum):
        return str(value)
    if value is None or isinstance(value, (str, int, float)):  # numpy's numbers among them
        return repr(value)
    raise NotWritableError
