"""Inputs given with a batch: signals that are the same for all members, numbers that may differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.inputs.accept import accepted
from mechc.inputs.driven_scene import with_inputs
from mechc.inputs.sampled import Sampled
from mechc.inputs.signals import Signal
from mechc.system.names import names_of
from mechc.system.parameters import Array
from mechc.system.system import System


class BatchInputs(NamedTuple):
    """Numbers by name, arrays () or (n,), signals, and controllers by the names of their inputs,
    one for all members or one for each."""

    numbers: Mapping[str, Array]
    signals: Mapping[str, Signal]
    controllers: Mapping[tuple[str, ...], Sequence[Sampled]] = MappingProxyType({})

    def cut(self, first: int, last: int) -> BatchInputs:
        """Those of members first ... last - 1."""
        rows = {n: c[first:last] if np.ndim(c) else c for n, c in self.numbers.items()}
        controllers = {
            names: c[first:last] if len(c) > 1 else c for names, c in self.controllers.items()
        }
        return BatchInputs(rows, self.signals, controllers)

    @property
    def own(self) -> dict[str, Array]:
        """The numbers that differ between members."""
        return {name: column for name, column in self.numbers.items() if np.ndim(column)}

    def of(self, member: int) -> dict[str, Any]:
        """What one member is given; 0 where it has a controller."""
        numbers = {n: float(c[member] if np.ndim(c) else c) for n, c in self.numbers.items()}
        controlled = (name for names in self.controllers for name in names)
        return {**numbers, **self.signals, **dict.fromkeys(controlled, 0.0)}


NONE = BatchInputs({}, {})


def checked_inputs(system: System, given: Mapping[str, Any] | None) -> BatchInputs:
    """Inputs of a batch, besides those that the model was given before.

    Raises
    ------
    UnknownNameError, ValueOutOfBoundsError
        For unknown names; for Python functions of time, which are called in single runs only; for
        numbers that are not finite.
    """
    slots = system.data.get("inputs", ())
    if system.driven is None:
        for name in given or {}:
            raise UnknownNameError("input", name, system.inputs)
        return NONE
    orders = {slot["name"]: max(slot["orders"]) for slot in slots}
    controllers = {k: c for k, x in dict(given or {}).items() if (c := _controllers(x))}
    others = {key: value for key, value in dict(given or {}).items() if key not in controllers}
    every = {**system.driven.given, **accepted(others, orders)}
    signals = {name: value for name, value in every.items() if isinstance(value, Signal)}
    numbers = {n: _numbers(n, value) for n, value in every.items() if n not in signals}
    named = {tuple(names_of(key)): several for key, several in controllers.items()}
    return BatchInputs(numbers, signals, named)


def _controllers(given: Any) -> tuple[Sampled, ...]:
    """One controller for all members, or one for each; none for anything else."""
    if isinstance(given, Sampled):
        return (given,)
    several = isinstance(given, (tuple, list)) and all(isinstance(x, Sampled) for x in given)
    return tuple(given) if several else ()


def _numbers(name: str, value: Any) -> Array:
    if callable(value) or (isinstance(value, (tuple, list)) and any(map(callable, value))):
        raise ValueOutOfBoundsError(
            f"the input {name} is a Python function, which a batch does not call: give a number, "
            "one a member, samples (times, values) or a mechc.Signal; or permanently an "
            "expression, with mechc.compile(..., inputs={...})"
        )
    try:
        column = np.asarray(value, dtype=np.float64)
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

    Raises
    ------
    MissingInputError, ValueOutOfBoundsError, MechcError
        If one is missing, too rough, or not known at a time; if members are assembled with
        different numbers in their constraints.
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


def in_segments(system: System, inputs: BatchInputs, span: tuple[float, float], rtol: float,
                count: int) -> Any:  # fmt: skip
    """What :class:`mechc.native._batch.Runs` takes; None for a scene without inputs."""
    if system.driven is None:
        return None
    own = inputs.own
    ends, values, places = system.driven.in_segments(*span, rtol, list(own))
    numbers = np.zeros((count, len(own)))
    for i, column in enumerate(own.values()):
        numbers[:, i] = column
    return ends, values, numbers, places


def evaluated(
    system: System, inputs: BatchInputs, name: str, states: Array, values: Array, times: Array
) -> Array:
    """An output at states (n, nt, nq + nu) of members with parameters (n, nt or 1, np)."""
    if system.driven is None or not inputs.own or system.driven.is_free(name):
        return system.evaluate(name, states, values, times)
    rows = [
        with_inputs(system, inputs.of(k)).evaluate(name, states[k], values[k], times[k])
        for k in range(len(states))
    ]
    return np.array(rows)
