"""A problem of the suite: a mechanism, its start, and exact values of its motion.

Every tool gets the ``Problem``.  A tool integrates it in coordinates that suit it and returns the
quantities named in ``quantities`` at ``t_end``; their exact values, from a closed
form or from arithmetic of 30 digits or more, judge it.  No tool is judged by its own runs.
Tools that integrate equations take them from ``formulations.equations.equations_of(problem)``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mechc

Array = NDArray[np.float64]
Observe = Callable[[Array], Array]


WRONG = 0.1  # of a scale: beyond this it is another motion, not an inaccurate one


def whole_state(y: Array) -> Array:
    return y


class NotExpressibleError(Exception):
    """The reason why a tool cannot express a problem."""


@dataclass(frozen=True)
class Formulation:
    """Coordinates to integrate the scene in, for tools that are given equations.

    Parameters
    ----------
    mechanism
        As in :class:`Problem`; its parameters are called the same.
    start, observe
        The first state and the quantities of a state, coordinates then speeds in its order.
    accelerations
        Of coordinates, speeds, values by name, sine and cosine: the accelerations in the fewest
        operations known, written for any arithmetic; None where elimination gives them.
    """

    mechanism: Callable[[], Any]
    start: Array
    observe: Observe
    accelerations: Callable[..., Sequence[Any]] | None = None


@dataclass(frozen=True, eq=False)
class Problem:
    """A mechanism, its start and end, and the quantities compared.

    Parameters
    ----------
    mechanism
        Builds the ``mechc.Mechanism`` or the SymPy object that mechc compiles.
    start
        The whole first state, coordinates then speeds in the model's order.
    params
        Parameters that differ from the defaults.
    quantities, exact, scale
        Quantities compared at ``t_end``: names, exact values, and units of their errors.
    observe
        The quantities of a state, coordinates then speeds in the model's order; all by default.
    wrong
        Errors beyond it, in the scale, are those of another motion: a wrong branch.
    formulation
        Equations for tools that take equations, if the model's coordinates do not suit them best,
        or if a form by hand is shorter than that by elimination.
    shipped
        Name in the library, where the model is compiled already.
    stiff
        Explicit methods of interpreted code are not given it.
    note
        What makes it hard, or special; shown in the report.
    """

    name: str
    title: str
    mechanism: Callable[[], Any]
    start: Array
    t_end: float
    quantities: tuple[str, ...]
    exact: Array
    observe: Observe = whole_state
    scale: Array | float = 1.0
    wrong: float = WRONG
    formulation: Formulation | None = None
    params: Mapping[str, float] = field(default_factory=dict)
    compile_options: Mapping[str, Any] = field(default_factory=lambda: {"outputs": ()})
    shipped: str = ""
    stiff: bool = False
    note: str = ""

    @cached_property
    def model(self) -> mechc.Model:
        """Compiled at the first use, and then from the cache."""
        if self.shipped:
            return mechc.load(self.shipped)
        return mechc.compile(self.mechanism(), **self.compile_options)

    @property
    def given(self) -> Formulation:
        """The formulation for tools that take equations."""
        return self.formulation or Formulation(self.mechanism, self.start, self.observe)

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters by name."""
        model = self.model
        found = model.system.parameter_set.resolve(self.params)
        return dict(zip(model.parameters, map(float, found), strict=True))

    def error(self, observed: Array) -> float:
        """Largest difference of any quantity from its exact value, in its scale."""
        return float((np.abs(observed - self.exact) / self.scale).max())
