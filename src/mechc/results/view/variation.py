"""A run with some of its values given anew: parameters, the start, inputs that are numbers.

Input: the arguments of ``simulate`` and ranges by name.  Output: a Solution for any values in them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.questions.motion import Arguments, MotionFunction, params_by_name
from mechc.questions.unknowns import Unknown, kinds_of
from mechc.results.player.sliders import checked_range, slider_data
from mechc.results.sampling import shown_unit
from mechc.system.names import by_name
from mechc.system.parameters import doubles

MOST: Final = 40
EXAMPLE: Final = "{name or symbol: (lowest, highest)}"


@dataclass(frozen=True)
class Variation:
    """``model.simulate(t_span, y0, params, inputs=..., **policy)`` and ranges of values in it."""

    function: MotionFunction
    t_span: Any
    ranges: Mapping[str, tuple[float, float]]

    @property
    def model(self) -> Any:
        """The :class:`mechc.Model`."""
        return self.function.model

    def simulate(self, values: Mapping[str, float]) -> Any:
        """The run with these values, whose names are among the ranges."""
        some = [one for one in self.function.unknowns if one.name in values]
        function = replace(self.function, unknowns=some)
        return function.simulate([values[one.name] for one in some], self.t_span)

    @cached_property
    def first(self) -> Any:
        """The run with the values as they were given."""
        return self.simulate({})

    @cached_property
    def values(self) -> dict[str, float]:
        """The value that was given, or follows by default, for each name of the ranges.

        Raises :class:`ValueOutOfBoundsError` if a value is not within its range.
        """
        values = self.values_of(self.first)
        for name, value in values.items():
            low, high = self.ranges[name]
            if not low <= value <= high:
                raise ValueOutOfBoundsError(
                    f"{name} is {value:g} at first, which is not between {low:g} and {high:g}"
                )
        return values

    def values_of(self, solution: Any) -> dict[str, float]:
        """The value in a run for each name of the ranges; of inputs as they were given."""
        parameters = dict(zip(self.model.parameters, solution.params, strict=True))
        start = dict(zip(self._states, solution.y[0], strict=True))
        known = {**start, **parameters, **self.function.given.inputs}
        return {name: float(known[name]) for name in self.ranges}

    @property
    def _states(self) -> tuple[str, ...]:
        return (*self.model.coordinates, *self.model.speeds)

    def sliders(self) -> list[dict[str, Any]]:
        """The sliders, for each name a label, a unit, and the range in units of the API."""
        words = self.model.descriptions
        return [
            slider_data(name, shown_unit(self.model, name), ends, words.get(name, ""))
            for name, ends in self.ranges.items()
        ]


def variation(
    model: Any, t_span: Any, y0: Any, params: Any, sliders: Any, policy: Mapping[str, Any]
) -> Variation:
    """The variation by ``sliders``: names or symbols to their ranges (lowest, highest).

    Raises :class:`UnknownNameError` for a name that is no parameter, coordinate, speed or input
    that is a number; :class:`ValueOutOfBoundsError` for a range that is none.
    """
    ranges = {
        name: checked_range(name, given)
        for name, given in by_name(sliders, "sliders", EXAMPLE).items()
    }
    if len(ranges) > MOST:
        raise ValueOutOfBoundsError(f"there are at most {MOST} sliders, not {len(ranges)}")
    rest = dict(policy)
    inputs = by_name(rest.pop("inputs", None) or {}, "inputs")
    numbers = [name for name, value in inputs.items() if isinstance(value, (int, float))]
    kinds = kinds_of(model.system, numbers)
    for name in ranges:
        if name not in kinds:
            raise UnknownNameError("parameter, coordinate, speed or constant input", name, kinds)
    start = by_name(y0, "y0") if isinstance(y0, Mapping) else doubles(y0, "y0")
    given = Arguments(params_by_name(model.system, params), start, inputs, {})
    unknowns = [Unknown(name, kinds[name], *ends, np.nan) for name, ends in ranges.items()]
    return Variation(MotionFunction(model, unknowns, given, rest), t_span, ranges)
