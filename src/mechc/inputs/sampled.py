"""Controllers in discrete time: called at their instants, their values held in between."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.inputs.accept import takes_state, with_state_apart
from mechc.inputs.signals import FAR, Signal
from mechc.system.names import name_of
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.units import SECONDS

TICKS = 8  # ulps: an instant that is no nearer to a break of the run is another time
MOST = 10_000_000  # instants of a run
AT_ONCE = 4096  # instants that a run without an end is given room for


class Sampled:
    """A controller that reads the state at its instants and whose values are held between them.

    ``model.simulate(..., inputs={"F": mechc.Sampled(controller, 0.005)})``; for several inputs at
    once ``{("F", "T"): mechc.Sampled(...)}`` with a controller that gives as many numbers.  A run
    steps exactly onto every instant, and onto every time at which a value changes.

    Parameters
    ----------
    controller
        Function of t, of t, q and u, or of (x, t) with x = [q, u], called at the instants in their
        order; it may have a memory.  Gives a number, or one for each input.
    period : float
        Time between instants, s, or with a unit, ``"10 ms"``; the first is the start of the run.
    delay : float
        Time from an instant until its value is applied, s.
    jitter : float
        Instants are late by a random time, uniform up to this, s; below the period.
    seed
        Of the random times.
    initial : float or sequence
        Values until the first one is applied.

    Raises
    ------
    TypeError
        If the controller is not callable.
    ValueOutOfBoundsError
        For times that are negative, not finite, or a jitter not below the period.
    """

    def __init__(
        self,
        controller: Callable[..., Any],
        period: float,
        delay: float = 0.0,
        *,
        jitter: float = 0.0,
        seed: int = 0,
        initial: float | Sequence[float] = 0.0,
    ) -> None:
        if not callable(controller):
            raise TypeError(f"a controller must be a function, not {controller!r}")
        self.controller, self.seed = controller, _checked_seed(seed)
        self.period, self.delay = _checked_time("period", period), _checked_time("delay", delay)
        self.jitter = _checked_time("jitter", jitter)
        if not self.jitter < self.period:
            raise ValueOutOfBoundsError(
                f"the period, {self.period:g} s, must be above 0 and above the jitter, "
                f"{self.jitter:g} s"
            )
        self.initial = doubles(initial, "initial")
        if self.initial.ndim > 1:
            raise ValueOutOfBoundsError("initial is a number, or one for each input")

    def instants(self, t0: float, t1: float) -> Array:
        """Times in s at which the controller is called in a run from t0 to before t1.

        Raises
        ------
        ValueOutOfBoundsError
            If the run is backwards, or has too many.
        """
        if not t1 >= t0:
            raise ValueOutOfBoundsError("a run with a sampled controller goes forwards in time")
        if not (t1 - t0) / self.period < MOST:
            raise ValueOutOfBoundsError(
                f"a period of {self.period:g} s makes more than {MOST} instants in this run"
            )
        times = t0 + self.period * np.arange(np.ceil((t1 - t0) / self.period) + 1)
        times += self.jitter * np.random.default_rng(self.seed).random(len(times))
        found: Array = times[times < t1 - TICKS * np.spacing(abs(t1))]
        return found


def _checked_seed(seed: int) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        raise ValueOutOfBoundsError(f"seed = {brief(seed)} must be a whole number from 0 on")
    return int(seed)


def _checked_time(name: str, given: float) -> float:
    value = one_double(given, name, SECONDS)
    if not 0.0 <= value < np.inf:
        raise ValueOutOfBoundsError(f"{name} = {value} must be a time in s, not below 0")
    return value


class HeldSignal(Signal):
    """The values of one input in one run: not known before the controller was called.

    ``control`` calls it, until the time ``until``.  Saved or sent elsewhere it is a plain signal.
    """

    control: Control
    until: float

    def __init__(self, changes: Array, initial: float, first: bool) -> None:
        """``first``: the first of the times has the initial value."""
        self.kind, self.outside, self._smoothness = "previous", "hold", -1
        self.times = changes
        self._knots = np.append(-FAR, changes)
        self._coefficients = np.full((len(self._knots), 1), np.nan)
        self._coefficients[0] = initial
        self.known_count = 2 if first else 1
        self._coefficients[: self.known_count] = initial

    @property
    def values(self) -> Array:
        """The values at the times (n,); NaN where the run did not come."""
        found: Array = self._coefficients[1:, 0]
        return found

    @values.setter
    def values(self, _: Array) -> None:
        raise AttributeError("a controller gives these values")

    def put(self, index: int, value: float) -> None:
        """Store the value of an instant."""
        self._coefficients[self.known_count + index] = value

    def breaks(self, rtol: float, order: int = 0) -> Array:
        """Instants, and times at which the value changes."""
        del rtol, order
        return np.union1d(self.control.instants, self._knots[1:])

    def as_signal(self) -> Signal:
        """The values that the run has applied, as a signal with the same breaks."""
        times = self.breaks(0.0)
        values = self(times)
        done = np.isfinite(values)
        done[:2] = True  # of two samples at least
        return Signal(
            times[done], np.nan_to_num(values[done]), "previous", outside="hold", breaks="samples"
        )

    @property
    def parts(self) -> tuple[dict[str, Any], dict[str, Array]]:
        return self.as_signal().parts

    def __reduce__(self) -> tuple[Any, ...]:
        return Signal.from_parts, self.parts

    def hold_last(self) -> None:
        """Hold the last value where the run did not come."""
        known = np.isfinite(self._coefficients[:, 0])
        self._coefficients[~known] = self._coefficients[np.flatnonzero(known)[-1]]


class Control:
    """A controller in one run: which of its instants comes next, and where its values go.

    ``takes_state``: whether it reads the state, so that its values change with the motion.
    """

    def __init__(
        self, names: Sequence[str], sampled: Sampled, signals: Sequence[HeldSignal], instants: Array
    ) -> None:
        what = f"the controller of {', '.join(names)}"
        self.names, self.signals, self.instants = tuple(names), tuple(signals), instants
        self.sampled = sampled
        self._function = with_state_apart(what, sampled.controller)
        self.takes_state = takes_state(what, self._function, (3, 1))
        self._next, self._called = 0, -1

    @property
    def repeats(self) -> bool:
        """Whether runs repeat what was recorded."""
        return self._called >= 0

    def restart(self) -> None:
        """Begin a run: the controller is called from the first instant on."""
        if not self.repeats:
            self._next = 0

    def repeat(self) -> None:
        """Let later runs repeat the recorded values, and call nothing."""
        self._called = self._called if self.repeats else self._next
        self._next = len(self.instants)
        for signal in self.signals:
            signal.hold_last()

    def skip(self, t: float) -> None:
        """Begin a part of a run at this time: earlier instants are over, and none of them is called
        again."""
        first = int(np.searchsorted(self.instants, t - TICKS * np.spacing(abs(t))))
        self._next = max(self._next, first)

    def longer(self, t0: float, t1: float) -> dict[str, HeldSignal]:
        """The signals of the same run, which began at t0, until t1 at least, with what is known."""
        until = t1 + max(t1 - t0, AT_ONCE * self.sampled.period)
        signals = _hold(list(self.names), self.sampled, (t0, until))
        control = next(iter(signals.values())).control
        control._next = self._called if self.repeats else self._next
        for signal, shorter in zip(signals.values(), self.signals, strict=True):
            known = shorter.known_count + control._next
            signal._coefficients[:known] = shorter._coefficients[:known]
        return signals

    def reach(self, t: float, q: Array, u: Array) -> None:
        """Call the controller where an instant has come.

        Raises ``ValueError`` if it gives something else than a finite number for each input.
        """
        while self._next < len(self.instants):
            if self.instants[self._next] > t + TICKS * np.spacing(abs(t)):
                return
            given = self._function(t, q, u) if self.takes_state else self._function(t)
            values = np.ravel(np.asarray(given, dtype=np.float64))
            if len(values) != len(self.signals) or not np.isfinite(values).all():
                raise ValueError(f"it must give {len(self.signals)} finite number(s), not {given}")
            for signal, value in zip(self.signals, values, strict=True):
                signal.put(self._next, value)
            self._next += 1


def with_held(inputs: Mapping[Any, Any], span: tuple[float, float]) -> tuple[dict[Any, Any], bool]:
    """The inputs of a run with a signal to be filled in place of each controller, and whether there
    is any.  Of a run without an end they are made for a while: :meth:`Control.longer`."""
    found: dict[Any, Any] = {}
    for key, value in inputs.items():
        if isinstance(value, Sampled):
            names = [name_of(each) for each in (key if isinstance(key, tuple) else (key,))]
            found |= _hold(names, value, span)
        else:
            found[key] = value
    return found, any(isinstance(value, Sampled) for value in inputs.values())


def _hold(names: list[str], sampled: Sampled, span: tuple[float, float]) -> dict[str, HeldSignal]:
    until = span[1] if span[1] < np.inf else span[0] + AT_ONCE * sampled.period
    instants = sampled.instants(span[0], until)
    changes = instants + sampled.delay
    first = not len(changes) or changes[0] > span[0]
    times = np.append(span[0], changes) if first else changes
    if len(times) < 2:
        times = np.append(times, times[-1] + sampled.period)
    if sampled.initial.shape not in ((), (1,), (len(names),)):
        raise ValueOutOfBoundsError(f"initial has a number for each of {', '.join(names)}")
    initial = np.broadcast_to(sampled.initial, len(names))
    signals = [HeldSignal(times, float(value), first) for value in initial]
    control = Control(names, sampled, signals, instants)
    for signal in signals:
        signal.control, signal.until = control, until
    return dict(zip(names, signals, strict=True))
