"""A linkage in numbers, from its geometry alone: positions, Jacobians, Lagrange's equations.

Nothing of SymPy and nothing of the compiler goes in.  Rotations are Rodrigues' formula; with the
geometric Jacobians of the mass centres M = sum m Jv^T Jv + Jw^T R I R^T Jw; the terms of the speeds
are Christoffel's symbols of M, loads the slopes of the potential (Murray, Li, Sastry: A
Mathematical Introduction to Robotic Manipulation, 1994, chapter 4).  Slopes are central
differences at 80 digits, with some 40 left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray

from tests.support.linkages.random_mechanisms import GROUND, Linkage

Array = NDArray[Any]
DIGITS = 80
STEP = mpf(10) ** -20


@dataclass(frozen=True)
class Pose:
    """Of a link: orientation, its joint's place, the joint's axis, its mass centre."""

    rotation: Array
    joint: Array
    axis: Array
    centre: Array


class Textbook:
    """Numbers of one linkage with the values of its parameters; inside ``workdps(DIGITS)``."""

    def __init__(self, linkage: Linkage, values: Mapping[str, float]) -> None:
        self.linkage = linkage
        self.values = {name: mpf(value) for name, value in values.items()}
        self.length = self.values["l"]
        self.masses = [self.values[f"m_{k}"] for k in range(len(linkage.links))]

    def poses(self, q: Sequence[mpf]) -> list[Pose]:
        found: list[Pose] = []
        for link, angle in zip(self.linkage.links, q, strict=True):
            turned, start = self._carrier(found, link.parent)
            axis = turned @ _exact(link.axis)
            joint = start + turned @ _exact(link.place) * self.length
            if link.turns:
                turned = turned @ _rodrigues(_exact(link.axis), angle)
            else:
                joint = joint + axis * angle
            centre = joint + turned @ _exact(link.centre) * self.length
            found.append(Pose(turned, joint, axis, centre))
        return found

    def _carrier(self, poses: Sequence[Pose], link: int) -> tuple[Array, Array]:
        if link == GROUND:
            return _exact(np.eye(3, dtype=int)), _exact([0, 0, 0])
        return poses[link].rotation, poses[link].joint

    def mass_matrix(self, q: Sequence[mpf]) -> Array:
        poses, size = self.poses(q), len(q)
        total = _exact(np.zeros((size, size), dtype=int))
        for k, (link, pose) in enumerate(zip(self.linkage.links, poses, strict=True)):
            linear, angular = self._jacobians(poses, k)
            inertia = pose.rotation @ self._inertia(k) @ pose.rotation.T
            total = total + self.masses[k] * linear.T @ linear + angular.T @ inertia @ angular
            assert link is self.linkage.links[k]
        return total

    def _jacobians(self, poses: Sequence[Pose], k: int) -> tuple[Array, Array]:
        linear = _exact(np.zeros((3, len(poses)), dtype=int))
        angular = linear.copy()
        for j in self.linkage.path(k):
            axis = poses[j].axis
            if self.linkage.links[j].turns:
                linear[:, j] = _cross(axis, poses[k].centre - poses[j].joint)
                angular[:, j] = axis
            else:
                linear[:, j] = axis
        return linear, angular

    def _inertia(self, k: int) -> Array:
        xx, yy, zz, xy, yz, zx = self.linkage.links[k].inertia
        about = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
        return _exact(about) * self.masses[k] * self.length**2

    def potential(self, q: Sequence[mpf]) -> mpf:
        weight = [self.values["g"] * a for a in _exact(self.linkage.gravity)]
        height = mpf(0)
        for mass, pose in zip(self.masses, self.poses(q), strict=True):
            height -= mass * sum(a * b for a, b in zip(weight, pose.centre, strict=True))
        springs = [self.values["k"] * x**2 / 2 for x, link in self._joints(q) if link.spring]
        return height + sum(springs, mpf(0))

    def other_forces(self, q: Sequence[mpf], u: Sequence[mpf], t: mpf) -> list[mpf]:
        """Generalised forces without a potential."""
        damping, torque = self.values["d"], self.values["tau"] * mpmath.cos(t)
        return [
            -damping * rate * link.damper + torque * link.driven for rate, link in self._joints(u)
        ]

    def _joints(self, of_each: Sequence[mpf]) -> Any:
        return zip(of_each, self.linkage.links, strict=True)

    def forcing(self, q: Sequence[mpf], u: Sequence[mpf], t: mpf) -> list[mpf]:
        slopes, size = slopes_of(self.mass_matrix, q), range(len(q))
        pulls = slopes_of(self.potential, q)
        found = []
        for i, other in enumerate(self.other_forces(q, u, t)):
            centrifugal = mpmath.fsum(
                (slopes[k][i, j] - slopes[i][j, k] / 2) * u[j] * u[k] for j in size for k in size
            )
            found.append(other - pulls[i] - centrifugal)
        return found

    def gaps(self, q: Sequence[mpf]) -> Array:
        """What the loop leaves open, along its axes."""
        loop, poses = self.linkage.loop, self.poses(q)
        if loop is None:
            return _exact([])
        turned, start = self._carrier(poses, loop.link)
        end = start + turned @ _exact(loop.point) * self.length
        turned, start = self._carrier(poses, loop.target_link)
        return (end - start - turned @ _exact(loop.target) * self.length)[list(loop.axes)]

    def jacobian(self, q: Sequence[mpf]) -> Array:
        return np.stack(slopes_of(self.gaps, q), axis=1)

    def gamma(self, q: Sequence[mpf], u: Sequence[mpf]) -> Array:
        """J u' = gamma: minus the second derivative along the motion at constant speeds."""
        ahead, behind = ([a + s * STEP * b for a, b in zip(q, u, strict=True)] for s in (1, -1))
        bend = self.gaps(ahead) - 2 * self.gaps(list(q)) + self.gaps(behind)
        return np.asarray(-bend / STEP**2)

    def motion(self, q: Sequence[mpf], u: Sequence[mpf], t: mpf) -> tuple[list[mpf], list[mpf]]:
        """u' and multipliers of M u' + J^T lambda = F, J u' = gamma."""
        mass, jacobian, size = self.mass_matrix(q), self.jacobian(q), len(q)
        rows = len(jacobian)
        whole = mpmath.zeros(size + rows)
        for i in range(size):
            for j in range(size):
                whole[i, j] = mass[i, j]
            for r in range(rows):
                whole[i, size + r] = whole[size + r, i] = jacobian[r, i]
        right = mpmath.matrix([*self.forcing(q, u, t), *self.gamma(q, u)])
        solved = list(mpmath.lu_solve(whole, right))
        return solved[:size], solved[size:]

    def kinetic(self, q: Sequence[mpf], u: Sequence[mpf]) -> mpf:
        speeds = np.array(u, dtype=object)
        return speeds @ self.mass_matrix(q) @ speeds / 2


def slopes_of(function: Callable[[Sequence[mpf]], Any], q: Sequence[mpf]) -> list[Any]:
    """Derivatives by each coordinate."""
    found = []
    for k in range(len(q)):
        ahead, behind = ([x + s * STEP * (i == k) for i, x in enumerate(q)] for s in (1, -1))
        found.append((function(ahead) - function(behind)) / (2 * STEP))
    return found


def _exact(entries: Any) -> Array:
    """Whole numbers and fractions as mpf."""

    def one(x: Any) -> mpf:
        return x if isinstance(x, mpf) else mpf(int(x.numerator)) / int(x.denominator)

    array = np.array(entries, dtype=object)
    return np.array([one(x) for x in array.flat], dtype=object).reshape(array.shape)


def _cross(a: Array, b: Array) -> Array:
    return np.array([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)], dtype=object)


def _rodrigues(axis: Array, angle: mpf) -> Array:
    x, y, z = axis
    spin = _exact([[0, 0, 0]] * 3)
    spin[0, 1], spin[0, 2], spin[1, 2] = -z, y, -x
    spin[1, 0], spin[2, 0], spin[2, 1] = z, -y, x
    unit = _exact(np.eye(3, dtype=int))
    return np.asarray(unit + mpmath.sin(angle) * spin + (1 - mpmath.cos(angle)) * (spin @ spin))
