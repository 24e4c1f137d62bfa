"""A motion in step with the world: advanced by intervals, with inputs that change between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from mechc.errors import MechcError, StepError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.native._codes import FINISHED, RUNNING, STEP_TOO_SMALL
from mechc.simulation.initialise import begin, checked_state
from mechc.simulation.settings import Policy
from mechc.simulation.status import AT_CROSSINGS, ChangePoint, Status, status_of
from mechc.system.names import name_of
from mechc.system.parameters import Array, Parameters
from mechc.system.system import System

FOR_EVER, INFINITY = 1e300, math.inf  # s
AHEAD = 100.0, 1000.0  # s, steps: a run that reads its dense output begins again after these
BESIDE = "dop853"  # steps more surely from a state close to a change point


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
    _of: Stepper
    _numbers: Mapping[str, float]
    _params: Array
    _run: Array | None


class Stepper:
    """A motion that is advanced step by step; made by :meth:`mechc.Model.stepper`.

    Each step continues the integration where the last one ended.  A mechanism without loops is
    integrated up to the end of the step.  One with loops may come to a change point, near which no
    step of the integrator should end: it is integrated in steps of their own length, beyond the end
    of the step, where its dense output is read; from there it begins again when an input changes.
    Nothing is recorded, so that memory does not grow.

    Attributes
    ----------
    params : (np,)
        The parameters.
    """

    def __init__(
        self, system: System, t: float, state: Array, params: Array, policy: Policy
    ) -> None:
        if system.reference.backend == "numpy":
            raise MechcError("a stepper needs compiled code: compile without backend='numpy'")
        self._system, self._policy = system, policy
        self._driven: Any = system.driven
        driven = self._driven
        self._scene = system.scene if driven is None else driven.without_inputs
        self._inputs = None if driven is None else driven.compiled()
        self._loops = system.scene.holonomic > 0
        self._slots: dict[str, Array] = {} if driven is None else driven.numbers
        self._numbers = {name: float(slot[0, 0]) for name, slot in self._slots.items()}
        self._has_signals = driven is not None and driven.has_signals
        self._begin_at(t, state, params)

    def _begin_at(self, t: float, state: Array, params: Array) -> None:
        self._t, self._y, self.params = t, state, params
        self._run: Any = None
        driven = self._driven
        self._kinks = driven.breaks(t, FOR_EVER, self._policy.rtol) if self._has_signals else []
        if driven is not None:
            driven.reset()

    # -- the present state --------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time reached, s."""
        return self._t if self._loops or self._run is None else float(self._run.t)

    @property
    def y(self) -> Array:
        """The state (nq + nu,) at :attr:`t`, a copy."""
        found: Array
        if self._run is None:
            found = self._y.copy()
        elif not self._loops:
            found = self._run.state()
        else:
            found = self._at(self._t)
        return found

    @property
    def status(self) -> Status:
        """``"finished"`` after a whole step; else why the last one ended before its end."""
        return self._status(FINISHED if self._run is None else self._run.status)

    @property
    def stats(self) -> dict[str, Any]:
        """Counters of the last step, with steps of the integrator, rejected ones, evaluations."""
        return {} if self._run is None else dict(self._run.stats())

    @property
    def change_points(self) -> tuple[ChangePoint, ...]:
        """Change points that the last step crossed."""
        if self._run is None:
            return ()
        rows = zip(*self._run.steps.change_points(), strict=True)
        return tuple(ChangePoint(float(t), tuple(q.tolist()), float(gap)) for t, q, gap in rows)

    def outputs(self, *names: str) -> dict[str, Array]:
        """Outputs of the model at the present state, with the present inputs, by name.

        Raises
        ------
        UnknownNameError, UnavailableOutputError
            If there is no such output, or it was not requested when compiling.
        """
        system, y, t = self._system, self.y, self.t
        return {
            name: system.energy(y, self.params, t)
            if name == "energy"
            else system.evaluate(name, y, self.params, t)
            for name in names
        }

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
        UnknownNameError, ValueOutOfBoundsError
            For an input that does not exist or is not a number, and a wrong dt.
        """
        if not 0.0 < dt < INFINITY:
            raise ValueOutOfBoundsError(f"dt = {brief(dt)} must be positive and finite, in s")
        changed = self._inputs if inputs and self._give(inputs) else None
        if self._loops:
            return self._followed(self._t + dt, changed is not None)
        run: Any = self._run or self._begun(self._t + dt)
        if self._has_signals:
            self._over_kinks(run, run.t + dt, changed)
        elif run.step_by(dt, changed) != FINISHED:
            self._fail(run.status)
        y: Array = run.state()
        return y

    def _followed(self, t1: float, changed: bool) -> Array:
        """The state at t1, of a run that may be ahead of it."""
        if changed:
            self._begin_at(self._t, self.y, self.params)
        method = self._policy.method
        while (run := self._run) is None or run.t < t1:
            run = run or self._begun(self._horizon(t1), method)
            code = run.reach(t1)
            if run.t >= t1:
                break
            beside = code in (*AT_CROSSINGS, STEP_TOO_SMALL) and method != BESIDE
            if code not in (RUNNING, FINISHED) and not beside:
                self._t = float(run.t)
                self._fail(code)
            method = BESIDE if beside else self._policy.method
            self._begin_at(float(run.t), run.state(), self.params)
        self._t = t1
        return self._at(t1)

    def _at(self, t: float) -> Array:
        """The state at a time within the last step."""
        y: Array = self._run.steps.interpolate(np.array([t]))[0]
        return y

    def _horizon(self, t1: float) -> float:
        """How far a new run goes: not over a kink of the inputs."""
        if self._has_signals:
            self._driven.check_times((t1,))
        kink = min((t for t in self._kinks if t > self._t), default=FOR_EVER)
        return min(self._t + max(AHEAD[0], AHEAD[1] * (t1 - self._t)), kink)

    def _over_kinks(self, run: Any, t1: float, changed: Any) -> None:
        """Step onto each kink or jump of a signal on the way, and on with its next piece."""
        driven = self._driven
        driven.check_times((t1,))
        start = float(run.t)
        kinks = [t for t in self._kinks if start < t < t1]
        for low, high in zip([start, *kinks], [*kinks, t1], strict=True):
            driven.narrow(self._inputs, low, high)
            at_kink = low in self._kinks
            code = run.step(high, self._inputs if at_kink else changed)
            changed = None
            if code != FINISHED:
                self._fail(code)

    def _give(self, inputs: Mapping[str, float]) -> bool:
        """Take over numbers for inputs; whether one differs from before."""
        changed = False
        for key, given in inputs.items():
            name = key if key in self._numbers else self._number_named(key)
            try:
                value = float(given)
            except (TypeError, ValueError):
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

    def _begun(self, t1: float, method: str | None = None) -> Any:
        """The integrator, at the present state."""
        if self._has_signals:
            self._driven.narrow(self._inputs, self._t, t1)
        start = self._scene.start
        if self._inputs is not None:
            start = partial(start, inputs=self._inputs)
        policy = self._policy._replace(method=method or self._policy.method)
        span = self._t, t1
        self._run = begin(self._system, span, self._y, self.params, policy, start)
        return self._run

    def _fail(self, code: int) -> None:
        driven = self._driven
        if driven is not None:
            driven.raise_failure()
        status = self._status(code)
        raise StepError(str(status), status)

    def _status(self, code: int) -> Status:
        if code in (RUNNING, FINISHED):
            return Status("finished", self.t)
        stats, speeds = self.stats, self._system.speeds
        bad, gap = stats["coordinate"], stats["critical_gap"]
        return status_of(code, self.t, speeds[bad] if bad >= 0 else "", gap)

    # -- other states -------------------------------------------------------------------------

    def set(self, y: Array | None = None, *, t: float | None = None, params: Parameters = None
            ) -> None:  # fmt: skip
        """Go on from another state, time or parameters; those that are not given stay.

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
        time = self.t if t is None else float(t)
        if not math.isfinite(time):
            raise ValueOutOfBoundsError(f"t = {time} must be finite")
        given = self.y if y is None else y
        self._begin_at(time, checked_state(self._system, given, values, time), values)

    def save(self) -> SavedStep:
        """The present moment, to the last bit, with what the integrator has learnt."""
        saved = None if self._run is None else self._run.save()
        return SavedStep(self.t, self.y, self, dict(self._numbers), self.params, saved)

    def restore(self, saved: SavedStep) -> None:
        """Back to a moment saved by this stepper; what follows is the same to the last bit.

        Raises
        ------
        ValueOutOfBoundsError
            If another stepper saved it: take ``set(saved.y, t=saved.t)`` there.
        """
        if saved._of is not self:
            raise ValueOutOfBoundsError(
                "another stepper saved this moment: stepper.set(saved.y, t=saved.t) continues "
                "from its state"
            )
        self._give(saved._numbers)
        if saved._run is None or self._run is None or self.params is not saved._params:
            self._begin_at(saved.t, saved.y.copy(), saved._params)
        if saved._run is not None:
            run = self._begun(saved.t + 1.0) if self._run is None else self._run
            run.restore(saved._run)
        self._t = saved.t
        if self._driven is not None:
            self._driven.reset()

    def __repr__(self) -> str:
        return f"<mechc.Stepper of {self._system.name} at t = {self.t:g} s>"
