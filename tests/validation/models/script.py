"""What a person's script holds once its equations are formed, and the list of all scripts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sympy import Expr, Symbol

Values = Mapping[Expr, float]


@dataclass(frozen=True)
class Script:
    """A formed method and its numbers, kept by symbol.

    ``start`` says coordinates and speeds (rates, with Lagrange's method); where constraints leave
    some of them to be found, ``guess`` says near which values.  ``inputs`` are numbers or
    functions of time, ``rates`` those of states that the method does not own, and ``further``
    what else ``mechc.compile`` is told.
    """

    method: Any
    constants: dict[Symbol, float]
    start: Values
    t_end: float
    inputs: Mapping[Expr, float | Callable[[float], float]] = field(default_factory=dict)
    guess: Values = field(default_factory=dict)
    rates: Mapping[Expr, Expr] = field(default_factory=dict)
    further: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Published:
    """A model, the page that its equations come from, and the function that derives them."""

    name: str
    source: str
    derive: Callable[[], Script]


MODELS: dict[str, Published] = {}


def published(source: str) -> Callable[[Callable[[], Script]], Callable[[], Script]]:
    """Enter a function that derives a model into the list of all."""

    def enter(derive: Callable[[], Script]) -> Callable[[], Script]:
        name = derive.__name__
        MODELS[name] = Published(name, source, derive)
        return derive

    return enter
