"""One thread at a time imports the compiler and compiles.

Modules that import each other are handed out half made when two threads import them at once, and
what the compiler and SymPy keep for later is theirs for one thread.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
_lock = threading.RLock()


def one_at_a_time(function: Callable[P, R]) -> Callable[P, R]:
    """The function, entered by one thread of the process at a time, which may enter again.

    Whatever waits for another thread must not be called from within.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _lock:
            return function(*args, **kwargs)

    return alone


def _new_lock() -> None:
    """In a process that was forked, the thread that held it is missing."""
    global _lock
    _lock = threading.RLock()


os.register_at_fork(after_in_child=_new_lock)
