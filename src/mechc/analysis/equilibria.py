"""Configurations of interest found by search: equilibria, limits of a driving coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechc.assembly.closer import SAME, even_points, search_of, wrap
from mechc.assembly.positions import closed_states, gaps
from mechc.assembly.sizes import is_open, refuse_uneven, sizes, steps_of
from mechc.errors import MechcError, UnknownNameError
from mechc.native._codes import RUNNING
from mechc.system.parameters import Array
from mechc.system.system import System

STARTS, ITERATIONS = 48, 60
SCAN, BISECTIONS = 181, 60  # ranges narrower than two degrees can be missed
NEUTRAL = 1e-7  # of the largest: slopes below it are rounding of the differences
DIFFERENCE = 1e-6  # step of the central differences along the manifold


@dataclass(frozen=True)
class Equilibrium:
    """A configuration that stays at rest.

    Attributes
    ----------
    y : (nq + nu,)
        The state, speeds zero.
    stable
        Whether the mechanism returns after a small displacement in every direction.
    neutral
        In how many directions it stays where it is put: a bar between two balls may spin, and
        every angle of it is an equilibrium.
    """

    y: Array
    stable: bool
    neutral: int = 0


def equilibria(system: System, values: Array, t: float = 0.0) -> tuple[Equilibrium, ...]:
    """Equilibria under the loads at time t: see :meth:`mechc.Model.equilibria`."""
    if system.states:
        raise MechcError(
            f"{system.name} has additional states ({', '.join(system.states)}): equilibria are "
            "found for mechanisms without them; at an equilibrium of both model.rhs is zero"
        )
    refuse_uneven(system, values, t)
    starts = closed_states(system, even_points(STARTS, len(system.coordinates)), values, t)
    found: list[Equilibrium] = []
    for start in starts:
        y = _settle(system, start, values, t)
        if y is not None and all(_apart(system, y, e.y, values) for e in found):
            found.append(Equilibrium(y, *_kind(system, y, values, t)))
    if not found:
        raise MechcError(
            f"no equilibrium was found from {len(starts)} configurations that close the loops: "
            "the loads have none, or the search did not reach it; integrate with damping "
            "to see where the mechanism comes to rest"
        )
    return tuple(sorted(found, key=lambda e: (not e.stable, e.y.tolist())))


def limits(system: System, coordinate: str, values: Array) -> tuple[tuple[float, float], ...]:
    """The ranges of a coordinate for which the loops close: see :meth:`mechc.Model.limits`."""
    if coordinate not in system.coordinates:
        raise UnknownNameError("coordinate", coordinate, system.coordinates)
    driven = system.state_index(coordinate)
    most = np.pi if system.angular[driven] else sizes(system, values).length
    grid = np.linspace(-most, most, SCAN)
    closed = _closed_at(system, driven, grid, values)
    edges = [-most] if closed[0] is not None else []
    for k in range(SCAN - 1):
        if (closed[k] is None) != (closed[k + 1] is None):
            sides = (grid[k], closed[k]), (grid[k + 1], closed[k + 1])
            edges.append(_edge(system, driven, *sides, values))
    if closed[-1] is not None:
        edges.append(most)
    return tuple((float(a), float(b)) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _closed_at(system: System, driven: int, grid: Array, values: Array) -> list[Array | None]:
    """Closed configurations (nq,), one for each value of a coordinate, None where there is none."""
    fixed = system.default_configurations(len(grid), [system.coordinates[driven]])
    fixed[:, driven] = grid
    free = system.unknowns([driven])
    if not free or not system.scene.holonomic:
        opened = gaps(system, fixed, values, 0.0)
        return [
            None if is_open(system, gap, values, 0.0) else q
            for q, gap in zip(fixed, opened, strict=True)
        ]
    p = np.tile(values, (len(grid), 1))
    any_start = search_of(system, free, starts=even_points(STARTS, len(free)))
    search = any_start.solve(0.0, fixed, p, 1, enough=1, tells_miss=False)
    return [q[0] if many else None for q, many in zip(search.found, search.many, strict=True)]


Side = tuple[float, "Array | None"]


def _edge(system: System, driven: int, a: Side, b: Side, values: Array) -> float:
    """The value between a and b where closing starts or ends, on the closed side, by bisection."""
    free = system.unknowns([driven])
    (inside, q), (outside, _) = (a, b) if a[1] is not None else (b, a)
    if not free:
        return inside
    nearby = search_of(system, free, free, np.zeros((1, len(free))))
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside) or q is None:
            break
        trial = q[None].copy()
        trial[0, driven] = middle
        search = nearby.solve(0.0, trial, values[None], 1, enough=1, tells_miss=False)
        if search.many[0]:
            inside, q = middle, search.found[0, 0]
        else:
            outside = middle
    return inside


def _settle(system: System, y: Array, values: Array, t: float) -> Array | None:
    """Newton's method along the manifold; None where it does not converge."""
    width = len(system.coordinates)
    for _ in range(ITERATIONS):
        basis = _tangent(system, y, values, t)
        residual = _along(system, y, basis, values, t)
        slope = _slope(system, y, basis, values, t)
        step = -np.linalg.lstsq(slope, residual, rcond=NEUTRAL)[0]
        size = float(np.abs(step).max(initial=0.0))
        moved = _neighbour(system, y, basis @ (step * min(1.0, 0.3 / max(size, 1e-300))), values, t)
        if moved is None:
            return None
        y = moved
        if size < 1e-12:
            if np.abs(residual).max(initial=0.0) > 1e-9 * max(1.0, np.abs(slope).max(initial=0.0)):
                return None  # pushed in a direction in which no displacement helps
            y[:width] = np.where(system.angular[:width], wrap(y[:width]), y[:width])
            return y
    return None


def _tangent(system: System, y: Array, values: Array, t: float) -> Array:
    """Directions that keep the constraints: (nu, freedoms), orthonormal in units of the steps."""
    jacobian = system.constraint_jacobian(y, values, t) * _speed_steps(system, values)
    if not len(jacobian):
        return np.eye(len(system.speeds))
    _, singular, rows = np.linalg.svd(jacobian)
    rank = int((singular > 1e-10 * singular[0]).sum())
    return np.asarray(rows[rank:].T)


def _along(system: System, y: Array, basis: Array, values: Array, t: float) -> Array:
    """Accelerations along the directions; those at rest lie in their span."""
    accelerations = system.rates(y, values, t)[len(system.coordinates) :]
    return np.asarray(basis.T @ (accelerations / _speed_steps(system, values)))


def _speed_steps(system: System, values: Array) -> Array:
    return steps_of(system, values)[len(system.coordinates) :]


def _slope(system: System, y: Array, basis: Array, values: Array, t: float) -> Array:
    """Derivative of the accelerations along the manifold, by central differences."""
    if not basis.shape[1]:
        return np.zeros((0, 0))
    columns = []
    for direction in basis.T:
        ends = [_neighbour(system, y, s * DIFFERENCE * direction, values, t) for s in (1.0, -1.0)]
        if ends[0] is None or ends[1] is None:
            columns.append(np.zeros(basis.shape[1]))
            continue
        forward, backward = (
            _along(system, end, basis, values, t) for end in ends if end is not None
        )
        columns.append((forward - backward) / (2 * DIFFERENCE))
    return np.column_stack(columns)


def _neighbour(system: System, y: Array, change: Array, values: Array, t: float) -> Array | None:
    """A state moved by `change` along the speeds, then put back onto the manifold, at rest."""
    width = len(system.coordinates)
    with_speeds = np.concatenate([y[:width], change * _speed_steps(system, values)])
    trial = y.copy()
    trial[:width] += system.rates(with_speeds, values, t)[:width]
    status, moved, _, _ = system.scene.project(t, trial, values)
    moved[width:] = 0.0
    return np.asarray(moved) if status == RUNNING else None


def _kind(system: System, y: Array, values: Array, t: float) -> tuple[bool, int]:
    """Whether an equilibrium is stable, and the number of its neutral directions."""
    slope = _slope(system, y, _tangent(system, y, values, t), values, t)
    if not len(slope):
        return True, 0
    singular = np.linalg.svd(slope, compute_uv=False)
    neutral = int((singular <= NEUTRAL * singular[0]).sum())
    return not neutral and bool(np.linalg.eigvals(slope).real.max() < 0), neutral


def _apart(system: System, a: Array, b: Array, values: Array) -> bool:
    difference = np.where(system.angular, wrap(a - b), a - b) / steps_of(system, values)
    return bool(np.abs(difference).max() > 10 * SAME)
