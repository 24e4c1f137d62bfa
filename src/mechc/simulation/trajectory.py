"""The result of a run: times, states, dense output, histories, and its status."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from mechc.errors import MechcError, UnavailableOutputError, ValueOutOfBoundsError
from mechc.native._arrays import all_within
from mechc.simulation.balance import conserves_energy, work_along
from mechc.simulation.events.event import Event, EventRecord
from mechc.simulation.events.run_events import RunEvents
from mechc.simulation.record import Record, SmoothPart
from mechc.simulation.settings import Policy, refuse_derivatives_in_contact
from mechc.simulation.status import ChangePoint, Status
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles
from mechc.system.quantities import Quantity, outputs_in, read_quantity
from mechc.system.system import System
from mechc.system.units import SECONDS


class Trajectory:
    """The states of a run over time; :class:`mechc.Solution`, its public face, tells of them."""

    _run_events: RunEvents | None = None  # the events looked for
    _titles: tuple[str, ...] = ()  # theirs, where they are known from a file alone
    joined = False  # of several runs, with jumps that no event explains
    checked: Any = None  # the result of ``check``, once it was made

    def __init__(
        self,
        system: System,
        params: Array,
        policy: Policy,
        record: Record,
        outcome: Callable[[], tuple[Status, dict[str, Any]]],
        times: Array | None = None,
        events: tuple[EventRecord, ...] = (),
    ) -> None:
        self.system, self.params, self.policy = system, params, policy
        self.events = events
        self.record, self._times, self._judge = record, times, outcome

    @cached_property
    def _outcome(self) -> tuple[Status, dict[str, Any]]:
        """Status and counters: a run that nobody asks for them is not judged."""
        return self._judge()

    @cached_property
    def status(self) -> Status:
        """:class:`mechc.Status`: how the run ended, in prose by ``str``."""
        return self._outcome[0]

    @cached_property
    def stats(self) -> Mapping[str, Any]:
        """Counters (steps, rejected, rhs_evaluations, closure_iterations), least conditioning of
        the constraints and its time, the method, and wall_s, the seconds that the run took; what
        had to be compiled for it is told when it is."""
        return MappingProxyType(self._outcome[1])

    @property
    def method(self) -> str:
        """The method of the run: what ``"auto"`` took."""
        return str(self.stats["method"])

    @cached_property
    def _history(self) -> tuple[Array, Array]:
        """Times and states as reported; times in t_eval after the run's end are omitted."""
        if self._times is not None:
            times = self._reached_times(self._times)
            return times, self.record.interpolate(times)
        return self.record.states()

    def _reached_times(self, times: Array) -> Array:
        """The times, in the direction of the run, that it reached."""
        start, end = self.span
        if not len(times) or abs(times[-1] - start) <= abs(end - start):
            return times
        if end >= start:
            return times[: np.searchsorted(times, end, side="right")]
        return times[: len(times) - np.searchsorted(times[::-1], end, side="left")]

    @property
    def t(self) -> Array:
        return self._history[0]

    @property
    def y(self) -> Array:
        return self._history[1]

    @property
    def q(self) -> Array:
        """Coordinates (nt, nq)."""
        return self.y[:, : len(self.system.coordinates)]

    @property
    def u(self) -> Array:
        """Speeds (nt, nu)."""
        return self.y[:, len(self.system.coordinates) :]

    def __getitem__(self, name: Any) -> Array:
        """History (nt,) of a quantity: ``sol["theta_0"]``, ``sol["points[2,0]"]``.

        Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` if it is none.
        """
        name, names = name_of(name), (*self.system.coordinates, *self.system.speeds)
        if name in names:
            return self.y[:, names.index(name)]
        return self.quantity_along(name, self.t, self.y)[1]

    def __len__(self) -> int:
        return len(self.t)

    def __call__(self, t: float | Array) -> Array:
        """Dense output: states at any times of the run, on the constraints, (..., nq + nu).

        Raises
        ------
        ValueOutOfBoundsError
            For times the run did not reach.
        MechcError
            If the run was made with ``dense=False``.
        """
        if not self.policy.dense:
            raise MechcError("this run kept no dense output: simulate with dense=True")
        times = self._times_of_run(t)
        rows = self.record.interpolate(times.reshape(-1))
        return rows.reshape(*times.shape, rows.shape[1])

    def _times_of_run(self, t: float | Array) -> Array:
        times = doubles(t, "the times", of=SECONDS, copied=False)
        low, high = sorted(self.span)
        if not all_within(times.reshape(-1), low, high):
            raise ValueOutOfBoundsError(f"the run covers {low:g} ... {high:g} s only")
        return times

    @cached_property
    def span(self) -> tuple[float, float]:
        """Times between which the run has states, s."""
        return self.record.span

    @property
    def asked_events(self) -> Sequence[Event]:
        """The events that were looked for."""
        return () if self._run_events is None else self._run_events.events

    @property
    def event_titles(self) -> tuple[str, ...]:
        """The titles of ``events``: the expression as given, or the name of the function."""
        titles = self._titles or (() if self._run_events is None else self._run_events.titles)
        if len(titles) == len(self.events):
            return titles
        return tuple(f"event {number}" for number in range(len(self.events)))

    @property
    def segments(self) -> tuple[SmoothPart, ...]:
        """The smooth parts of the motion, between the resets of events; one without resets."""
        return self.record.smooth_parts()

    def params_at(self, t: float | Array) -> Array:
        """Parameters that hold at any times of the run (..., np): resets may change them.

        At a jump those after it; of two equal times in a row there, the first before it.
        """
        times = self._times_of_run(t)
        rows = self.values_along(times.reshape(-1))
        return np.array(np.broadcast_to(rows, (times.size, rows.shape[-1]))).reshape(
            *times.shape, rows.shape[-1]
        )

    def values_along(self, t: Array) -> Array:
        """``params`` (np,); where resets change them, a row for each time (nt, np)."""
        return self.record.params_along(t)

    def output_along(self, name: str, t: Array, y: Array) -> Array:
        """An output (nt, ...) at times (nt,) and states (nt, nq + nu) of the run.

        It has the forces of the contacts that last there, and is compiled now if the model was
        compiled without.
        """
        return self._along(self.system.with_output(name), name, t, y)

    def quantity_along(self, name: Any, t: Array, y: Array) -> tuple[Quantity, Array]:
        """A quantity and its values (nt,) at times and states of the run, as ``sol[name]``."""
        system = self.system.with_output(*outputs_in([name]))
        one = read_quantity(system, name)
        if one.of_state:
            return one, y[:, one.entry]
        return one, self._along(system, one.output, t, y).reshape(len(t), -1)[:, one.entry]

    def _along(self, system: System, name: str, t: Array, y: Array) -> Array:
        """:meth:`output_along` of a system that may have further outputs."""
        forces = self.record.contact_forces(t, y)
        if forces is not None:
            refuse_derivatives_in_contact([name])
        p = system.values_of(self.system, self.values_along(t))
        return system.evaluate(name, y, p, t, forces)

    # -- histories, computed when requested ---------------------------------------------------

    @cached_property
    def energy(self) -> Array:
        """Kinetic plus potential energy (nt,), J; NaN where it is not known.

        It is compiled now if the model was compiled without.
        """
        if not self._knows_energy:
            return np.full(len(self.t), np.nan)
        return self.system.energy(self.y, self.values_along(self.t), self.t)

    @property
    def has_energy(self) -> bool:
        """Whether ``energy`` is known without compiling: it was compiled, or asked for before."""
        asked = self.__dict__.get("energy", np.nan)
        return self.system.knows_energy or not bool(np.isnan(asked).all())

    @cached_property
    def _knows_energy(self) -> bool:
        try:
            return self.system.with_output("energy").knows_energy
        except UnavailableOutputError:
            return False

    @cached_property
    def closure(self) -> Array:
        """Largest gap of the configuration constraints (nt,): m, or what unit they have."""
        return _largest(self.system.constraints(self.y, self.values_along(self.t), self.t))

    @cached_property
    def velocity_closure(self) -> Array:
        """Largest residual of the velocity constraints (nt,): m/s, or what unit they have."""
        p = self.values_along(self.t)
        return _largest(self.system.velocity_constraints(self.y, p, self.t))

    @cached_property
    def work(self) -> Array:
        """Work done on the mechanism since the start by all that has no potential (nt,), J.

        By dampers, inputs, prescribed motions, and by the resets of events; 0 where the energy is
        conserved.  NaN where the energy is not known, and where it is not conserved in a run
        without dense output.
        """
        return self.work_until(self.t)

    def work_until(self, times: float | Array) -> Array:
        """The work done until any times (...) of the run, J."""
        times = self._times_of_run(times)
        flat = times.reshape(-1)
        known = self._knows_energy
        if not known or not times.size or (not self.policy.dense and not self._conserves_energy):
            return np.full(times.shape, np.nan)
        work = work_along(self.system, self.record, flat, self._conserves_energy)
        return work.reshape(times.shape)

    @cached_property
    def _conserves_energy(self) -> bool:
        if self.record.in_contact().any():
            return False
        t, y = self.record.states()
        return conserves_energy(self.system, t, y, self.values_along(t))

    @property
    def energy_drift(self) -> float:
        """Largest departure of the energy from its first value and the work done, over largest T.

        Over all accepted steps, whichever times are reported.  NaN where energy or work are not
        known.
        """
        if not self._knows_energy:
            return float("nan")
        t, y = self.record.states() if self._times is not None else self._history
        p = self.values_along(t)
        energy = self.system.energy(y, p, t) - self.work_until(t)
        largest = float(self.system.kinetic_energy(y, p, t).max(initial=0.0))
        departure = float(np.abs(energy - energy[:1]).max(initial=0.0))
        return departure / largest if largest > 0 else departure

    @cached_property
    def change_points(self) -> tuple[ChangePoint, ...]:
        """Change points crossed (or, with "stop", reached), in order: time and configuration."""
        return tuple(
            ChangePoint(float(t), tuple(q.tolist()), float(gap))
            for t, q, gap in zip(*self.record.change_points(), strict=True)
        )


def _largest(residuals: Array) -> Array:
    if residuals.shape[-1] == 0:
        return np.zeros(len(residuals))
    return np.asarray(np.abs(residuals).max(axis=-1))
