"""The settings of a functional mock-up unit, and its variables.

Input: the metadata of a scene, and start values.  Output: variables in the order of their value
references, which ``runtime/fmu/instance.h`` counts in the same way.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from mechc_codegen.emit.metadata import distinct
from mechc_codegen.emit.units.event_functions import EventExpressions

VERSIONS = ("3.0", "2.0")
_DRIFT = (
    "model exchange: a state that is farther from the constraints than this, over its nominal "
    "value, is moved onto them in event mode; 0: never"
)
# Signs that XML 1.0 cannot hold, and those that end a line.
_NO_TEXT = re.compile("[^\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True)
class FmuEvents:
    """The events of a unit.

    Attributes
    ----------
    titles, directions, expressions
        Of each event; direction 0: its zero is crossed in both.
    contacts
        Of each event the number of the contact that it is, or -1.
    has_gap, has_friction, is_linear
        Of each contact.
    poisson
        Whether impacts follow Poisson's law of restitution, not Newton's.
    quantities
        Of all contacts, row after row: ``hybrid/events/functions.h``.
    """

    titles: Sequence[str] = ()
    directions: Sequence[float] = ()
    expressions: Sequence[EventExpressions] = ()
    contacts: Sequence[int] = ()
    has_gap: Sequence[int] = ()
    has_friction: Sequence[int] = ()
    is_linear: Sequence[int] = ()
    poisson: bool = False
    quantities: Sequence[Any] = ()

    def every_expression(self) -> Iterator[Any]:
        """All expressions of the events."""
        for event in self.expressions:
            yield from () if event.value is None else (event.value,)
            yield from (event.reset or {}).values()
        yield from self.quantities


@dataclass(frozen=True)
class FmuOptions:
    """The settings of an export.

    Attributes
    ----------
    name
        Begins names of files.
    start
        State (nq + nu), SI units.
    values
        Parameters that were given, by name; the others have their defaults, and follow.
    rtol
        Tolerance of co-simulation.
    version
        Version of FMI, one of :data:`VERSIONS`.
    end
        End of the default experiment, s.
    drift
        The least drift that model exchange projects away.
    tool
        Name and version of what exports.
    derivatives
        Whether the unit offers derivatives, which take most of the time of a large mechanism.
    events
        The events over the symbols t, y0, y1, ..., p0, p1, ... of a scene with this metadata.
    """

    name: str
    start: Sequence[float]
    values: Mapping[str, float]
    rtol: float
    version: str = VERSIONS[0]
    end: float = 1.0
    drift: float = 0.0
    tool: str = ""
    derivatives: bool = True
    events: Callable[[Mapping[str, Any]], FmuEvents] = lambda metadata: FmuEvents()


@dataclass(frozen=True)
class Variable:
    """One real variable; ``rate_of``: the reference of the state whose rate it is."""

    name: str
    causality: str
    variability: str
    initial: str | None = None
    start: float | None = None
    unit: str = ""
    description: str = ""
    rate_of: int | None = None
    lower: float | None = None
    upper: float | None = None
    is_indicator: bool = False


@dataclass(frozen=True)
class StartValues:
    """Start values: states, parameters in the scene's order, and which of these follow others."""

    states: Sequence[float]
    parameters: Sequence[float]
    calculated: Sequence[bool]
    drift: float


def variables(
    metadata: Mapping[str, Any], values: StartValues, events: Sequence[str] = ()
) -> list[Variable]:
    """All variables; the place of each in the list is its value reference.

    ``events``: the expressions whose zeros are events, as text.
    """
    found = [Variable("time", "independent", "continuous", unit="s"), *_states(metadata, values)]
    found += _parameters(metadata, values)
    found.append(Variable("mechc.drift", "parameter", "tunable", "exact", values.drift, "", _DRIFT))
    found += [
        Variable(each["name"], "input", "continuous", unit=each["unit"], start=0.0)
        for each in metadata.get("inputs", ()) if 0 in each["orders"]
    ]  # fmt: skip
    found += _outputs(metadata)
    found += [
        Variable(f"mechc.event[{number}]", "local", "continuous", "calculated",
                 description=f"zero at the event: {title}", is_indicator=True)
        for number, title in enumerate(events)
    ]  # fmt: skip
    names = distinct(plain_text(each.name) or "_" for each in found)
    return [
        replace(each, name=name, description=plain_text(each.description))
        for each, name in zip(found, names, strict=True)
    ]


def plain_text(words: str) -> str:
    """The words without line breaks and characters that XML does not allow."""
    return _NO_TEXT.sub("\ufffd", words)


def open_inputs(metadata: Mapping[str, Any]) -> list[int]:
    """The places of inputs, without their rates, among the values that a run is given."""
    orders = [order for each in metadata.get("inputs", ()) for order in each["orders"]]
    return [place for place, order in enumerate(orders) if order == 0]


def output_sizes(metadata: Mapping[str, Any]) -> list[tuple[str, int]]:
    """The outputs, in the order of the rows of their Jacobians."""
    own = [(name, 1) for name in metadata["own"]]
    return own + [(name, size) for name, size in metadata.get("differentiated", ())]


def _states(metadata: Mapping[str, Any], values: StartValues) -> Iterator[Variable]:
    described = [*metadata["coordinates"], *metadata["speeds"]]
    for quantity, start in zip(described, values.states, strict=True):
        yield replace(_quantity(quantity), causality="output", variability="continuous",
                      initial="exact", start=float(start))  # fmt: skip
    for number, quantity in enumerate(described):
        yield Variable(
            f"der({quantity['name']})", "local", "continuous", "calculated",
            unit=_rate_unit(quantity["unit"]), rate_of=1 + number,
        )  # fmt: skip


def _rate_unit(unit: str) -> str:
    """The unit of a rate, if the quantity has a known and simple unit."""
    known = {"rad": "rad/s", "m": "m/s", "rad/s": "rad/s^2", "m/s": "m/s^2", "1": "1/s"}
    return known.get(unit, f"{unit}/s" if unit and "/" not in unit else "")


def _quantity(told: Mapping[str, Any]) -> Variable:
    return Variable(
        told["name"], "parameter", "tunable", unit=told["unit"], description=told["description"]
    )


def _parameters(metadata: Mapping[str, Any], values: StartValues) -> Iterator[Variable]:
    columns = (metadata["parameters"], values.parameters, values.calculated)
    for told, start, calculated in zip(*columns, strict=True):
        each = _quantity(told)
        if calculated:
            yield replace(each, causality="calculatedParameter", initial="calculated")
        else:
            yield replace(each, initial="exact", start=float(start),
                          lower=told["lower"], upper=told["upper"])  # fmt: skip


def _outputs(metadata: Mapping[str, Any]) -> Iterator[Variable]:
    sizes = metadata.get("differentiated", ())
    labels = [(name, name) for name in metadata["own"]]
    labels += [(name, label) for name, size in sizes for label in _labels(metadata, name, size)]
    for name, label in labels:
        unit = metadata["output_units"].get(name, "")
        yield Variable(label, "output", "continuous", "calculated", unit=unit)


def _labels(metadata: Mapping[str, Any], name: str, size: int) -> Iterator[str]:
    """Labels ``points[A,x]``, by the point, body or joint of an element, where shapes allow it."""
    shape = metadata["shapes"].get(name, [size])
    axes: list[Sequence[Any]] = [range(each) for each in shape]
    if metadata["axes"].get(name, [""])[-1] == "xyz":
        axes = [metadata[metadata["axes"][name][0]], "xyz"]
    if math.prod(shape) != size:
        axes = [range(size)]
    for place in product(*axes):
        yield f"{name}[{','.join(map(str, place))}]" if place else name
