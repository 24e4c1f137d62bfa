"""Axes that cut joints hold: they point the right way, or the configuration is none.

Rows of constraints keep axes perpendicular, which also holds where an axis points against the right
way, or across it.  The output ``cut_directions`` tells these apart: 1, or else -1 or 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.native._closing import ALIGNED
from mechc.system.parameters import Array
from mechc.system.system import System

TURN = "if the joint is meant so, turn its child_interframe"


def are_turned(system: System, y: Array, p: Array, t: float) -> Any:
    """Whether states y (..., nq + nu) have an axis that points another way (...)."""
    if "cut_directions" not in system.scene.outputs:
        return np.zeros(y.shape[:-1], bool) if y.ndim > 1 else False
    return ~(system.evaluate("cut_directions", y, p, t) > ALIGNED).all(axis=-1)


def turned_in_words(system: System, y: Array, p: Array, t: float) -> str:
    """The joint and axis of a state (nq + nu,) that are turned the most."""
    cosines = system.evaluate("cut_directions", y, p, t)
    joint, one, other = system.data["cut_directions"][int(np.argmin(cosines))]
    way = "against" if cosines.min() < -ALIGNED else "across"
    return (
        f"the loops closed with the joint {joint} turned: {one} of its child points {way} {other} "
        "of its parent instead of along it"
    )


def at_rest(system: System, q: Array) -> Array:
    """States (n, nq + nu) at configurations (n, nq), without speeds."""
    return np.hstack([q, np.zeros((len(q), len(system.speeds)))])
