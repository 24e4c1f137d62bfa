"""The tools that mechc is compared with, by name; each module is imported when it is first used.

A module ``peers.NAME`` has ``TOOLS``, the names that it reports as, and
``build(problem, tolerances, *, quick=False)``, which gives its cases and the seconds of setting
up; it raises ImportError where its package is missing and :class:`NotExpressibleError` where it
cannot model the problem.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType
from typing import Any

from ..problems.problem import NotExpressibleError, Problem
from ..timing.cases import Case

MODULES = {
    "heyoka": "heyoka_taylor", "scipy": "scipy_ivp", "casadi": "casadi_sundials",
    "sundae": "sundae", "notebook": "notebook", "pydy": "pydy_cython",
    "pinocchio": "pinocchio_tree", "mujoco": "mujoco_engine", "exudyn": "exudyn_engine",
}  # fmt: skip
NAMES = tuple(MODULES)
FINEST = 1e-15  # below it doubles cannot tell a step's error from its rounding
__all__ = ["NAMES", "Built", "NotExpressibleError", "build", "module_of", "with_tighter"]


@dataclass
class Built:
    """Cases of a peer on a problem, and per tool name the seconds of "derive" and "compile"."""

    cases: list[Case]
    setup: dict[str, dict[str, float]] = field(default_factory=dict)

    def timed(self, tool: str, equations: Any, make: Callable[[Any], Any]) -> Any:
        """What is made of the equations; the seconds of both are noted."""
        began = time.perf_counter()
        made = make(equations)
        compiled = time.perf_counter() - began
        self.setup[tool] = {"derive": equations.seconds, "compile": compiled}
        return made


def module_of(name: str) -> ModuleType:
    """The module of a peer; a KeyError where none is called so."""
    return import_module(f".{MODULES[name]}", __name__)


def build(
    name: str, problem: Problem, tolerances: Sequence[float], *, quick: bool = False
) -> Built:
    """The cases of a peer on a problem."""
    built: Built = module_of(name).build(problem, tolerances, quick=quick)
    return built


def with_tighter(tolerances: Sequence[float], finest: float = FINEST) -> list[float]:
    """The tolerances, and decades on from the tightest where that is 1e-12 or less.

    What is compared is time over the error that was achieved.  The error of a multistep method
    may be thousands of times the tolerance: left at what others are given it would seem to stop
    at an error that it can well go beyond.
    """
    wanted = list(tolerances)
    while min(wanted) < 2e-12 and min(wanted) / 10 > 0.9 * finest:
        wanted.append(min(wanted) / 10)
    return wanted
