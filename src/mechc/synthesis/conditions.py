"""Conditions that a linkage has to meet besides its targets, judged along one assembly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechc.system.parameters import Array

WEIGHT = 10.0  # of a condition, against deviations in units of their tolerances
MET = 1e-3  # rad, or of the targets' extent: what a condition may fall short by


@dataclass(frozen=True)
class Conditions:
    """Which conditions there are.

    Attributes
    ----------
    turns
        The driven coordinate turns fully, on one assembly and past no change point.
    one_assembly, ordered
        All positions are on one assembly, with no change point between them; one after the other.
    joints
        Points before, at and behind a joint, and its least transmission angle, rad.
    box : (2, axes) or None
        The least and the largest coordinates of all points, m; ``size`` divides what is beyond.
    """

    turns: bool
    one_assembly: bool
    ordered: bool
    joints: tuple[tuple[tuple[int, int, int], float], ...]
    box: Array | None
    size: float

    @property
    def swept(self) -> bool:
        """Whether the linkage has to be followed for them at every step of a search."""
        return self.turns or bool(self.joints) or self.box is not None

    def stops(self, sweep: Any) -> Array:
        """Whether each member (n,) of a sweep ends, or passes a change point."""
        passed = np.isfinite(sweep.change_points).any(axis=-1)
        return np.asarray(np.isnan(sweep.q).any(axis=(-1, -2)) | passed)

    def shortfalls(self, points: Array) -> Array:
        """Shortfalls at points (..., m, points, 3), zero where met: (..., m, c)."""
        found = [np.maximum(value, 0.0) for value, _ in self._terms(points)]
        return np.stack(found, axis=-1) if found else np.zeros((*points.shape[:-2], 0))

    def beyond(self, points: Array) -> float:
        """How far a point leaves the box, in units of the size; 0 if none does."""
        outside = replace(self, joints=()).shortfalls(points)
        return float(np.nan_to_num(outside).max(initial=0.0))

    def slopes(self, points: Array, of_points: Array) -> Array:
        """Derivatives (..., m, c, k) of the shortfalls, from those of the points (..., 3, k)."""
        found = [
            np.einsum("...,...pi,...pik->...k", value > 0.0, slope, of_points)
            for value, slope in self._terms(points)
        ]
        none = np.zeros((*points.shape[:-2], 0, of_points.shape[-1]))
        return np.stack(found, axis=-2) if found else none

    def _terms(self, points: Array) -> list[tuple[Array, Array]]:
        """Each shortfall (..., m), negative where met, and its slope by the points."""
        found = []
        for joint, least in self.joints:
            angle, slope = transmission_angle(points, joint)
            found.append((least - angle, -slope))
        for axis in range(0 if self.box is None else self.box.shape[1]):
            assert self.box is not None
            for side, sign in enumerate((-1.0, 1.0)):
                beyond = sign * (points[..., axis] - self.box[side, axis]) / self.size
                worst = np.argmax(beyond, axis=-1)[..., None]
                slope = np.zeros_like(points)
                np.put_along_axis(slope[..., axis], worst, sign / self.size, axis=-1)
                found.append((np.take_along_axis(beyond, worst, axis=-1)[..., 0], slope))
        return found


def transmission_angle(points: Array, joint: tuple[int, int, int]) -> tuple[Array, Array]:
    """The acute angle at a joint between points (..., points, 3), rad, and its slope by them."""
    before, at, behind = joint
    a, b = points[..., before, :] - points[..., at, :], points[..., behind, :] - points[..., at, :]
    long = [np.linalg.norm(each, axis=-1, keepdims=True) for each in (a, b)]
    a, b = a / long[0], b / long[1]
    cosine = (a * b).sum(axis=-1, keepdims=True)
    sine = np.linalg.norm(np.cross(a, b), axis=-1, keepdims=True)
    side = np.where(cosine >= 0.0, 1.0, -1.0)
    divisor = np.maximum(sine, np.finfo(float).tiny)
    slope = np.zeros_like(points)
    slope[..., before, :] = side * (cosine * a - b) / divisor / long[0]
    slope[..., behind, :] = side * (cosine * b - a) / divisor / long[1]
    slope[..., at, :] = -slope[..., before, :] - slope[..., behind, :]
    return np.arctan2(sine, np.abs(cosine))[..., 0], slope
