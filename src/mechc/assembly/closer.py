"""The search for configurations that close the loops, in compiled code, for one or many members."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from mechc.native._closing import Closings, Closure
from mechc.system.parameters import Array
from mechc.system.system import System

SAME = 1e-6  # two solutions closer than this (rad, or of the mechanism's length) are one
MOST_NUMBERS = 1 << 22  # of all starts together
USED = (
    "constraints", "constraint_gradient", "velocity_constraints", "constraint_jacobian",
    "preference", "cut_directions",
)  # fmt: skip


@dataclass(frozen=True)
class Search:
    """A plan of searches that move the same coordinates of a system.

    ``free``: the coordinates that may move, ``starts`` (count, free) within -1 ... 1, ``near``: how
    many of them are at the guess, ``only_near``: whether there are no others.
    """

    system: System
    free: Any
    starts: Array
    guessed: Any
    near: int
    only_near: bool

    def closings(self, t: float, fixed: Array, p: Array, most: int, **options: Any) -> Any:
        """The search for members with coordinates ``fixed`` (n, nq), which contain the guess.

        Parameters p (n, np); ``work`` of the result searches, ``solved`` at once.
        """
        lengths = self.system.parameter_set.lengths(p)
        most = min(most, len(self.starts) + self.near)
        return Closings(
            closure(self.system, t), t, self.free, self.starts, fixed, p, lengths, most,
            guessed=self.guessed, near=self.near, only_near=self.only_near, **options,
        )  # fmt: skip

    def solve(self, t: float, fixed: Array, p: Array, most: int, **options: Any) -> Any:
        """A search as :meth:`closings` makes it, after its work."""
        search = self.closings(t, fixed, p, most, **options)
        search.work()
        if self.system.driven is not None:
            self.system.driven.raise_failure()
        return search


def search_of(
    system: System, free: Sequence[int], guessed: Sequence[int] = (), starts: Array | None = None
) -> Search:
    """The search that moves the coordinates ``free``, of which some are guessed."""
    places = np.array(free, np.intc)
    flags = np.array([i in guessed for i in free], np.uint8) if guessed else None
    chosen = spread(len(free)) if starts is None else starts
    near = min(start_count(len(free) - len(guessed)), len(chosen))
    only_near = flags is not None and len(free) > closing_rows(system, free)
    return Search(system, places, chosen, flags, near, only_near)


def closing_rows(system: System, free: Sequence[int]) -> int:
    """The number of conditions that closed loops are: quaternions that may move have length one."""
    return int(system.scene.holonomic + len(system.attitudes.within(free)))


def closure(system: System, t: float) -> Any:
    """The constraints of a system, with its inputs where they contain any."""
    inputs = None if system.driven is None else system.driven.given_to(USED, t)
    known = system.cache.get("closure")
    if known is None:
        kinds = np.where(system.angular, 1, np.where(system.dimensionless, 2, 0))  # as of Closure
        units = system.closure_units
        alike = [units.index(unit) if unit else i for i, unit in enumerate(units)]
        known = system.cache["closure"] = Closure(
            system.scene.evaluator, inputs, kinds[: len(system.coordinates)].astype(np.uint8),
            np.array(alike, np.intc), system.attitudes.free_in_length,
        )  # fmt: skip
    return known


def start_count(unknowns: int) -> int:
    """The number of starts that finds all assemblies, by experience."""
    return max(24 * unknowns * unknowns, 1)


@lru_cache(maxsize=64)
def spread(unknowns: int) -> Array:
    """Starts (count, unknowns) for a search over all configurations."""
    return even_points(min(start_count(unknowns), MOST_NUMBERS // max(unknowns, 1)), unknowns)


def even_points(count: int, size: int) -> Array:
    """Points (count, size) spread evenly over (-1, 1) in every component (Roberts 2018)."""
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (size + 1))
    steps = ratio ** -np.arange(1.0, size + 1.0)
    return np.asarray(2.0 * ((0.5 + np.outer(np.arange(count), steps)) % 1.0) - 1.0)


def wrap(angle: Array) -> Array:
    """An angle, brought into (-pi, pi]."""
    return np.asarray(np.pi - (np.pi - angle) % (2 * np.pi))
