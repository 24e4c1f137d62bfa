"""Where prescribed motion comes to the end of what the loops can follow: a dead point of the drive.

There rows of J become dependent that J u + b = 0 does not satisfy together: w J tends to zero and
w b does not, so the speeds grow without bound.  At a change point of the drive w b is zero too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.assembly.sizes import steps_of
from mechc.assembly.speeds import in_words
from mechc.errors import MechcError
from mechc.native._codes import END_OF_REACH, NOT_CLOSED, STEP_TOO_SMALL
from mechc.simulation.status import AT_CROSSINGS, Status, status_of
from mechc.system.parameters import Array
from mechc.system.system import System

SHRUNK_AWAY = (STEP_TOO_SMALL, NOT_CLOSED, *AT_CROSSINGS)  # the steps
DEPENDENT = 1e-3  # singular values of J, of the largest: methods end between 1e-4 and 1e-8
SHARE = 1e-2  # of the prescribed motion, along dependent rows
ROUNDING = 1e-10  # of J u, which is the motion that is prescribed


def rows_beyond_reach(system: System, t: Any, y: Array, p: Array) -> Array:
    """The row of J whose prescribed motion the loops cannot follow, of last states (n,); -1: of
    none.  Times (n,), states (n, nq + nu), parameters (np,) or (n, np)."""
    found = np.full(len(y), -1)
    if not system.scene.holonomic or not len(y):
        return found
    width = len(system.coordinates)
    steps = steps_of(system, p if p.ndim == 1 else p[0])[width:]
    try:
        jacobian = system.constraint_jacobian(y, p, t) * steps
    except MechcError:  # of a user's input
        return found
    usable = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(y).all(axis=1)
    jacobian, speeds = jacobian[usable], y[usable, width:] / steps
    lengths = np.linalg.norm(jacobian, axis=2, keepdims=True)
    jacobian = jacobian / np.where(lengths > 0.0, lengths, 1.0)
    left, singular, _ = np.linalg.svd(jacobian, full_matrices=False)
    prescribed = -(jacobian @ speeds[..., None])[..., 0]
    size = np.linalg.norm(prescribed, axis=1, keepdims=True)
    along = np.abs((left.swapaxes(1, 2) @ prescribed[..., None])[..., 0])
    dependent = singular < DEPENDENT * singular[:, :1]
    fastest = np.linalg.norm(speeds, axis=1, keepdims=True)
    beyond = dependent & (along > SHARE * size) & (size > ROUNDING * singular[:, :1] * fastest)
    worst = np.argmax(np.where(beyond, along, 0.0), axis=1)
    of_worst = np.take_along_axis(left, worst[:, None, None], axis=2)[..., 0]
    rows = np.argmax(np.abs(of_worst * prescribed), axis=1)
    found[usable] = np.where(beyond.any(axis=1), rows, -1)
    return found


def status_beyond_reach(system: System, t: float, y: Array, p: Array) -> Status | None:
    """The status of a run whose steps shrank away at such a state (nq + nu,); None elsewhere."""
    row = int(rows_beyond_reach(system, np.array([t]), y[None], p)[0])
    if row < 0:
        return None
    jacobian = system.constraint_jacobian(y[None], p, t)[0, row]
    driven = np.flatnonzero(np.abs(jacobian) > ROUNDING * np.abs(jacobian).max())
    beyond = "this time"
    if len(driven) == 1 and system.data["identity_kinematics"]:
        coordinate = system.coordinates[driven[0]]
        beyond = in_words(system.quantities[coordinate], float(y[driven[0]]))
    return status_of(END_OF_REACH, t, beyond)
