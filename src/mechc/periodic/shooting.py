"""Shooting: a motion over one period, what it lacks of its return, and the derivatives of both.

The unknowns are independent coordinates and speeds of the start, the period where it is free, and
the parameter that is followed.  The other components follow by closing the loops, so that every
start is on the constraints.  Derivatives are those of the motion, exact through loops and events;
where it has none (friction, contacts that last) differences of motions are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from mechc.analysis.linearize import least_tied, scaled_rows
from mechc.errors import MechcError
from mechc.system.parameters import Array

STEP = 1e-5  # of differences of motions, whose own error is some 1e-10, over each size
HELD = 1e-6  # weight of what is held where independent ones are chosen: it is one of them


class Trial(NamedTuple):
    """A start y (nq + nu,), a period in s, and the value of the parameter that is followed."""

    y: Array
    period: float
    value: float = 0.0


@dataclass(frozen=True)
class Shooting:
    """The question for a cycle; all arguments are checked.

    Attributes
    ----------
    params, run
        Parameters by name, and the keywords of ``simulate``: inputs, events, rtol, method.
    law
        The period as a function of parameters (np,); None of a number.
    autonomous, free
        Whether no time drives the motion, and whether the period is unknown.
    gain : (nq + nu,)
        What components grow by in a period; NaN where they need not return.
    held
        Components of the start that stay as they are.
    energy
        That of the start, where it is held.
    size, tempo
        Units of deviations of components (nq + nu,), and of the period.
    parameter, width
        The parameter that is followed, and the unit of its deviations.
    repeated
        How many periods are one: of a doubled cycle 2.
    reasons
        Why differences are taken, once they are.
    """

    model: Any
    params: Mapping[str, Any]
    t0: float
    run: Mapping[str, Any]
    law: Callable[[Array], float] | None
    autonomous: bool
    free: bool
    gain: Array
    held: frozenset[int]
    energy: float | None
    size: Array
    tempo: float
    parameter: str = ""
    width: float = 1.0
    repeated: int = 1
    reasons: list[str] = field(default_factory=list)

    def parameters_at(self, value: Any) -> dict[str, Any]:
        """Parameters with the value of the one that is followed."""
        return {**self.params, self.parameter: value} if self.parameter else dict(self.params)

    def period_at(self, value: float) -> float:
        """The period by its law at a value of the parameter that is followed."""
        assert self.law is not None
        p = self.model.system.parameter_set.resolve(self.parameters_at(value))
        return self.repeated * self.law(p)

    def simulate(self, trial: Trial) -> Any:
        """The motion over one period."""
        span = (self.t0, self.t0 + trial.period)
        return self.model.simulate(span, trial.y, self.parameters_at(trial.value), **self.run)

    def shoot(self, trial: Trial) -> Shot | None:
        """The motion from a trial; None where it does not reach its end."""
        sol = self.simulate(trial)
        return Shot(self, trial, sol) if sol.status.ok else None

    def coordinates(self, trial: Trial) -> Array:
        """A trial as numbers of one size (nq + nu + 2,): start, period, parameter."""
        times = trial.period / self.tempo, trial.value / self.width
        return np.concatenate([trial.y / self.size, times])

    @property
    def returning(self) -> Any:
        """Flags of the components that have to return."""
        return np.isfinite(self.gain)

    def is_fixed(self, component: int) -> bool:
        """Whether a component of the start stays as it is."""
        return component in self.held or not self.returning[component]


class Shot:
    """One motion over a period.

    Steps are over the unknowns (m,): independent components, the period where it is free, the
    parameter where one is followed, all in their units.
    """

    def __init__(self, problem: Shooting, trial: Trial, sol: Any) -> None:
        self.problem, self.trial, self.sol = problem, trial, sol

    @cached_property
    def gap(self) -> Array:
        """Distance of each component from its return, over its size (nq + nu,)."""
        end = self.sol.record.ends()[1][1]
        missed: Array = end - self.trial.y - np.nan_to_num(self.problem.gain)
        return missed / self.problem.size

    @cached_property
    def residual(self) -> Array:
        """Zero for a cycle: the gaps of what returns, and that of the energy where it is held."""
        excess = [] if self.problem.energy is None else [self._excess(self.trial.y)]
        return np.append(self.gap[self.problem.returning], excess)

    @cached_property
    def flow(self) -> Array:
        """The rates at the end, in our units (nq + nu,)."""
        t, y = (part[1:] for part in self.sol.record.ends())
        rates: Array = self.sol.output_along("rates", t, y)[0]
        return rates * self.problem.tempo / self.problem.size

    @cached_property
    def independent(self) -> list[int]:
        """Components of the start that determine the others; what is fixed is among them."""
        system, at = self.sol.system, (self.trial.y, self.sol.params, self.problem.t0)
        nq = len(system.coordinates)
        weights = np.array([HELD if self.problem.is_fixed(i) else 1.0 for i in range(len(at[0]))])
        parts = (0, system.constraint_gradient(*at)), (nq, system.constraint_jacobian(*at))
        return [
            first + int(i)
            for first, rows in parts
            for i in least_tied(scaled_rows(rows) * weights[first : first + rows.shape[1]])
        ]

    @property
    def unknown(self) -> list[int]:
        """The independent components that are searched for."""
        return [i for i in self.independent if not self.problem.is_fixed(i)]

    @cached_property
    def columns(self) -> tuple[Array, Array, Array]:
        """How start and end (nq + nu, m) and the trial's coordinates (nq + nu + 2, m) change along
        the unknowns."""
        problem, k = self.problem, len(self.unknown)
        m = k + problem.free + bool(problem.parameter)
        varied = [*range(k), *([m - 1] if problem.parameter else [])]
        start, end = np.zeros((2, len(problem.size), m))
        start[:, varied], end[:, varied] = self._exact() or self._differences()
        moved = np.vstack([start, np.zeros((2, m))])
        if problem.free:
            moved[-2, k] = 1.0
        if problem.parameter:
            moved[-1, -1] = 1.0
            if problem.law is not None:
                sides = self.trial.value + np.array([STEP, -STEP]) * problem.width
                ahead, behind = map(problem.period_at, sides.tolist())
                moved[-2, -1] = (ahead - behind) / (2.0 * STEP * problem.tempo)
        return start, end + np.outer(self.flow, moved[-2]), moved

    @cached_property
    def jacobian(self) -> Array:
        """The derivative of the residual by the unknowns."""
        start, end, _ = self.columns
        rows: Array = (end - start)[self.problem.returning]
        if self.problem.energy is None:
            return rows
        sides = STEP * np.diag(self.problem.size)
        slopes = self._excess(self.trial.y + sides) - self._excess(self.trial.y - sides)
        energy = slopes / (2.0 * STEP) @ start
        if self.problem.parameter:  # the energy of one state changes with it
            sides = self.trial.value + np.array([STEP, -STEP]) * self.problem.width
            ahead, behind = (self._excess(self.trial.y, value) for value in sides.tolist())
            energy[-1] += (ahead - behind) / (2.0 * STEP)
        return np.vstack([rows, energy])

    def after(self, change: Array) -> Trial:
        """The trial after a change of its coordinates (nq + nu + 2,), with its loops closed.

        Raises :class:`AssemblyError` if they do not close there.
        """
        value = self.trial.value + float(change[-1]) * self.problem.width
        period = self.trial.period + float(change[-2]) * self.problem.tempo
        if self.problem.law is not None:
            period = self.problem.period_at(value)
        return Trial(self._closed_start(change[:-2], value), period, value)

    # -- derivatives of start and end by the unknown components and the parameter ----------------

    def _exact(self) -> tuple[Array, Array] | None:
        """Exact derivatives of the motion; None where it has none, and from then on."""
        system, problem = self.sol.system, self.problem
        if problem.reasons:
            return None
        names, followed = (*system.coordinates, *system.speeds), bool(problem.parameter)
        by = [names[i] for i in self.unknown] + [problem.parameter] * followed
        given = {names[i]: self.trial.y[i] for i in self.independent}
        try:
            found = self.sol.differentiate(by, given, problem.parameters_at(self.trial.value))
        except MechcError as error:
            problem.reasons.append(str(error))
            return None
        sizes = np.append(problem.size[self.unknown], [problem.width] * followed)
        start, end = found.at(*self.sol.record.ends()) * sizes / problem.size[:, None]
        if np.isfinite(end).all():
            return start, end
        problem.reasons.append("; ".join(found.notes))
        return None

    def _differences(self) -> tuple[Array, Array]:
        """Central differences, of motions that are members of one batch."""
        problem, k = self.problem, len(self.unknown)
        sides = STEP * np.repeat(np.eye(k + bool(problem.parameter)), 2, axis=0)
        if not len(sides):  # all is held but the period
            return np.zeros((len(problem.size), 0)), np.zeros((len(problem.size), 0))
        sides[1::2] *= -1.0
        changes = np.zeros((len(sides), len(problem.size)))
        changes[:, self.unknown] = sides[:, :k]
        values = self.trial.value + problem.width * sides[:, k:].sum(axis=1)
        starts = np.array([self._closed_start(*one) for one in zip(changes, values, strict=True)])
        batch = problem.model.simulate_batch(
            (problem.t0, problem.t0 + self.trial.period), starts, problem.parameters_at(values),
            progress=False, **problem.run,
        )  # fmt: skip
        if not batch.ok.all():
            why = batch.status(int(np.argmin(batch.ok))).headline
            raise MechcError(f"motions beside the cycle do not last a period: {why}")
        of_start, of_end = (
            (part[0::2] - part[1::2]).T / (2.0 * STEP * problem.size[:, None])
            for part in (starts, batch.y)
        )
        return of_start, of_end

    def _closed_start(self, change: Array, value: float) -> Array:
        """The start after a change (nq + nu,) over the sizes: independent components as they are
        then, the others near."""
        y, model = self.trial.y + change * self.problem.size, self.sol.model
        if not model.system.scene.rows:
            return y
        names, nq = (*model.coordinates, *model.speeds), len(model.coordinates)
        coordinates = {names[i]: float(y[i]) for i in self.independent if i < nq}
        speeds = {names[i]: float(y[i]) for i in self.independent if i >= nq}
        guess = {names[i]: float(y[i]) for i in range(nq) if names[i] not in coordinates}
        params, t0 = self.problem.parameters_at(value), self.problem.t0
        return np.asarray(model.assemble(coordinates, speeds, guess, params, t=t0))

    def _excess(self, y: Array, value: float | None = None) -> Array:
        """The energy of states (..., nq + nu) beyond that which is held, over its size."""
        held = self.problem.energy or 0.0
        value = self.trial.value if value is None else value
        found = self.sol.model.energy(y, self.problem.parameters_at(value))
        return np.asarray((found - held) / (abs(held) or 1.0))
