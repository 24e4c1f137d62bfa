"""Differences between ways to the same numbers, and how large they may be."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import mechc

from ..timing.cases import Array
from .reference import Reference
from .scene import Numbers, Scene

RTOL = 1e-9
SHARE = 300.0  # of a tolerance times the growth: the sum over all steps of a run
SHIFT = 1e-7  # of a start, for the growth
TOLD = 1e-2  # a limit above tells nothing
MOST_STEPS = 10_000  # of a motion that is compared: a thousand are usual
POINTS = 7  # times that are compared
PLACES = (0, 2, 4)  # at which a motion is disturbed


class Difference(NamedTuple):
    """What a door gave beside what it should; ``told``: of what."""

    door: str
    size: float
    allowed: float
    told: str = ""

    @property
    def fails(self) -> bool:
        return not self.size <= self.allowed


class Fault(NamedTuple):
    """A door that gave no number where others do."""

    door: str
    told: str


Told = Difference | Fault


@dataclass
class Run:
    """One set of numbers: its start, its motion by ``dop853`` and the growth of a disturbance."""

    numbers: Numbers
    y0: Array
    states: Array | None = None
    growth: float = 1.0
    ended: str = ""  # why it has no states
    status: str = ""  # of a motion that ends early

    @property
    def params(self) -> dict[str, float]:
        """Values of all parameters that the model has."""
        return self.numbers.params


@dataclass
class Case:
    """A compiled scene with its reference and its runs."""

    scene: Scene
    names: dict[str, Any]
    model: mechc.Model
    reference: Reference
    rng: np.random.Generator
    times: Array
    runs: list[Run] = field(default_factory=list)

    @property
    def more(self) -> dict[str, Any]:
        """Keywords of all runs."""
        return {"events": self.names["events"]} if "events" in self.names else {}

    @property
    def span(self) -> tuple[float, float]:
        """The begin and the end of all runs, in s."""
        return 0.0, float(self.times[-1])

    @property
    def whole(self) -> list[Run]:
        """The runs that last."""
        return [run for run in self.runs if run.states is not None]

    @property
    def order(self) -> list[int]:
        """Where the model's states stand among the reference's."""
        model = (*self.model.coordinates, *self.model.speeds)
        return [self.reference.names.index(name) for name in model]

    def to_reference(self, y: Array) -> Array:
        """A state of the model in the reference's order."""
        found = np.empty_like(y)
        found[..., self.order] = y
        return found

    def moved(self, run: Run, y: Array, t: float, direction: Array) -> Array:
        """A state beside another, on the constraints."""
        there = self.to_reference(y)
        along = self.reference.along(t, there, run.params, self.to_reference(direction))
        found: Array = self.reference.closed(t, there + along, run.params)[self.order]
        return found


def apart(found: Array, expected: Array) -> float:
    """The largest difference, of a component of the size 1 or of its largest value."""
    if found.shape != expected.shape or not np.isfinite(found).all():
        return float("inf")
    scale = np.maximum(1.0, np.abs(expected).max(axis=0))
    return float((np.abs(found - expected) / scale).max())


def allowed(run: Run, *tolerances: float) -> float:
    """For two motions by these tolerances."""
    return SHARE * sum(tolerances) * run.growth


def growth(case: Case, run: Run) -> float:
    """The largest growth of small disturbances of the motion, from its start and from within."""
    assert run.states is not None
    times, rng = case.times, case.rng
    most, scale = 1.0, np.maximum(1.0, np.abs(run.states).max(axis=0))
    for k in PLACES:
        direction = SHIFT * rng.choice([-1.0, 1.0], len(scale)) * scale
        found = None
        for along in (direction, -direction):  # one of which leaves a contact
            moved = case.moved(run, run.states[k], float(times[k]), along)
            with suppress(mechc.ValueOutOfBoundsError):  # the parts overlap
                found = case.model.simulate(
                    (times[k], times[-1]), moved, run.params, rtol=1e-11, method="dop853",
                    t_eval=times[k:], dense=False, max_steps=2 * MOST_STEPS, **case.more,
                )  # fmt: skip
                break
        if found is None:
            continue
        if not found.status.ok:
            return float("inf")
        most = max(most, apart(found.y, run.states[k:]) / SHIFT)
    return most
