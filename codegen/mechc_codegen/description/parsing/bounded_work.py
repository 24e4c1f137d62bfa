"""A bound on SymPy's work for a typed text.

The time of SymPy for an expression does not follow from its length: some of twenty characters take
minutes.  Calls of Python functions are counted, so the bound is the same on every machine.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class TooMuchWorkError(BaseException):
    """The bound was reached; not caught by ``except Exception``."""


def with_at_most(calls: int, work: Callable[[], T]) -> T:
    """The result of ``work()``, stopped after so many calls of Python functions in this thread.

    Raises
    ------
    TooMuchWorkError
        When there are more.
    """
    left = calls

    def count(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal left
        if event == "call":
            left -= 1
            if left < 0:
                raise TooMuchWorkError

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        return work()
    finally:
        _profile_by(before)


def _profile_by(profiler: Any) -> None:
    """Profile this thread as before; a profiler in C, which is not called, enables itself."""
    if profiler is None or callable(profiler):
        sys.setprofile(profiler)
    else:
        sys.setprofile(None)
        profiler.enable()
