"""Expressions of events: typed ones read, and all of a run compiled into one small unit."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mechc.compilation import entries, toolchain
from mechc.compilation.compiler import errors_of_compiler
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.toolchain.processor import environment
from mechc.native._events import EventFunctions

SOURCE = "events.c"
FLAGS = ("-std=gnu11", "-O2", "-fno-math-errno", "-ffp-contract=off", "-fvisibility=hidden")
MOST_KNOWN = 256
_compiled: dict[str, EventFunctions] = {}
_known: dict[Any, EventFunctions | None] = {}  # by the expressions


@one_at_a_time
def typed_expression(text: str, names: Mapping[str, Any]) -> Any:
    """The expression of these names that a text is.

    Raises :class:`ExpressionError` if it is not of the grammar.
    """
    from mechc_codegen.description.parsing.parser import parse_expression

    errors_of_compiler()
    return parse_expression(text, names)


@one_at_a_time
def event_functions(
    events: Sequence[tuple[Any, Mapping[int, Any] | None]], contacts: Sequence[Any], width: int,
    parameters: int,
) -> EventFunctions | None:  # fmt: skip
    """Compiled functions of events and contacts, from the cache where they are known.

    None for functions that have no form in C, where there are none, and without a C compiler.
    """
    plain = tuple(
        (value, None if reset is None else tuple(reset.items())) for value, reset in events
    )
    asked = (plain, tuple(contacts), width, parameters)
    if asked not in _known:
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known[asked] = _compile(events, contacts, width, parameters)
    return _known[asked]


def _compile(
    events: Sequence[tuple[Any, Mapping[int, Any] | None]], contacts: Sequence[Any], width: int,
    parameters: int,
) -> EventFunctions | None:  # fmt: skip
    if not contacts and all(value is None for value, _ in events):
        return None
    from mechc_codegen.emit.units.event_unit import EventExpressions, event_unit

    errors = errors_of_compiler()
    if toolchain.find_compiler() is None:
        return None
    try:
        text = event_unit(
            [EventExpressions(*event) for event in events], contacts, width, parameters
        )
    except errors["MechanismError"]:
        return None
    return load_functions(text)


def load_functions(text: str) -> EventFunctions:
    """The functions that C of :func:`event_functions` is, compiled where they are not known."""
    from mechc_codegen.extension.flags import RUNTIME

    header = (RUNTIME / "hybrid" / "events" / "functions.h").read_text("utf-8")
    deciding = "\n".join([text, header, *FLAGS, *environment()])
    key = hashlib.sha256(deciding.encode()).hexdigest()

    def write(work: Path) -> None:
        work.mkdir()
        (work / SOURCE).write_text(text, "utf-8")

    if key not in _compiled:
        _compiled[key] = entries.load_or_make(
            key, lambda folder: entries.make_of_one(folder, write, SOURCE, FLAGS),
            lambda path: EventFunctions(path, text),
        )  # fmt: skip
    return _compiled[key]


COMPILER = (typed_expression, event_functions)  # what events need of this folder
