"""Errors of the compiler: wrong descriptions in one family, bugs of mechc in the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self


class CodegenError(Exception):
    """Base of all errors of the compiler."""

    _kinds: ClassVar[Mapping[type[CodegenError], type[CodegenError]]] = {}

    def __new__(cls, *args: Any) -> Self:
        """An error of the kind that :func:`raise_as` names, where it names one."""
        return super().__new__(CodegenError._kinds.get(cls, cls), *args)  # type: ignore[return-value]


class MechanismError(CodegenError, ValueError):
    """The description is wrong: the message names the symbol and says what to do."""


class ExpressionError(CodegenError, ValueError):
    """A typed expression could not be read: the message shows where."""


class SkippedPartWarning(UserWarning):
    """A file has parts that move or hold its mechanism, and mechc does not take them."""


class InternalError(CodegenError):
    """An invariant of the compiler does not hold: a bug of mechc."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"{what}. This is a bug in mechc, not in your mechanism: please report it "
            "together with the mechanism's description."
        )


KINDS = (CodegenError, MechanismError, ExpressionError, InternalError)


def raise_as(kinds: Mapping[type[CodegenError], type[CodegenError]]) -> None:
    """Raise children of these classes in their place: a program's own errors, which this package
    cannot import."""
    CodegenError._kinds = dict(kinds)
