"""Trees of links without C: mass matrix, forcing and rows of cuts, of many states at once.

The same recursions as the compiled ones: composite rigid bodies and recursive Newton-Euler
(Featherstone 2008, chapters 5 and 6).  Vectors of motion are (omega; v) of a link's reference
point, wrenches (moment; force) there, along the inertial axes; in a plane (omega_z; v_x, v_y).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from mechc.system.parameters import Array

LOWER = tuple((i, j) for i in range(3) for j in range(i + 1))


class TreeData(NamedTuple):
    """Of n states: offsets (n, links, arm), subspace (n, nu, d), inertias (n, links, d, d), and for
    cuts the reference points (n, links, arm) and ends and axis (n, cuts, 3, arm)."""

    offset: Array
    subspace: Array
    inertia: Array
    reference: Array | None
    cut: Array | None


class LinkTree:
    """The recursions over one tree; ``tree`` has parents, columns, planar and cuts."""

    def __init__(self, tree: Any) -> None:
        self.parents, self.planar, self.cuts = tree.parents, tree.planar, tree.cuts
        self.arm, self.size = (2, 3) if tree.planar else (3, 6)
        self.speeds = np.array([speed for own in tree.columns for speed in own], np.intp)
        ends = np.cumsum([0, *map(len, tree.columns)])
        self.columns = [np.arange(a, b) for a, b in pairwise(ends.tolist())]
        self.link = np.repeat(np.arange(len(self.parents)), np.diff(ends))
        self.paths = [self._path(link) for link in range(len(self.parents))]

    def _path(self, link: int) -> Any:
        """Columns of the links from here to the ground."""
        found = list[int]()
        while link >= 0:
            found += self.columns[link].tolist()
            link = self.parents[link]
        return np.array(found, np.intp)

    def data(self, filled: dict[str, Array]) -> TreeData:
        """The arrays that the scene's function filled, in their shapes."""
        count = len(filled["offset"])
        cut, reference = filled.get("cut"), filled.get("reference")
        return TreeData(
            filled["offset"].reshape(count, -1, self.arm),
            filled["subspace"].reshape(count, -1, self.size),
            self._rigid(filled["inertia"].reshape(count, len(self.parents), -1)),
            None if reference is None else reference.reshape(count, -1, self.arm),
            None if cut is None else cut.reshape(count, -1, 3, self.arm),
        )

    def _rigid(self, masses: Array) -> Array:
        """Inertias (n, links, d, d) from m, m c and the lower half about the reference point."""
        out = np.zeros((*masses.shape[:2], self.size, self.size))
        m, c = masses[..., 0], masses[..., 1 : 1 + self.arm]
        turning = self.size - self.arm
        for i in range(self.arm):
            out[..., turning + i, turning + i] = m
        if self.planar:
            out[..., 0, 0] = masses[..., 3]
            coupling = np.stack([-c[..., 1], c[..., 0]], axis=-1)[..., None, :]
        else:
            for k, (i, j) in enumerate(LOWER):
                out[..., i, j] = out[..., j, i] = masses[..., 4 + k]
            coupling = _skew(c)
        out[..., :turning, turning:] = coupling
        out[..., turning:, :turning] = np.swapaxes(coupling, -1, -2)
        return out

    def _shift(self, arm: Array) -> Array:
        """X (n, d, d): the motion of a point at the end of an arm is X times that at its start."""
        out = np.zeros((len(arm), self.size, self.size))
        out[:, np.arange(self.size), np.arange(self.size)] = 1.0
        if self.planar:
            out[:, 1, 0], out[:, 2, 0] = -arm[:, 1], arm[:, 0]
        else:
            out[:, 3:, :3] = -_skew(arm)
        return out

    def mass_matrix(self, data: TreeData) -> Array:
        """M (n, nu, nu), from the inertia of each link and its descendants."""
        count, size = data.subspace.shape[:2]
        mass, composite = np.zeros((count, size, size)), data.inertia.copy()
        hanging: list[list[tuple[Any, Array]]] = [[] for _ in self.parents]
        for link in reversed(range(len(self.parents))):
            own, speeds = self.columns[link], self.speeds[self.columns[link]]
            axes = data.subspace[:, own]
            hanging[link].append((speeds, composite[:, link] @ np.swapaxes(axes, 1, 2)))
            others = np.concatenate([each for each, _ in hanging[link]])
            wrenches = np.concatenate([wrench for _, wrench in hanging[link]], axis=2)
            block = axes @ wrenches
            mass[:, speeds[:, None], others] = block
            mass[:, others[:, None], speeds] = np.swapaxes(block, 1, 2)
            if (parent := self.parents[link]) >= 0:
                shift = self._shift(data.offset[:, link])
                turned = np.swapaxes(shift, 1, 2)
                composite[:, parent] += turned @ composite[:, link] @ shift
                hanging[parent].append((others, turned @ wrenches))
        return mass

    def forcing(self, data: TreeData, bias: Array, wrench: Array) -> Array:
        """F (n, nu): wrenches (n, links d), minus the inertia forces of the motion with u' = 0."""
        count = len(bias)
        motion = bias.reshape(count, -1, self.size).copy()
        left = wrench.reshape(count, -1, self.size).copy()
        shifts = [self._shift(data.offset[:, link]) for link in range(len(self.parents))]
        for link, parent in enumerate(self.parents):
            if parent >= 0:
                motion[:, link] += np.einsum("nij,nj->ni", shifts[link], motion[:, parent])
            left[:, link] -= np.einsum("nij,nj->ni", data.inertia[:, link], motion[:, link])
        forcing = np.zeros(data.subspace.shape[:2])
        for link in reversed(range(len(self.parents))):
            own = self.columns[link]
            axes = data.subspace[:, own]
            forcing[:, self.speeds[own]] = np.einsum("nci,ni->nc", axes, left[:, link])
            if (parent := self.parents[link]) >= 0:
                left[:, parent] += np.einsum("nij,ni->nj", shifts[link], left[:, link])
        return forcing

    def cut_rows(self, data: TreeData) -> Array:
        """J (n, cuts, nu): partial velocities of each cut's gap."""
        count, size = data.subspace.shape[:2]
        rows = np.zeros((count, len(self.cuts), size))
        assert data.cut is not None
        for i, links in enumerate(self.cuts):
            for link, end, sign in zip(links, (0, 1), (1.0, -1.0), strict=True):
                if link >= 0:
                    own = self.paths[link]
                    part = self._partials(data, own, data.cut[:, i, end], data.cut[:, i, 2])
                    rows[:, i, self.speeds[own]] += sign * part
        return rows

    def _partials(self, data: TreeData, columns: Any, point: Array, axis: Array) -> Array:
        """Velocity of a point along an axis by the speeds of these columns (n, columns)."""
        assert data.reference is not None
        arm = point[:, None, :] - data.reference[:, self.link[columns]]
        motion = data.subspace[:, columns]
        if self.planar:
            turn = motion[..., :1] * np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
            return np.asarray(np.einsum("nci,ni->nc", motion[..., 1:] + turn, axis))
        moved = motion[..., 3:] + np.cross(motion[..., :3], arm)
        return np.asarray(np.einsum("nci,ni->nc", moved, axis))


def _skew(a: Array) -> Array:
    """The matrix of a cross product from the left, (..., 3, 3)."""
    out = np.zeros((*a.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return out
