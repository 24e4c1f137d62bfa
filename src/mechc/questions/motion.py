"""The motion as a function of unknown numbers: its arguments, one motion, a batch of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Number
from typing import Any

import numpy as np

from mechc.assembly.initial_values import Assembly, closed_freedoms, filled_start, guess_of_start
from mechc.errors import ValueOutOfBoundsError, brief
from mechc.questions.unknowns import INPUT, PARAMETER, START, Unknown
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System
from mechc.system.units import in_si


@dataclass(frozen=True)
class Arguments:
    """Arguments of a motion; in a batch values may be columns, one number for each member.

    Attributes
    ----------
    params, inputs
        By name.
    start
        Coordinates and speeds by name, a state (..., nq + nu), or None: the model's own.
    guess
        Coordinates near the assembly wanted.
    """

    params: Mapping[str, Any]
    start: Any
    inputs: Mapping[str, Any]
    guess: Mapping[str, float]

    def values_of(self, kind: str) -> Mapping[str, Any]:
        """The given values of a kind of unknowns, by name."""
        start: Mapping[str, Any] = self.start if isinstance(self.start, Mapping) else {}
        return {PARAMETER: self.params, INPUT: self.inputs, START: start}[kind]

    def with_values(
        self, unknowns: Sequence[Unknown], x: Any, states: Sequence[str] = ()
    ) -> Arguments:
        """These arguments with the values of unknowns: numbers, or columns of numbers.

        ``states``: the names of a state's components, where the start is one.
        """
        found: dict[str, dict[str, Any]] = {PARAMETER: {}, INPUT: {}, START: {}}
        for one, value in zip(unknowns, x, strict=True):
            found[one.kind][one.name] = value if np.ndim(value) else float(value)
        start = self.start
        if isinstance(start, np.ndarray) and found[START]:
            columns = dict(enumerate(np.moveaxis(start, -1, 0)))
            columns |= {states.index(name): value for name, value in found[START].items()}
            start = np.stack(np.broadcast_arrays(*columns.values()), axis=-1)
        elif not isinstance(start, np.ndarray):
            start = {**(start or {}), **found[START]}
        return replace(
            self, params={**self.params, **found[PARAMETER]}, start=start,
            inputs={**self.inputs, **found[INPUT]},
        )  # fmt: skip

    def driven(self, model: Any) -> Any:
        """The model driven by the inputs."""
        return model.with_inputs(self.inputs) if self.inputs else model

    def state(self, model: Any, t: float) -> Array:
        """The state of the start (nq + nu,).

        Raises :class:`AssemblyError` if its loops do not close.
        """
        if not isinstance(self.start, Mapping):
            return np.asarray(self.start)
        rest, speeds, guess = self.assembly(model.system, own=False)
        return np.asarray(model.assemble(rest, speeds, guess or None, self.params, t))

    def assembly(
        self, system: System, own: bool
    ) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """Coordinates, speeds and a guess to assemble from; ``own``: what is not given follows the
        model's own start."""
        rest, speeds = system.coordinates_and_speeds(self.start or {})
        if own:
            return filled_start(system, rest, speeds, self.guess)
        guess = self.guess
        if not guess and len(rest) >= closed_freedoms(system, rest):  # as Model.assemble
            guess = guess_of_start(system, rest)
        return dict(rest), dict(speeds), dict(guess)


@dataclass(frozen=True)
class MotionFunction:
    """The motion of a model as a function of unknown numbers x (k,).

    Attributes
    ----------
    model
        The :class:`mechc.Model`.
    unknowns
        What x stands for.
    given
        What is not unknown, and where the unknowns are among it.
    policy
        Keywords of ``simulate``.
    member
        Which of several motions with some unknowns in common it is.
    """

    model: Any
    unknowns: Sequence[Unknown]
    given: Arguments
    policy: Mapping[str, Any]
    member: int = 0

    @property
    def mine(self) -> list[int]:
        """The places in x of what changes this motion."""
        return [k for k, one in enumerate(self.unknowns) if one.holds_for(self.member)]

    def arguments(self, x: Any) -> Arguments:
        """The arguments of the motion with values x (k,), or with columns, x (..., k)."""
        columns = np.moveaxis(np.asarray(x, dtype=np.float64), -1, 0)
        states = (*self.model.coordinates, *self.model.speeds)
        unknowns = [self.unknowns[k] for k in self.mine]
        return self.given.with_values(unknowns, columns[self.mine], states)

    def simulate(self, x: Any, span: Any, names: Sequence[str] = (), **more: Any) -> Any:
        """The motion for values x (k,), with derivatives by the names.

        Raises :class:`AssemblyError` if its loops do not close.
        """
        given = self.arguments(x)
        y0 = start = given.start
        if not isinstance(start, np.ndarray):
            near = given.assembly(self.model.system, self.given.start is None)
            y0 = start = {**near[0], **near[1]}
            if near[2]:
                model, t = given.driven(self.model), np.ravel(span)[0]
                y0 = model.assemble(*near, params=given.params, t=t)
        inputs = given.inputs or None
        sol = self.model.simulate(span, y0, given.params, inputs=inputs, **{**self.policy, **more})
        if names:
            sol.differentiate(names, start, given.params)
        return sol

    def batch(self, points: Array, span: Any, **more: Any) -> Any:
        """The motions for values (n, k), in one batch."""
        given = self.arguments(points)
        start: Any = given.start
        if isinstance(start, np.ndarray):
            start = np.broadcast_to(start, (len(points), start.shape[-1]))
        else:
            start = Assembly(*given.assembly(self.model.system, self.given.start is None))
        return self.model.simulate_batch(
            span, start, given.params, progress=False, inputs=given.inputs or None,
            **{**self.policy, **more},
        )  # fmt: skip


def params_by_name(system: System, params: Any) -> dict[str, Any]:
    """One set of parameters by name in SI units, from a mapping or an array of all.

    Raises :class:`ValueOutOfBoundsError` for several sets.
    """
    if params is not None and not isinstance(params, Mapping):
        values = system.parameter_set.resolve(params)
        if values.ndim != 1:
            raise ValueOutOfBoundsError("one set of parameters is needed")
        return dict(zip(system.parameters, values.tolist(), strict=True))
    found = by_name(params or {}, "params")
    for name, value in found.items():
        if name in system.quantities:
            found[name] = value = in_si(value, system.quantities[name])
        if np.ndim(value):
            raise ValueOutOfBoundsError(f"{name}: one value is needed, not {brief(value)}")
        if isinstance(value, Number) or getattr(value, "is_number", False):
            found[name] = float(value)
    return found
