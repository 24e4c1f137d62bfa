"""Runs that come near gimbal lock, where two of three angles turn a body about the same axis.

At a determinant d of the angles' axes the mass matrix over their rates has an eigenvalue of about
d^2 of the body's inertia.  Rounding enters the accelerations with eps / d^2 of their size: where
this is more than rtol the tolerance does not hold.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mechc.native._codes import NOT_FINITE, SINGULAR_MASS
from mechc.simulation.balance import WORTH
from mechc.simulation.limits import LIMITED
from mechc.simulation.record import Record
from mechc.simulation.settings import Policy
from mechc.simulation.status import Status
from mechc.system.parameters import Array
from mechc.system.system import System

EPS = float(np.finfo(float).eps)
FAILS = LIMITED | {SINGULAR_MASS, NOT_FINITE}  # codes of failures that gimbal lock can cause
ADVICE = (
    "Turn the body by quaternions (mechc.BallJoint), or take angular velocities along its axes as "
    "speeds"
)


class _Nearest(NamedTuple):
    gimbal: Any
    determinants: Array  # of the nearest gimbal at each state
    row: int

    @property
    def determinant(self) -> float:
        return float(self.determinants[self.row])

    @property
    def roundings(self) -> Array:
        """The errors of accelerations by rounding at each state, of their size."""
        return np.minimum(1.0, EPS / np.maximum(self.determinants, EPS) ** 2)

    @property
    def rounding(self) -> float:
        """The largest of them."""
        return float(self.roundings[self.row])


def gimbal_note(system: System, record: Record, policy: Policy) -> tuple[str, ...]:
    """A warning where rounding beside gimbal lock exceeds the tolerance of a run."""
    if "gimbals" not in system.data or record.stats["rhs_evaluations"] < WORTH:
        return ()
    if policy.checkpoints is not None:  # states between would be computed again
        return ()
    t, y = record.states()
    near = _nearest(system, y)
    if not near.rounding > policy.rtol:
        return ()
    return (
        f"At t = {t[near.row]:.9g} s {_what(system, near)}: {_harm(near, policy.rtol)}, and the "
        f"motion from there on may have such errors. {ADVICE}",
    )


def gimbal_note_of_batch(system: System, y: Array, rtol: float) -> tuple[str, ...]:
    """A warning that names how many members ended beside gimbal lock; ``y``: their last states."""
    if not len(y):
        return ()
    near = _nearest(system, y)
    count = np.count_nonzero(near.roundings > rtol)
    if not count:
        return ()
    return (
        f"{count} members ended beside gimbal lock: at the nearest {_what(system, near)}, and "
        f"{_harm(near, rtol)}. {ADVICE}",
    )


def with_gimbal_lock(status: Status, code: int, system: System, y: Array, rtol: float) -> Status:
    """The status of a run, with gimbal lock as the cause of a failure beside it; ``y``: its last
    state (1, nq + nu)."""
    if code not in FAILS or "gimbals" not in system.data:
        return status
    near = _nearest(system, y)
    if not near.rounding > rtol:
        return status
    cause = f"{_what(system, near)}, so that the mass matrix is singular"
    return replace(status, cause=cause, advice=ADVICE)


def _nearest(system: System, y: Array) -> _Nearest:
    """The gimbal whose axes come nearest to a plane at states (n, nq + nu), and where."""
    sizes = []
    for gimbal in system.data["gimbals"]:
        a, b, c = gimbal["determinant"]
        q = y[:, gimbal["middle"]]
        sizes.append(np.abs(a * np.cos(q) + b * np.sin(q) + c))
    which, row = np.unravel_index(np.argmin(sizes), np.shape(sizes))
    return _Nearest(system.data["gimbals"][which], np.min(sizes, axis=0), int(row))


def _what(system: System, near: _Nearest) -> str:
    names = [system.coordinates[i] for i in near.gimbal["angles"]]
    middle = system.coordinates[near.gimbal["middle"]]
    others = " and ".join(name for name in names if name != middle)
    return (
        f"{middle} comes within {near.determinant:.2g} rad of gimbal lock, where {others} turn "
        f"{near.gimbal['frame']} about the same axis"
    )


def _harm(near: _Nearest, rtol: float) -> str:
    return (
        f"rounding enters the accelerations with {near.rounding:.1g} of their size, more than "
        f"rtol = {rtol:g}"
    )
