"""Columns moved onto the tangent space of the constraints: the derivative of their projection.

At a state on the constraints Phi(q, p) = 0 and J u + b = 0 columns S of derivatives keep

    Phi_q S_q + Phi_p = 0,    J S_u + (J u + b)_q S_q + (J u + b)_p = 0;

the least change in the metric of the mass matrix makes them do so, as it does with states.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.sensitivities.columns import Columns
from mechc.system.parameters import Array
from mechc.system.system import System

DEPENDENT = 1e-11  # of the largest singular value: a row with a smaller one is redundant


def tangent(
    system: System, y: Array, values: Array, t: Any, columns: Columns
) -> tuple[Array, Array] | None:
    """P (n, nx, nx) and Q (n, nx, k) with which columns S at states y become P S + Q.

    None without constraints.
    """
    if not system.scene.rows:
        return None
    nq, holonomic = len(system.coordinates), int(system.scene.holonomic)
    rows = system.constraint_jacobian(y, values, t)
    change = least_change(system.mass_matrix(y, values, t), rows)
    pushed = system.evaluate("velocity_gradient", y, values, t)
    moved = np.zeros((len(y), system.scene.width, system.scene.width))
    moved[:] = np.eye(system.scene.width)
    offset = np.zeros((len(y), system.scene.width, columns.count))
    if holonomic:
        step = change[:, :, :holonomic]
        if "kinematic_matrix" in system.scene.outputs:
            step = system.evaluate("kinematic_matrix", y, values, t) @ step
        moved[:, :nq, :nq] -= step @ gradient(system, y, values, t, rows)
        opened = columns.of(
            system, "constraints_by_parameters", "constraints_by_inputs", y, values, t
        )
        if opened is not None:
            offset[:, :nq] = -step @ opened
    faster = columns.of(
        system, "velocity_constraints_by_parameters", "velocity_constraints_by_inputs", y, values, t
    )
    drift = pushed @ offset[:, :nq] if faster is None else pushed @ offset[:, :nq] + faster
    moved[:, nq:, :nq] = -change @ (pushed @ moved[:, :nq, :nq])
    moved[:, nq:, nq:] -= change @ rows
    offset[:, nq:] = -change @ drift
    return moved, offset


def gradient(system: System, y: Array, values: Array, t: Any, rows: Array) -> Array:
    """Derivative of the configuration constraints by the coordinates, (..., nh, nq)."""
    if "constraint_gradient" in system.scene.outputs:
        return system.evaluate("constraint_gradient", y, values, t)
    return rows[..., : system.scene.holonomic, :]


def least_change(mass: Array, rows: Array) -> Array:
    """The least speeds, in the metric of M, that give the rows J (n, nc, nu) a value: (n, nu, nc).

    By singular values of J L^-T with M = L L^T, so that nothing is squared.
    """
    try:
        factor = np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:  # a speed that moves no mass by itself
        size = np.trace(mass, axis1=-2, axis2=-1)[..., None, None]
        factor = np.linalg.cholesky(mass + size * (np.swapaxes(rows, -1, -2) @ rows))
    scaled = np.linalg.solve(factor, np.swapaxes(rows, -1, -2))
    found = np.linalg.pinv(np.swapaxes(scaled, -1, -2), rcond=DEPENDENT)
    return np.asarray(np.linalg.solve(np.swapaxes(factor, -1, -2), found))
