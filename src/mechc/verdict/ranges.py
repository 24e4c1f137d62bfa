"""What joints of loops with one freedom reach from a closed configuration.

Each coordinate is driven both ways from the farthest configuration that is known, first from the
drawn pose, to its dead point, to a limit of a joint, or round to where it began; again, until none
goes farther.  So one coordinate leads the loops through the dead points of another.
"""

from __future__ import annotations

import numpy as np

from mechc.analysis.position_sweep import follow
from mechc.assembly.closer import wrap
from mechc.assembly.directions import at_rest
from mechc.assembly.positions import reach
from mechc.system.parameters import Array
from mechc.system.system import System

STEPS, FINER = 360, 64  # of a whole turn, or two lengths of the mechanism; between two of them
ROUNDS, MOST = 8, 24  # of all coordinates; parts of one drive
WEAK, SINGULAR = 0.2, 1e-6  # least singular values that are looked at, and that are zero
SAME, OUTSIDE, EXACT = 1e-6, 1e-9, 1e-13  # relative to the reach; beyond a limit; of its place


def loop_rows(system: System, places: list[int], q: Array, p: Array) -> Array:
    """Derivatives of the rows by some coordinates at configurations q (n, nq), with rows for the
    lengths of quaternions (n, rows, places)."""
    gradient = system.constraint_gradient(at_rest(system, q), p, 0.0)
    lengths = system.attitudes.lengths_gradient(q, places)
    return np.asarray(np.concatenate([gradient, lengths], axis=1)[..., places])


class LoopRanges:
    """The ranges (2, nq) of coordinates from a closed configuration q (nq,) on, of which those at
    the places ``free`` change, within limits (2, nq).

    ``stops``: the coordinates whose limits stop them.  ``change_points``: configurations (nq,)
    where rows become dependent, angles in (-pi, pi].
    """

    def __init__(self, system: System, free: list[int], q: Array, p: Array, limits: Array) -> None:
        self.system, self.free, self.p = system, free, p
        self.reach, self.known, self.ranges = reach(system, p), q[None], np.stack([q, q])
        lower, upper = limits  # those that the pose exceeds bound nothing
        self.lower = np.where(q < lower - OUTSIDE, -np.inf, np.minimum(lower, q))
        self.upper = np.where(q > upper + OUTSIDE, np.inf, np.maximum(upper, q))
        self.stops, self.change_points, self.usual = set[int](), list[Array](), 0.0

    def explore(self) -> bool:
        """Drive the coordinates until none goes farther; whether that was reached."""
        quaternions = {i for places in self.system.attitudes.quaternions for i in places}
        for _ in range(ROUNDS):
            before = self.ranges.copy()
            for driven in (i for i in self.free if i not in quaternions):
                for way in (1.0, -1.0):
                    start = self.known[np.argmax(way * self.known[:, driven])]
                    path, end = self._drive(start, driven, way)
                    self._find_change_points(path, driven)
                    self.known = np.concatenate([self.known, path[1:]])
                    if np.isinf(end):
                        return False
                    path[-1, driven] = end
                    reached = np.clip([*path, *self.ranges], self.lower, self.upper)
                    self.ranges = np.array([reached.min(axis=0), reached.max(axis=0)])
            if np.allclose(before, self.ranges, rtol=0.0, atol=SAME):
                return True
        return False

    def _drive(self, start: Array, driven: int, way: float) -> tuple[Array, float]:
        """Closed configurations from one on, and the value of the driven coordinate at their end;
        infinite where none was met."""
        path, far = start[None], start[driven] + 2.0 * way * self.reach[driven]
        for _ in range(MOST):
            values = np.linspace(path[-1, driven], far, STEPS + 1)
            piece, end = self._follow(path[-1], driven, values)
            excess = np.maximum(piece - self.upper, self.lower - piece)
            fit = np.append((excess <= EXACT).all(axis=1), False)  # False where they are NaN
            count = int(np.argmin(fit))
            path = np.concatenate([path, piece[1:count]])
            last = float(path[-1, driven])
            if count > STEPS:
                if self._comes_round(start, path[-1]):
                    return path, last
                far += 2.0 * way * self.reach[driven]
                continue
            far, is_dead = values[count], bool(np.isnan(piece[count]).any())
            if abs(far - last) <= (SAME if is_dead else EXACT) * self.reach[driven] or not count:
                if not is_dead:
                    self.stops.add(int(np.argmax(excess[count])))
                return path, end if is_dead and np.isfinite(end) else last
        return path, np.inf

    def _follow(self, q: Array, driven: int, values: Array) -> tuple[Array, float]:
        """Configurations (values, nq) from q (nq,) on, NaN beyond their end, and this end."""
        places = np.array([i for i in self.free if i != driven], np.intc)
        name = self.system.coordinates[driven]
        sweep = follow(self.system, name, values, places, q[None], self.p[None], 0.0)
        return sweep.q[0], float(sweep.end[0])

    def _comes_round(self, first: Array, last: Array) -> bool:
        """Whether two configurations are one but for whole turns, which no limit bounds: what has
        turned between them has no ends."""
        moved = np.abs(last - first) > SAME * self.reach
        bounded = np.isfinite(self.lower) | np.isfinite(self.upper)
        if self._apart(first, last) >= SAME or (moved & bounded).any():
            return False
        self.ranges[:, moved] = [[-np.inf], [np.inf]]
        return True

    def _apart(self, one: Array, other: Array) -> float:
        """How far two configurations are apart, relative to the reach, but for whole turns."""
        away, angles = other - one, list(self.system.angles)
        away[angles] = wrap(away[angles])
        return float(np.abs(away / self.reach)[self.free].max())

    def _find_change_points(self, path: Array, driven: int) -> None:
        """Note the change points on a path: where two loops are in line at once no determinant
        changes its sign, so the minima of the least singular value are refined."""
        weak, angles = self._weakest(path), list(self.system.angles)
        self.usual = max(self.usual, float(weak.max()))
        around = np.concatenate([[np.inf], weak, [np.inf]])
        least = (weak <= around[:-2]) & (weak <= around[2:]) & (weak < WEAK * self.usual)
        for k in np.flatnonzero(least) if len(path) > 1 else ():
            near, place = path, int(k)
            for _ in range(4):
                one, other = near[max(place - 1, 0)], near[min(place + 1, len(near) - 1)]
                near, _ = self._follow(one, driven, np.linspace(one[driven], other[driven], FINER))
                near = near[np.isfinite(near).all(axis=1)]
                place = int(np.argmin(self._weakest(near)))
            q = near[place].copy()
            q[angles] = wrap(q[angles])
            is_new = all(self._apart(q, other) > 100.0 * SAME for other in self.change_points)
            if is_new and self._weakest(q[None])[0] < SINGULAR * self.usual:
                self.change_points.append(q)

    def _weakest(self, q: Array) -> Array:
        """The least singular value that one freedom leaves, relative to the largest (n,)."""
        rows = loop_rows(self.system, self.free, q, self.p) * self.reach[self.free]
        sizes = np.linalg.svd(rows, compute_uv=False)
        return np.asarray(sizes[:, len(self.free) - 2] / sizes[:, 0])
