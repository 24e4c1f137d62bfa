"""The loops of a mechanism as equations in its free coordinates, and their solution."""

from __future__ import annotations

import numpy as np

from mechc.errors import AssemblyError
from mechc.system.kinds import Kind
from mechc.system.parameters import Array, NamedQuantity
from mechc.system.system import System

ITERATIONS = 60
POLISHES = 30
SAME = 1e-6  # two solutions closer than this (rad, or of the model's length) are one
EPS = float(np.finfo(float).eps)


class Loop:
    """The configuration constraints as equations in the free coordinates."""

    def __init__(
        self, system: System, values: Array, fixed: Array, free: list[int], t: float = 0.0
    ) -> None:
        self.system, self.values, self.fixed, self.free = system, values, fixed, free
        self.t = t
        self.rows = system.scene.holonomic
        self.length = system.length(values)
        self.angular = system.angular[free]
        self.scale = np.where(self.angular, 1.0, self.length)

    def states(self, x: Array) -> Array:
        """Full states at rest for free coordinates x (n, free)."""
        width = len(self.system.coordinates)
        y = np.zeros((len(x), width + len(self.system.speeds)))
        y[:, :width] = self.fixed  # (nq,), or (n, nq): one for each
        y[:, self.free] = x
        return y

    def gap(self, x: Array) -> Array:
        return self.system.constraints(self.states(x), self.values, self.t)

    def gradient(self, x: Array) -> Array:
        scene = self.system.scene.outputs
        name = "constraint_gradient" if "constraint_gradient" in scene else "constraint_jacobian"
        whole = self.system.evaluate(name, self.states(x), self.values, self.t)
        return whole[:, : self.rows, self.free]

    def solve(self, x: Array) -> Array:
        """Closed configurations (n, nq) reached from the starts, each once."""
        x, closed = self.search(x)
        gaps = np.linalg.norm(self.gap(x), axis=1)
        if not closed.any():
            raise AssemblyError(self._miss(self._least_gap(x[np.argmin(gaps)])))
        order = np.argsort(gaps[closed], kind="stable")
        wrapped = np.where(self.angular, wrap(x[closed]), x[closed])[order]
        return self.states(self._distinct(wrapped))[:, : len(self.fixed)]

    def search(self, x: Array) -> tuple[Array, Array]:
        """The end of the search from each start (n, free), and whether the loops close there."""
        before = np.full(len(x), np.inf)
        for _ in range(ITERATIONS):
            x = self._descend(x)
            size = np.linalg.norm(self.gap(x), axis=1)
            if ((size <= 1e-12 * self.length) | (size > 0.999 * before)).all():
                break
            before = size
        x = self._polish(x)
        return x, np.linalg.norm(self.gap(x), axis=1) <= 64 * EPS * self.length

    def _descend(self, x: Array) -> Array:
        """A Levenberg-Marquardt step with the damping of Yamashita & Fukushima (2001)."""
        gap, gradient = self.gap(x), self.gradient(x) * self.scale
        size = np.linalg.norm(gap, axis=1)
        damping = (size / self.length) ** 2 * np.linalg.norm(gradient, axis=(1, 2)) ** 2
        transposed = np.swapaxes(gradient, 1, 2)
        square = transposed @ gradient
        square += (damping + 1e-300)[:, None, None] * np.eye(x.shape[1])
        square += 1e-14 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(x.shape[1])
        step = -np.linalg.solve(square, transposed @ gap[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 0.7 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        best, best_size = x, size
        for factor in (1.0, 0.25, 0.0625):
            trial = x + factor * step * self.scale
            trial_size = np.linalg.norm(self.gap(trial), axis=1)
            better = trial_size < best_size
            best = np.where(better[:, None], trial, best)
            best_size = np.where(better, trial_size, best_size)
        return best

    def _polish(self, x: Array) -> Array:
        """Gauss-Newton steps, each kept where it reduces the gap.

        Where two assemblies meet they converge by one bit per step, so there may be many.
        """
        for _ in range(POLISHES):
            gap = self.gap(x)
            step = np.linalg.pinv(self.gradient(x), rcond=1e-13) @ gap[:, :, None]
            trial = x - step[:, :, 0]
            better = np.abs(self.gap(trial)).max(axis=1) < np.abs(gap).max(axis=1)
            if not better.any():
                break
            x = np.where(better[:, None], trial, x)
        return x

    def _distinct(self, x: Array) -> Array:
        kept: list[Array] = []
        for row in x:
            if all(self._distance(row, other) > SAME for other in kept):
                kept.append(row)
        return np.array(kept)

    def _distance(self, a: Array, b: Array) -> float:
        difference = np.where(self.angular, wrap(a - b), a - b)
        return float(np.abs(difference / self.scale).max())

    def _least_gap(self, x: Array) -> float:
        """The least gap of the loops found from x on, m."""
        from scipy.optimize import minimize

        def square(z: Array) -> tuple[float, Array]:
            gap = self.gap((z * self.scale)[None])[0]
            slope = gap @ self.gradient((z * self.scale)[None])[0] * self.scale
            return float(gap @ gap) / 2, slope

        found = minimize(square, x / self.scale, jac=True, method="BFGS", options={"gtol": 1e-12})
        return float(np.sqrt(2 * found.fun))

    def _miss(self, gap: float) -> str:
        system = self.system
        kept = [i for i in range(len(self.fixed)) if i not in self.free]
        at = ", ".join(
            in_words(system.quantities[system.coordinates[i]], self.fixed[i]) for i in kept
        )
        return (
            f"the loop cannot close at {at}: the ends miss each other by at least {gap:.6g} m "
            "with these lengths. Change the lengths or the coordinates given"
        )


def even_points(count: int, size: int) -> Array:
    """Points (count, size) spread evenly over (-1, 1) in every component (Roberts 2018)."""
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (size + 1))
    steps = ratio ** -np.arange(1.0, size + 1.0)
    return np.asarray(2.0 * ((0.5 + np.outer(np.arange(count), steps)) % 1.0) - 1.0)


def wrap(angle: Array) -> Array:
    """The same angle in (-pi, pi]."""
    return np.asarray(np.pi - (np.pi - angle) % (2 * np.pi))


def in_words(coordinate: NamedQuantity, value: float) -> str:
    """A coordinate with its value, angles in degrees."""
    if coordinate.kind is Kind.ANGLE:
        return f"{coordinate.name} = {np.degrees(value):.6g} deg"
    return f"{coordinate.name} = {value:.6g} {coordinate.unit}".rstrip()
