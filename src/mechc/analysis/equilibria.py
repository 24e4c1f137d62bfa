"""Configurations of interest found by search: equilibria, limits of a driving coordinate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechc.analysis.linearize import linearize
from mechc.analysis.neutral import are_joined, distance, kept_directions, null_directions
from mechc.assembly.closer import SAME, even_points, search_of, wrap
from mechc.assembly.directions import are_turned
from mechc.assembly.positions import are_closed, closed_states
from mechc.assembly.sizes import refuse_uneven, sizes, steps_of
from mechc.errors import ChangePointError, MechcError, UnknownNameError
from mechc.native._codes import RUNNING
from mechc.system.parameters import Array
from mechc.system.system import System

FIRST, MOST_STARTS, MOST_WORK = 48, 8192, 1 << 22  # of the first batch; of all; times speeds cubed
ITERATIONS, LONGEST, CONVERGED = 60, 1.0, 1e-10  # steps of Newton's method, rad or lengths
SURE = 0.5  # expected number of equilibria that were not found
SCAN, BISECTIONS = 181, 60  # ranges narrower than two degrees can be missed
NEUTRAL = 1e-7  # of the largest: slopes below it are rounding of the differences
DIFFERENCE = 1e-6  # step of the central differences along the manifold
DEPENDENT = 1e-10  # of the largest singular value: below it constraints are dependent
BALANCED = 1e-9  # of the forces or their slopes: what is left of them is rounding
STILL = 1e-6  # of them over the mass: accelerations below it are rounding


@dataclass(frozen=True)
class Equilibrium:
    """A configuration that stays at rest.

    Attributes
    ----------
    y : (nq + nu,)
        The state, speeds zero.
    kind
        ``"unstable"`` where a small deviation grows, else ``"neutral"`` where there are directions
        in which it stays, else ``"stable"``; ``"undecided"`` at a change point.
    neutral
        In how many directions it may move and stays where it is put: a bar between two balls may
        spin, and every angle of it is an equilibrium.
    eigenvalues : (2 freedoms,)
        Of the linear model about it, 1/s, complex, those that grow fastest first.  No real part is
        positive where it is stable: without damping all are zero, and small oscillations last.
    directions : (len(free), nq)
        To the equilibria around it: how the coordinates (m, rad) change together.
    free
        The names of those that change, by direction: ``("x",)`` of a cart on a rail,
        ``("x, angle",)`` of a wheel, whose x and angle change together.  Of wheels that do not slip
        sideways there are more directions than ``neutral``.
    """

    y: Array
    kind: str
    neutral: int
    eigenvalues: NDArray[np.complex128]
    directions: Array
    free: tuple[str, ...] = ()

    @property
    def stable(self) -> bool:
        """Whether small deviations do not grow, nor stay."""
        return self.kind == "stable"


class Equilibria(tuple[Equilibrium, ...]):
    """The equilibria that were found, the stable ones first, and how likely they are all.

    Of a family, along which a mechanism stays wherever it is put, it has one: see ``free``.

    Attributes
    ----------
    searches
        How many searches ended at isolated equilibria, those found before included.
    expected
        The number of isolated equilibria to expect: W (N - 1) / (N - W - 2) where N searches found
        W, if nothing is known of the share of the starts that lead to each (Boender & Rinnooy
        Kan 1987, Mathematical Programming 37).  Infinite until N > W + 2.
    unexplored
        The share of the starts to expect that lead to others: W (W + 1) / (N (N - 1)).
    """

    searches: int

    @property
    def expected(self) -> float:
        found, searches = self._isolated, self.searches
        if not found:
            return 0.0
        more = searches - found - 2
        return found * (searches - 1) / more if more > 0 else np.inf

    @property
    def unexplored(self) -> float:
        found, searches = self._isolated, self.searches
        return min(1.0, found * (found + 1) / max(1, searches * (searches - 1)))

    @property
    def _isolated(self) -> int:
        return sum(not each.neutral for each in self)


def equilibria(
    system: System, values: Array, t: float = 0.0, most_starts: int | None = None
) -> Equilibria:
    """Equilibria under the loads at time t: see :meth:`mechc.Model.equilibria`.

    Searches go on, in batches twice as large each time, until less than half an equilibrium more is
    expected.  Neutral equilibria, of which there are infinitely many, do not count there.
    """
    if system.states:
        raise MechcError(
            f"{system.name} has additional states ({', '.join(system.states)}): equilibria are "
            "found for mechanisms without them; at an equilibrium of both model.rhs is zero"
        )
    refuse_uneven(system, values, t)
    work = MOST_WORK // max(1, len(system.speeds)) ** 3
    most = most_starts or max(FIRST, min(MOST_STARTS, work))
    points = even_points(most, len(system.coordinates))
    found, searches, tried = list[Equilibrium](), 0, 0
    members = list[tuple[Equilibrium, Equilibrium]]()  # of families, each with its first
    for first, last in _batches(most):
        starts = closed_states(system, points[first:last], values, t)
        for places in system.attitudes.quaternions:  # zero is no attitude
            starts[~starts[:, places].any(axis=1), places[0]] = 1.0
        tried += len(starts)
        for y in _settled(system, starts, values, t):
            known = _same(system, y, found, values)
            if known is None:
                one = known = _judged(system, y, values, t)
                if len(one.directions):
                    known = _first_of_family(system, one, members, values, t)
                if known.free:
                    members.append((one, known))
                if all(known is not other for other in found):
                    found.append(known)
            searches += not known.neutral
        result = Equilibria(sorted(found, key=lambda e: (not e.stable, e.y.tolist())))
        result.searches = searches
        if found and result.expected < sum(not e.neutral for e in found) + SURE:
            break
    if not found:
        raise MechcError(
            f"no equilibrium was found from {tried} configurations that close the loops: "
            "the loads have none, or the search did not reach it; integrate with damping "
            "to see where the mechanism comes to rest"
        )
    return result


def _first_of_family(
    system: System, one: Equilibrium, members: Sequence[tuple[Equilibrium, Equilibrium]],
    values: Array, t: float,
) -> Equilibrium:  # fmt: skip
    """The first equilibrium of the family of this one: this one where it is of no known family.

    Asks the nearest member of each family, the nearest family first.
    """

    def settle(y: Array) -> Array | None:
        return next(iter(_settled(system, y[None], values, t)), None)

    def directions_at(y: Array) -> Array:
        return _judged(system, y, values, t).directions

    asked = set[int]()
    for member, first in sorted(
        members, key=lambda pair: distance(system, pair[0].y, one.y, values)
    ):
        if id(first) in asked or first.kind != one.kind:
            continue
        asked.add(id(first))
        ends = (member.y, member.directions), (one.y, one.directions)
        if are_joined(system, *ends, settle, directions_at, values):
            return first
    kept = kept_directions(system, one.y, one.directions, settle, values)
    names = np.array(system.coordinates)
    free = tuple(", ".join(names[direction != 0.0]) for direction in kept)
    return replace(one, free=free, directions=kept)


def _batches(most: int) -> Iterator[tuple[int, int]]:
    """Ranges of starts: the first ones, then each time as many as before in all."""
    first, last = 0, min(FIRST, most)
    while first < last:
        yield first, last
        first, last = last, min(2 * last, most)


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
        closed = are_closed(system, fixed, values, 0.0)
        return [q if closes else None for q, closes in zip(fixed, closed, strict=True)]
    p = np.tile(values, (len(grid), 1))
    any_start = search_of(system, free, starts=even_points(FIRST, len(free)))
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


def _settled(system: System, y: Array, values: Array, t: float) -> list[Array]:
    """The equilibria (nq + nu,) to which Newton's method leads from states (n, nq + nu) at rest.

    It solves F - J^T lambda = 0 and the constraints: in the span of the constraints' gradients the
    step closes them, across it the step ends the force that they do not hold.
    """
    width, ends = len(system.coordinates), list[Array]()
    y = y.copy()
    for _ in range(ITERATIONS):
        step, left, size = _newton_step(system, y, values, t)
        longest = np.abs(step).max(axis=1, initial=0.0)
        shortened = step * (LONGEST / np.maximum(longest, LONGEST))[:, None]
        y[:, :width] += _moved(system, y, shortened[:, None], values, t)[:, 0]
        done = longest < CONVERGED
        balanced = done & (left <= BALANCED * size)  # else no displacement helps
        ends += list(y[balanced][_at_rest(system, y[balanced], size[balanced], values, t)])
        y = y[~done & np.isfinite(longest)]
        if not len(y):
            break
    closed = (_closed(system, end, values, t) for end in ends)
    return [end for end in closed if end is not None]


def _at_rest(system: System, y: Array, size: Array, values: Array, t: float) -> Array:
    """Whether states (n, nq + nu) stay (n,), for forces of this size: at poles of the coordinates
    forces vanish, since nothing moves by these coordinates, and the accelerations do not."""
    steps = _speed_steps(system, values)
    mass = np.abs(system.mass_matrix(y, values, t) * np.outer(steps, steps)).max(axis=(1, 2))
    accelerations = system.rates(y, values, t)[:, len(system.coordinates) :] / steps
    return np.asarray(mass * np.abs(accelerations).max(axis=1) <= STILL * size)


def _newton_step(system: System, y: Array, values: Array, t: float) -> tuple[Array, Array, Array]:
    """The step (n, nu) of Newton's method in units of the steps, the force that is left over and
    the size of forces (n,), in units of work."""
    force, rows = _force_and_rows(system, y, values, t)
    inverse = np.asarray(np.linalg.pinv(rows, rcond=DEPENDENT), np.float64)
    across: Array = np.eye(force.shape[1]) - inverse @ rows
    multipliers = _times(inverse.transpose(0, 2, 1), force)
    gaps = system.constraints(y, values, t) / sizes(system, values, t).rows
    closing = -_times(inverse[:, :, : gaps.shape[1]], gaps)
    units = np.broadcast_to(np.eye(force.shape[1]), (len(y), *across.shape[1:]))
    sides = list[Array]()
    for side in (DIFFERENCE, -DIFFERENCE):
        moved = np.repeat(y[:, None], force.shape[1], axis=1)
        moved[..., : len(system.coordinates)] += side * _moved(system, y, units, values, t)
        there, rows_there = _force_and_rows(system, moved, values, t)
        sides.append(there - _times(rows_there.swapaxes(-1, -2), multipliers[:, None]))
    slope: Array = ((sides[0] - sides[1]) / (2.0 * DIFFERENCE)).transpose(0, 2, 1)
    left = _times(across, force)
    wanted = left + _times(across, _times(slope, closing))
    along = np.asarray(np.linalg.pinv(across @ slope @ across, rcond=NEUTRAL), np.float64)
    step = closing - _times(along, wanted)
    size = np.maximum(np.abs(force).max(axis=1), np.abs(slope).max(axis=(1, 2)))
    return step, np.abs(left).max(axis=1), size


def _force_and_rows(system: System, y: Array, values: Array, t: float) -> tuple[Array, Array]:
    """The forces (..., nu) and the rows of J (..., nc, nu) at rest, by the steps of the speeds."""
    steps = _speed_steps(system, values)
    rows = system.constraint_jacobian(y, values, t) * steps
    holonomic = system.scene.holonomic
    rows[..., :holonomic, :] /= sizes(system, values, t).rows[:, None]
    return system.evaluate("forcing", y, values, t) * steps, rows


def _moved(system: System, y: Array, steps: Array, values: Array, t: float) -> Array:
    """The changes of the coordinates (n, m, nq) by m steps (n, m, nu) of the speeds at states."""
    width = len(system.coordinates)
    moving = np.repeat(y[:, None], steps.shape[1], axis=1)
    still = system.rates(y, values, t)[:, None, :width]
    moving[..., width:] = steps * _speed_steps(system, values)
    return np.asarray(system.rates(moving, values, t)[..., :width] - still)


def _times(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _closed(system: System, y: Array, values: Array, t: float) -> Array | None:
    """The nearest state on the manifold, at rest, angles within (-pi, pi]."""
    status, moved, _, _ = system.scene.project(t, y, values)
    if status != RUNNING or are_turned(system, moved, values, t):
        return None
    width = len(system.coordinates)
    moved[width:] = 0.0
    moved[:width] = np.where(system.angular[:width], wrap(moved[:width]), moved[:width])
    return system.attitudes.one_of_two(system.attitudes.scale(np.asarray(moved)))


def _speed_steps(system: System, values: Array) -> Array:
    return steps_of(system, values)[len(system.coordinates) :]


def _judged(system: System, y: Array, values: Array, t: float) -> Equilibrium:
    """An equilibrium with its kind, by the eigenvalues of the linear model about it."""
    none, nowhere = np.zeros(0, np.complex128), np.zeros((0, len(system.coordinates)))
    try:
        lin = linearize(system, y, values, t, (), (), None, ())
    except ChangePointError:
        return Equilibrium(y, "undecided", 0, none, nowhere)
    width = sum(name in system.coordinates for name in lin.states)
    steps = steps_of(system, values)[[system.state_index(name) for name in lin.states[width:]]]
    slope = lin.A[width:, :width] @ lin.A[:width, width:] * steps / steps[:, None]
    damping = lin.A[width:, width:] * steps / steps[:, None]
    if not len(slope):
        return Equilibrium(y, "stable", 0, none, nowhere)
    singular = np.linalg.svd(slope, compute_uv=False)
    pull = _pull(system, y, values, t)
    rounding = BALANCED * max(singular[0], pull)
    neutral = int((singular <= rounding).sum())
    directions = null_directions(system, lin, values, pull) if neutral else nowhere
    roots, unsure = _eigenvalues(np.block([[np.zeros_like(slope), np.eye(len(slope))],
                                           [slope, damping]]))  # fmt: skip
    grows = bool((roots.real > np.maximum(unsure, np.sqrt(rounding) if neutral else 0.0)).any())
    kind = "unstable" if grows else "neutral" if neutral else "stable"
    roots = roots[np.argsort(-roots.real, kind="stable")]
    return Equilibrium(y, kind, neutral, roots, directions)


def _pull(system: System, y: Array, values: Array, t: float) -> float:
    """The largest acceleration, in steps, that the loads would give without the constraints."""
    loads = system.evaluate("forcing", y, values, t)
    free = np.linalg.lstsq(system.mass_matrix(y, values, t), loads, rcond=None)[0]
    return float(np.abs(free / _speed_steps(system, values)).max(initial=0.0))


def _eigenvalues(matrix: Array) -> tuple[NDArray[np.complex128], Array]:
    """Eigenvalues, and by how much each may be off for a matrix that is right but for rounding.

    By the angles between left and right eigenvectors, which are at right angles where two
    eigenvalues meet: these are off by the root.
    """
    from scipy.linalg import eig, matrix_balance  # slow to import

    balanced = matrix_balance(matrix)[0]
    roots, left, right = eig(balanced, left=True, right=True)
    cosine = np.abs((left.conj() * right).sum(axis=0))
    size = np.linalg.norm(balanced, 2)
    return roots, size * np.minimum(BALANCED / np.maximum(cosine, BALANCED), np.sqrt(BALANCED))


def _same(
    system: System, y: Array, found: Sequence[Equilibrium], values: Array
) -> Equilibrium | None:
    """The equilibrium that is at this state, if any is."""
    if not found:
        return None
    away = np.array([e.y for e in found]) - y
    away = np.abs(np.where(system.angular, wrap(away), away) / steps_of(system, values))
    nearest = int(np.argmin(away.max(axis=1)))
    return found[nearest] if away[nearest].max() <= 10 * SAME else None
