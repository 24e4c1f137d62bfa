"""Inputs that are given with a run: numbers, sampled signals, Python functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from mechc.errors import MissingInputError, UnknownNameError, ValueOutOfBoundsError
from mechc.inputs.accept import takes_state
from mechc.inputs.sampled import Control, HeldSignal, Sampled
from mechc.inputs.signals import FAR, Signal, polynomials_at
from mechc.native._inputs import Caller, Inputs
from mechc.system.parameters import Array

TICKS = 4  # ulps: knots nearer to each other are one
Function = Callable[..., float]


@dataclass(frozen=True)
class InputSlot:
    """An input of a scene: its derivatives that the equations contain, in order.

    ``of_time``: constraints, mass matrix or kinematics contain it: it may depend on time only.
    """

    name: str
    orders: tuple[int, ...]
    of_time: bool

    @classmethod
    def from_metadata(cls, data: Mapping[str, Any]) -> InputSlot:
        return cls(data["name"], tuple(data["orders"]), bool(data["of_time"]))


class GivenInputs:
    """Values for the inputs of a scene; ``complete``: whether every input has one.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for unknown names and wrong
    values.
    """

    def __init__(
        self, slots: Sequence[InputSlot], given: Mapping[str, Any], sizes: tuple[int, int]
    ) -> None:
        known = [slot.name for slot in slots]
        for name in given:
            if name not in known:
                raise UnknownNameError("input", name, known)
        self.complete = len(given) == len(known)
        self.signals = {n: x for n, x in given.items() if isinstance(x, Signal)}
        self._order = {slot.name: max(slot.orders) for slot in slots}
        self._values = {n: x[0] for n, value in given.items() if (x := functions_of(value))}
        self.function_names = list(self._values)
        self._numbers: dict[str, Array] = {}
        self._places: dict[str, int] = {}
        self._pieces: list[tuple[Array, Array]] = []
        self._sources: list[tuple[int, int]] = []
        functions: list[tuple[str, Function, bool] | None] = []
        for slot in (slot for slot in slots if slot.name in given):
            value = given[slot.name]
            if functions_of(value):
                functions += _checked_functions(slot, functions_of(value))
                self._sources += [(-1, order) for order in slot.orders]
            else:
                functions += [None] * len(slot.orders)
                self._sources += [(len(self._pieces), order) for order in slot.orders]
                self._places[slot.name] = len(self._pieces)
                self._pieces.append(_polynomials(slot, value))
                if not isinstance(value, Signal):
                    self._numbers[slot.name] = self._pieces[-1][1]
        self._functions, self._sizes = functions, sizes
        self.caller = Caller(functions, *sizes)

    def native_inputs(self) -> Any:
        """The values for compiled code."""
        return Inputs(self._pieces, self._sources, self.caller)

    def for_c(self) -> Any:
        """The values for C functions, which nothing checks: NaN at times beyond the samples of a
        signal, and with a caller of their own."""
        pieces = [(knots, coefficients.copy()) for knots, coefficients in self._pieces]
        for name, signal in self.signals.items():
            if not np.isfinite(signal.span).all():
                continue
            knots, coefficients = pieces[self._places[name]]
            beyond = np.full((1, coefficients.shape[1]), np.nan)
            times = np.concatenate([[-FAR], knots, [np.nextafter(signal.span[1], np.inf)]])
            pieces[self._places[name]] = times, np.vstack([beyond, coefficients, beyond])
        caller = Caller(self._functions, *self._sizes)
        return Inputs(pieces, self._sources, caller)

    def value(self, name: str, t: Array, y: Array) -> Array:
        """An input (n,) at times (n,) and states (n, nq + nu)."""
        if name in self._places:
            return polynomials_at(*self._pieces[self._places[name]], t, 0)
        function, count = self._values[name], self._sizes[0]
        if takes_state(f"the input {name}", function):
            rows = zip(t.tolist(), y, strict=True)
            return np.array([function(s, row[:count], row[count:]) for s, row in rows], dtype=float)
        return np.array([function(s) for s in t.tolist()], dtype=float)

    def places(self, names: Sequence[str]) -> Array:
        """The places of the numbers with these names among the signals of :meth:`native_inputs`."""
        return np.array([self._places[name] for name in names], np.intc)

    @property
    def controls(self) -> list[Control]:
        """Controllers that are called during a run."""
        held = [s.control for s in self.signals.values() if isinstance(s, HeldSignal)]
        return list(dict.fromkeys(held))

    @property
    def numbers(self) -> dict[str, Array]:
        """The place (1, 1), which runs read, of each input that is a number."""
        return dict(self._numbers)

    def breaks(self, t0: float, t1: float, rtol: float) -> list[float]:
        """Times within the span that no step may cross, in its direction."""
        low, high = sorted((t0, t1))
        knots = [signal.breaks(rtol, self._order[n]) for n, signal in self.signals.items()]
        times = np.sort(np.concatenate([*knots, [low, high]]))
        times = times[(times >= low) & (times <= high)]
        apart = np.diff(times) > TICKS * np.spacing(np.abs(times[1:]))
        inner: list[float] = times[1:][apart].tolist()
        inner = [t for t in inner if high - t > TICKS * np.spacing(abs(high))]
        return inner if t1 >= t0 else inner[::-1]

    def check_times(self, times: Sequence[float] | Array, additions: int = 0) -> None:
        """Raise :class:`ValueOutOfBoundsError` for times beyond the samples of a signal.

        ``additions``: each that has led to the times may have rounded them by an ulp.
        """
        if len(times) > 2:
            times = (min(times), max(times))
        for name, signal in self.signals.items():
            low, high = signal.span
            for t in times:
                rounding = (TICKS + additions) * float(np.spacing(abs(t)))
                if t < low - rounding or t > high + rounding:
                    raise ValueOutOfBoundsError(
                        f"the input {name} is sampled from {low:.9g} to {high:.9g} s, but is "
                        f"needed at {t:.9g} s: give more samples, or mechc.Signal(..., "
                        "outside='hold')"
                    )

    def notes(self, method: str) -> tuple[str, ...]:
        """The cost of the Python functions, and what a method does not see of them, as warnings."""
        if not self.caller.calls:
            return ()
        which = f"The input {self.function_names[0]} is a Python function"
        if len(self.function_names) > 1:
            which = f"The inputs {', '.join(self.function_names)} are Python functions"
        cost = f"{self.caller.calls} calls from compiled code took {1e3 * self.caller.seconds:.3g}"
        return (f"{which}: {cost} ms", *missed_jumps(method))


def missed_jumps(method: str) -> tuple[str, ...]:
    """Warnings of what a method does not see of a Python function."""
    if not method.startswith("gauss8"):
        return ()
    return (
        "gauss8 may miss a jump in a Python function between a step's end and the node next to it; "
        "method='auto' sees it",
    )


def missing(slots: Sequence[InputSlot], given: Mapping[str, Any]) -> MissingInputError:
    """The error for inputs that have no value."""
    names = ", ".join(slot.name for slot in slots if slot.name not in given)
    return MissingInputError(
        f"these inputs have no value: {names}. Give each as a number, an expression such as "
        "'3*sin(4*t)', a mechc.Signal or a function of time, with simulate(..., inputs={...}), "
        "model.with_inputs({...}) or, an expression, mechc.compile(..., inputs={...})"
    )


def functions_of(value: Any) -> tuple[Function, ...]:
    """The functions of a value; none if it is something else."""
    if isinstance(value, Signal):
        return ()
    several = value if isinstance(value, (tuple, list)) else (value,)
    return tuple(several) if all(map(callable, several)) else ()


def _checked_functions(
    slot: InputSlot, functions: tuple[Function, ...]
) -> list[tuple[str, Function, bool]]:
    """The function of each derivative that is needed, and whether it takes the state."""
    highest = max(slot.orders)
    if highest >= len(functions):
        raise ValueOutOfBoundsError(
            f"the equations contain rates of the input {slot.name} up to order {highest}, which "
            f"a function does not give: give {highest + 1} functions of time (value, rate, ...), "
            "or a mechc.Signal that is smooth enough"
        )
    asked, what = [functions[order] for order in slot.orders], f"the input {slot.name}"
    chosen = [(slot.name, function, takes_state(what, function)) for function in asked]
    if slot.of_time and any(reads_state for _, _, reads_state in chosen):
        raise ValueOutOfBoundsError(
            f"constraints, mass matrix or kinematics contain the input {slot.name}: it must be a "
            "function of time only"
        )
    return chosen


def _polynomials(slot: InputSlot, value: Any) -> tuple[Array, Array]:
    """Knots (n,) and coefficients (n, degree + 1)."""
    if isinstance(value, Signal):
        highest = max(slot.orders)  # may jump, as accelerations may
        if highest > value.smoothness + 1:
            kinds = "'quintic'" if highest > 3 else "'cubic' or 'quintic'"
            held = " that is held" if value.outside == "hold" else ""
            raise ValueOutOfBoundsError(
                f"the equations contain rates of the input {slot.name} up to order {highest}, and "
                f"a {value.kind} signal{held} has jumps in those of order {value.smoothness + 1}: "
                f"take kind={kinds} without outside='hold'"
            )
        return value.pieces
    if isinstance(value, Sampled):
        raise ValueOutOfBoundsError(
            f"the input {slot.name} is a mechc.Sampled, whose values a run makes: give it to "
            "simulate(..., inputs={...})"
        )
    number = isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
    if not number or not np.isfinite(float(value)):
        raise ValueOutOfBoundsError(
            f"the input {slot.name} must be a finite number, a mechc.Signal or a function, not "
            f"{value!r}; an expression is given to mechc.compile(..., inputs={{...}})"
        )
    return np.zeros(1), np.full((1, 1), float(value))
