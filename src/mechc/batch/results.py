"""The results of many members."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from mechc.batch.spec import Recipe
from mechc.errors import MechcError, UnknownNameError
from mechc.inputs.bind import missed_jumps
from mechc.native._codes import (
    END_OF_REACH,
    FINISHED,
    NOT_ASSEMBLED,
    NOT_RUN,
    STOPPED_BY_EVENT,
)
from mechc.simulation.end_of_reach import status_beyond_reach
from mechc.simulation.gimbal_lock import gimbal_note_of_batch, with_gimbal_lock
from mechc.simulation.status import CODES, Status, status_of
from mechc.system.names import name_of, names_of
from mechc.system.parameters import Array
from mechc.system.system import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechc.results.solution import Solution

ENDED = ("finished", "stopped by an event")
REACHED = (FINISHED, STOPPED_BY_EVENT)  # the end, or the crossing requested


class Batch:
    """The results of many members.

    Attributes
    ----------
    system, recipe
        What was simulated.
    complete
        False after Ctrl-C: the members not computed have the status ``"not run"``.
    arrays
        Name -> array with the members first: ``y`` (n, nq + nu) final states, ``t`` (n,) times in s
        reached, ``y0`` (n, nq + nu) starts, ``status`` (n,), counters, ``y_eval``
        (n, nt, nq + nu); with sensitivities by k names ``sensitivity_final`` and
        ``sensitivity_max`` (n, nq + nu, k), ``sensitivity`` (n, nt, nq + nu, k); a Zarr array
        where the batch was streamed to a file.  Each is also an attribute: ``batch.y0``.
    """

    def __init__(
        self, system: System, recipe: Recipe, arrays: Mapping[str, Any], complete: bool = True
    ) -> None:
        self.system, self.recipe = system, recipe
        self.model: Any = system
        self.arrays, self.complete = arrays, complete

    def __reduce__(self) -> tuple[Any, ...]:
        """The numbers of the batch, and the model's reference, for pickle."""
        arrays = {name: np.asarray(values) for name, values in self.arrays.items()}
        known = {} if self.system.driven is None else self.system.driven.given
        recipe = replace(self.recipe, inputs=self.recipe.inputs.without_functions(known))
        models = self.model, self._whole_model
        return _unpickled, (type(self), *models, recipe, arrays, self.complete)

    def __len__(self) -> int:
        return self.recipe.count

    def __iter__(self) -> Iterator[Solution]:
        """The motions of the members, each simulated when it is its turn."""
        return map(self.member, range(len(self)))

    @overload
    def __getitem__(self, name: int) -> Solution: ...

    @overload
    def __getitem__(self, name: Any) -> Array: ...

    def __getitem__(self, name: Any) -> Any:
        """An array of ``arrays``, a reduction or an output by name; a member's motion by number."""
        if isinstance(name, slice):
            raise TypeError("a batch is asked for one member, batch[3], or a result by its name")
        if hasattr(name, "__index__"):
            return self.member(name)
        name = str(name_of(name))
        keys = {key: key for key in self.arrays}
        keys |= {text: f"output_{i}" for i, text in enumerate(self.recipe.outputs)}
        keys |= {
            "".join(text.split()): f"reduction_{i}" for i, text in enumerate(self.recipe.reductions)
        }
        short = name if name in keys else "".join(name.split())
        states = (*self.system.coordinates, *self.system.speeds)
        if short not in keys and short in states:
            place = states.index(short)
            raise UnknownNameError.with_message(
                f"no result is called {short!r}: it is batch.y[:, {place}] at the end, "
                f"batch.y_eval[:, :, {place}] at t_eval, and batch[0][{short!r}] along a motion"
            )
        if short not in keys:
            raise UnknownNameError("result", name, keys)
        return np.asarray(self.arrays[keys[short]])

    def __getattr__(self, name: str) -> Array:
        """An array of ``arrays`` as an attribute: ``batch.y0``, ``batch.steps``."""
        if name not in self.__dict__.get("arrays", ()):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return self[name]

    def member(self, number: int) -> Solution:
        """The motion of one member, simulated again: the same to the last bit.

        With ``until`` it ends where the member did.

        Raises
        ------
        IndexError
            If there is no such member.
        MechcError
            If it was not assembled or not run; for events of a batch that was read from a folder:
            expressions are known there by what identifies them only; and for inputs of a batch
            that was pickled or copied, where they were functions or controllers.
        """
        from mechc.batch.run import run_alone

        place = operator.index(number)
        if not -len(self) <= place < len(self):
            raise IndexError(f"member {place}: the batch has {len(self)} members")
        place %= len(self)
        if not self._has_run[place]:
            raise MechcError(
                f"member {place} has no motion: {self.status(place)}. batch.ok says which "
                "members reached their end"
            )
        until = float(self["t"][place]) if self.recipe.until else self.recipe.span[1]
        return run_alone(self._whole_model, self.recipe, place, self["y0"][place], until)

    @property
    def _whole_model(self) -> Any:
        """The model of what was simulated, compiled with more than the batch's model."""
        return type(self.model).of_system(self.system)

    @cached_property
    def _has_run(self) -> Array:
        started = np.isfinite(self["y0"]).all(axis=1)
        return np.asarray(started & ~np.isin(self["status"], (NOT_RUN, NOT_ASSEMBLED)))

    @property
    def method(self) -> str:
        """The method of the members: what ``"auto"`` took, ``"gauss8 in lockstep"`` for example.

        ``model.simulate(..., method=batch.method)`` repeats a member to the last bit, also one that
        has gone over from ``"dop853 in lockstep"`` or ``"taylor in lockstep"`` to collocation,
        where stability limits its steps or beside a critical configuration.  Of stiff members by
        ``"gauss8 in lockstep"`` only ``batch[i]`` does.
        """
        return self.recipe.policy.method_of_users

    @property
    def t_eval(self) -> Array:
        """The times (nt,) of ``y_eval`` and of outputs, s."""
        return self.recipe.t_eval

    @cached_property
    def ok(self) -> Array:
        """Whether each member reached the end, or the crossing that ends it."""
        return np.asarray(np.isin(self["status"], REACHED))

    def status(self, member: int) -> Status:
        """The status of one member, in words by ``str``."""
        code, t = int(self["status"][member]), float(self["t"][member])
        end = self["y"][member][None]
        if code == END_OF_REACH:
            return self._beyond_reach(member, t, end[0])
        status = status_of(code, t, "some speed", float(self["critical_gap"][member]))
        return with_gimbal_lock(status, code, self.system, end, self.recipe.policy.rtol)

    def _beyond_reach(self, member: int, t: float, y: Array) -> Status:
        """The status of a member whose prescribed motion its loops cannot follow."""
        from mechc.batch.run import parameter_rows

        place = member % len(self)
        values = parameter_rows(self.system, self.recipe.cut(place, place + 1))[0]
        found = status_beyond_reach(self.system, t, y, values)
        return found or status_of(END_OF_REACH, t, "this time")

    @cached_property
    def counts(self) -> dict[str, int]:
        """Outcome in words -> how many members have it."""
        codes, counts = np.unique(self["status"], return_counts=True)
        return {CODES[int(c)][0]: int(n) for c, n in zip(codes, counts, strict=True)}

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the whole batch."""
        told = []
        met = int(np.count_nonzero(self["change_points"]))
        if met:
            told.append(
                f"{met} members crossed change points, where the links are in line and two motions "
                "are possible: the ideal mechanism goes straight on, as computed"
            )
        infinite = [
            np.isinf(self[f"reduction_{i}"]) for i in range(len(self.recipe.reductions)) if met
        ]
        if np.any(infinite):
            texts = [x for x, of in zip(self.recipe.reductions, infinite, strict=True) if of.any()]
            told.append(
                f"infinite in {np.any(infinite, axis=0).sum()} members: {', '.join(texts)}. At a "
                "change point constraint forces of an ideal mechanism grow without bound; extremes "
                "leave out the time around it with away=, as in "
                "max(norm(multipliers), away=10ms)"
            )
        failed = {what: n for what, n in self.counts.items() if what not in ENDED}
        if failed:
            words = ", ".join(f"{n} {what}" for what, n in failed.items())
            told.append(f"not all members reached the end: {words}")
        if "gimbals" in self.system.data:
            ends = self["y"][self._has_run]
            told += gimbal_note_of_batch(self.system, ends, self.recipe.policy.rtol)
        lowered = np.count_nonzero(self["lowered_impacts"]) if self.recipe.events else 0
        if lowered:
            told.append(
                f"in {lowered} members Newton's law of restitution with friction would have given "
                "energy: as much of the restitution was taken as gives none (lowered_impacts)"
            )
        driven = self.system.driven
        if self.recipe.inputs.functions or (driven is not None and driven.calls_python):
            told += missed_jumps(self.method)
        if self.recipe.sensitivities:
            missing = np.isnan(self["sensitivity_final"]).reshape(len(self), -1).any(axis=1)
            none = np.count_nonzero(np.logical_and(self.ok, missing))
            told += [f"{none} members have no derivative by some name: NaN"] if none else []
        return tuple(told)

    def to_xarray(self) -> Any:
        """Everything as an ``xarray.Dataset`` over ``member``, ``state`` and ``time``.

        Parameters, coordinates and speeds that differ between members are coordinates along
        ``member``; reductions and outputs have their requested names, with
        characters that files do not take replaced by ``_``.
        """
        from mechc.batch.dataset import to_dataset

        return to_dataset(self.system, self.recipe, self.arrays, self.warnings)

    def to_dataframe(self) -> Any:
        """One row a member, as a ``pandas.DataFrame``.

        Columns are what differs between the members, the outcome in words, the time reached, the
        reductions by their texts, the state there (``theta_0_end``), the counters, and the least
        gaps, NaN of members that met none.

        Raises
        ------
        MissingPackageError
            If pandas is not installed: ``pip install pandas``.
        """
        from mechc.batch.dataset import to_dataframe

        return to_dataframe(self.system, self.recipe, self.arrays)

    def plot(self, *names: Any) -> Figure:
        """Histograms over the members, a panel for each name: a matplotlib figure.

        Parameters
        ----------
        names
            Reductions of the batch by their texts, and coordinates and speeds, whose values at the
            end are counted.  By default all reductions, or the coordinates where there is none.
            Angles are shown in degrees; members that did not reach the end are left out, and the
            title counts them.

        Raises
        ------
        UnknownNameError
            For a name that the batch does not have.
        """
        from mechc.batch.sweeps.histograms import draw_histograms

        default = self.recipe.reductions or self.system.coordinates
        return draw_histograms(self, names_of(names) if names else default)

    def __repr__(self) -> str:
        words = ", ".join(f"{n} {what}" for what, n in self.counts.items())
        return f"<mechc.Batch of {self.system.name}: {len(self)} members, {words or 'none'}>"


def _unpickled(
    kind: type[Batch], model: Any, whole: Any, recipe: Recipe, arrays: Mapping[str, Any],
    complete: bool,
) -> Batch:  # fmt: skip
    batch = kind(whole.system, recipe, arrays, complete)
    batch.model = model
    return batch
