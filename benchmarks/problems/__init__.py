"""The problems of the suite by name; each is built when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from _problem import Problem

from problems import four_bar

BUILDERS: dict[str, Callable[[], Problem]] = {
    "four_bar_regular": four_bar.regular,
    "four_bar_change_point": four_bar.change_point,
}
NAMES = tuple(BUILDERS)


@cache
def problem(name: str) -> Problem:
    return BUILDERS[name]()
