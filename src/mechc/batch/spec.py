"""The request of a batch, as plain data that can be divided, compared and sent."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.assembly.initial_values import Assembly
from mechc.batch.driven import NONE, BatchInputs, Columns, check_driven, cut
from mechc.batch.events import BatchEvents
from mechc.errors import AssemblyError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.simulation.settings import Policy
from mechc.system.names import by_name, without_unused
from mechc.system.parameters import Array, Parameters, doubles
from mechc.system.quantities import outputs_in
from mechc.system.system import System
from mechc.system.units import in_si

Chunk = tuple[int, dict[str, Array], bool]  # first member, arrays, whether complete
Compute = Callable[[Sequence[tuple[int, int]], Callable[[int], None]], Iterator[Chunk]]


@dataclass(frozen=True)
class Recipe:
    """A batch without its model: plain numbers, names and arrays.

    ``params``, ``coordinates`` and ``speeds`` hold columns: arrays () or (n,).  ``states`` is
    (nq + nu,), (n, nq + nu), or None where members are assembled.
    """

    count: int
    span: tuple[float, float]
    params: Columns
    states: Array | None
    coordinates: Columns
    speeds: Columns
    guess: Mapping[str, float]
    t_eval: Array
    keep_states: bool
    outputs: tuple[str, ...]
    reductions: tuple[str, ...]
    until: str
    policy: Policy
    inputs: BatchInputs = NONE
    events: BatchEvents | None = None
    sensitivities: tuple[str, ...] = ()
    sensitivity_error_control: bool = False

    def cut(self, first: int, last: int) -> Recipe:
        """Members first ... last - 1 only."""
        states = self.states
        if states is not None and states.ndim == 2:
            states = states[first:last]
        return replace(
            self,
            count=last - first,
            params=cut(self.params, first, last),
            coordinates=cut(self.coordinates, first, last),
            speeds=cut(self.speeds, first, last),
            states=states,
            inputs=self.inputs.cut(first, last),
        )

    def ranges(self, size: int) -> list[tuple[int, int]]:
        """First and last + 1 member of every chunk of a size."""
        return [(k, min(k + size, self.count)) for k in range(0, self.count, size)]

    def varying_columns(self) -> dict[str, Array]:
        """The columns that differ between members: parameters, coordinates, speeds, inputs."""
        every = {**self.params, **self.coordinates, **self.speeds, **self.inputs.numbers}
        return {name: column for name, column in every.items() if np.ndim(column)}

    def as_json(self) -> dict[str, Any]:
        """The recipe as JSON data: all that decides the results, with arrays by their hash."""
        policy = self.policy.as_dict()
        del policy["dense"]
        signals = {}
        for name, signal in sorted(self.inputs.signals.items()):
            words, arrays = signal.parts
            signals[name] = {**words, **{part: _hash(values) for part, values in arrays.items()}}
        driven = {"inputs": _columns_as_json(self.inputs.numbers), "signals": signals}
        return {
            **(driven if self.inputs != NONE else {}),
            **({} if self.events is None else {"events": self.events.as_json()}),
            **({"sensitivities": list(self.sensitivities)} if self.sensitivities else {}),
            **({"sensitivity_error_control": True} if self.sensitivity_error_control else {}),
            "members": self.count,
            "t_span": list(self.span),
            "params": _columns_as_json(self.params),
            "y0": _hash(self.states),
            "assembled coordinates": _columns_as_json(self.coordinates),
            "assembled speeds": _columns_as_json(self.speeds),
            "guess": dict(self.guess),
            "t_eval": _hash(self.t_eval),
            "keep_states": self.keep_states,
            "outputs": list(self.outputs),
            "reductions": list(self.reductions),
            "until": self.until,
            **{k: _hash(v) if isinstance(v, np.ndarray) else v for k, v in policy.items()},
        }


def _columns_as_json(columns: Columns) -> dict[str, Any]:
    return {n: _hash(c) if np.ndim(c) else float(c) for n, c in sorted(columns.items())}


def _hash(values: Array | None) -> str | None:
    if values is None:
        return None
    digest = hashlib.sha256(json.dumps(values.shape).encode())
    digest.update(np.ascontiguousarray(values).data)
    return digest.hexdigest()


def system_for_results(
    system: System, outputs: Sequence[str], reductions: Sequence[str], until: str | None,
    sensitivities: Sequence[str],
) -> System:  # fmt: skip
    """The system with all that the results of a batch need; see :meth:`System.including`."""
    texts = [*reductions, until if isinstance(until, str) else ""]
    names = [*outputs, *outputs_in(texts)]
    return system.differentiable(*names) if sensitivities else system.with_output(*names)


def checked_recipe(
    system: System,
    span: tuple[float, float],
    y0: Array | Assembly,
    params: Parameters,
    t_eval: Array,
    keep_states: bool,
    outputs: Sequence[str],
    reductions: Sequence[str],
    until: str,
    policy: Policy,
    given: BatchInputs,
) -> Recipe:
    """A recipe that names only what the model has, with columns of one length.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError`, :class:`MechcError` for wrong
    names, values, shapes and reductions.
    """
    from mechc.batch.reductions import read_reduction, read_stop

    if isinstance(y0, Mapping):
        y0 = Assembly(*system.coordinates_and_speeds(by_name(y0, "y0")))
    start = y0 if isinstance(y0, Assembly) else Assembly({})
    states = None if isinstance(y0, Assembly) else _checked_states(system, y0)
    columns = _checked_params(system, params)
    coordinates = _checked_columns(system, start.coordinates, system.coordinates, "coordinate")
    speeds = _checked_columns(system, start.speeds, system.speeds, "speed")
    guess = _checked_columns(system, start.guess, system.coordinates, "coordinate")
    for name in guess:
        if name in coordinates or np.ndim(guess[name]):
            raise AssemblyError(f"{name}: a guess is one number, for a coordinate not given")
    check_driven(system, given, np.append(t_eval, span), states is None)
    every = {**columns, **coordinates, **speeds, **given.numbers}
    every |= {"y0": states} if states is not None else {}
    for names, several in given.controllers.items():
        every |= {", ".join(names): np.zeros(len(several))} if len(several) > 1 else {}
    count = common_count(every)
    for text in reductions:
        read_reduction(system, text)
    if not isinstance(until, str) or until:
        read_stop(system, until)
    for name in outputs:
        if name not in system.scene.outputs:
            raise UnknownNameError("output", name, system.scene.outputs)
    if outputs and not len(t_eval):
        raise ValueOutOfBoundsError("outputs are evaluated at t_eval: give the times as well")
    return Recipe(
        count, span, columns, states, coordinates, speeds,
        {name: float(value) for name, value in guess.items()}, t_eval,
        keep_states and len(t_eval) > 0, tuple(outputs), tuple(reductions), until, policy, given,
    )  # fmt: skip


def _checked_states(system: System, y0: Array) -> Array:
    states = doubles(y0, "y0")
    if states.ndim not in (1, 2) or states.shape[-1] != system.scene.width:
        names = ", ".join((*system.coordinates, *system.speeds))
        raise ValueError(
            f"y0 must be states ({names}) of the shape ({system.scene.width},) or "
            f"(n, {system.scene.width}), or a mechc.Assembly; it has the shape {states.shape}"
        )
    system.attitudes.check(states)
    return states


def _checked_params(system: System, params: Parameters) -> dict[str, Array]:
    if params is None:
        params = {}
    if not isinstance(params, Mapping):
        table = np.asarray(system.parameter_set.resolve(params))
        params = {name: table[..., i] for i, name in enumerate(system.parameters)}
    known = without_unused(params, system.parameters, "params")
    columns = {
        name: _column(system.parameter_set.values_of(name, v), name) for name, v in known.items()
    }
    # parameters without a default must be given: checked here, for one member
    system.parameter_set.resolve({n: float(c.reshape(-1)[0]) for n, c in columns.items() if c.size})
    return columns


def _checked_columns(
    system: System, columns: Columns, known: tuple[str, ...], kind: str
) -> dict[str, Array]:
    checked = {}
    for name, values in by_name(columns, f"{kind}s", f"{{{known[0]!r}: 0.5}}").items():
        if name not in known:
            raise UnknownNameError(kind, name, known)
        given = in_si(values, system.quantities[name])
        try:
            checked[name] = _column(np.array(np.asarray(given, dtype=np.float64)), name)
        except (TypeError, ValueError, OverflowError):
            raise ValueOutOfBoundsError(f"{name} must be numbers, not {brief(values)}") from None
        if not np.isfinite(checked[name]).all():
            raise ValueOutOfBoundsError(f"{name} contains a number that is not finite")
    return checked


def _column(values: Array, name: str) -> Array:
    if values.ndim > 1:
        raise ValueOutOfBoundsError(
            f"{name} must be one number, or one a member, not an array of the shape {values.shape}"
        )
    return np.ascontiguousarray(values) if values.ndim else values


def common_count(every: Mapping[str, Array]) -> int:
    """The number of members, on which all that is given per member must agree."""
    counts = {
        name: len(values)
        for name, values in every.items()
        if (values.ndim == 2 if name == "y0" else values.ndim == 1)
    }
    if not counts:
        return 1
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} ({n})" for name, n in counts.items())
        raise ValueOutOfBoundsError(f"the numbers of members differ: {told}")
    return next(iter(counts.values()))
