"""Errors of the compiler: the user's faults in one family, our own in the other."""

from __future__ import annotations


class CodegenError(Exception):
    """Base of everything the compiler raises on purpose."""


class MechanismError(CodegenError, ValueError):
    """The description is wrong: the message names the symbol and what to do about it."""


class ExpressionError(CodegenError, ValueError):
    """A typed expression could not be read: the message shows where."""


class InternalError(CodegenError):
    """An invariant of the compiler does not hold: our bug, not the user's."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"{what}. This is a bug in mechc, not in your mechanism: please report it "
            "together with the mechanism's description."
        )
