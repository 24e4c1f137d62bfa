"""Change points: the speeds possible at a configuration where the configuration curve crosses
itself.

There J loses rank, and J u + b = 0 does not suffice: for every left null vector w of J, the
closure must also hold to second order, w . (d/dt (J u + b)) = 0, quadratic equations in the speeds
that J allows.  Their solutions are the tangents of the branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import even_points
from mechc.system.parameters import Array
from mechc.system.system import System

NEAR = 1e-5  # of the largest singular value: below it a change point is searched for
GENERIC = 1e-7
SNAP = 1e-6  # two assemblies that meet are found to about half the digits
SAME = 1e-7
STARTS = 64
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class SingularConfiguration:
    """A configuration q (nq,) whose Jacobian has the left null vectors ``normals`` (k, nc).

    ``excess``: how many of them it does not have at configurations around.
    """

    q: Array
    normals: Array
    excess: int


def find(
    system: System,
    y: Array,
    values: Array,
    t: float,
) -> SingularConfiguration | None:
    """The change point that the configuration of a state is, to half the digits; else None.

    Searched for below ``NEAR`` of the largest singular value; one that is farther from the state
    than ``SNAP`` in any coordinate does not count.
    """
    if not system.scene.holonomic or len(system.coordinates) != len(system.speeds):
        return None
    jacobian = system.constraint_jacobian(y, values, t)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    if singular[-1] > NEAR * singular[0] and len(jacobian) <= len(system.speeds):
        return None
    generic = generic_rank(system, y, values, t)
    if generic == 0 or singular[generic - 1] > NEAR * singular[0]:
        return None
    return _refined_configuration(system, y, values, t, generic)


def generic_rank(system: System, y: Array, values: Array, t: float) -> int:
    """Rank of J around the configuration of a state, on the constraints."""
    width, rank = len(system.coordinates), 0
    for direction in np.eye(width):
        beside = np.append(y[:width] + 1e-2 * direction, np.zeros(len(system.speeds)))
        code, beside, _, _ = system.scene.project(t, beside, values)
        if code == 0:
            jacobian = system.constraint_jacobian(beside, values, t)
            size = float(np.linalg.norm(jacobian, 2))
            rank = max(rank, int(np.linalg.matrix_rank(jacobian, tol=GENERIC * size)))
    return rank


def _refined_configuration(
    system: System, y: Array, values: Array, t: float, generic: int
) -> SingularConfiguration | None:
    """Gauss-Newton steps for a closed configuration where J^T w = 0."""
    width = len(system.coordinates)
    still = np.append(y[:width], np.zeros(len(system.speeds)))
    rows = system.scene.holonomic
    length = system.length(values)
    for _ in range(6):
        jacobian = system.constraint_jacobian(still, values, t)
        left, singular, right = np.linalg.svd(jacobian)
        rank = int((singular > NEAR * singular[0]).sum())
        normals = left[:, rank:].T
        free = right[rank:].T  # a change of w removes the other components of J^T w
        pulls = (normals @ jacobian @ free).ravel()
        bend = np.stack([
            (normals @ (_jacobian_at(system, still, k, 1e-5, values, t)
                        - _jacobian_at(system, still, k, -1e-5, values, t)) @ free).ravel() / 2e-5
            for k in range(width)
        ], axis=1)  # fmt: skip
        gap = system.constraints(still, values, t)
        step = np.linalg.lstsq(
            np.vstack([jacobian[:rows], bend]), -np.append(gap, pulls), rcond=1e-9
        )[0]
        still[:width] += step
    off = np.abs(still[:width] - y[:width]).max()
    closed = np.abs(system.constraints(still, values, t)).max() <= 64 * EPS * length
    singular = np.linalg.svd(system.constraint_jacobian(still, values, t), compute_uv=False)
    critical = singular[rank] <= 1e-12 * singular[0] if rank < len(singular) else True
    if not (rank < generic and off <= SNAP and closed and critical):
        return None
    rounding = 4 * np.spacing(np.maximum(1.0, np.abs(y[:width])))
    q = np.where(np.abs(still[:width] - y[:width]) <= rounding, y[:width], still[:width])
    return SingularConfiguration(q, normals, generic - rank)


def _jacobian_at(system: System, y: Array, k: int, step: float, values: Array, t: float) -> Array:
    moved = y.copy()
    moved[k] += step
    return system.constraint_jacobian(moved, values, t)


def second_order(
    system: System, at: SingularConfiguration, u: Array, values: Array, t: float
) -> Array:
    """w . d/dt (J u + b) for speeds u (..., nu), by central differences of eighth order."""
    u = np.asarray(u)
    weights = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    size = np.maximum(1.0, np.abs(u).max(axis=-1, keepdims=True, initial=0.0))
    step = 0.02 / size
    total = 0.0
    for k, weight in enumerate(weights, start=1):
        for sign in (1, -1):
            h = sign * k * step
            y = np.concatenate([at.q + h * u, u], axis=-1)
            residual = system.velocity_constraints(y, values, t + h[..., 0])
            total = total + sign * weight * residual / step
    return np.asarray(total @ at.normals.T)


def speeds_on_branches(
    system: System, at: SingularConfiguration, given: dict[int, float], values: Array, t: float
) -> Array | None:
    """Possible speeds (n, nu) with the values given; None where these do not determine them.

    n = 0 where there are none.  Least speeds where only rest is determined.
    """
    count = len(system.speeds)
    still = np.append(at.q, np.zeros(count))
    jacobian = system.constraint_jacobian(still, values, t)
    equations = np.vstack([jacobian, np.eye(count)[list(given)]])
    wanted = np.append(-system.velocity_constraints(still, values, t), list(given.values()))
    particular = np.linalg.lstsq(equations, wanted, rcond=GENERIC)[0]
    if np.abs(equations @ particular - wanted).max() > 1e-9 * max(1.0, np.abs(wanted).max()):
        return np.zeros((0, count))
    _, singular, right = np.linalg.svd(equations)
    free = right[int((singular > GENERIC * singular[0]).sum()) :]
    if np.abs(particular).max() == 0:
        return np.zeros((1, count))
    if len(free) > at.excess:
        return None
    quadric = _Quadric(system, at, particular, free, values, t)
    speeds = particular + quadric.roots() @ free
    return np.asarray(speeds[np.lexsort(np.round(speeds, 9).T[::-1])])


class _Quadric:
    """The second-order closure at u + a . free as quadratic polynomials in a."""

    def __init__(
        self,
        system: System,
        at: SingularConfiguration,
        u: Array,
        free: Array,
        values: Array,
        t: float,
    ) -> None:
        self.size = float(np.linalg.norm(u))
        free = free * self.size
        d = len(free)
        pairs = [(i, j) for i in range(d) for j in range(i + 1, d)]
        a = [np.zeros(d), *np.eye(d), *-np.eye(d), *(np.eye(d)[i] + np.eye(d)[j] for i, j in pairs)]
        f = second_order(system, at, u + np.array(a) @ free, values, t)
        self.constant = f[0]
        self.linear = (f[1 : d + 1] - f[d + 1 : 2 * d + 1]) / 2
        self.square = np.zeros((d, d, f.shape[1]))
        for i in range(d):
            self.square[i, i] = (f[1 + i] + f[d + 1 + i]) / 2 - f[0]
        for (i, j), both in zip(pairs, f[2 * d + 1 :], strict=True):
            mixed = both - f[0] - self.linear[i] - self.linear[j]
            mixed -= self.square[i, i] + self.square[j, j]
            self.square[i, j] = self.square[j, i] = mixed / 2
        self.scale = system.length(values) * self.size**2
        self.dimension = d

    def value(self, a: Array) -> Array:
        """(n, k) at a (n, d)."""
        return np.asarray(
            self.constant + a @ self.linear + np.einsum("ni,ijk,nj->nk", a, self.square, a)
        )

    def slope(self, a: Array) -> Array:
        """(n, k, d)"""
        return np.asarray(self.linear.T + 2 * np.einsum("ijk,nj->nki", self.square, a))

    def roots(self) -> Array:
        """Real solutions (n, d), scaled as the free speeds are, each once: Newton's method."""
        a = 4.0 * even_points(STARTS, self.dimension) if self.dimension else np.zeros((1, 0))
        for _ in range(60 if self.dimension else 0):
            a = (
                a
                - (np.linalg.pinv(self.slope(a), rcond=1e-12) @ self.value(a)[:, :, None])[:, :, 0]
            )
            a = np.clip(a, -1e6, 1e6)
        small = np.abs(self.value(a)).max(axis=1, initial=0.0) <= 1e-9 * self.scale * (
            1.0 + np.abs(a).max(axis=1, initial=0.0) ** 2
        )
        kept: list[Array] = []
        for row in a[small]:
            if all(np.abs(row - other).max(initial=0.0) > SAME * 10 for other in kept):
                kept.append(row)
        return np.array(kept).reshape(len(kept), self.dimension) * self.size
