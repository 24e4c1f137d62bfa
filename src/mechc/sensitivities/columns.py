"""The columns of a sensitivity: parameters, inputs and starts that derivatives are taken by.

Every column is a direction: of the parameters (with those whose defaults follow), of the inputs'
values, of a value of a sampled signal, or of the start.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.inputs.samples import places_of_values, signal_of
from mechc.sensitivities.samples import Samples, samples_of, width
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System

START = "y0"
COMPONENT = re.compile(r"y0\[(\d+)\]\Z")


@dataclass(frozen=True)
class Columns:
    """Attributes
    ----------
    names
        As asked for; ``"y0"`` has one column for each component of the start, ``"y0[2]"`` that of
        component 2, an input that is a signal one for each sample, others have one.
    places
        Name -> its column, or columns.
    parameters : (np, k)
        How the parameters change with each column.
    inputs : (ni, k)
        How the values of inputs do.
    samples
        The columns that are by values of signals.
    held
        Parameters that the user gave: they do not follow others.
    """

    names: tuple[str, ...]
    places: Mapping[str, int | slice]
    parameters: Array
    inputs: Array
    samples: Samples | None = None
    held: Collection[str] = ()

    @property
    def count(self) -> int:
        return int(self.parameters.shape[1])

    @cached_property
    def directions(self) -> Array:
        """Parameters and then inputs, (np + ni, k)."""
        return np.ascontiguousarray(np.vstack([self.parameters, self.inputs]))

    @property
    def shapes(self) -> Any:
        """The changes of inputs as functions of time, for compiled code."""
        return self.samples and self.samples.shapes

    def for_system(self, system: System, wider: System) -> Columns:
        """The columns of a wider system for one that lacks some of its parameters and inputs."""
        return replace(
            self,
            parameters=self.parameters[[*map(wider.parameters.index, system.parameters)]],
            inputs=self.inputs[[*map(wider.input_values.index, system.input_values)]],
            samples=samples_of(system, self.places),
        )

    @cached_property
    def of_start(self) -> dict[int, int]:
        """The columns that are by components of the whole start -> these components."""
        found: dict[int, int] = {}
        for name, place in self.places.items():
            if name == START and isinstance(place, slice):
                found |= {column: k for k, column in enumerate(range(place.start, place.stop))}
            elif (one := COMPONENT.match(str(name))) is not None:
                assert isinstance(place, int)
                found[place] = int(one[1])
        return found

    def names_among(self, marked: Array) -> list[str]:
        """The names of which a column is marked, of (k,) flags."""
        if not marked.any():
            return []
        return [name for name in self.names if np.any(marked[self.places[name]])]

    def of(
        self, system: System, by_parameters: str, by_inputs: str, y: Array, values: Array, t: Any
    ) -> Array | None:
        """An array's derivative along the columns, (n, rows, k); None where none changes it."""
        parts = [
            system.evaluate(name, y, values, t) @ directions
            for name, directions in zip((by_parameters, by_inputs), self._changing, strict=True)
            if directions is not None and name in system.scene.outputs
        ]
        if self.samples is not None and by_inputs in system.scene.outputs:
            slopes = system.evaluate(by_inputs, y, values, t)
            parts.append(np.zeros((*slopes.shape[:-1], self.count)))
            self.samples.add(slopes, t, parts[-1])
        return sum(parts[1:], parts[0]) if parts else None

    def at_state(
        self, system: System, by_parameters: str, by_inputs: str, y: Array, values: Array, t: float
    ) -> Array | None:
        """An array's derivative along the columns at one state (nx,): (rows, k)."""
        if self.samples is None:
            return self.of(system, by_parameters, by_inputs, y, values, t)
        found = self.of(system, by_parameters, by_inputs, y[None], values, t)
        return None if found is None else np.asarray(found[0])

    @cached_property
    def _changing(self) -> tuple[Array | None, Array | None]:
        """Parameters and inputs; None where no column changes them."""
        parameters, inputs = self.parameters, self.inputs
        return parameters if parameters.any() else None, inputs if inputs.any() else None


def held_by(system: System, params: Any) -> Collection[str]:
    """The parameters among those that a user gave, by name or all of a system in an array."""
    by_names = params is None or isinstance(params, Mapping)
    return by_name(params or {}, "params") if by_names else system.parameters


def columns_of(
    system: System, names: Sequence[str], values: Array, held: Collection[str]
) -> Columns:
    """The columns of the names asked for; ``held``: parameters that do not follow others.

    Raises :class:`UnavailableOutputError` if the model cannot be compiled with sensitivities;
    :class:`UnknownNameError` for what is neither parameter, coordinate, speed nor input of the
    model; :class:`MechcError`, :class:`ValueOutOfBoundsError` for an input that is neither number
    nor signal, and for a sample or a component of the start that there is not.
    """
    system = system.differentiable()
    places: dict[str, int | slice] = {}
    count = 0
    for name in dict.fromkeys(names):
        several = system.scene.width if name == START else width(system, name)
        places[name] = count if several is None else slice(count, count + several)
        count += 1 if several is None else several
    along = np.zeros((len(system.parameters), count))
    pushed = np.zeros((int(system.scene.inputs), count))
    slopes = default_slopes(system, values, held)
    for name, place in places.items():
        if name in system.parameters:
            along[system.parameters.index(name), place] = 1.0
        elif signal_of(system, name) is None and name in system.inputs:
            pushed[_input_place(system, name), place] = 1.0
        elif not _of_start(system, name) and signal_of(system, name) is None:
            known = (*system.parameters, *system.coordinates, *system.speeds, *system.inputs, START)
            if name not in known:
                raise UnknownNameError("parameter, coordinate, speed or input", name, known)
    along = with_defaults(along, slopes)
    return Columns(tuple(places), places, along, pushed, samples_of(system, places), held)


def _of_start(system: System, name: str) -> bool:
    """Whether a name is the whole start, or a component of it."""
    one = COMPONENT.match(str(name))
    if one is not None and int(one[1]) >= system.scene.width:
        raise ValueOutOfBoundsError(
            f"{name}: a state has {system.scene.width} components, 0 to {system.scene.width - 1}"
        )
    return name == START or one is not None


def default_slopes(system: System, values: Array, held: Collection[str]) -> Array | None:
    """The slopes of parameters not held by the others, (..., np, np); None where none follows.

    Values (..., np)."""
    if "default_slopes" not in system.scene.outputs:
        return None
    slopes = system.evaluate("default_slopes", np.zeros(system.scene.width), values, 0.0).copy()
    fixed = {*system.reference.defaults, *held}.intersection(system.parameters)
    slopes[..., [*map(system.parameters.index, fixed)], :] = 0.0
    return slopes


def with_defaults(along: Array, slopes: Array | None) -> Array:
    """The change of all parameters along each column, where those not given follow
    their defaults."""
    if slopes is None:
        return along
    changes = along
    for _ in range(len(along)):  # a default may follow one that follows
        further = np.where(along != 0.0, along, slopes @ changes)
        if (further == changes).all():
            break
        changes = further
    return changes


def _input_place(system: System, name: str) -> int:
    """The place of an input's value among all values; refused unless it is a number."""
    assert system.driven is not None
    held = system.driven.given.get(name)
    if not isinstance(held, (int, float, np.integer, np.floating)):
        raise MechcError(
            f"the derivative by {name} needs a number or a signal for it: {name} is given as "
            f"{type(held).__name__}"
        )
    for place, order in places_of_values(system, name):
        if order == 0:
            return place
    raise MechcError(f"the equations contain only rates of {name}: a number has none")
