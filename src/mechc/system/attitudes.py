"""Quaternions among the coordinates: all multiples of one, except zero, are one attitude."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array

Places = Sequence[Sequence[int]]  # of the components of each quaternion


def unturned(q: Array, quaternions: Places, given: Collection[int]) -> Array:
    """Configurations (n, nq) with the quaternions without a given component at 1, 0, 0, 0."""
    for places in quaternions:
        if not set(places) & set(given):
            q[:, places[0]] = 1.0
    return q


def refuse_no_attitude(states: Array, quaternions: Places, names: Sequence[str]) -> None:
    """Refuse states (..., nq + nu) with a quaternion that is zero.

    Raises
    ------
    ValueOutOfBoundsError
        The message has its components.
    """
    for places in quaternions:
        if not np.any(states[..., places], axis=-1).all():
            components = ", ".join(names[i] for i in places)
            raise ValueOutOfBoundsError(
                f"the quaternion {components} is zero, which is no attitude: 1, 0, 0, 0 is that of "
                "the parent"
            )
