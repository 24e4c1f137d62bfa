"""Quaternions among the coordinates.

Of a joint's quaternion all multiples, except zero, are one attitude.  Direction cosines with the
components as they stand, those of ``orient_quaternion`` in SymPy, are a rotation at length one
only: elsewhere they stretch every length.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array

Places = tuple[tuple[int, ...], ...]  # of the components of each quaternion

EQUAL = 1e-6  # components that differ by less, relatively, are equally large
DECIMALS = 1e-3  # by which the length of components that were typed may differ from one


@dataclass(frozen=True)
class Attitudes:
    """The quaternions of a scene, those ``of_length_one`` last; ``names``: its coordinates,
    ``held``: of those, with a constraint of the description on their length."""

    names: Sequence[str]
    multiples: Places = ()
    of_length_one: Places = ()
    held: Places = ()

    @classmethod
    def of(cls, data: Mapping[str, Any], names: Sequence[str]) -> Attitudes:
        """The attitudes in a scene's data."""
        kinds = (f"{kind}quaternions" for kind in ("", "unit_", "held_"))
        found = (data.get(kind, ()) for kind in kinds)
        return cls(names, *(tuple(tuple(places) for places in each) for each in found))

    @cached_property
    def quaternions(self) -> Places:
        """The places of the components of every quaternion."""
        return self.multiples + self.of_length_one

    @cached_property
    def free_in_length(self) -> Places:
        """The quaternions whose length no constraint of the description holds."""
        return tuple(places for places in self.quaternions if places not in self.held)

    def within(self, free: Collection[int]) -> Places:
        """Those of these of which every component may move."""
        return tuple(places for places in self.free_in_length if {*places} <= {*free})

    def lengths_gradient(self, q: Array, free: Collection[int]) -> Array:
        """The derivatives of |x|^2 / 2 of quaternions :meth:`within` by coordinates (..., nq)."""
        places = self.within(free)
        rows = np.zeros((*q.shape[:-1], len(places), q.shape[-1]))
        for row, components in enumerate(places):
            rows[..., row, components] = q[..., components]
        return rows

    def fill_quaternions(self, q: Array, given: Collection[int]) -> Array:
        """Configurations (n, nq) with the quaternions without a given component at 1, 0, 0, 0."""
        for places in self.quaternions:
            if not set(places) & set(given):
                q[:, places[0]] = 1.0
        return q

    def scale(self, states: Array, given: Collection[int] = ()) -> Array:
        """Bring joints' quaternions without a given component to length one, in states (..., nq),
        in place: multiples are the same attitude, and a search for closed loops changes lengths."""
        for places in self.multiples:
            if not set(places) & set(given):
                length = np.linalg.norm(states[..., places], axis=-1, keepdims=True)
                states[..., places] /= np.where(length > 0.0, length, 1.0)
        return states

    def one_of_two(self, states: Array) -> Array:
        """States (..., nq) with the first of the largest components of free quaternions positive,
        in place: x and -x are one attitude."""
        for places in self.free_in_length:
            x = np.abs(states[..., places])
            first = np.argmax(x > (1.0 - EQUAL) * x.max(axis=-1, keepdims=True), axis=-1)
            largest = np.take_along_axis(states[..., places], first[..., None], axis=-1)
            states[..., places] *= np.where(largest < 0.0, -1.0, 1.0)
        return states

    def check(self, states: Array) -> None:
        """Check states (..., nq + nu).

        Raises :class:`ValueOutOfBoundsError` where a quaternion is zero, or has another length than
        one where it has to have it; the message has its components.
        """
        for places in self.quaternions:
            if not np.any(states[..., places], axis=-1).all():
                raise ValueOutOfBoundsError(
                    f"the quaternion {self._components(places)} is zero, which is no attitude: "
                    "1, 0, 0, 0 is that of the parent"
                )
        for places in self.of_length_one:
            components = states[..., places].reshape(-1, 4)
            lengths = np.linalg.norm(components, axis=1)
            worst = int(np.argmax(abs(lengths - 1.0)))
            if abs(lengths[worst] - 1.0) > DECIMALS:
                unit = ", ".join(f"{x:.6g}" for x in components[worst] / lengths[worst])
                raise ValueOutOfBoundsError(
                    f"the quaternion {self._components(places)} has the length "
                    f"{lengths[worst]:.6g}; its frame's direction cosines are a rotation at length "
                    f"one only: divide it by its length ({unit})"
                )

    def _components(self, places: Sequence[int]) -> str:
        return ", ".join(self.names[i] for i in places)
