"""Units in a SymPy object: as given, rad for coordinates that turn frames, unknown otherwise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Expr
from sympy.core.function import AppliedUndef

from mechc_codegen.convert.fingerprint import Fingerprint
from mechc_codegen.description.quantity import refuse_scaled
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import printed_name


class Units:
    """Units: as given; rad for coordinates that turn frames; unknown ("") otherwise.

    Raises
    ------
    MechanismError
        For units that are not SI units: all values are in SI units, and are not converted.
    """

    def __init__(
        self,
        source: Source,
        read: Fingerprint,
        kinematics: Sequence[Expr],
        given: Mapping[Expr, str],
    ) -> None:
        for symbol, unit in given.items():
            refuse_scaled(printed_name(symbol), str(unit))
        self.given = given
        turning = _turning(source, read)
        self.known: dict[Expr, str] = {}
        for q, rate in zip(source.q, kinematics, strict=True):
            unit = given.get(q, "rad" if q in turning else "")
            self.known[q] = unit
            if unit and rate in source.u:
                self.known[rate] = f"{unit}/s"

    def of(self, symbol: Expr) -> str:
        return str(self.given.get(symbol, self.known.get(symbol, "")))


def _turning(source: Source, read: Fingerprint) -> set[AppliedUndef]:
    """Coordinates in sines and cosines of positions and orientations."""
    return {
        q for angle in read.angles for q in source.q if angle.has(q) and angle.diff(q).is_Number
    }
