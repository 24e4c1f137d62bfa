"""A lock by which one thread at a time imports the compiler and compiles.

Two threads that import modules with mutual imports at once may see them incomplete, and the caches
of the compiler and SymPy are not safe for several threads.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from mechc.files import in_forked_child
from mechc.interrupts import import_as_a_whole

P = ParamSpec("P")
R = TypeVar("R")
_lock = threading.RLock()


def one_at_a_time(function: Callable[P, R]) -> Callable[P, R]:
    """The function, for one thread of the process at a time; calls may be nested.

    It must not wait for another thread.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _lock:
            return function(*args, **kwargs)

    return alone


def _new_lock() -> None:
    """A new lock in a forked process, where the thread that held the old one does not exist."""
    global _lock
    _lock = threading.RLock()


in_forked_child(_new_lock)
import_as_a_whole()
