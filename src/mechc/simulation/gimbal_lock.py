"""Runs that come near gimbal lock, where two of three angles turn a body about the same axis.

At a determinant d of the angles' axes the mass matrix over their rates has an eigenvalue of about
d^2 of the body's inertia.  Rounding enters the accelerations with eps / d^2 of their size: where
this is more than rtol the tolerance does not hold.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mechc.simulation.balance import WORTH
from mechc.simulation.record import Record
from mechc.simulation.settings import Policy
from mechc.simulation.status import Status
from mechc.system.parameters import Array
from mechc.system.system import System

EPS = float(np.finfo(float).eps)
ADVICE = (
    "Turn the body by quaternions (mechc.BallJoint), or take angular velocities along its axes as "
    "speeds"
)


class _Nearest(NamedTuple):
    gimbal: Any
    determinant: float
    row: int

    @property
    def rounding(self) -> float:
        """The error of accelerations by rounding, of their size."""
        return min(1.0, EPS / max(self.determinant, EPS) ** 2)


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
        f"At t = {t[near.row]:.9g} s {_what(system, near)}: rounding enters the accelerations "
        f"with {near.rounding:.1g} of their size, more than rtol = {policy.rtol:g}, and the motion "
        f"from there on may have such errors. {ADVICE}",
    )


def with_gimbal_lock(status: Status, system: System, record: Record, policy: Policy) -> Status:
    """The status of a failed run, with gimbal lock as its cause where it ended beside it."""
    if "gimbals" not in system.data or not record.last.steps.count:
        return status
    near = _nearest(system, record.last.steps.tail(1)[1])
    if not near.rounding > policy.rtol:
        return status
    cause = f"{_what(system, near)}, so that the mass matrix is singular"
    return replace(status, cause=cause, advice=ADVICE)


def _nearest(system: System, y: Array) -> _Nearest:
    """The gimbal whose axes come nearest to a plane at states (n, nq + nu), and where."""
    found = []
    for gimbal in system.data["gimbals"]:
        a, b, c = gimbal["determinant"]
        q = y[:, gimbal["middle"]]
        sizes = np.abs(a * np.cos(q) + b * np.sin(q) + c)
        row = int(np.argmin(sizes))
        found.append(_Nearest(gimbal, float(sizes[row]), row))
    return min(found, key=lambda near: near.determinant)


def _what(system: System, near: _Nearest) -> str:
    names = [system.coordinates[i] for i in near.gimbal["angles"]]
    middle = system.coordinates[near.gimbal["middle"]]
    others = " and ".join(name for name in names if name != middle)
    return (
        f"{middle} comes within {near.determinant:.2g} rad of gimbal lock, where {others} turn "
        f"{near.gimbal['frame']} about the same axis"
    )
