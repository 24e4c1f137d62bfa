"""The problem by multiple shooting: what is unknown, cost and conditions, and their derivatives.

The horizon has equal intervals.  Unknown are the samples of the inputs, parameters, numbers of the
start, the duration, and the state at the end of every interval.  The motion of an interval begins
with the state before it, moved onto the closed loops, and has to end at the state after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechc.assembly.closed import Retraction
from mechc.inputs.signals import Signal
from mechc.optimal.terms import Points, Terms
from mechc.questions.motion import Arguments
from mechc.questions.unknowns import Unknown
from mechc.system.parameters import Array

LINEAR = "linear"
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Unknowns:
    """The vector x of all unknowns: its blocks, bounds and sizes.

    Attributes
    ----------
    controls
        Names of inputs that are found.
    parameters, start
        Parameters, and coordinates and speeds of the start, that are found.
    free
        Whether the duration is.
    samples, nodes, width
        Samples of each input, intervals, components of a state.
    lower, upper, size : (nx,)
        Bounds, and units of changes.
    """

    controls: tuple[str, ...]
    parameters: tuple[Unknown, ...]
    start: tuple[Unknown, ...]
    free: bool
    samples: int
    nodes: int
    width: int
    lower: Array = field(default_factory=lambda: np.zeros(0))
    upper: Array = field(default_factory=lambda: np.zeros(0))
    size: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def blocks(self) -> dict[str, Any]:
        """Places in x: controls (samples, n), parameters, start, duration, nodes (nodes, nx)."""
        shapes = {
            "controls": (self.samples, len(self.controls)),
            "parameters": (len(self.parameters),),
            "start": (len(self.start),),
            "duration": (int(self.free),),
            "nodes": (self.nodes, self.width),
        }
        found, first = {}, 0
        for name, shape in shapes.items():
            count = int(np.prod(shape))
            found[name] = first + np.arange(count).reshape(shape)
            first += count
        return found

    @property
    def sizes_of_state(self) -> Array:
        """Units of changes of the components of a state (nx,)."""
        return np.asarray(self.size[self.blocks["nodes"][0]])

    @property
    def count(self) -> int:
        return int(self.blocks["nodes"][-1, -1]) + 1


@dataclass(frozen=True)
class OptimalProblem:
    """All arguments are checked.

    Attributes
    ----------
    model, system
        The :class:`mechc.Model`, with the derivatives that are needed.
    unknowns
        See :class:`Unknowns`.
    given
        What is not found.
    t0, duration
        The begin, and the duration where it is given, s.
    kind
        Of the signals: ``"linear"`` or ``"previous"``.
    run
        Keywords of ``simulate``: events, rtol, method.
    integral, final, along, end
        Expressions: the cost over time and at the end (one or none each), bounds at the ends of all
        intervals, and conditions at the end.
    lower, upper : (rows,)
        Bounds of ``along``, and then those of ``end``.
    retraction
        Moves the states of all nodes but the last onto the loops.
    counts
        How many motions of an interval were computed, and how many with derivatives.
    """

    model: Any
    unknowns: Unknowns
    given: Arguments
    t0: float
    duration: float
    kind: str
    run: Mapping[str, Any]
    integral: Terms
    final: Terms
    along: Terms
    end: Terms
    lower: Array
    upper: Array
    retraction: Retraction = field(default_factory=lambda: Retraction(np.zeros(0), np.zeros(0)))
    counts: dict[str, int] = field(default_factory=lambda: {"motions": 0, "derivatives": 0})

    @property
    def system(self) -> Any:
        return self.model.system

    @property
    def of_states(self) -> bool:
        """Whether the integral depends on states between the ends of intervals."""
        return self.integral.of_state

    def read(self, x: Array) -> Choice:
        """The choice that the unknowns x (n,) stand for.

        Raises :class:`AssemblyError` if its start cannot be assembled.
        """
        unknowns, blocks = self.unknowns, self.unknowns.blocks
        duration = float(x[blocks["duration"]][0]) if unknowns.free else self.duration
        numbers = np.concatenate([x[blocks["parameters"]], x[blocks["start"]]])
        found = self.given.with_values((*unknowns.parameters, *unknowns.start), numbers)
        samples = x[blocks["controls"]]
        times = self.t0 + duration * (np.arange(unknowns.nodes + 1.0) / unknowns.nodes)
        signals = self._signals(times, samples)
        given = replace(found, inputs={**found.inputs, **signals})
        model = given.driven(self.model)
        p = model.system.parameter_set.resolve(given.params)
        return Choice(
            self, given, samples, duration, x[blocks["nodes"]], times, signals, model, p,
            given.state(model, self.t0),
        )  # fmt: skip

    def _signals(self, times: Array, samples: Array) -> dict[str, Signal]:
        """The inputs that are found, from their samples."""
        rows = samples if self.kind == LINEAR else np.vstack([samples, samples[-1:]])
        return {
            name: Signal(times, rows[:, k], self.kind, outside="hold", breaks="samples")
            for k, name in enumerate(self.unknowns.controls)
        }

    def row_bounds(self) -> tuple[Array, Array]:
        """Bounds of the conditions (rows,): no gaps between intervals, ``along``, ``end``."""
        count, m = self.unknowns.nodes, self.along.count
        gaps: Array = np.zeros(count * self.unknowns.width)
        lower, upper = (
            np.concatenate([gaps, np.tile(each[:m], count), each[m:]])
            for each in (self.lower, self.upper)
        )
        return lower, upper

    def row_sizes(self) -> Array:
        """Units of the conditions (rows,): of expressions half the width of their bounds, else
        what they are, 1 if that is 0; gaps have that of the state."""
        lower, upper = self.row_bounds()
        low, high = (np.where(np.isfinite(each), np.abs(each), 0.0) for each in (lower, upper))
        half = 0.5 * (upper - lower)
        found = np.where(np.isfinite(half) & (half > 0.0), half, np.maximum(low, high))
        return np.where(found > 0.0, found, 1.0)


@dataclass(frozen=True)
class Choice:
    """The motion that one choice of the unknowns stands for.

    Attributes
    ----------
    samples : (n, controls)
        Of the inputs that are found.
    given
        The arguments of the motion, with what is found.
    duration, nodes
        In s, and states (intervals, nx).
    times : (intervals + 1,)
        The ends of the intervals, s.
    signals, model
        The inputs that are found, and the model driven by all inputs.
    p : (np,)
        All parameters.
    y0 : (nx,)
        The state of the start.
    """

    problem: OptimalProblem
    given: Arguments
    samples: Array
    duration: float
    nodes: Array
    times: Array
    signals: dict[str, Signal]
    model: Any
    p: Array
    y0: Array

    @property
    def params(self) -> Mapping[str, Any]:
        """The parameters by name."""
        return self.given.params

    @property
    def length(self) -> float:
        """The length of an interval, s."""
        return float(self.duration / len(self.nodes))

    def input_values(self, k: Any, share: Any) -> tuple[Array, Array]:
        """Weights (n, 2) of the samples k and k + 1 at shares of intervals k (n,), and the values
        (n, controls) of the inputs that are found."""
        late = share if self.problem.kind == LINEAR else np.zeros_like(share)
        weights = np.stack([1.0 - late, late], axis=-1)
        after = np.minimum(k + 1, len(self.samples) - 1)
        values = weights[:, :1] * self.samples[k] + weights[:, 1:] * self.samples[after]
        return weights, values

    def points(self, k: Indices, share: Array, y: Array) -> Points:
        """States y (n, nx) at shares of intervals k (n,) as points of expressions."""
        system, duration = self.model.system, self.duration
        t = self.times[k] + share * self.length
        if self.problem.kind != LINEAR:  # at the end of an interval its own value, not the next
            t = np.where(share == 1.0, np.nextafter(t, -np.inf), t)
        r, found = np.zeros((len(t), len(system.inputs))), self.input_values(k, share)[1].T
        values = dict(zip(self.problem.unknowns.controls, found, strict=True))
        others = [name for name in system.inputs if name not in values]
        if others:
            values |= zip(others, system.driven.values(others, t, y), strict=True)
        for place, name in enumerate(system.inputs):
            r[:, place] = values[name]
        return Points(system, t, y, r, self.p, self.y0, duration)

    def points_of_nodes(self) -> Points:
        """The ends of all intervals as points of expressions."""
        count = len(self.nodes)
        return self.points(np.arange(count), np.ones(count), self.nodes)
