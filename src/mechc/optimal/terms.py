"""Costs and conditions as expressions: their values along a motion, and their derivatives.

An expression is over time, the state, inputs, parameters, numbers of outputs (``points[2,0]``), the
state at the start (``v[0]``) and the duration.  SymPy differentiates it; outputs have their
compiled derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mechc.compilation.event_tapes import typed_expression
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.inputs.samples import places_of_values
from mechc.simulation.events.expressions import EventReader, StateNames, as_written, function_of
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.quantities import (
    ELEMENT,
    NAME,
    Quantity,
    index_of,
    read_quantity,
    shape_of,
    slopes_of,
    values_of,
)
from mechc.system.quantity import SUMS
from mechc.system.system import System

DURATION = "duration"


class Points(NamedTuple):
    """Where expressions are evaluated: t (n,), y (n, nx), inputs r (n, ni), parameters p (np,), the
    state at the start (nx,), the duration in s, and the system driven by the inputs."""

    system: System
    t: Array
    y: Array
    r: Array
    p: Array
    start: Array
    duration: float

    def take(self, places: slice) -> Points:
        """Some of the points."""
        return self._replace(t=self.t[places], y=self.y[places], r=self.r[places])


class Slopes(NamedTuple):
    """Values (n, m) of m expressions at n points, and derivatives: by time (n, m), state
    (n, m, nx), inputs (n, m, ni), parameters (n, m, np), start (n, m, nx), duration (n, m)."""

    values: Array
    by_time: Array
    by_state: Array
    by_inputs: Array
    by_parameters: Array
    by_start: Array
    by_duration: Array


class Terms:
    """Expressions of one model.

    Parameters
    ----------
    system
        With the derivatives of all outputs of ``entries``.
    texts
        The expressions as they were given.
    entries, starts
        The numbers of outputs in them, and the components of the start, by the name that stands for
        each.
    """

    def __init__(
        self, system: System, texts: Sequence[Any], entries: Mapping[str, Quantity],
        starts: Mapping[str, int],
    ) -> None:  # fmt: skip
        self.inputs, self.entries = system.inputs, tuple(entries.values())
        self.starts = [*starts.values()]
        state = (*system.coordinates, *system.speeds)
        known = (*state, *system.inputs, *system.parameters)
        last = f"the {DURATION}" if DURATION in known else DURATION
        self.nx, self.np = len(state), len(system.parameters)
        extra = (*system.inputs, *entries, *starts, last)
        names = StateNames((*system.coordinates,), (*system.speeds, *extra), system.parameters)
        self._reader = EventReader(names, np.zeros(self.np), typed_expression)
        self.expressions = [self._reader.plain(_with_stand_ins(system, text)) for text in texts]
        self.titles = [as_written(text) for text in texts]

    @property
    def count(self) -> int:
        return len(self.expressions)

    def at(self, points: Points) -> Array:
        """Values (n, m)."""
        return self._evaluate(self._values, points, self._extended_states(points))

    def linear(self, points: Points) -> Slopes:
        """Values and derivatives."""
        extended = self._extended_states(points)
        whole = np.zeros((len(points.t), self.count, 1 + extended.shape[1] + self.np))
        places, function = self._slopes
        whole[:, *places] = self._evaluate(function, points, extended)
        sizes = [1, self.nx, len(self.inputs), len(self.entries), len(self.starts), 1]
        parts = np.split(whole, np.cumsum(sizes), axis=-1)
        by_time, by_state, by_inputs, of_entries, of_starts, by_duration, by_parameters = parts
        if self.entries:
            each = self._of_entries(points)
            chained = [np.einsum("nme,nei->nmi", of_entries, one) for one in each]
            by_state = by_state + chained[0]
            by_inputs, by_parameters = by_inputs + chained[1], by_parameters + chained[2]
        by_start = np.zeros((*whole.shape[:2], self.nx))
        by_start[..., self.starts] = of_starts
        return Slopes(
            self._evaluate(self._values, points, extended), by_time[..., 0], by_state, by_inputs,
            by_parameters, by_start, by_duration[..., 0],
        )  # fmt: skip

    @property
    def of_state(self) -> bool:
        """Whether an expression depends on coordinates, speeds or outputs."""
        free = {s.name for e in self.expressions for s in e.free_symbols}
        width = self.nx + len(self.inputs)
        of_state = {f"y{k}" for k in (*range(self.nx), *range(width, width + len(self.entries)))}
        return bool(free & of_state)

    # -- how they are evaluated -------------------------------------------------------------------

    @property
    def _names(self) -> list[Any]:
        """The symbols: time, the state with what extends it, parameters."""
        names = list(self._reader.names.values())
        return [names[0], *names[1 + self.np :], *names[1 : 1 + self.np]]

    @cached_property
    def _values(self) -> Any:
        return function_of(self.expressions)

    @cached_property
    def _slopes(self) -> tuple[tuple[Any, Any], Any]:
        """The places (rows, columns) of the derivatives that are not zero, and their function."""
        found = [(i, j, e.diff(x)) for i, e in enumerate(self.expressions)
                 for j, x in enumerate(self._names) if e.has(x)]  # fmt: skip
        rows, columns = (np.array([one[k] for one in found], np.intp) for k in (0, 1))
        return (rows, columns), function_of([one[2] for one in found])

    @staticmethod
    def _evaluate(function: Any, points: Points, extended: Array) -> Array:
        found = function(points.t, extended.T, points.p)
        rows = [np.broadcast_to(one, points.t.shape) for one in found]
        return np.stack(rows, axis=-1) if rows else np.zeros((len(points.t), 0))

    def _extended_states(self, points: Points) -> Array:
        """States with inputs, numbers of outputs, the start and the duration (n, ...)."""
        same = np.append(points.start[self.starts], points.duration)
        last = np.tile(same, (len(points.t), 1))
        numbers = values_of(self.entries, points.system, points.y, points.p, points.t)
        return np.hstack([points.y, points.r, numbers, last])

    def _of_entries(self, points: Points) -> tuple[Array, Array, Array]:
        """Derivatives of the numbers of outputs by states, inputs and parameters (n, ne, ...)."""
        system, at = points.system, (points.system, points.y, points.p, points.t)
        by_state, by_values, by_parameters = (
            slopes_of(self.entries, by, *at) for by in ("state", "input", "parameter")
        )
        by_inputs = np.zeros((*by_state.shape[:2], len(self.inputs)))
        for k, name in enumerate(self.inputs):
            for place, order in places_of_values(system, name):
                if order == 0:
                    by_inputs[..., k] = by_values[..., place]
        return by_state, by_inputs, by_parameters


def read_terms(system: System, texts: Sequence[Any]) -> tuple[System, Terms]:
    """Expressions as they were given, and the system with the derivatives of their outputs.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError`, :class:`ExpressionError` for
    names that the model does not have, indices that there are not, and texts that are not of the
    grammar; :class:`UnavailableOutputError` for outputs that cannot be compiled.
    """
    states = (*system.coordinates, *system.speeds)
    asked = dict.fromkeys((m[1], m[2].strip()) for text in texts if isinstance(text, str)
                          for m in ELEMENT.finditer(text))  # fmt: skip
    starts = {_stand_in(system, *one): states.index(one[0]) for one in asked if one[0] in states}
    for name, index in asked:
        if name in states and index != "0":
            raise ValueOutOfBoundsError(f"{name}[0] is the value at the start, the only one known")
    names = {name for text in texts for name in _names_in(text)}
    known = (*states, *system.inputs, *system.parameters)
    if DURATION in names.intersection(known):
        raise ValueOutOfBoundsError(
            f"{DURATION} is that of the motion, and what {system.name} calls so: give the latter "
            "another name where the model is made"
        )
    numbers = [one for one in asked if one[0] not in states]
    used = names - {"t", DURATION, *known}
    system = system.differentiable(*used, *(name for name, _ in numbers))
    single = sorted(used & {*SUMS, *system.derivative_rows})
    written = {name: name for name in single}
    written |= {_stand_in(system, *one): f"{one[0]}[{one[1]}]" for one in numbers}
    entries = {
        stand_in: read_quantity(system, text, differentiable=True)
        for stand_in, text in written.items()
    }
    return system, Terms(system, texts, entries, starts)


def _names_in(text: Any) -> set[str]:
    if isinstance(text, str):
        return set(NAME.findall(ELEMENT.sub("", text)))
    return {name_of(one) for one in getattr(text, "free_symbols", ())}


def _stand_in(system: System, name: str, typed: str) -> str:
    """The name that stands for a number of an output, or for a component of the start."""
    index: Sequence[int] = (0,)
    if name not in (*system.coordinates, *system.speeds):
        index = index_of(system, name, shape_of(system, name, differentiable=True), typed)
    return "_".join(["number", name, *map(str, index)])


def _with_stand_ins(system: System, text: Any) -> Any:
    """A text with names in place of numbers of outputs and of the start."""
    if not isinstance(text, str):
        return text
    return ELEMENT.sub(lambda m: _stand_in(system, m[1], m[2]), text)


def refuse_rates(system: System, name: str) -> None:
    """Raise :class:`MechcError` if the equations contain rates of an input that is to be found."""
    if any(order for _, order in places_of_values(system, name)):
        raise MechcError(
            f"the equations contain rates of {name}, of which no signal with kinks is found: "
            "describe it as a state whose rate is an input, states={...}"
        )
