"""Expressions of events: typed ones read, and all of a run made tapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.native._events import EventTapes

MOST_KNOWN = 256
_known: dict[Any, EventTapes | None] = {}  # by the expressions


@one_at_a_time
def typed_expression(text: str, names: Mapping[str, Any]) -> Any:
    """The expression of these names that a text is.

    Raises :class:`ExpressionError` if it is not of the grammar.
    """
    from mechc_codegen.description.parsing.parser import parse_expression

    errors_of_compiler()
    return parse_expression(text, names)


@one_at_a_time
def event_tapes(
    events: Sequence[tuple[Any, Mapping[int, Any] | None]], contacts: Sequence[Any], width: int,
    parameters: int,
) -> EventTapes | None:  # fmt: skip
    """Tapes of events and contacts, each made once.

    None for functions that have no form in C, or are too long, and where there are none.
    """
    plain = tuple(
        (value, None if reset is None else tuple(reset.items())) for value, reset in events
    )
    asked = (plain, tuple(contacts), width, parameters)
    if asked not in _known:
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known[asked] = _assemble(events, contacts, width, parameters)
    return _known[asked]


def _assemble(
    events: Sequence[tuple[Any, Mapping[int, Any] | None]], contacts: Sequence[Any], width: int,
    parameters: int,
) -> EventTapes | None:  # fmt: skip
    if not contacts and all(value is None for value, _ in events):
        return None
    from mechc_codegen.emit.tape import event_tapes as of_codegen
    from mechc_codegen.emit.tape.assembler import NoTapeError
    from mechc_codegen.emit.units.event_functions import EventExpressions

    errors = errors_of_compiler()
    expressions = [EventExpressions(*event) for event in events]
    try:
        found = of_codegen.event_tapes(expressions, contacts, width)
    except (errors["MechanismError"], NoTapeError, RecursionError):  # sums of many terms
        return None
    numbers = np.array(found.numbers, np.intc).reshape(len(events), 3)
    return EventTapes(width, parameters, numbers, found.contacts, tuple(found.code))


COMPILER = (typed_expression, event_tapes)  # what events need of this folder
