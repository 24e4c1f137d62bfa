"""The contacts of a mechanism itself, which are in each of its runs, as events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from mechc.simulation.events.expressions import is_one_event
from mechc.simulation.events.friction import DryFriction
from mechc.simulation.events.stops import Stop


class WithoutContacts(tuple[Any, ...]):
    """No events, and no contacts of the mechanism: of parts of a motion that are computed again."""


WITHOUT = WithoutContacts()


def with_own_contacts(given: Any, metadata: Mapping[str, Any], cache: dict[Any, Any]) -> Any:
    """Events, or one by itself, and after them the stops and dry friction of a scene.

    Its stops have the law of restitution of those given.

    ``metadata``: that of the scene; ``cache``: of its system, where they are kept.
    """
    contacts = metadata.get("contacts", ())
    if not contacts or given is WITHOUT:
        return given
    if "own contacts" not in cache:
        cache["own contacts"] = [*map(_contact, contacts)]
    single = not isinstance(given, (tuple, list)) and is_one_event(given)
    every, own = [given] if single else [*given], cache["own contacts"]
    for law in {each.law for each in every if isinstance(each, Stop)}:
        own = [replace(each, law=law) if isinstance(each, Stop) else each for each in own]
    return (*every, *own)


def _contact(parts: Mapping[str, Sequence[Any]]) -> Stop | DryFriction:
    values = {name: _polynomial(terms) for name, terms in parts.items()}
    return Stop(values["gap"]) if "gap" in values else DryFriction(values["slip"], values["force"])


def _polynomial(terms: Sequence[Any]) -> Any:
    from sympy import Add, Mul, Symbol, sympify

    return Add(*(
        Mul(sympify(coefficient), *(Symbol(name) ** power for name, power in powers.items()))
        for coefficient, powers in terms
    ))  # fmt: skip
