"""Robust losses: rho(z) of squared residuals z, as SciPy's ``least_squares`` has them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.system.parameters import Array

Rho = tuple[Array, Array, Array]  # rho(z), rho'(z), rho''(z)


def _linear(z: Array) -> Rho:
    return z, np.ones_like(z), np.zeros_like(z)


def _soft_l1(z: Array) -> Rho:
    root = np.sqrt(1 + z)
    return 2 * (root - 1), 1 / root, -0.5 / root**3


def _huber(z: Array) -> Rho:
    inside = z <= 1
    root = np.sqrt(np.where(inside, 1.0, z))
    return np.where(inside, z, 2 * root - 1), 1 / root, np.where(inside, 0.0, -0.5 / root**3)


def _cauchy(z: Array) -> Rho:
    return np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2


def _arctan(z: Array) -> Rho:
    return np.arctan(z), 1 / (1 + z * z), -2 * z / (1 + z * z) ** 2


LOSSES: dict[str, Callable[[Array], Rho]] = {
    "linear": _linear,
    "soft_l1": _soft_l1,
    "huber": _huber,
    "cauchy": _cauchy,
    "arctan": _arctan,
}


@dataclass(frozen=True)
class Loss:
    """f_scale^2 rho((r / f_scale)^2) of residuals r."""

    rho: Callable[[Array], Any]
    f_scale: float
    robust: bool

    def cost(self, r: Array) -> Array:
        """Half the sum over the last axis."""
        value: Array = np.asarray(self.rho((r / self.f_scale) ** 2)[0])
        return np.asarray(0.5 * self.f_scale**2 * value.sum(axis=-1))

    def influence(self, r: Array) -> tuple[Array, Array]:
        """psi, the derivative of half the loss by r, and psi'."""
        z = (r / self.f_scale) ** 2
        _, first, second = self.rho(z)
        return np.asarray(first * r), np.asarray(first + 2 * z * second)


def loss_of(loss: Any, f_scale: float) -> Loss:
    """A loss by its name, or from a function that gives rho, rho', rho'' as SciPy's do.

    Raises :class:`UnknownNameError` for a name that SciPy does not have.
    """
    if callable(loss):
        return Loss(loss, f_scale, True)
    if not isinstance(loss, str) or loss not in LOSSES:
        raise UnknownNameError("loss", loss, LOSSES)
    return Loss(LOSSES[loss], f_scale, loss != "linear")
