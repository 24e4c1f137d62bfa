"""Events and laws of contacts as expressions -> tapes, ``runtime/hybrid/events/by_tape.h``.

Input: expressions over the symbols t, y0, y1, ..., p0, p1, ...  Output: numbers.  Invariant: they
are the operations of the C that exports have.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sympy import Expr

from mechc_codegen.emit.tape.code import Code, CodeParts
from mechc_codegen.emit.units.event_functions import KINDS, EventExpressions, functions_of


class AssembledEvents(NamedTuple):
    """The tapes of the functions of events.

    Attributes
    ----------
    numbers
        Of each event the tapes of its value, its slopes and its reset, -1 without.
    contacts
        The tape of the quantities of all contacts, or -1.
    code
        What they have in common.
    """

    numbers: list[list[int]]
    contacts: int
    code: CodeParts


def event_tapes(
    events: Sequence[EventExpressions], contacts: Sequence[Expr], width: int
) -> AssembledEvents:
    """The tapes for states of ``width`` components.

    ``contacts``: the quantities of all contacts, row after row; () without any.

    Raises
    ------
    MechanismError
        For a function that has no form in C.
    NoTapeError
        For one that no tape holds.
    """
    code, numbers, of_contacts = Code(), [[-1] * len(KINDS) for _ in events], -1
    for each in functions_of(events, contacts, width):
        code.lookups |= {table.__name__: table for table in each.tables}
        tape = code.add(each.lines, ("y", "p", "out"))
        if each.kind == "contacts":
            of_contacts = tape
        else:
            numbers[each.event][KINDS.index(each.kind)] = tape
    return AssembledEvents(numbers, of_contacts, code.parts())
