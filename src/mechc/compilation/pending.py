"""Objects that are made in the background."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any


class Pending:
    """An object that is made in the background; a request for it waits.

    If it was not begun at once, it is made when requested.  In a forked process, which has no such
    thread, it is made again; so it is at the next request after a failure.
    """

    def __init__(self, make: Callable[[], Any], *, at_once: bool = True) -> None:
        self._make, self._process = make, os.getpid()
        self._made: Any = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="mechc compiler", daemon=True)
        self._begun = at_once
        if at_once:
            self._thread.start()

    def _run(self) -> None:
        try:
            self._made = self._make()
        except BaseException as error:
            self._error = error

    def if_made(self) -> Any:
        """The object, or None."""
        return self._made

    def result(self) -> Any:
        """The object; an error of its making is raised here."""
        if self._begun and self._process == os.getpid():
            self._thread.join()
            self._begun, error = False, self._error
            self._error = None
            if error is not None:
                raise error
        if self._made is None:
            self._made = self._make()
        return self._made

