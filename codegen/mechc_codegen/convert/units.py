"""Units in a SymPy object: as given, rad for coordinates that turn frames, unknown otherwise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Expr
from sympy.core.function import AppliedUndef

from mechc_codegen.convert.fingerprint import Fingerprint
from mechc_codegen.description.quantity import refuse_scaled
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import printed_name


def symbol_units(
    source: Source, read: Fingerprint, kinematics: Sequence[Expr], given: Mapping[Expr, str]
) -> dict[Expr, str]:
    """The units that are given, rad for coordinates that turn frames, and those of rates.

    Raises
    ------
    MechanismError
        For units that are not SI units: all values are in SI units, and are not converted.
    """
    for symbol, unit in given.items():
        refuse_scaled(printed_name(symbol), str(unit))
    known = {**dict.fromkeys(_turning(source, read), "rad"), **given}
    rates = zip(source.q, kinematics, strict=True)
    of_rates = {rate: f"{known[q]}/s" for q, rate in rates if known.get(q) and rate in source.u}
    return {symbol: str(unit) for symbol, unit in (of_rates | known).items()}


def _turning(source: Source, read: Fingerprint) -> set[AppliedUndef]:
    """Coordinates in sines and cosines of positions and orientations."""
    return {
        q for angle in read.angles for q in source.q if angle.has(q) and angle.diff(q).is_Number
    }
