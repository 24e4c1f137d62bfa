"""Branches of cycles through a parameter, by pseudo-arclength, with their special points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.periodic import report
from mechc.periodic.newton import NoCycleError, rounding, search
from mechc.periodic.repeats import UNEVEN, is_later_the_same, refuse_other_periods
from mechc.periodic.shooting import Shot
from mechc.simulation.settings import checked_count, checked_positive
from mechc.system.parameters import Array
from mechc.system.units import in_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLD, DOUBLING, BRANCHING, TORUS = "fold", "period doubling", "branching", "torus"
BEND = 0.9  # cosine of the angle between directions: below it the step is halved
ALONG = 0.999  # share of the flow that lies in these directions, where it is one of them
LEAST = 1e-5  # of the longest step
ITERATIONS = 8  # of Newton's method in one step
LOCATED = 1e-9  # of a step
APART = 1e-5  # of 1: multipliers nearer to it do not tell on which side they are


@dataclass(frozen=True)
class SpecialPoint:
    """A cycle at which stability changes.

    Attributes
    ----------
    kind
        ``"fold"``, ``"period doubling"``, ``"branching"``, ``"torus"``.
    value
        The parameter's.
    cycle
        The cycle there.
    """

    kind: str
    value: float
    cycle: Any

    def switch(self, size: float = 0.05) -> Any:
        """A cycle on the branch that begins here, of twice the period at a doubling.

        It is ``size`` off, in units of the sizes of coordinates and speeds, at another value of
        the parameter.

        Raises :class:`MechcError` at a fold and a torus, and where no cycle is found.
        """
        if self.kind not in (DOUBLING, BRANCHING):
            raise MechcError(f"no other branch of cycles begins at a {self.kind}")
        shot, twice = self.cycle.shot, 2 if self.kind == DOUBLING else 1
        problem = replace(
            shot.problem, repeated=twice * shot.problem.repeated, gain=twice * shot.problem.gain,
            tempo=twice * shot.problem.tempo,
        )  # fmt: skip
        way = self.cycle.direction(1.0 - 2.0 * (twice - 1))
        row = np.append(way / np.linalg.norm(way), np.zeros(2))
        trial = shot.trial._replace(period=twice * shot.trial.period)
        far = Shot(problem, trial, self.cycle.solution).after(size * row)
        try:
            return type(self.cycle)(search(problem, far, self.cycle.tol, 40, row), self.cycle.tol)
        except NoCycleError as error:
            raise MechcError(f"{error}. Try another size than {size:g}") from None

    def __str__(self) -> str:
        return f"{self.kind} at {self.cycle.shot.problem.parameter} = {self.value:.9g}"


@dataclass(frozen=True)
class CycleBranch:
    """Cycles in the order in which they follow each other; ``branch[3]`` is one of them.

    Attributes
    ----------
    parameter
        The name of what changes.
    cycles
        A :class:`Cycle` each.
    special
        The points at which stability changes, in order.
    ended
        Why the branch is not followed farther.
    """

    parameter: str
    cycles: tuple[Any, ...]
    special: tuple[SpecialPoint, ...]
    ended: str

    def __len__(self) -> int:
        return len(self.cycles)

    def __getitem__(self, number: int) -> Any:
        return self.cycles[number]

    def __iter__(self) -> Iterator[Any]:
        return iter(self.cycles)

    @property
    def values(self) -> Array:
        """Values (n,) of the parameter."""
        return np.array([cycle.shot.trial.value for cycle in self.cycles])

    @property
    def periods(self) -> Array:
        """Periods (n,), s."""
        return np.array([cycle.period for cycle in self.cycles])

    @property
    def stable(self) -> Array:
        """Whether each is stable (n,)."""
        return np.array([cycle.stable for cycle in self.cycles])

    @property
    def folds(self) -> tuple[SpecialPoint, ...]:
        return tuple(point for point in self.special if point.kind == FOLD)

    @property
    def doublings(self) -> tuple[SpecialPoint, ...]:
        return tuple(point for point in self.special if point.kind == DOUBLING)

    def plot(self, quantity: Any = None, *others: CycleBranch) -> Figure:
        """The largest value of a coordinate or speed in each cycle over the parameter, by default
        of the first coordinate, in one matplotlib figure: dashed where it is unstable."""
        return report.draw_branches((self, *others), quantity)

    def __str__(self) -> str:
        return report.branch_in_words(self)

    def __repr__(self) -> str:
        ends = f"{self.values.min():.6g} ... {self.values.max():.6g}"
        return f"<mechc.CycleBranch of {len(self)} cycles, {self.parameter} = {ends}>"


@dataclass(frozen=True)
class _Stage:
    """A cycle on a branch; ``like``: the direction (nq + nu + 2,) of the branch before it."""

    cycle: Any
    like: Array

    @cached_property
    def tangent(self) -> Array:
        """The direction of the branch in a trial's coordinates."""
        shot = self.cycle.shot
        _, sizes, rows = np.linalg.svd(shot.jacobian)
        rank = int((sizes > rounding(shot.problem) * sizes.max(initial=0.0)).sum())
        ways = np.linalg.qr(shot.columns[2] @ rows[rank:].T)[0]
        found = ways @ (ways.T @ self.like)
        flow = np.append(shot.flow / (np.linalg.norm(shot.flow) or 1.0), np.zeros(2))
        if shot.problem.autonomous and np.linalg.norm(ways.T @ flow) > ALONG:  # a shift in time
            found -= flow * (flow @ found)
        if not np.any(found):
            raise MechcError("no cycle is beside this one: hold less")
        return np.asarray(found / np.linalg.norm(found))

    def ahead(self, length: float) -> _Stage:
        """The stage a length farther; raises :class:`MechcError` where none is found."""
        return self.search_near(length * self.tangent, self.tangent)

    def search_near(self, change: Array, row: Array) -> _Stage:
        """The stage near a change of the trial's coordinates, as far along a row."""
        shot, tol = self.cycle.shot, self.cycle.tol
        near = search(shot.problem, shot.after(change), tol, ITERATIONS, row)
        return _Stage(type(self.cycle)(near, tol), self.tangent)

    @property
    def value(self) -> float:
        return float(self.cycle.shot.trial.value)


def follow(
    cycle: Any, parameter: str, ends: tuple[Any, Any], most: int, step: float
) -> CycleBranch:
    """See :meth:`mechc.periodic.cycle.Cycle.follow`."""
    most, step = checked_count("most", most), checked_positive("step", step)
    stages, ends = _begin(cycle, parameter, ends)
    special, length, ended = list[SpecialPoint](), step, f"{most} cycles"
    while len(stages) < most:
        try:
            new, last = _next(stages[-1], length, ends)
            found = _between(stages[-1], new)
        except MechcError as error:
            length, ended = 0.5 * length, str(error)
            if length < LEAST * step:
                break
            continue
        stages.append(new)
        special += found
        length, ended = min(1.3 * length, step), f"{most} cycles"
        if last:
            ended = "an end of the range"
            break
    return CycleBranch(parameter, tuple(stage.cycle for stage in stages), tuple(special), ended)


def _begin(
    cycle: Any, parameter: str, ends: tuple[Any, Any]
) -> tuple[list[_Stage], tuple[float, float]]:
    """The first stage, and the ends in SI units, of checked arguments."""
    system, shot = cycle.model.system, cycle.shot
    if parameter not in system.parameters:
        raise UnknownNameError("parameter", parameter, system.parameters)
    first, last = (float(in_si(value, system.quantities[parameter])) for value in ends)
    now = float(system.parameter_set.resolve(cycle.params)[system.parameters.index(parameter)])
    if not min(first, last) <= now <= max(first, last) or first == last:
        raise ValueOutOfBoundsError(
            f"{parameter} = {now:g} must lie within the ends of the branch, {first:g} and {last:g}"
        )
    problem = replace(
        shot.problem, params=cycle.params, parameter=parameter, width=abs(last - first)
    )
    if now == last:
        raise ValueOutOfBoundsError(
            f"{parameter} = {now:g} is already at the second end, towards which the branch begins"
        )
    trial = shot.trial._replace(value=now)
    beside = trial._replace(value=now + 1e-3 * (last - first))
    if problem.autonomous and not is_later_the_same(problem, beside, UNEVEN * trial.period):
        raise ValueOutOfBoundsError(
            f"time drives the motion where {parameter} is not {now:g}: begin with a cycle of the "
            "driven motion"
        )
    if problem.law is None:
        refuse_other_periods(problem, beside)
    towards = np.zeros(len(problem.size) + 2)
    towards[-1] = np.sign(last - first)
    own = type(cycle)(Shot(problem, trial, cycle.solution), cycle.tol)
    return [_Stage(own, towards)], (first, last)


def _next(stage: _Stage, length: float, ends: tuple[float, float]) -> tuple[_Stage, bool]:
    """The next stage, and whether it is at an end; raises :class:`MechcError` if it is too far."""
    new = stage.ahead(length)
    if new.tangent @ stage.tangent < BEND:
        raise MechcError("the branch bends more than steps are short")
    if min(ends) < new.value < max(ends):
        return new, False
    wanted = min(max(new.value, min(ends)), max(ends))
    row = np.zeros_like(new.tangent)
    row[-1] = 1.0
    change = (wanted - new.value) / new.cycle.shot.problem.width * row
    return new.search_near(change, row), True


# -- special points -------------------------------------------------------------------------------


def _between(one: _Stage, two: _Stage) -> list[SpecialPoint]:
    """The special points between two stages."""
    found = list[SpecialPoint]()
    for kind, test in TESTS.items():
        folds = any(point.kind == FOLD for point in found)
        if test(one) * test(two) < 0.0 and not (kind == BRANCHING and folds):
            found.append(_locate(kind, test, one, two))
    return found


def _locate(kind: str, test: Callable[[_Stage], float], one: _Stage, two: _Stage) -> SpecialPoint:
    """The point between two stages at which a test function is zero."""
    from scipy.optimize import brentq

    ends = [one.cycle.shot.problem.coordinates(stage.cycle.shot.trial) for stage in (one, two)]
    whole = float(one.tangent @ (ends[1] - ends[0]))
    try:
        length = brentq(
            lambda along: test(one.ahead(along) if along else one), 0.0, whole,
            xtol=LOCATED * whole,
        )  # fmt: skip
    except ValueError:  # the point is beyond the last of these stages, which is not quite ``two``
        raise MechcError(f"a {kind} could not be located") from None
    found = one.ahead(length)
    return SpecialPoint(kind, found.value, found.cycle)


def _from(stage: _Stage, critical: float) -> float:
    """The product of the multipliers' distances from 1 or -1; 0 where a 1 is too near to tell."""
    away = stage.cycle.multipliers - critical
    told = critical < 0.0 or np.abs(away).min(initial=1.0) > APART
    return float(np.prod(away).real) if told else 0.0


def _outside(stage: _Stage) -> float:
    """By how much the largest pair lies outside the unit circle; 0 where it is on it."""
    found = stage.cycle.multipliers
    largest = np.abs(found[np.abs(found.imag) > APART]).max(initial=0.0) - 1.0
    return float(largest) if APART < np.abs(largest) < 1.0 else 0.0


TESTS: dict[str, Callable[[_Stage], float]] = {
    FOLD: lambda stage: float(stage.tangent[-1]),
    DOUBLING: lambda stage: _from(stage, -1.0),
    BRANCHING: lambda stage: _from(stage, 1.0),
    TORUS: _outside,
}
