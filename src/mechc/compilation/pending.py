"""A model that can be used before all of it is compiled.

Rates and outputs are compiled first, in a fraction of the time that the integrators take; those
follow in the background, and whatever needs them waits for them.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Any

OUTPUTS_ONLY = frozenset(
    (
        *("coordinates", "speeds", "rows", "holonomic", "parameters", "inputs", "width"),
        *("metadata", "instruction_set", "outputs", "complete", "complete_rows", "evaluate"),
    )
)


class Pending:
    """Something that is made in the background; whoever asks for it waits.

    Not begun at once, it is made when it is asked for.  In a process that was forked meanwhile,
    where the thread is missing, it is made anew; so it is after it failed, when asked for again.
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

    def result(self) -> Any:
        """What was made; an error of the making is raised here."""
        if self._begun and self._process == os.getpid():
            self._thread.join()
            self._begun, error = False, self._error
            self._error = None
            if error is not None:
                raise error
        if self._made is None:
            self._made = self._make()
        return self._made


class DeferredScene:
    """What a compiled scene can do, by its first unit where that is enough."""

    def __init__(self, first: Any, whole: Pending) -> None:
        self._first, self._whole = first, whole

    def __getattr__(self, name: str) -> Any:
        return getattr(self._first if name in OUTPUTS_ONLY else self._whole.result(), name)
