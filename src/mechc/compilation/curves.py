"""Data of a function of a coordinate -> an expression: piecewise polynomials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.inputs.accept import samples_or_signal
from mechc.inputs.signals import Signal

LEAST_DERIVATIVES = 2  # of positions, for accelerations


def with_curves(inputs: Mapping[Any, Any]) -> dict[Any, Any]:
    """The same, with an expression where a function of a coordinate is given by data.

    ``(positions, values)`` become a cubic spline; a :class:`mechc.Signal` and interpolants of SciPy
    are taken as they are.  Beyond the data the first and the last polynomial go on.

    Raises
    ------
    ValueOutOfBoundsError
        For data that are not valid, and data of a function of time.
    """
    return {key: _expression(key, value) for key, value in inputs.items()}


def _expression(key: Any, value: Any) -> Any:
    signal = samples_or_signal(value, order=LEAST_DERIVATIVES)
    if signal is None:
        return value
    if len(getattr(key, "args", ())) != 1 or getattr(key.args[0], "is_Symbol", False):
        raise ValueOutOfBoundsError(
            f"inputs: samples of {key} are given with a run, simulate(..., inputs={{...}}), or to "
            "mechc.compile for a function of a coordinate, sympy.Function('h')(q)"
        )
    return _piecewise(key.args[0], signal)


def _piecewise(x: Any, signal: Signal) -> Any:
    """A tree of choices: SymPy compares all conditions of a Piecewise with each other."""
    from mechc_codegen.description.piecewise import Step, Where
    from sympy import Float

    knots = [Float(float(knot)) for knot in signal.pieces[0]]
    values = []
    for knot, row in zip(knots, signal.pieces[1], strict=True):
        value = Float(0)
        for factor in row[::-1]:
            value = value * (x - knot) + Float(float(factor))
        values.append(value)

    def chosen(first: int, last: int) -> Any:
        middle = (first + last) // 2
        if middle == first:
            return values[first]
        return Where(Step(knots[middle] - x), chosen(first, middle), chosen(middle, last))

    return chosen(0, len(values))
