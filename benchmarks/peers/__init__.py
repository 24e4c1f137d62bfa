"""The tools that mechc is compared with, by name; each module is imported when it is first used.

A module ``peers.NAME`` has ``TOOLS``, the names that it reports as, and
``build(problem, tolerances, *, quick=False)``, which gives its cases and the seconds of setting
up; it raises ImportError where its package is missing and :class:`NotExpressibleError` where it
cannot model the problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType

from ..problems.problem import NotExpressibleError, Problem
from ..timing.cases import Case

MODULES = {
    "heyoka": "heyoka_taylor",
    "scipy": "scipy_ivp",
    "casadi": "casadi_sundials",
    "sundae": "sundae",
    "notebook": "notebook",
    "pydy": "pydy_cython",
    "pinocchio": "pinocchio_tree",
    "mujoco": "mujoco_engine",
    "exudyn": "exudyn_engine",
}
NAMES = tuple(MODULES)
__all__ = ["NAMES", "Built", "NotExpressibleError", "build", "module_of"]


@dataclass
class Built:
    """Cases of a peer on a problem, and per tool name the seconds of "derive" and "compile"."""

    cases: list[Case]
    setup: dict[str, dict[str, float]] = field(default_factory=dict)


def module_of(name: str) -> ModuleType:
    """The module of a peer; a KeyError where none is called so."""
    return import_module(f".{MODULES[name]}", __name__)


def build(
    name: str, problem: Problem, tolerances: Sequence[float], *, quick: bool = False
) -> Built:
    """The cases of a peer on a problem."""
    built: Built = module_of(name).build(problem, tolerances, quick=quick)
    return built
