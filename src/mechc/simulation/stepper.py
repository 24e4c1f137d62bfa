"""A motion in step with the world: advanced by intervals, with inputs that change between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mechc.errors import MechcError, StepError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.native._codes import EVENT_FAILED, FINISHED, INTERRUPTED, RUNNING
from mechc.native._motion import Stepping
from mechc.simulation.end_of_reach import SHRUNK_AWAY, status_beyond_reach
from mechc.simulation.events.outcome import failure_of
from mechc.simulation.events.run_events import RunEvents
from mechc.simulation.gimbal_lock import with_gimbal_lock
from mechc.simulation.initialise import checked_state, request_of
from mechc.simulation.settings import Policy, refuse_derivatives_in_contact
from mechc.simulation.status import ChangePoint, Status, status_of
from mechc.system.names import name_of
from mechc.system.parameters import Array, Parameters, one_double
from mechc.system.quantities import output_of
from mechc.system.system import System
from mechc.system.units import SECONDS, in_si

FOR_EVER, INFINITY = 1e300, math.inf  # s


@dataclass(frozen=True)
class SavedStep:
    """A moment of a :class:`Stepper`, for its :meth:`Stepper.restore`.

    Attributes
    ----------
    t, y
        Time in s and state (nq + nu,).
    """

    t: float
    y: Array
    _of: Stepper = field(repr=False)
    _numbers: Mapping[str, float] = field(repr=False)
    _motion: Stepping = field(repr=False)
    _saved: Array = field(repr=False)


class Stepper:
    """A motion that is advanced step by step; made by :meth:`mechc.Model.stepper`.

    Each step continues the integration where the last one ended.  A mechanism without loops and
    events is integrated up to the end of the step.  One with loops may come to a change point,
    near which no step of the integrator should end: it is integrated in steps of their own length,
    beyond the end of the step, where its dense output is read; from there it begins again when an
    input changes.  Nothing is recorded, so that memory does not grow.
    """

    def __init__(
        self, system: System, t: float, state: Array, params: Array, policy: Policy,
        events: RunEvents | None = None,
    ) -> None:  # fmt: skip
        self._system, self._policy, self._events = system, policy, events
        self._driven: Any = system.driven
        self._slots: dict[str, Array] = {} if self._driven is None else self._driven.numbers
        self._numbers = {name: float(slot[0, 0]) for name, slot in self._slots.items()}
        self._code = FINISHED
        self._begin_at(t, state, params)

    def _begin_at(self, t: float, state: Array, params: Array) -> None:
        self._start, self._additions = t, 0
        if self._driven is not None:
            self._drive(self._driven.with_controllers_from(t))
            self._driven.restart(t)
        self._go_from(t, state, params)

    def _drive(self, driven: Any) -> None:
        """Take over a scene with the inputs as they are."""
        if driven is not self._driven:
            self._driven, self._system = driven, self._system.replaced_scene(driven)
            self._slots = driven.numbers
            self._give_numbers_to(driven)

    def _give_numbers_to(self, driven: Any) -> None:
        """Let a scene have the numbers that inputs have now."""
        for name, value in self._numbers.items():
            driven.numbers[name][0, 0] = value

    def _go_from(self, t: float, state: Array, params: Array) -> None:
        system = self._system
        request = request_of(system, (t, FOR_EVER), params, self._policy, self._events)
        ahead = system.scene.holonomic > 0 or self._events is not None
        self._motion = Stepping(request, t, state, ahead)

    # -- the present state --------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time reached, s."""
        return float(self._motion.t)

    @property
    def y(self) -> Array:
        """The state (nq + nu,) at :attr:`t`, a copy."""
        state: Array = self._motion.state()
        return state

    @property
    def params(self) -> Array:
        """The parameters (np,) at :attr:`t`, as resets have left them, a copy."""
        params: Array = self._motion.params()
        return params

    @property
    def status(self) -> Status:
        """``"finished"`` after a whole step; else why the last one ended before its end."""
        return self._status(self._code)

    @property
    def stats(self) -> dict[str, Any]:
        """Counters of the last step, with steps of the integrator, rejected ones, evaluations."""
        stats = dict(self._motion.stats())
        stats.pop("left_series", None)  # it takes none
        return stats

    @property
    def change_points(self) -> tuple[ChangePoint, ...]:
        """Change points that the last step crossed."""
        steps = self._motion.steps()
        rows = () if steps is None else zip(*steps.change_points(), strict=True)
        return tuple(ChangePoint(float(t), tuple(q.tolist()), float(gap)) for t, q, gap in rows)

    def outputs(self, *names: str) -> dict[str, Array]:
        """Outputs of the model at the present state, with the present inputs, by name.

        Accelerations, multipliers and reactions have the forces of the contacts that last; before
        the first step it is not known which do.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If there is no such output, or it was not requested and cannot be compiled now.
        """
        y, t = self.y, self.t
        forces = self._contact_forces(t, y)
        if forces is not None:
            refuse_derivatives_in_contact(names)
        return {
            name: output_of(self._system, name, lambda whole: self._output(whole, y, t, forces))
            for name in names
        }

    def _output(self, name: str, y: Array, t: float, forces: Array | None) -> Array:
        system = self._system.with_output(name)
        if system.driven is not None:
            self._give_numbers_to(system.driven)
        return system.evaluate(name, y, system.values_of(self._system, self.params), t, forces)

    def _contact_forces(self, t: float, y: Array) -> Array | None:
        """Generalized forces (nu,) of the contacts that last; None where there are no contacts."""
        steps = self._motion.steps() if self._events is not None and self._events.laws else None
        return None if steps is None else steps.forces(np.array([t]), y[None])[0]

    # -- stepping -----------------------------------------------------------------------------

    def step(self, dt: float, inputs: Mapping[str, float] | None = None) -> Array:
        """Advance by dt and return the state there.

        Parameters
        ----------
        dt
            In s, above 0.
        inputs
            Input -> number, constant from now on; inputs that are not named keep their value.

        Returns
        -------
        y : (nq + nu,)

        Raises
        ------
        StepError
            If the integration ended before, with its ``status``; the stepper is then at the time
            reached.
        InputError
            If the function of an input failed.
        KeyboardInterrupt
            At Ctrl-C; the stepper is then at the time reached, ``stepper.set()`` goes on there.
        UnknownNameError, ValueOutOfBoundsError
            For an input that does not exist or is not a number, and a wrong dt.
        """
        dt = one_double(dt, "dt", SECONDS)
        if not 0.0 < dt < INFINITY:
            raise ValueOutOfBoundsError(f"dt = {brief(dt)} must be positive and finite, in s")
        changed = inputs is not None and self._give(inputs)
        t = self.t + dt
        if self._driven is not None:
            self._additions += 1
            self._driven.check_times((t,), self._additions)
            self._go_on_until(t)
        self._code = self._motion.reach(t, changed)
        if self._code not in (RUNNING, FINISHED):
            self._fail()
        return self.y

    def _go_on_until(self, t: float) -> None:
        """Make room for the values of controllers until a time."""
        driven = self._driven.controlled_until(self._start, t)
        if driven is not self._driven:
            before = self._motion
            self._drive(driven)
            self._go_from(self.t, self.y, self.params)
            self._motion.restore(before.t, before.state(), before.save(with_run=False))

    def _give(self, inputs: Mapping[str, float]) -> bool:
        """Take over numbers for inputs; whether one differs from before."""
        changed = False
        if not isinstance(inputs, Mapping):
            raise TypeError(
                f"inputs are given by name, such as {{'F': 1.0}}, not as {brief(inputs)}"
            )
        for key, given in inputs.items():
            name = key if key in self._numbers else self._number_named(key)
            try:
                value = (
                    given
                    if type(given) is float
                    else float(in_si(given, self._system.quantity_of(name)))
                )
            except ValueOutOfBoundsError:
                raise
            except (TypeError, ValueError, OverflowError):
                value = INFINITY
            if not -INFINITY < value < INFINITY:
                raise ValueOutOfBoundsError(
                    f"the input {name} must be a finite number in a step, not {brief(given)}"
                )
            if value != self._numbers[name]:
                self._numbers[name] = self._slots[name][0, 0] = value
                changed = True
        return changed

    def _number_named(self, key: Any) -> str:
        name: str = name_of(key)
        if name not in self._numbers:
            if name in self._system.inputs:
                raise ValueOutOfBoundsError(
                    f"the input {name} was given as a function or a signal: a step can change only "
                    "inputs that were given as numbers"
                )
            raise UnknownNameError("input", name, self._system.inputs)
        return name

    def _fail(self) -> None:
        try:
            if self._driven is not None:
                self._driven.raise_failure()
            status = self._status(self._code)
        except KeyboardInterrupt:  # in a function of Python
            self._code = INTERRUPTED
            raise
        raise StepError(str(status), status)

    def _status(self, code: int) -> Status:
        if code in (RUNNING, FINISHED):
            return Status("finished", self.t)
        beyond = code in SHRUNK_AWAY and status_beyond_reach(
            self._system, self.t, self.y, self.params
        )
        if beyond:
            return beyond
        stats, speeds = self.stats, self._system.speeds
        bad = stats.get("coordinate", -1)
        status = status_of(
            code, self.t, speeds[bad] if bad >= 0 else "", stats.get("critical_gap", 0.0)
        )
        status = with_gimbal_lock(status, code, self._system, self.y[None], self._policy.rtol)
        failed = code == EVENT_FAILED and failure_of(self._events, self._motion)
        return replace(status, cause=str(failed)) if failed else status

    # -- other states -------------------------------------------------------------------------

    def set(self, y: Array | None = None, *, t: float | None = None, params: Parameters = None
            ) -> None:  # fmt: skip
        """Go on from another state, time or parameters; those that are not given stay.

        Controllers (:class:`mechc.Sampled`) begin again there.

        Raises
        ------
        AssemblyError
            If the state does not satisfy the constraints.
        UnknownNameError, ValueOutOfBoundsError, ValueError
            For bad names, values and shapes.
        """
        values = self.params if params is None else self._system.parameter_set.resolve(params)
        if values.ndim != 1:
            raise ValueOutOfBoundsError("a stepper takes one set of parameters")
        time = self.t if t is None else one_double(t, "t", SECONDS)
        if not math.isfinite(time):
            raise ValueOutOfBoundsError(f"t = {time} must be finite")
        given = self.y if y is None else y
        self._begin_at(time, checked_state(self._system, given, values, time), values)

    def save(self) -> SavedStep:
        """The present moment, to the last bit, with what the integrator has learnt and with what is
        known of events; where there are some, the integration begins anew here and where it is
        restored.

        Raises
        ------
        MechcError
            With a :class:`mechc.Sampled`: what its controller remembers is not known.
        """
        if self._driven is not None and self._driven.due is not None:
            raise MechcError(
                "a stepper with a mechc.Sampled cannot be saved: its controller may have a memory"
            )
        y, numbers = self.y, dict(self._numbers)
        y.flags.writeable = False
        return SavedStep(self.t, y, self, numbers, self._motion, self._motion.save())

    def restore(self, saved: SavedStep) -> None:
        """Back to a moment saved by this stepper; what follows is the same to the last bit.

        Raises
        ------
        ValueOutOfBoundsError
            If another stepper saved it: take ``set(saved.y, t=saved.t)`` there.
        """
        if getattr(saved, "_of", None) is not self:
            raise ValueOutOfBoundsError(
                "another stepper saved this moment: stepper.set(saved.y, t=saved.t) continues "
                "from its state"
            )
        self._give(saved._numbers)
        self._motion = saved._motion
        self._motion.restore(saved.t, saved.y, saved._saved)
        self._code = FINISHED
        if self._driven is not None:
            self._driven.reset()

    def __repr__(self) -> str:
        return f"<mechc.Stepper of {self._system.name} at t = {self.t:g} s>"
