"""The laws of contacts as expressions of time, state and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechc.simulation.events.event import Event
from mechc.simulation.events.expressions import MOST_KEPT
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.events.stops import NEWTON, POISSON, StopReset

OPEN = 0
WORDS = ("open", "held", "sticks", "slides +", "slides -")  # of mechc_contact_state


@dataclass(frozen=True)
class ContactLaw:
    """One contact, or one place of dry friction; expressions over plain symbols.

    Attributes
    ----------
    number
        Among the events of the run.
    gap, restitution
        Of a stop; None for dry friction at a place that is always in contact.
    slip
        The speed of sliding; None without friction.
    friction, static
        Coefficients while it slides and while it sticks; without a gap the forces in N.
    law
        Of restitution.
    """

    number: int
    gap: Any = None
    restitution: Any = 0.0
    slip: Any = None
    friction: Any = 0.0
    static: Any = 0.0
    law: str = NEWTON


class Contacts(NamedTuple):
    """Contacts among the events of a run, as the driver takes them.

    Attributes
    ----------
    numbers : (k,)
        Of each event the number of the contact that it is, or -1.
    has_gap, has_friction : (n,)
        Of each contact.
    is_linear : (n,)
        Whether parameters alone decide the coefficients of its slip, a linear function of the
        speeds and a constant, and its friction.
    poisson
        Whether impacts follow Poisson's law of restitution, not Newton's.
    quantities
        Of all contacts, row after row.
    """

    numbers: NDArray[np.intc]
    has_gap: NDArray[np.uint8]
    has_friction: NDArray[np.uint8]
    is_linear: NDArray[np.uint8]
    poisson: bool
    quantities: list[Any]


def contacts_of(laws: Sequence[ContactLaw], events: int, nq: int, nu: int) -> Contacts:
    """The contacts among so many events of a model with nq coordinates and nu speeds."""
    numbers = np.full(events, -1, np.intc)
    numbers[[law.number for law in laws]] = np.arange(len(laws))
    return Contacts(
        numbers,
        np.array([law.gap is not None for law in laws], np.uint8),
        np.array([law.slip is not None for law in laws], np.uint8),
        np.array([_is_linear(law, nq, nu) for law in laws], np.uint8),
        any(law.law == POISSON for law in laws),
        [entry for law in laws for entry in quantities(law, nq, nu)],
    )


def contact_laws(events: Sequence[Any]) -> list[ContactLaw]:
    """The laws of the contacts among a run's events."""
    found = []
    for number, event in enumerate(events):
        function, reset = getattr(event, "function", None), getattr(event, "reset", None)
        if isinstance(function, FrictionLaw):
            found.append(ContactLaw(number, None, 0.0, *function.expressions))
        elif isinstance(event, Event) and isinstance(reset, StopReset):
            gap, kept = reset.gap.expression, reset.restitution
            found.append(ContactLaw(number, gap, kept, *reset.friction.expressions, reset.law))
    return found


def _symbols(nq: int, nu: int) -> tuple[Any, list[Any], list[Any], list[Any]]:
    """t, q, u and q' of the expressions of laws."""
    from sympy import Symbol

    q, u, v = (
        [Symbol(f"y{k}", real=True) for k in range(first, first + count)]
        for first, count in ((0, nq), (nq, nu), (nq + nu, nq))
    )
    return Symbol("t", real=True), q, u, v


@lru_cache(MOST_KEPT)
def _is_linear(law: ContactLaw, nq: int, nu: int) -> bool:
    """Whether slip and friction of a contact are linear, as :class:`Contacts` says."""
    from sympy import diff, expand, sympify

    if law.slip is None:
        return False
    t, q, u, _ = _symbols(nq, nu)
    slopes = [diff(law.slip, x) for x in u]
    rest = expand(law.slip - sum(slope * x for slope, x in zip(slopes, u, strict=True)))
    constants = [*slopes, rest, *map(sympify, (law.friction, law.static))]
    return all(value.free_symbols.isdisjoint((t, *q, *u)) for value in constants)


@lru_cache(MOST_KEPT)
def quantities(law: ContactLaw, nq: int, nu: int) -> list[Any]:
    """The quantities of a contact by t, y = (q, u, q') and p: ``hybrid/events/functions.h``."""
    from sympy import Integer, diff, sympify

    t, q, u, v = _symbols(nq, nu)

    def along(value: Any) -> Any:
        return diff(value, t) + sum(diff(value, x) * rate for x, rate in zip(q, v, strict=True))

    gap = Integer(0) if law.gap is None else law.gap
    slip = Integer(0) if law.slip is None else law.slip
    rate = along(gap)
    coefficients = map(sympify, (law.restitution, law.friction, law.static))
    return [
        gap, rate, along(rate), slip, along(slip), *coefficients,
        *(diff(gap, x) for x in q), *(diff(slip, x) for x in u),
    ]  # fmt: skip
