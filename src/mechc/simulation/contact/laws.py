"""The laws of contacts as functions of time, state and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mechc.simulation.events.event import Event
from mechc.simulation.events.expressions import MOST_KEPT, function_of
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.events.stops import NEWTON, POISSON, StopReset
from mechc.system.parameters import Array
from mechc.system.system import System

Mask: TypeAlias = "np.ndarray[Any, np.dtype[np.bool_]]"
IRRATIONAL = 0.6180339887498949


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


class Numbers(NamedTuple):
    """Values of n laws at one state; 0 where a law has no such quantity.

    ``gap``, its ``rate`` and the part of its acceleration that is not linear in q'' (n,), its
    ``slopes`` by the coordinates (n, nq); ``slip``, the part of its rate without u' (n,), its
    ``rows`` over the speeds (n, nu); ``restitution``, ``friction`` and ``static`` (n,).
    """

    gap: Array
    rate: Array
    bend: Array
    slopes: Array
    slip: Array
    drift: Array
    rows: Array
    restitution: Array
    friction: Array
    static: Array


def contact_laws(events: Sequence[Any]) -> list[ContactLaw]:
    """The laws of those of a run's events that are contacts."""
    found = []
    for number, event in enumerate(events):
        function, reset = getattr(event, "function", None), getattr(event, "reset", None)
        if isinstance(function, FrictionLaw):
            found.append(ContactLaw(number, None, 0.0, *function.expressions))
        elif isinstance(event, Event) and isinstance(reset, StopReset):
            gap, kept = reset.gap.expression, reset.restitution
            found.append(ContactLaw(number, gap, kept, *reset.friction.expressions, reset.law))
    return found


class Laws:
    """The laws of all contacts of a run, evaluated together; ``has_gap``, ``has_friction`` (n,);
    ``poisson``: whether impacts follow Poisson's law of restitution.

    ``compiler``: as :attr:`mechc.simulation.events.expressions.Compiler.compile`; None: none.
    """

    def __init__(
        self, laws: Sequence[ContactLaw], system: System, p: Array, compiler: Any = None
    ) -> None:
        self.laws, self.system, self.p, self.compiler = tuple(laws), system, p, compiler
        self.has_gap = np.array([law.gap is not None for law in laws])
        self.has_friction = np.array([law.slip is not None for law in laws])
        self.poisson = any(law.law == POISSON for law in laws)

    def __len__(self) -> int:
        return len(self.laws)

    @cached_property
    def function(self) -> Any:
        """Their table, as :class:`mechc.native._contact.ContactEquations` takes it: compiled, or
        where an expression has no form in C a function of Python."""
        made = None
        if self.compiler is not None:
            from sympy import Integer

            told = [(Integer(0), dict(enumerate(self._expressions)), None)]
            made = self.compiler(told, len(self._expressions), len(self.p))
        return self.values if made is None else made

    def values(self, t: float, state: Array) -> Array:
        """Their table (n, 8 + nq + nu) at one state with the coordinates' rates (2 nq + nu,)."""
        with np.errstate(all="ignore"):
            found = function_of(self._expressions)(t, state, self.p)
        return np.array(found, dtype=np.float64).reshape(len(self.laws), -1)

    def numbers(self, table: Array) -> Numbers:
        """By their names."""
        nq = len(self.system.coordinates)
        gap, rate, bend, slip, drift, restitution, friction, static = table[:, :8].T
        return Numbers(
            gap, rate, bend, table[:, 8 : 8 + nq], slip, drift, table[:, 8 + nq :], restitution,
            friction, static,
        )  # fmt: skip

    @cached_property
    def _expressions(self) -> list[Any]:
        sizes = len(self.system.coordinates), len(self.system.speeds)
        return [entry for law in self.laws for entry in _entries(law, *sizes)]


@lru_cache(MOST_KEPT)
def _entries(law: ContactLaw, nq: int, nu: int) -> list[Any]:
    """The columns of :meth:`Laws.values`."""
    from sympy import Integer, Symbol, diff, sympify

    t = Symbol("t", real=True)
    q, u, v = (
        [Symbol(f"y{k}", real=True) for k in range(first, first + count)]
        for first, count in ((0, nq), (nq, nu), (nq + nu, nq))
    )

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


def has_plain_kinematics(system: System, p: Array, times: tuple[float, float]) -> bool:
    """Whether q' = u at every state: at two that have nothing in common, at two times."""
    nq, nu = len(system.coordinates), len(system.speeds)
    if nq != nu:
        return False
    for k, t in zip((1.0, 2.0), times, strict=True):
        y = np.modf(IRRATIONAL * k * np.arange(1.0, 1.0 + nq + nu))[0]
        if not np.array_equal(system.rates(y, p, t)[:nq], y[nq:]):
            return False
    return True
