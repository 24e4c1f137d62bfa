"""Arguments of a search for a motion, checked: the problem, and where the search begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from mechc.compilation.event_tapes import typed_expression
from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError, brief
from mechc.inputs.accept import laws_apart
from mechc.inputs.signals import Signal
from mechc.optimal.problem import LINEAR, Choice, OptimalProblem, Unknowns
from mechc.optimal.terms import Terms, read_terms, refuse_rates
from mechc.questions.motion import Arguments, params_by_name
from mechc.questions.unknowns import (
    PARAMETER,
    START,
    Bounds,
    checked_bounds,
    kinds_of,
    named_free,
    read_unknown,
)
from mechc.simulation.events.event import Event, value_of
from mechc.simulation.events.expressions import read_events
from mechc.simulation.settings import checked_positive
from mechc.system.names import by_name, name_of
from mechc.system.parameters import Array, doubles, one_double
from mechc.system.quantity import NamedQuantity
from mechc.system.system import System
from mechc.system.units import SECONDS, in_si

TIMES, UNEVEN = 33, 0.61803398875  # where it is asked whether time drives; golden, not periodic
SAME = 1e-9  # values that differ by less do not depend on time


@dataclass(frozen=True)
class Question:
    """Arguments of :meth:`mechc.Model.optimise`, as they were given."""

    duration: Any
    y0: Any
    controls: Any
    params: Any
    inputs: Any
    guess: Any
    integral: Any
    final: Any
    end: Any
    bounds: Any
    free: Any
    t0: float
    intervals: int
    kind: str
    run: Mapping[str, Any]


class Condition(NamedTuple):
    """An expression with its bounds."""

    text: Any
    lower: float
    upper: float


class StateConditions(NamedTuple):
    """Bounds of components of the state, by their places, and of other expressions."""

    components: dict[int, tuple[float, float]]
    others: list[Condition]

    @property
    def texts(self) -> list[Any]:
        return [one.text for one in self.others]


@dataclass
class Box:
    """Bounds, sizes and first values of all unknowns (n,), as they are gathered."""

    lower: Array
    upper: Array
    size: Array
    first: Array

    @classmethod
    def open(cls, count: int) -> Box:
        """Unknowns without bounds."""
        whole = np.ones(count)
        return cls(-np.inf * whole, np.inf * whole, whole.copy(), np.zeros(count))

    def bound(self, places: Any, ends: tuple[float, float]) -> None:
        """Set bounds, and sizes where both are finite."""
        self.lower[places], self.upper[places] = ends
        if np.isfinite(ends[1] - ends[0]):
            self.size[places] = 0.5 * (ends[1] - ends[0])

    def within(self, unknowns: Unknowns) -> tuple[Unknowns, Array]:
        """The unknowns with these bounds, and first values within them."""
        found = replace(unknowns, lower=self.lower, upper=self.upper, size=self.size)
        return found, np.clip(self.first, self.lower, self.upper)


def read_problem(model: Any, asked: Question) -> tuple[OptimalProblem, Array]:
    """The problem, and the first values of its unknowns, the states of its nodes still 0.

    Raises what :meth:`mechc.Model.optimise` says.
    """
    laws, inputs = laws_apart({} if asked.inputs is None else by_name(asked.inputs, "inputs"))
    system = model.system.with_laws(laws) if laws else model.system
    controls = by_name(asked.controls or {}, "controls", "{'F': (-10, 10)}")
    for name in controls:
        if name not in system.inputs:
            raise UnknownNameError("input", name, system.inputs)
        refuse_rates(system, name)
    along, end = (_conditions(system, *one) for one in
                  ((asked.bounds, "bounds"), (asked.end, "end")))  # fmt: skip
    system, terms = _terms(system, asked, along, end)
    given = Arguments(
        params_by_name(system, asked.params), _checked_start(asked.y0), inputs,
        by_name(asked.guess or {}, "guess"),
    )  # fmt: skip
    unknowns, first = _unknowns(system, asked, controls, given, along, end)
    kept = {name: value for name, value in inputs.items() if name not in controls}
    limits = np.array([one[1:] for one in (*along.others, *end.others)]).reshape(-1, 2)
    problem = OptimalProblem(
        type(model).of_system(system), unknowns, replace(given, inputs=kept),
        one_double(asked.t0, "t0", SECONDS), 0.0 if unknowns.free else _seconds(asked.duration),
        asked.kind, asked.run, *terms, limits[:, 0], limits[:, 1],
    )  # fmt: skip
    _refuse_open(problem)
    if unknowns.free:
        _refuse_driven(problem.read(first))
    return problem, first


def _terms(
    system: System, asked: Question, along: StateConditions, end: StateConditions
) -> tuple[System, tuple[Terms, Terms, Terms, Terms]]:
    """Cost over time and at the end, bounds along the motion, conditions at the end; and the system
    with the derivatives of what is in them."""
    if asked.integral is None and asked.final is None:
        raise ValueOutOfBoundsError(
            "nothing is to be least: give integral='F**2', final='duration', or both"
        )
    cost = [[one for one in (each,) if one is not None] for each in (asked.integral, asked.final)]
    every = [*cost, along.texts, end.texts]
    system, _ = read_terms(system, [text for texts in every for text in texts])
    one, two, three, four = (read_terms(system, texts)[1] for texts in every)
    return system, (one, two, three, four)


def _checked_start(y0: Any) -> Any:
    return by_name(y0, "y0") if isinstance(y0, Mapping) else doubles(y0, "y0")


def _seconds(duration: Any) -> float:
    return checked_positive("the duration", duration, of=SECONDS)


# -- conditions -----------------------------------------------------------------------------------


def _conditions(system: System, given: Any, what: str) -> StateConditions:
    names = (*system.coordinates, *system.speeds)
    found = StateConditions({}, [])
    for key, value in ({} if given is None else dict(given)).items():
        name = _name_or_none(key)
        if name not in names:
            ends = _numbers(what, key, value)
            found.others.append(Condition(key, *ends))
        elif np.ndim(value) == 0:
            one = float(in_si(value, system.quantities[name]))
            ends = found.components[names.index(name)] = one, one
        else:
            ends = found.components[names.index(name)] = checked_bounds(system, name, value)
        if not ends[0] <= ends[1] or (ends[0] == ends[1] and np.isinf(ends[0])):
            raise ValueOutOfBoundsError(
                f"{what}: {key} is a finite number, or has bounds that rise, not {brief(value)}"
            )
    return found


def _name_or_none(key: Any) -> Any:
    """The name of a text or a symbol; None of an expression."""
    symbol = getattr(key, "is_Symbol", False) or getattr(key, "is_Function", False)
    return name_of(key) if isinstance(key, str) or symbol else None


def _numbers(what: str, key: Any, value: Any) -> tuple[float, float]:
    """The bounds of an expression, twice the same of a value."""
    try:
        low, high = (value, value) if np.ndim(value) == 0 else value
        ends = float("-inf" if low is None else low), float("inf" if high is None else high)
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"{what}: {key} has a value or (lower, upper), not {brief(value)}"
        ) from None
    return ends


# -- unknowns -------------------------------------------------------------------------------------


def _unknowns(
    system: System, asked: Question, controls: Mapping[str, Any], given: Arguments,
    along: StateConditions, end: StateConditions,
) -> tuple[Unknowns, Array]:  # fmt: skip
    """The unknowns with bounds and first values; the nodes are not known yet."""
    states = (*system.coordinates, *system.speeds)
    kinds = kinds_of(system)
    free = named_free(asked.free or {}, kinds)
    for name, ends in free.items():
        known = {*given.params, *system.defaults}
        if kinds[name] == PARAMETER and name not in known and not _is_bounded(system, name, ends):
            raise ValueOutOfBoundsError(
                f"the search has no value of {name} to begin with: give params={{{name!r}: ...}}"
            )
    numbers = [
        read_unknown(system, name, kind, ends, given.values_of(kind), clipped=True)
        for name, ends in free.items() for kind in (kinds[name],)
    ]  # fmt: skip
    parameters, begun = (
        tuple(one for one in numbers if one.kind == kind) for kind in (PARAMETER, START)
    )
    if begun and not isinstance(asked.y0, Mapping):
        told = f"{begun[0].name} is free: give y0 as a mapping, which is assembled"
        raise ValueOutOfBoundsError(told)
    unknowns = Unknowns(
        tuple(controls), parameters, begun,
        np.ndim(asked.duration) > 0, asked.intervals + (asked.kind == LINEAR), asked.intervals,
        len(states),
    )  # fmt: skip
    box, blocks = Box.open(unknowns.count), unknowns.blocks
    shares = np.arange(unknowns.samples) / asked.intervals
    for place, (name, ends) in zip(blocks["controls"].T, controls.items(), strict=True):
        box.bound(place, checked_bounds(system, name, ends))
        box.first[place] = _first_signal(
            system.quantity_of(name), given.inputs.get(name, 0.0), shares
        )
    for block, ones in (("parameters", parameters), ("start", begun)):
        for place, one in zip(blocks[block], ones, strict=True):
            box.lower[place], box.upper[place] = one.lower, one.upper
            box.first[place], box.size[place] = one.first, one.size
    if unknowns.free:
        low, high = _ends_of_duration(asked.duration)
        box.bound(blocks["duration"], (low, high))
        box.first[blocks["duration"]], box.size[blocks["duration"]] = 0.5 * (low + high), high
    nodes = blocks["nodes"]
    for i, ends in along.components.items():
        box.bound(nodes[:, i], ends)
    for i, ends in end.components.items():
        box.bound(nodes[-1, i], _in_both(states[i], ends, along.components.get(i)))
    p = system.parameter_set.resolve(
        given.with_values(parameters, [one.first for one in parameters]).params
    )
    box.size[nodes] = system.scale(p)
    return box.within(unknowns)


def _is_bounded(system: System, name: str, ends: Any) -> bool:
    return bool(np.isfinite(checked_bounds(system, name, ends)).any())


def _in_both(name: str, ends: Bounds, along: Bounds | None) -> Bounds:
    """Bounds of a component at the end, where those along the motion hold as well."""
    low, high = (max(ends[0], along[0]), min(ends[1], along[1])) if along else ends
    if not low <= high:
        raise ValueOutOfBoundsError(
            f"{name} cannot be {brief(ends)} at the end, as its bounds along the motion are "
            f"{brief(along)}"
        )
    return low, high


def _ends_of_duration(given: Any) -> tuple[float, float]:
    try:
        low, high = (_seconds(one) for one in given)
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"duration is a time in s, or two bounds of it, (0.5, 5.0), not {brief(given)}"
        ) from None
    if not low < high < np.inf:
        raise ValueOutOfBoundsError(f"the bounds of the duration do not rise: {brief(given)}")
    return low, high


def _first_signal(quantity: NamedQuantity, given: Any, shares: Array) -> Any:
    """The samples that the search begins with: a number, or a signal over shares of its span."""
    if isinstance(given, Signal):
        low, high = given.times[0], given.times[-1]
        return given(low + shares * (high - low))
    return one_double(given, f"the first value of {quantity.name}", quantity)


# -- what cannot be found -------------------------------------------------------------------------


def _refuse_open(problem: OptimalProblem) -> None:
    """Raise :class:`MechcError` where states could not follow what is found."""
    system, unknowns = problem.system, problem.unknowns
    if system.attitudes.of_length_one:
        raise MechcError(
            f"{system.name} has a quaternion of length one, which the states of a search have not: "
            "describe its attitude by angles, or by a mechc.BallJoint or mechc.FreeJoint"
        )
    if not system.scene.rows:
        return
    if unknowns.parameters and not isinstance(problem.given.start, Mapping):
        raise MechcError(
            f"{unknowns.parameters[0].name} is free, and a whole state y0 does not close the loops "
            "with another value of it: give y0 as a mapping, which is assembled"
        )
    for slot in system.data.get("inputs", ()):
        if slot["of_time"] and slot["name"] in unknowns.controls:
            raise MechcError(
                f"constraints or the mass matrix contain {slot['name']}, so it cannot be found: "
                "describe it as a coordinate, moved by a force that is found"
            )


def _refuse_driven(choice: Choice) -> None:
    """Raise :class:`MechcError` if the motion, cost or conditions would change with the time of the
    begin, while the duration is free."""
    if told := _drives(choice):
        raise MechcError(
            f"the duration is free, and {' and '.join(told)} drives the motion or what is asked of "
            "it: give the duration, or what does not depend on time (expressions may contain t)"
        )


def _drives(choice: Choice) -> list[str]:
    """Names of what depends on time: inputs, rates, outputs of the expressions, events."""
    problem, unknowns = choice.problem, choice.problem.unknowns
    given = {**problem.given.inputs, **dict.fromkeys(unknowns.controls, 0.0)}
    system = (problem.model.with_inputs(given) if given else problem.model).system
    t0, longest = problem.t0, float(unknowns.upper[unknowns.blocks["duration"]][0])
    times = t0 + longest * np.sort(np.arange(TIMES) * UNEVEN % 1.0)
    if system.driven:
        kinks = system.driven.breaks(t0, t0 + longest, problem.run["rtol"])
        times = np.union1d(times, kinks)
    y = np.tile(choice.y0, (len(times), 1))
    terms = problem.integral, problem.final, problem.along, problem.end
    outputs = {one.output for each in terms for one in each.entries}

    def differs(values: Any) -> bool:
        return not np.allclose(values, values[0], rtol=SAME, atol=SAME)

    try:
        found = [name for name in problem.given.inputs if name in system.inputs
                 and differs(system.driven.values([name], times, y)[0])]  # fmt: skip
        rates = not found and differs(system.rates(y, choice.p, times))
        found += ["time in the equations"] * rates
        found += [f"time in {name}" for name in sorted(outputs)
                  if differs(system.evaluate(name, y, choice.p, times))]  # fmt: skip
    except ValueOutOfBoundsError:  # beyond the samples of a signal
        found = list(problem.given.inputs)
    events = read_events(problem.run["events"], system, choice.p, typed_expression)
    found += [f"time in event {k}" for k, one in enumerate(events) if _of_time(one, times, y[0])]
    return found


def _of_time(event: Event, times: Array, y: Array) -> bool:
    """Whether an event, or what its reset gives, depends on time."""
    expression, changes = (getattr(one, name, None) for one, name in
                           ((event.function, "expression"), (event.reset, "changes")))  # fmt: skip
    if expression is not None:
        each = [expression, *(changes or {}).values()]
        return any(symbol.name == "t" for one in each for symbol in one.free_symbols)
    values = [value_of(event, t, y) for t in times.tolist() if callable(event.function)]
    return bool(values) and np.ptp(values) > SAME
