"""The door to the compiler: one thread at a time passes it, and errors of users come back short.

Two threads that import modules with mutual imports at once may see them incomplete, and the caches
of the compiler and SymPy are not safe for several threads.

Below the door an error of a description is twenty calls deep, which tell its author nothing: the
traceback ends at the door.  ``MECHC_TRACEBACK=full`` keeps all of it; what may be a bug of mechc,
an :class:`InternalError`, a :class:`CompilerError` or an error of Python, always has all of it.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from mechc.errors import CacheError, CompilerError, MechcError
from mechc.files import in_forked_child
from mechc.interrupts import import_as_a_whole

P = ParamSpec("P")
R = TypeVar("R")
TRACEBACK = "MECHC_TRACEBACK"  # the variable of the environment
_lock = threading.RLock()


def one_at_a_time(function: Callable[P, R]) -> Callable[P, R]:
    """The function, for one thread of the process at a time; calls may be nested.

    It must not wait for another thread.  Errors of a description leave it without what is below.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _lock:
            try:
                return function(*args, **kwargs)
            except MechcError as error:
                if os.environ.get(TRACEBACK) == "full" or _may_be_a_bug(error):
                    raise
                __tracebackhide__ = True  # in pytest and IPython
                raise error.with_traceback(None)  # noqa: B904  # it is the same error

    return alone


def _may_be_a_bug(error: MechcError) -> bool:
    from mechc_codegen.errors import InternalError

    return isinstance(error, (CacheError, CompilerError, InternalError))


def _new_lock() -> None:
    """A new lock in a forked process, where the thread that held the old one does not exist."""
    global _lock
    _lock = threading.RLock()


in_forked_child(_new_lock)
import_as_a_whole()
