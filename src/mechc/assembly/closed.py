"""Derivatives through closed loops by the implicit function theorem, and states moved onto loops.

What follows from the closing of Phi(q, p) = 0 changes by dq = -Phi_q^-1 Phi_p dp, where the loops
determine it: one threshold, SINGULAR, decides that everywhere.

A search moves all components of a state.  The state that a motion begins with is q + G a, u + H b
with the a and b that close the loops; G and H are the rows of the constraints where the search
began.  So it is a smooth function of the components and the parameters, and the identity on states
that are closed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import AssemblyError
from mechc.system.parameters import Array
from mechc.system.system import System

MOST = 30  # Newton's steps, quadratic near the loops
CLOSED = 1e-13  # of the mechanism's size
SINGULAR = 1e-7  # of the largest singular value: below it rows depend on each other


def rank(rows: Array) -> Any:
    """The number of independent rows of the last two axes."""
    if not rows.size:
        return np.zeros(rows.shape[:-2], np.intp)[()]
    return np.linalg.matrix_rank(rows, rtol=SINGULAR)


def inverse(rows: Array) -> Array:
    """The pseudo-inverse (..., n, m) of rows (..., m, n); of rows that depend on each other, that
    of the independent ones."""
    return np.asarray(np.linalg.pinv(rows, rcond=SINGULAR), np.float64)


def following(rows: Array, opened: Array) -> tuple[Array, Any]:
    """Changes (..., n, k) of the n coordinates or speeds that keep loops closed which other changes
    open by (..., m, k), for rows (..., m, n) of derivatives; whether the rows determine them."""
    return -inverse(rows) @ opened, rank(rows) == rows.shape[-1]


class ClosedState(NamedTuple):
    """Closed states (..., nx), their derivatives by the states that were moved (..., nx, nx), by
    parameters (..., nx, np) and by values of inputs (..., nx, ni)."""

    y: Array
    by_state: Array
    by_parameters: Array
    by_inputs: Array

    def take(self, k: int) -> ClosedState:
        """The state k of several."""
        return ClosedState(*(part[k] for part in self))


@dataclass(frozen=True)
class Retraction:
    """Directions (..., nq, nh) of coordinates and (..., nu, nc) of speeds, along which states are
    moved."""

    of_coordinates: Array
    of_speeds: Array

    @classmethod
    def at(cls, system: System, y: Array, p: Array, t: Any) -> Retraction:
        """The directions normal to the constraints at states, over the sizes of components."""
        size, nq = system.scale(p) ** 2, len(system.coordinates)
        rows = _gradient(system, y, p, t), system.constraint_jacobian(y, p, t)
        return cls(
            size[:nq, None] * rows[0].swapaxes(-1, -2), size[nq:, None] * rows[1].swapaxes(-1, -2)
        )

    def close(self, system: System, y: Array, p: Array, t: Any) -> ClosedState:
        """The closed states near states y (..., nx) at times (...).

        Raises :class:`AssemblyError` if there is none along the directions.
        """
        nq, nx = len(system.coordinates), y.shape[-1]
        y, by_state = y.copy(), np.tile(np.eye(nx), (*y.shape[:-1], 1, 1))
        widths = {"parameters": len(p), "inputs": len(system.input_values)}
        by = {name: np.zeros((*y.shape, width)) for name, width in widths.items()}
        if not system.scene.rows:
            return ClosedState(y, by_state, *by.values())
        self._close_coordinates(system, y, p, t)
        rows, turn = system.constraint_jacobian(y, p, t), _gradient(system, y, p, t)
        back = self.of_speeds @ inverse(rows @ self.of_speeds)
        y[..., nq:] -= _times(back, system.velocity_constraints(y, p, t))
        lift = self.of_coordinates @ inverse(turn @ self.of_coordinates)
        bent = system.evaluate("velocity_gradient", y, p, t)
        by_state[..., :nq, :nq] -= lift @ turn
        by_state[..., nq:, nq:] -= back @ rows
        by_state[..., nq:, :nq] = -back @ bent @ by_state[..., :nq, :nq]
        for name, found in by.items():
            opened, faster = f"constraints_by_{name}", f"velocity_constraints_by_{name}"
            if opened in system.scene.outputs:
                found[..., :nq, :] = -lift @ system.evaluate(opened, y, p, t)
            found[..., nq:, :] = -back @ bent @ found[..., :nq, :]
            if faster in system.scene.outputs:
                found[..., nq:, :] -= back @ system.evaluate(faster, y, p, t)
        return ClosedState(y, by_state, *by.values())

    def _close_coordinates(self, system: System, y: Array, p: Array, t: Any) -> None:
        """Newton's steps for states in place, each until its loops are closed."""
        nq, size = len(system.coordinates), system.length(p)
        before = np.full(y.shape[:-1], np.inf)
        for _ in range(MOST):
            gap = system.constraints(y, p, t)
            left = np.abs(gap).max(axis=-1, initial=0.0)
            settled = (left >= 0.5 * before) & (left < 1e3 * CLOSED * size)
            opened = ~((left <= CLOSED * size) | settled)
            if not opened.any():
                return
            if not np.isfinite(left).all():
                break
            before = left
            way = inverse(_gradient(system, y, p, t) @ self.of_coordinates)
            step = _times(self.of_coordinates, _times(way, gap))
            y[..., :nq] -= np.where(opened[..., None], step, 0.0)
        raise AssemblyError("the loops do not close near a state that the search came to")


def _times(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _gradient(system: System, y: Array, p: Array, t: Any) -> Array:
    """The derivative of the configuration constraints by the coordinates (..., nh, nq)."""
    return system.constraint_gradient(y, p, t)[..., : system.scene.holonomic, :]
