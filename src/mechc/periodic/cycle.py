"""A cycle: its motion, Floquet multipliers and stability, and the starts that lead to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mechc.periodic import branch, report
from mechc.periodic.repeats import whole_turns
from mechc.periodic.shooting import Shot
from mechc.results.answer import Answer, finite
from mechc.system.names import name_of
from mechc.system.parameters import Array

NEUTRAL = 1e-6, 1e-3  # off the unit circle by less is rounding: exact derivatives, differences
PARTS = 2, 3, 5, 7
SEEN, CURVE = 24, 1500  # states of a last period, and of a cycle that they are compared with


class Cycle(Answer):
    """A motion that repeats; it prints as a table.

    Attributes
    ----------
    period
        In s.  Of a motion with resets that no time drives the start ``y0`` lies amid the longest
        smooth part.
    solution
        The motion over one period, a :class:`mechc.Solution`.
    closure
        The largest of what components lack of their return, over their sizes in the motion.
    """

    def __init__(self, shot: Shot, tol: float) -> None:
        self.shot, self.tol, self.solution = shot, tol, shot.sol
        self.model, self.period = shot.sol.model, shot.trial.period
        self.closure = float(np.abs(shot.residual).max(initial=0.0))
        self.converged, self.message = True, "converged"

    @property
    def params(self) -> dict[str, Any]:
        """Parameters by name, for ``simulate``."""
        return self.shot.problem.parameters_at(self.shot.trial.value)

    @property
    def y0(self) -> Array:
        """The start (nq + nu,), on the constraints."""
        return self.shot.trial.y

    @property
    def values(self) -> dict[str, float]:
        """The period, and the start by name."""
        names = (*self.model.coordinates, *self.model.speeds)
        return {"period": self.period, **dict(zip(names, self.y0.tolist(), strict=True))}

    @property
    def run(self) -> dict[str, Any]:
        """See :attr:`Answer.run`; over one period."""
        return {"t_span": self.solution.span, **self.shot.problem.run}

    def to_json(self) -> Mapping[str, Any]:
        """Numbers and words as JSON data."""
        found: Mapping[str, Any] = finite({
            "values": self.values, "advances": self.advances,
            "multipliers": [[one.real, one.imag] for one in self.multipliers.tolist()],
            "stable": self.stable, "closure": self.closure, "notes": list(self.notes),
        })  # fmt: skip
        return found

    def plot(self, *names: Any) -> Any:
        """Coordinates and speeds over one period, or what is named, as of ``solution.plot``."""
        return self.solution.plot(*(names or (*self.model.coordinates, *self.model.speeds)))

    def samples(self, count: int) -> Array:
        """States (count, nq + nu) at even distances in time, the first and the last a period
        apart."""
        start, end = self.solution.span
        return np.asarray(self.solution(np.linspace(start, end, count)))

    @property
    def advances(self) -> dict[str, float]:
        """Growth of coordinates in a period: name -> rad, m; without those that return."""
        grown = self.solution.record.ends()[1][1] - self.y0
        gain = self.shot.problem.gain  # NaN: by what it closes is free
        grown = np.where(np.isnan(gain), grown, gain)
        return {name: float(grown[i]) for i, name in enumerate(self.model.coordinates) if gain[i]}

    @cached_property
    def _return(self) -> tuple[Array, Array]:
        """The derivative of the return (n, n) in the independent components that return, across the
        flow where no time drives the motion; and these ways, (nq + nu, n), over the sizes."""
        problem = replace(
            self.shot.problem, held=frozenset(), energy=None, free=False, law=None, parameter="",
            params=self.params,
        )  # fmt: skip
        shot = Shot(problem, self.shot.trial, self.solution)
        start, end, _ = shot.columns
        ones = [shot.flow] if problem.autonomous else []
        for places in self.model.system.attitudes.multiples:  # of any length, which stays
            ones.append(np.where(np.isin(np.arange(len(self.y0)), places), self.y0, 0.0))
            ones[-1] /= problem.size
        across = np.eye(len(shot.unknown))
        if ones:
            across = np.linalg.svd(np.array(ones)[:, shot.unknown])[2][len(ones) :].T
        return across.T @ end[shot.unknown] @ across, start @ across

    @cached_property
    def multipliers(self) -> Array:
        """Floquet multipliers, complex, the largest first: small deviations grow by these factors
        in a period.  Without the 1 of a shift along a motion that no time drives."""
        found = np.linalg.eigvals(self._return[0]).astype(complex)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])

    def direction(self, critical: float) -> Array:
        """The deviation (nq + nu,) whose multiplier is the nearest to a number, over the sizes."""
        found, vectors = np.linalg.eig(self._return[0])
        return np.asarray(self._return[1] @ vectors[:, np.argmin(np.abs(found - critical))].real)

    @property
    def _rounding(self) -> float:
        return NEUTRAL[bool(self.shot.problem.reasons)]

    @property
    def stable(self) -> bool:
        """Whether no multiplier lies outside the unit circle: small deviations do not grow."""
        return bool((np.abs(self.multipliers) < 1.0 + self._rounding).all())

    @property
    def neutral(self) -> int:
        """The number of multipliers on the unit circle, of deviations that do not die away."""
        return int((np.abs(np.abs(self.multipliers) - 1.0) < self._rounding).sum())

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks: shorter periods, a family of which it is one, how derivatives were taken."""
        problem = self.shot.problem
        reasons = [reason.partition(": ")[0] for reason in problem.reasons[:1]]
        found = [f"derivatives are differences, good to some 4 digits: {one}" for one in reasons]
        for part in PARTS:
            lack = self.solution(self.solution.span[0] + self.period / part) - self.y0
            off = np.nan_to_num(lack - problem.gain / part) / problem.size
            if np.abs(off).max() < 10.0 * self.tol:
                found.append(f"it repeats already after {self.period / part:.9g} s")
        sizes = np.linalg.svd(self.shot.jacobian, compute_uv=False)
        lost = self.shot.jacobian.shape[1] - (sizes > self._rounding * sizes.max(initial=0.0)).sum()
        lost -= len(self.model.system.attitudes.multiples)
        if lost > problem.autonomous and not problem.parameter:
            found.append(
                "it is one of a family, of all energies or amplitudes, and the nearest to the "
                "guess: hold=['energy'], ['period'] or names of coordinates and speeds choose one"
            )
        return tuple(found)

    def follow(
        self, parameter: Any, ends: tuple[Any, Any], *, most: int = 200, step: float = 0.05
    ) -> branch.CycleBranch:
        """The branch of cycles of which this is one, through values of a parameter.

        By pseudo-arclength (Keller 1977): where the branch folds it goes on, back.  Folds, period
        doublings, branchings and tori are located, where multipliers pass 1, -1, and the unit
        circle in pairs.  What was held stays so.

        Parameters
        ----------
        parameter
            Name or symbol.
        ends
            Values between which the branch is followed; it begins towards the second.
        most
            The most cycles.
        step
            The longest step: of the parameter, over the distance of the ends; of states, over
            their sizes.

        Raises
        ------
        UnknownNameError, ValueOutOfBoundsError
            For a parameter that there is not; for a value now that is not between the ends; if
            what drives the motion has another period with another value, and the period is a
            number.
        """
        return branch.follow(self, name_of(parameter), ends, most, step)

    def basin(self, starts: Any, *others: Cycle, periods: int = 200, tol: float = 1e-2) -> Array:
        """Which cycle each of many starts leads to, by one batch.

        Parameters
        ----------
        starts
            As y0 of :meth:`mechc.Model.simulate_batch`: states (n, nq + nu), or by name.
        others
            Other cycles of the same model and parameters.
        periods
            After how many; the last one is compared with the cycles, whole turns left out.
        tol
            The largest distance from a cycle, in units of ``closure``.

        Returns
        -------
        (n,)
            0 for this cycle, 1, 2, ... for the others, -1 for none.
        """
        problem, end = self.shot.problem, self.shot.problem.t0 + periods * self.period
        batch = self.model.simulate_batch(
            (problem.t0, end), starts, dict(self.params), progress=False,
            t_eval=np.linspace(end - self.period, end, SEEN), **problem.run,
        )  # fmt: skip
        seen, found = self._without_turns(batch["y_eval"]), np.full(len(batch), -1)
        for number, cycle in enumerate((self, *others)):
            near = _distances(self._without_turns(cycle._curve), seen).max(axis=1)
            found[batch.ok & (near < tol) & (found < 0)] = number
        return found

    @property
    def _curve(self) -> Array:
        """States (CURVE, nq + nu), the denser the shorter the integrator's steps are."""
        t = self.solution.record.states()[0]
        even = np.linspace(0.0, len(t) - 1.0, CURVE)
        return np.asarray(self.solution(np.interp(even, np.arange(len(t)), t)))

    def _without_turns(self, y: Array) -> Array:
        """States (..., k) over the sizes, of whole turns the rest, without what grows otherwise."""
        turning = whole_turns(self.solution)
        kept = np.setdiff1d(np.flatnonzero(self.shot.problem.gain == 0.0), turning)
        circles = np.cos(y[..., turning]), np.sin(y[..., turning])
        return np.concatenate([(y / self.shot.problem.size)[..., kept], *circles], axis=-1)

    def __str__(self) -> str:
        return report.cycle_in_words(self)

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"<mechc.Cycle of {self.model.name}: period {self.period:.9g} s, {kind}>"


def _distances(curve: Array, states: Array) -> Array:
    """Distances (n, nt) of states (n, nt, k) from the nearest point of a curve (m, k)."""
    from scipy.spatial import cKDTree

    known = np.where(np.isfinite(states), states, np.finfo(float).max ** 0.25)
    near = cKDTree(curve).query(known.reshape(-1, states.shape[-1]))[0]
    return np.asarray(near.reshape(states.shape[:-1]))
