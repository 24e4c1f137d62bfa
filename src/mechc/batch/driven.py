"""Inputs given with a batch: signals that are the same for all members, numbers that may differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.inputs.accept import accepted_inputs
from mechc.inputs.bind import functions_of
from mechc.inputs.driven_scene import with_inputs
from mechc.inputs.sampled import Sampled, with_held
from mechc.inputs.signals import Signal
from mechc.system.names import names_of
from mechc.system.parameters import Array
from mechc.system.system import System

Columns = Mapping[str, Any]  # name -> number, or one number a member


def cut(columns: Columns, first: int, last: int) -> dict[str, Any]:
    """The columns of members first ... last - 1."""
    return {name: c[first:last] if np.ndim(c) else c for name, c in columns.items()}


class BatchInputs(NamedTuple):
    """Numbers by name, arrays () or (n,), signals, functions of Python, and controllers by the
    names of their inputs, one for all members or one for each.

    ``left_behind``: names of inputs that were functions in the process of the batch, and are not
    known in this one.
    """

    numbers: Mapping[str, Array]
    signals: Mapping[str, Signal]
    functions: Mapping[str, Any] = MappingProxyType({})
    controllers: Mapping[tuple[str, ...], Sequence[Sampled]] = MappingProxyType({})
    left_behind: tuple[str, ...] = ()

    def cut(self, first: int, last: int) -> BatchInputs:
        """The inputs of members first ... last - 1."""
        controllers = {
            names: c[first:last] if len(c) > 1 else c for names, c in self.controllers.items()
        }
        return self._replace(numbers=cut(self.numbers, first, last), controllers=controllers)

    def with_signals(self, span: tuple[float, float]) -> BatchInputs:
        """The inputs of one member, with a signal to be filled in place of each controller."""
        given = {names: several[0] for names, several in self.controllers.items()}
        signals, _ = with_held(given, span)
        return self._replace(signals={**self.signals, **signals}, controllers={})

    @property
    def calls_python(self) -> bool:
        """Whether any of them is a function of this process."""
        return bool(self.functions or self.controllers)

    @property
    def own(self) -> dict[str, Array]:
        """The numbers that differ between members."""
        return {name: column for name, column in self.numbers.items() if np.ndim(column)}

    @property
    def controlled(self) -> tuple[str, ...]:
        """The inputs that controllers give."""
        return tuple(name for names in self.controllers for name in names)

    def without_functions(self, known: Mapping[str, Any]) -> BatchInputs:
        """The inputs that another process can have, beside those known to its model."""
        lost = [name for name, value in self.functions.items() if value is not known.get(name)]
        names = (*self.left_behind, *lost, *self.controlled)
        return self._replace(functions={}, controllers={}, left_behind=names)

    def of(self, member: int) -> dict[str, Any]:
        """The inputs of one member; 0 where it has a controller.

        Raises :class:`MechcError` where some were left behind.
        """
        if self.left_behind:
            raise MechcError(
                f"{', '.join(self.left_behind)}: inputs that are functions or controllers are not "
                "kept with a batch that is pickled or copied: simulate the member with "
                "model.simulate(..., inputs=...)"
            )
        numbers = {n: float(c[member] if np.ndim(c) else c) for n, c in self.numbers.items()}
        return {**numbers, **self.signals, **self.functions, **dict.fromkeys(self.controlled, 0.0)}


NONE = BatchInputs({}, {})


def checked_inputs(system: System, given: Mapping[str, Any] | None) -> BatchInputs:
    """Inputs of a batch, besides those that the model was given before.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for unknown names, and numbers
    that are not finite.
    """
    named_inputs = {} if given is None else given
    if not isinstance(named_inputs, Mapping):
        raise TypeError(f"inputs are given by name, not as {brief(given)}")
    if system.driven is None:
        for name in named_inputs:
            raise UnknownNameError("input", name, system.inputs)
        return NONE
    controllers = {k: c for k, x in named_inputs.items() if (c := _controllers(x))}
    others = {key: value for key, value in named_inputs.items() if key not in controllers}
    every = {**system.driven.given, **accepted_inputs(others, system)}
    signals = {name: value for name, value in every.items() if isinstance(value, Signal)}
    functions = {name: value for name, value in every.items() if functions_of(value)}
    known = {*signals, *functions}
    numbers = {n: _numbers(n, value) for n, value in every.items() if n not in known}
    named = {tuple(names_of(key)): several for key, several in controllers.items()}
    return BatchInputs(numbers, signals, functions, named)


def _controllers(given: Any) -> tuple[Sampled, ...]:
    """One controller for all members, or one for each; none for anything else."""
    if isinstance(given, Sampled):
        return (given,)
    several = isinstance(given, (tuple, list)) and all(isinstance(x, Sampled) for x in given)
    return tuple(given) if several else ()


def _numbers(name: str, value: Any) -> Array:
    try:
        column = np.array(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        column = np.full(1, np.nan)
    if column.ndim > 1 or not np.isfinite(column).all():
        raise ValueOutOfBoundsError(
            f"the input {name} must be a finite number, one a member, samples (times, values) or "
            f"a mechc.Signal, not {brief(value)}"
        )
    return np.ascontiguousarray(column) if column.ndim else column


def driven_by(system: System, inputs: BatchInputs) -> System:
    """The system with the inputs of the first member."""
    return with_inputs(system, inputs.of(0)) if system.driven is not None else system


def check_driven(system: System, inputs: BatchInputs, times: Array, assembled: bool) -> None:
    """Refuse inputs that the scene cannot have, or not at these times.

    Raises :class:`MissingInputError`, :class:`ValueOutOfBoundsError`, :class:`MechcError` if one is
    missing, too rough, or not known at a time; if members are assembled with different numbers in
    their constraints.
    """
    if system.driven is None or any(np.size(c) == 0 for c in inputs.own.values()):
        return
    driven: Any = driven_by(system, inputs).driven
    driven.check_times(times)
    if assembled and (names := driven.of_time(list(inputs.own))):
        raise MechcError(
            f"{', '.join(names)} differ between members, and constraints contain them: give "
            "states, from model.assemble for each member, instead of coordinates to assemble"
        )


def own_numbers(system: System, inputs: BatchInputs, count: int) -> tuple[Array, Any]:
    """The inputs that differ between members (n, k), and the places of their signals (k,)."""
    own, driven = inputs.own, system.driven
    numbers = np.zeros((count, len(own)))
    for i, column in enumerate(own.values()):
        numbers[:, i] = column
    places = np.zeros(0) if driven is None else driven.places(list(own))
    return numbers, np.asarray(places, np.intc)


def evaluate_output(
    system: System, inputs: BatchInputs, name: str, states: Array, values: Array, times: Array,
    forces: Array | None,
) -> Array:  # fmt: skip
    """An output at states (n, nt, nq + nu) of members with parameters (n, nt or 1, np), with the
    ``forces`` of contacts (n, nt, nu)."""
    if system.driven is None or not inputs.own or system.driven.is_free(name):
        return system.evaluate(name, states, values, times, forces)
    rows = [
        with_inputs(system, inputs.of(k)).evaluate(
            name, states[k], values[k], times[k], None if forces is None else forces[k]
        )
        for k in range(len(states))
    ]
    return np.array(rows)
