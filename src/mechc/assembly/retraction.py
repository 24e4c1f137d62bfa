"""States moved onto the closed loops along directions that stay, and the derivative of that.

A search moves all components of a state.  The state that a motion begins with is q + G a, u + H b
with the a and b that close the loops; G and H are the rows of the constraints where the search
began.  So it is a smooth function of the components and the parameters, and the identity on states
that are closed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 30  # Newton's steps, quadratic near the loops
CLOSED = 1e-13  # of the mechanism's size
SINGULAR = 1e-9  # of the largest singular value: below, a row that depends on the others


class ClosedState(NamedTuple):
    """A closed state (nx,), its derivatives by the state that was moved (nx, nx), by the parameters
    (nx, np) and by the values of inputs (nx, ni)."""

    y: Array
    by_state: Array
    by_parameters: Array
    by_inputs: Array


@dataclass(frozen=True)
class Retraction:
    """Directions (nq, nh) of coordinates and (nu, nc) of speeds, along which a state is moved."""

    of_coordinates: Array
    of_speeds: Array

    @classmethod
    def at(cls, system: System, y: Array, p: Array, t: float) -> Retraction:
        """The directions normal to the constraints at a state, over the sizes of components."""
        if not system.scene.rows:
            return cls(np.zeros((0, 0)), np.zeros((0, 0)))
        size, nq = system.scale(p) ** 2, len(system.coordinates)
        return cls(
            size[:nq, None] * _gradient(system, y, p, t).T,
            size[nq:, None] * system.constraint_jacobian(y, p, t).T,
        )

    def close(self, system: System, y: Array, p: Array, t: float) -> ClosedState:
        """The closed state near y (nx,).

        Raises :class:`AssemblyError` if there is none along the directions.
        """
        nq, nx = len(system.coordinates), len(y)
        by_others = {"parameters": np.zeros((nx, len(p))),
                     "inputs": np.zeros((nx, len(system.input_values)))}  # fmt: skip
        if not system.scene.rows:
            return ClosedState(y, np.eye(nx), *by_others.values())
        y = y.copy()
        self._close_coordinates(system, y, p, t)
        rows, turn = system.constraint_jacobian(y, p, t), _gradient(system, y, p, t)
        back = self.of_speeds @ np.linalg.pinv(rows @ self.of_speeds, rcond=SINGULAR)
        y[nq:] -= back @ system.velocity_constraints(y, p, t)
        lift = self.of_coordinates @ np.linalg.pinv(turn @ self.of_coordinates, rcond=SINGULAR)
        by_state = np.eye(nx)
        by_state[:nq, :nq] -= lift @ turn
        bent = system.evaluate("velocity_gradient", y, p, t)
        by_state[nq:, nq:] -= back @ rows
        by_state[nq:, :nq] = -back @ bent @ by_state[:nq, :nq]
        for name, found in by_others.items():
            found[:nq] = -lift @ _slopes(system, f"constraints_by_{name}", len(turn), y, p, t)
            faster = _slopes(system, f"velocity_constraints_by_{name}", len(rows), y, p, t)
            found[nq:] = -back @ (faster + bent @ found[:nq])
        return ClosedState(y, by_state, *by_others.values())

    def _close_coordinates(self, system: System, y: Array, p: Array, t: float) -> None:
        nq, size = len(system.coordinates), system.length(p)
        before = np.inf
        for _ in range(MOST):
            gap = system.constraints(y, p, t)
            left = float(np.abs(gap).max(initial=0.0))
            if left <= CLOSED * size or (left >= 0.5 * before and left < 1e3 * CLOSED * size):
                return
            if not np.isfinite(left):
                break
            before = left
            turn = _gradient(system, y, p, t)
            way = np.linalg.pinv(turn @ self.of_coordinates, rcond=SINGULAR)
            y[:nq] -= self.of_coordinates @ (way @ gap)
        raise AssemblyError("the loops do not close near a state that the search came to")


def _slopes(system: System, name: str, count: int, y: Array, p: Array, t: float) -> Array:
    """A derivative of the constraints' rows; zero (count, 1) in a scene without it."""
    if name in system.scene.outputs:
        return np.asarray(system.evaluate(name, y, p, t))
    return np.zeros((count, 1))


def _gradient(system: System, y: Array, p: Array, t: float) -> Array:
    """The derivative of the configuration constraints by the coordinates (nh, nq)."""
    return system.constraint_gradient(y, p, t)[: system.scene.holonomic]
