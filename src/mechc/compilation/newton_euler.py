"""The accelerations of a description by numbers alone, which judge those of the compiled program.

Newton's and Euler's equations of every body, projected onto the motions that its velocities allow
(Kane & Levinson 1985, section 6.1).  Nothing is derived or compiled: frames and points are placed
one after the other, velocities are differences of positions, accelerations those of velocities
along the motion, and partial velocities those by the speeds, in which velocities are linear.
Velocities that the description itself gives are taken from it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.compilation.picture import numeric
from mechc.errors import MechcError
from mechc.system.judged import Judged
from mechc.system.parameters import Array
from mechc.system.system import System

# Central differences of order 8 (Fornberg 1988, table 1)
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
# Of the largest singular value of the constraints: below the first rows depend, between is unclear.
DEPENDENT, CLEAR = 1e-9, 1e-4
Vectors = list[tuple[Any, int]]  # the frame of each part, and the place of its three components


@one_at_a_time
def judge(
    system: System, t: Array, y: Array, p: Array, steps: Sequence[Array],
    forces: Array | None = None,
) -> list[Judged]:  # fmt: skip
    """The rates of states along a motion, compared with those that the description determines.

    Parameters
    ----------
    t, y : (n,), (n, nq + nu)
        Times, and states on the constraints.
    p : (n, np)
        Parameters.
    steps : [(n,)]
        Steps of differences in s, for each of which the states are judged.
    forces : (n, nu)
        Generalized forces of contacts.

    Raises
    ------
    MechcError
        Where the equations of motion do not follow from bodies and loads alone, or the description
        is not at hand; with the reason.
    """
    if _Bodies not in system.cache:
        system.cache[_Bodies] = _bodies_of(system)
    bodies, given = system.cache[_Bodies]
    names = [f.func.__name__ for f in bodies.mechanism.open_inputs]
    told = [name for name in names if name in system.inputs]
    given_now = [] if system.driven is None else system.driven.values(told, t, y)
    of_inputs = dict(zip(told, given_now, strict=True))
    bodies.values = [of_inputs.get(name, 1.0) for name in names]
    ours = {**given, **{name: p[:, k] for k, name in enumerate(system.parameters)}}
    # what is not in the equations, as the inertia of what only slides, has any value
    bodies.values += [ours.get(q.symbol.name, 1.0) for q in bodies.mechanism.parameters]
    rates = system.evaluate("rates", y, p, t, forces)
    return [bodies.judge(t, y, rates, h, forces) for h in steps]


def _bodies_of(system: System) -> tuple[_Bodies, dict[str, float]]:
    """The bodies of a system's description, and the values of its fixed parameters."""
    if system.origin is None:
        raise MechcError("the description is not at hand in this process")
    mechanism, requested = system.origin.description()
    names = [f.func.__name__ for f in mechanism.open_inputs]
    if system.driven is not None and (moving := system.driven.of_time(names)):
        raise MechcError(f"constraints, mass matrix or kinematics contain the input {moving[0]}")
    if mechanism.lagrangian is not None:
        raise MechcError("they come from a Lagrangian")
    if mechanism.equations is not None:
        raise MechcError("they were given as matrices")
    fixed = {symbol.name: float(value) for symbol, value in requested.fixed.items()}
    absent = [f for f in mechanism.open_inputs if f.func.__name__ not in system.inputs]
    return _Bodies(mechanism, absent), fixed


class _Velocities(NamedTuple):
    """Quantities linear in the speeds, at n states, along the inertial axes."""

    linear: Array  # velocities of the mass centres (n, bodies, 3)
    angular: Array  # of the rigid bodies (n, rigid bodies, 3)
    momenta: Array  # linear (n, bodies, 3)
    moments: Array  # angular momenta about the mass centres (n, rigid bodies, 3)
    acting: Array  # velocities where loads act (n, loads, 3)
    rows: Array  # rates of the constraints (n, rows)


@dataclass
class _Located:
    """A point or a frame by its number, or, where it has none, by the velocity that is given."""

    number: int  # among all points, or all frames
    given: Vectors | None


class _Bodies:
    """The bodies, loads and constraints of a mechanism as functions of arrays.

    ``absent``: functions of time that the equations do not contain, such as the angle of a wheel
    whose speed has no coordinate.  They have any value, and what is placed by them has the velocity
    that the description gives it.
    """

    values: list[Any]  # of inputs and parameters, at the states at hand

    def __init__(self, mechanism: Any, absent: Sequence[Any] = ()) -> None:
        from mechc_codegen.description.placement import steps_from, way_to
        from mechc_codegen.description.terms import is_rigid
        from sympy.physics.mechanics import dynamicsymbols

        self.mechanism = mechanism
        self._way_to = way_to
        self._bound = {f: e for f, e in mechanism.inputs.items() if e is not None}
        self._frames_before = steps_from(mechanism.frame, lambda f: f._dcm_dict)
        self._points_before = steps_from(mechanism.origin, lambda p: p._pos_dict)
        self._frames, self._points = {mechanism.frame: 0}, {mechanism.origin: 0}
        self._absent, self._loose = tuple(absent), set[Any]()  # frames and points placed by them
        self._turns: list[tuple[int, int]] = []  # frame before, place of the nine entries
        self._ways: list[tuple[int, Vectors]] = []
        self._entries: list[Any] = []  # of time and coordinates
        self._entries_moving: list[Any] = []  # of the speeds too
        rigid = [body for body in mechanism.bodies if is_rigid(body)]
        self.centres = [self._place(body.masscenter) for body in mechanism.bodies]
        self.spins = [self._spin(body.frame) for body in rigid]
        self.masses = [self._of_speeds(body.mass) for body in mechanism.bodies]
        self.inertias = [self._dyadic(body.central_inertia) for body in rigid]
        self.loads = [self._load(place, vector) for place, vector in mechanism.loads]
        if mechanism.gravity is not None:
            self.loads += [self._load(b.masscenter, b.mass * mechanism.gravity)
                           for b in mechanism.bodies]  # fmt: skip
        self.added = [
            (self._target(a.place), [self._vector(v, self._of_speeds) for v in a.per_acceleration])
            for a in mechanism.added_inertia
        ]
        self.targets = [target for target, _ in (*self.loads, *self.added)]
        self.configuration = [self._of_places(c.expression)
                              for c in mechanism.configuration_constraints]  # fmt: skip
        self.closures = [self._closure(closure) for closure in mechanism.closures]
        self.motion = [self._of_speeds(c.expression) for c in mechanism.motion_constraints]
        rates = (*mechanism.kinematics, *(s.rate for s in mechanism.states))
        self.kinematics = [self._of_speeds(rate) for rate in rates]
        known = [dynamicsymbols._t, *mechanism.q, *mechanism.x]
        others = [*mechanism.open_inputs, *(p.symbol for p in mechanism.parameters)]
        self._of_q = numeric([*known, *others], self._entries)
        self._of_u = numeric([*known, *mechanism.u, *others], self._entries_moving)

    # -- entries --------------------------------------------------------------------------------

    def _bind(self, expression: Any) -> Any:
        from sympy import Derivative, sympify

        rates, found = self.mechanism.rates, sympify(expression)
        found = found.xreplace(self.mechanism.second_rates).xreplace(rates)
        for _ in self._bound:  # one may contain another
            found = found.xreplace(self._bound)
        if self._bound and found.has(Derivative):
            found = found.doit()
        return found.xreplace(rates)

    def _of_places(self, expression: Any) -> int:
        self._entries.append(self._bind(expression))
        return len(self._entries) - 1

    def _of_speeds(self, expression: Any) -> int:
        self._entries_moving.append(self._bind(expression))
        return len(self._entries_moving) - 1

    def _frame(self, frame: Any) -> int:
        if frame not in self._frames and frame not in self._frames_before:
            raise MechcError(f"how the frame {frame.name} is turned is not known")
        for step in self._way_to(frame, self._frames_before, self._frames):
            before = self._frames_before[step]
            places = [self._of_places(e) for e in before.dcm(step)]
            self._note(step, before, before.dcm(step))
            self._turns.append((self._frames[before], places[0]))
            self._frames[step] = len(self._turns)
        return self._frames[frame]

    def _note(self, step: Any, before: Any, placed_by: Any, frames: Sequence[Any] = ()) -> None:
        """Note a frame or a point that is placed by what is absent."""
        apart = bool(self._absent) and placed_by.has(*self._absent)
        if apart or self._loose.intersection((before, *frames)):
            self._loose.add(step)

    def _vector(self, vector: Any, kept: Callable[[Any], int]) -> Vectors:
        return [
            (self._frame(frame), min([kept(entry) for entry in matrix]))
            for matrix, frame in vector.args
        ]

    def _point(self, point: Any) -> int:
        for step in self._way_to(point, self._points_before, self._points):
            before = self._points_before[step]
            vector = step._pos_dict[before]
            way = self._vector(vector, self._of_places)
            for entries, frame in vector.args:
                self._note(step, before, entries, (frame,))
            self._ways.append((self._points[before], way))
            self._points[step] = len(self._ways)
        return self._points[point]

    def _place(self, point: Any) -> _Located:
        """A point, with the velocity that the description gives it."""
        from mechc_codegen.description.terms import velocity_of

        frame = self.mechanism.frame
        placed = point in self._points or point in self._points_before
        number = self._point(point) if placed and frame not in point._vel_dict else -1
        if number >= 0 and point not in self._loose:
            return _Located(number, None)
        return _Located(-1, self._vector(velocity_of(point, frame), self._of_speeds))

    def _spin(self, frame: Any) -> _Located:
        """A frame, with the angular velocity that is given where its axes are not known."""
        placed = frame in self._frames or frame in self._frames_before
        number = self._frame(frame) if placed else -1
        if placed and frame not in self._loose:
            return _Located(number, None)
        return _Located(-1, self._vector(frame.ang_vel_in(self.mechanism.frame), self._of_speeds))

    def _dyadic(self, inertia: Any) -> list[tuple[int, Vectors, Vectors]]:
        return [
            (self._of_speeds(measure), self._vector(one, self._of_places),
             self._vector(other, self._of_places))
            for measure, one, other in inertia.args
        ]  # fmt: skip

    def _target(self, place: Any) -> tuple[bool, _Located]:
        from sympy.physics.mechanics import Point

        if isinstance(place, Point):
            return False, self._place(place)
        return True, self._spin(place)

    def _load(self, place: Any, vector: Any) -> tuple[tuple[bool, _Located], Vectors]:
        return self._target(place), self._vector(vector, self._of_speeds)

    def _closure(self, closure: Any) -> Any:
        held = closure.axes or closure.length is not None
        ends = (self._point(closure.point), self._point(closure.target)) if held else None
        length = None if closure.length is None else self._of_places(closure.length)
        axes = [self._vector(axis, self._of_places) for axis in closure.axes]
        pairs = [[self._vector(v, self._of_places) for v in p] for p in closure.perpendicular]
        return ends, axes, length, pairs

    # -- numbers ----------------------------------------------------------------------------------

    def _numbers(self, function: Any, t: Array, *parts: Array) -> Array:
        """All entries (n, entries)."""
        states = [part[:, k] for part in parts for k in range(part.shape[1])]
        found = function(t, *states, *self.values)
        return _side_by_side(
            [np.broadcast_to(np.asarray(x, dtype=float), t.shape) for x in found], t
        )

    def _along(self, vector: Vectors, entries: Array, frames: Array) -> Array:
        """A vector along the inertial axes (n, 3)."""
        total = np.zeros((len(entries), 3))
        for frame, first in vector:
            total += np.einsum("nij,nj->ni", frames[:, frame], entries[:, first : first + 3])
        return total

    def _placed(self, t: Array, q: Array) -> tuple[Array, Array, Array, Array]:
        """Entries, frames (n, frames, 3, 3), points (n, points, 3), constraints (n, rows)."""
        entries = self._numbers(self._of_q, t, q)
        frames = np.broadcast_to(np.eye(3), (len(t), 1 + len(self._turns), 3, 3)).copy()
        for k, (before, first) in enumerate(self._turns, 1):
            turn = entries[:, first : first + 9].reshape(-1, 3, 3)
            frames[:, k] = frames[:, before] @ turn
        points = np.zeros((len(t), 1 + len(self._ways), 3))
        for k, (before, way) in enumerate(self._ways, 1):
            points[:, k] = points[:, before] + self._along(way, entries, frames)
        rows = [entries[:, k] for k in self.configuration]
        for ends, axes, length, pairs in self.closures:
            for axis in axes:
                gap = points[:, ends[0]] - points[:, ends[1]]
                rows.append(_dot(gap, self._along(axis, entries, frames)))
            if length is not None:
                gap, size = points[:, ends[0]] - points[:, ends[1]], entries[:, length]
                rows.append((_dot(gap, gap) - size**2) / (2 * size))
            for pair in pairs:
                rows.append(_dot(*(self._along(each, entries, frames) for each in pair)))
        return entries, frames, points, _side_by_side(rows, t)

    def _moving(self, t: Array, q: Array, u: Array, h: Array) -> _Velocities:
        """The motion at states; ``q`` with the states of the description."""
        numbers = self._numbers(self._of_u, t, q, u)
        rates = numbers[:, self.kinematics]
        entries, frames, _, _ = self._placed(t, q)
        turning, going, closing = _slopes(
            lambda s: self._placed(t + s, q + s[:, None] * rates)[1:], h
        )
        turned = turning @ np.swapaxes(frames, -1, -2)
        spins = np.stack([turned[..., 2, 1], turned[..., 0, 2], turned[..., 1, 0]], axis=-1)

        def velocity(place: _Located, known: Array) -> Array:
            if place.given is None:
                return known[:, place.number]
            return self._along(place.given, numbers, frames)

        linear = [velocity(place, going) for place in self.centres]
        angular = [velocity(place, spins) for place in self.spins]
        momenta = [numbers[:, [m]] * v for m, v in zip(self.masses, linear, strict=True)]
        moments = []
        for inertia, turn in zip(self.inertias, angular, strict=True):
            total = np.zeros((len(t), 3))
            for measure, *axes in inertia:
                one, other = (self._along(axis, entries, frames) for axis in axes)
                total += (numbers[:, measure] * _dot(other, turn))[:, None] * one
            moments.append(total)
        acting = [velocity(place, spins if turns else going) for turns, place in self.targets]
        rows = np.concatenate([closing, numbers[:, self.motion]], axis=1)
        return _Velocities(
            _vectors(linear, t), _vectors(angular, t), _vectors(momenta, t), _vectors(moments, t),
            _vectors(acting, t), rows,
        )  # fmt: skip

    def judge(self, t: Array, y: Array, rates: Array, h: Array, forces: Array | None) -> Judged:
        """See :func:`judge`."""
        count, size = len(self.kinematics), len(self.mechanism.u)
        q, u, accelerations = y[:, :count], y[:, count:], rates[:, count:]
        numbers = self._numbers(self._of_u, t, q, u)
        frames = self._placed(t, q)[1]
        change = _Velocities(*_slopes(lambda s: self._moving(
            t + s, q + s[:, None] * rates[:, :count], u + s[:, None] * accelerations, h), h
        ))  # fmt: skip
        rest = self._moving(t, q, np.zeros_like(u), h)
        moved = [self._moving(t, q, np.broadcast_to(e, u.shape), h) for e in np.eye(size)]
        partials = [_Velocities(*(a - b for a, b in zip(m, rest, strict=True))) for m in moved]
        mass = _side_by_side(
            [_side_by_side([_work(a, b) for b in partials], t) for a in partials], t
        )
        inertial = _side_by_side([_work(partial, change) for partial in partials], t)
        loads = [
            _side_by_side([_dot(partial.acting[:, k], force) for partial in partials], t)
            for k, force in enumerate(self._along(v, numbers, frames) for _, v in self.loads)
        ]
        loads += [] if forces is None else [forces]
        for k, (_, per) in enumerate(self.added, len(self.loads)):
            for i, vector in enumerate(per):
                along = self._along(vector, numbers, frames)
                part = _side_by_side([_dot(each.acting[:, k], along) for each in partials], t)
                loads.append(part * accelerations[:, [i]])
                mass[:, :, i] -= part
        pushes = np.stack([np.zeros_like(inertial), *loads], axis=-1)
        jacobian = _side_by_side([partial.rows for partial in partials], t)
        found = [_correction(*each) for each in
                 zip(mass, inertial, pushes, jacobian, change.rows, strict=True)]  # fmt: skip
        off, felt = (np.stack([np.zeros(size) if each is None else each[k] for each in found])
                     for k in range(2))  # fmt: skip
        return Judged(rates, np.abs(numbers[:, self.kinematics] - rates[:, :count]), off, felt,
                      np.array([each is not None for each in found]))  # fmt: skip


def _correction(
    mass: Array, inertial: Array, pushes: Array, jacobian: Array, rates: Array
) -> tuple[Array, Array] | None:
    """What accelerations lack of M u' + J^T lambda = F, J u' = gamma, and the sum of the magnitudes
    that each of the loads gives them; None near a singularity."""
    left, sizes, right = np.linalg.svd(jacobian)
    largest = sizes.max(initial=0.0)
    rank = int((sizes > CLEAR * largest).sum())
    if (sizes[rank:] > DEPENDENT * largest).any():
        return None
    closing = right[:rank].T @ ((left[:, :rank].T @ -rates) / sizes[:rank])
    free = right[rank:].T
    missing = inertial - pushes.sum(axis=1) + mass @ closing
    along = _solution(free.T @ mass @ free, free.T @ np.column_stack([-missing, pushes]))
    moved = free @ along
    return closing + moved[:, 0], np.abs(moved[:, 1:]).sum(axis=1)


def _solution(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], dtype=float)


def _slopes(of: Callable[[Array], Sequence[Array]], h: Array) -> list[Array]:
    """Derivatives at s = 0 of functions of s (n,), by central differences of step ``h`` (n,)."""
    total: list[Array] | None = None
    for k, weight in enumerate(WEIGHTS, 1):
        parts = [weight * (a - b) for a, b in zip(of(k * h), of(-k * h), strict=True)]
        total = parts if total is None else [a + b for a, b in zip(total, parts, strict=True)]
    assert total is not None
    return [each / h.reshape(-1, *[1] * (each.ndim - 1)) for each in total]


def _work(one: _Velocities, other: _Velocities) -> Array:
    """The scalar product of velocities and momenta (n,)."""
    linear = np.einsum("nki,nki->n", one.linear, other.momenta)
    return np.asarray(linear + np.einsum("nki,nki->n", one.angular, other.moments))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ni,ni->n", a, b))


def _side_by_side(parts: Sequence[Array], t: Array) -> Array:
    """Arrays (n, ...) side by side (n, ..., parts)."""
    return np.stack(parts, axis=-1) if parts else np.zeros((len(t), 0))


def _vectors(parts: Sequence[Array], t: Array) -> Array:
    """Vectors (n, 3) one after the other (n, parts, 3)."""
    return np.stack(parts, axis=1) if parts else np.zeros((len(t), 0, 3))
