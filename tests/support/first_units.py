"""Rates and outputs alone: what is compiled first, without the integrators behind it."""

from __future__ import annotations

from typing import Any


class NeverBehind:
    """In place of the thread that compiles the integrators."""

    def __init__(self, make: Any, at_once: bool) -> None:
        self.result = make
