"""Forward sensitivities of the members of a batch, each as a run of its own has them."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.batch.spec import Recipe
from mechc.errors import CacheError, CompilerError, MechcError, ValueOutOfBoundsError
from mechc.inputs.driven_scene import with_inputs
from mechc.inputs.samples import signals_among
from mechc.sensitivities.columns import START, columns_of
from mechc.sensitivities.control import controlled
from mechc.sensitivities.history import Sensitivity
from mechc.sensitivities.run import sensitivity_of_run
from mechc.simulation.initialise import checked_state
from mechc.simulation.settings import Policy
from mechc.simulation.simulate import run
from mechc.simulation.trajectory import Trajectory
from mechc.system.names import names_of
from mechc.system.parameters import Array
from mechc.system.system import System


def one_number_each(system: System, names: Sequence[str]) -> tuple[str, ...]:
    """The names of a batch's columns: for ``"y0"`` those of its components, ``"y0[0]"`` and on."""
    components = [f"{START}[{k}]" for k in range(system.scene.width)]
    return tuple(each for n in names_of(names) for each in (components if n == START else [n]))


def check_names(system: System, recipe: Recipe) -> None:
    """Refuse names that have no derivatives, before anything is computed.

    Raises :class:`UnavailableOutputError`, :class:`UnknownNameError`,
    :class:`ValueOutOfBoundsError`, :class:`MechcError` as :func:`columns_of`; for names that stand
    for several columns, for what a batch with sensitivities cannot have.
    """
    if recipe.until or recipe.events is not None:
        raise ValueOutOfBoundsError(
            "a batch with sensitivities takes neither until= nor events= yet"
        )
    if recipe.inputs.controllers:
        raise ValueOutOfBoundsError(
            "how a controller depends on the state is not known, so a batch with mechc.Sampled has "
            "no sensitivities"
        )
    if not recipe.count:
        return
    driven, first = _system_of(system, recipe, 0), system.parameter_set.resolve(_params(recipe, 0))
    columns = columns_of(driven, recipe.sensitivities, np.asarray(first), _params(recipe, 0))
    for name, place in columns.places.items():
        if isinstance(place, slice):
            raise ValueOutOfBoundsError(
                f"a batch takes sensitivities by single numbers, and {name} stands for several: "
                "name coordinates, speeds, parameters, or values of signals such as 'F[0]'"
            )


class Members:
    """The work on all members, for several threads.

    ``final`` and ``largest`` are (n, nq + nu, k): derivatives at the end, and the largest absolute
    values at the accepted steps or at t_eval; ``at_times`` (n, nt, nq + nu, k).  NaN where a
    member has none.
    """

    def __init__(self, system: System, recipe: Recipe, values: Array, y0: Array, ok: Array) -> None:
        self.system, self.recipe, self.values, self.y0, self.ok = system, recipe, values, y0, ok
        n, width, k = recipe.count, system.scene.width, len(recipe.sensitivities)
        self.final = np.full((n, width, k), np.nan)
        self.largest = self.final.copy()
        self.at_times = np.full((n, len(recipe.t_eval), width, k), np.nan)
        self.done, self._lock, self._stopped = 0, threading.Lock(), False
        self._next = iter(range(n))

    def work(self) -> None:
        """Members one after the other, until none is left."""
        while not self._stopped:
            with self._lock:
                member = next(self._next, None)
            if member is None:
                return
            if self.ok[member]:
                self._differentiate(member)
            self.done += 1

    def stop(self) -> None:
        """Stop after the members at hand."""
        self._stopped = True

    def _differentiate(self, member: int) -> None:
        recipe, given = self.recipe, _start(self.recipe, member)
        system = _system_of(self.system, recipe, member)
        times = recipe.t_eval if len(recipe.t_eval) else None
        policy, p = recipe.policy._replace(dense=True), self.values[member]
        try:
            state = checked_state(system, self.y0[member], p, recipe.span[0])
            start = state if given is None else given, _params(recipe, member)

            def motion(policy: Policy) -> Trajectory:
                return run(Trajectory, system, recipe.span, state, p, policy, times)

            def differentiate(sol: Trajectory) -> Sensitivity:
                return sensitivity_of_run(sol, recipe.sensitivities, *start)

            sol = motion(policy)
            if recipe.sensitivity_error_control:
                sol, found = controlled(motion, sol, differentiate)
            else:
                found = differentiate(sol)
        except (CompilerError, CacheError):  # no member has any
            raise
        except MechcError:  # this member has none
            return
        columns = found.at(sol.t, sol.y)
        self.final[member] = found.at(np.array([sol.span[1]]), sol(np.array([sol.span[1]])))[0]
        self.largest[member] = np.abs(columns).max(axis=0)
        if times is not None:
            self.at_times[member] = columns

    @property
    def results(self) -> dict[str, Array]:
        """The results by the names of a batch's arrays."""
        found = {"sensitivity_final": self.final, "sensitivity_max": self.largest}
        return found | ({"sensitivity": self.at_times} if len(self.recipe.t_eval) else {})


def _system_of(system: System, recipe: Recipe, member: int) -> System:
    """A system with a member's inputs, whose steps end at the samples derivatives are taken by."""
    if system.driven is None:
        return system
    own = with_inputs(system, recipe.inputs.of(member))
    return with_inputs(own, signals_among(own, recipe.sensitivities))


def _params(recipe: Recipe, member: int) -> dict[str, float]:
    return {name: _one(column, member) for name, column in recipe.params.items()}


def _start(recipe: Recipe, member: int) -> Mapping[str, float] | None:
    """The coordinates and speeds that a start was assembled from; None for a whole state."""
    if recipe.states is not None:
        return None
    every: Sequence[tuple[str, Any]] = [*recipe.coordinates.items(), *recipe.speeds.items()]
    return {name: _one(column, member) for name, column in every}


def _one(column: Any, member: int) -> float:
    return float(column[member] if np.ndim(column) else column)
