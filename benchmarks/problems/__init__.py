"""The problems of the suite by name; each is built at its first use."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module

from .problem import Problem

# Module and what builds the problem, in the order in which they are shown.
BUILDERS: dict[str, tuple[str, str, tuple[int, ...]]] = {
    "pendulum_1": ("library", "simple", ()), "pendulum_2": ("library", "chain", (2,)),
    "pendulum_5": ("library", "chain", (5,)), "pendulum_10": ("library", "chain", (10,)),
    "four_bar_regular": ("four_bar", "regular", ()),
    "four_bar_change_point": ("four_bar", "change_point", ()),
    "windows_1": ("windows", "row", (1,)), "windows_2": ("windows", "row", (2,)),
    "windows_5": ("windows", "row", (5,)), "slider_crank": ("library", "crank_and_slider", ()),
    "andrews": ("library", "squeezing_mechanism", ()), "heavy_top": ("library", "top", ()),
    "flyball_governor": ("library", "governor", ()), "bicycle": ("bicycle", "without_hands", ()),
}  # fmt: skip
NAMES = tuple(BUILDERS)


@cache
def problem(name: str) -> Problem:
    """The problem of this name; a KeyError where there is none."""
    module, build, numbers = BUILDERS[name]
    made: Callable[..., Problem] = getattr(import_module(f".{module}", __name__), build)
    return made(*numbers)
