"""Rates and outputs alone: integrators are compiled when they are asked for, not behind a test."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mechc.compilation.pending import Pending


class MadeOnRequest(Pending):
    """In place of the thread that compiles the integrators: many tests need none."""

    def __init__(self, make: Callable[[], Any], *, at_once: bool = True) -> None:
        super().__init__(make, at_once=False)
