"""The points and frames that a mechanism's description connects, and what is rigid among them.

Input: a mechanism and the names of the parameters whose values are known.  Output: which points
coincide, which are fixed to a body or to the ground, and which keep their distance.  Invariant: no
position is expanded; each step from point to point is looked at by itself.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from sympy import Derivative, Expr, Symbol
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.placement import Placement, dot, steps_from
from mechc_codegen.description.terms import printed_name

if TYPE_CHECKING:
    from mechc_codegen.description.mechanism import Mechanism

CHOICES = 3  # random configurations at which a distance has to be the same
CONSTANT = 1e-9
Way: TypeAlias = "tuple[Point, Point, Vector]"
Neighbours: TypeAlias = Mapping[Point, Collection[Point]]


class Places:
    """Points and frames of a mechanism, as far as their places follow from what is known.

    Attributes
    ----------
    bodies
        All that can be drawn.
    frames, points
        For every frame and point that can be placed the one before it, from the inertial frame
        and the origin outwards.
    """

    def __init__(self, mechanism: Mechanism, known: Collection[str]) -> None:
        self.mechanism = mechanism
        self.bodies = (*mechanism.bodies, *mechanism.drawn)
        self.parameters = [p.symbol for p in mechanism.parameters if p.symbol.name in known]
        self._bound = {f: x for f, x in mechanism.inputs.items() if x is not None}
        self._known = {*mechanism.q, *mechanism.x, *self.parameters, dynamicsymbols._t}
        self.frames = steps_from(
            mechanism.frame,
            lambda frame: (f for f in frame._dcm_dict if self._are_known(frame.dcm(f))),
        )
        self._placed = {mechanism.frame, *self.frames}
        self.points = steps_from(mechanism.origin, self._located_from)
        self._rigid_frames = self._groups_of_frames()

    def expression(self, given: Expr) -> Expr:
        """An entry of a step, with the expressions of specified functions in it."""
        for _ in self._bound:  # one may contain another
            given = given.xreplace(self._bound)
        return given

    def load(self, given: Expr) -> Expr:
        """A component of a load, by coordinates and speeds."""
        rates = self.mechanism.rates
        return self.expression(given.xreplace(rates)).xreplace(rates)

    def at_zero(self, given: Expr) -> Expr:
        """An expression with all coordinates and the time at zero."""
        zero = dict.fromkeys((*self.mechanism.q, *self.mechanism.x, dynamicsymbols._t), 0)
        return self.expression(given).xreplace(zero)

    def activation(self, given: Expr) -> Expr | str | None:
        """A muscle's activation by state, time and parameters; the name of an input of runs."""
        found = self.load(given)
        if _variables(found) <= self._known | {*self.mechanism.u}:
            return found
        return printed_name(found) if found in self.mechanism.open_inputs else None

    def is_given(self, entries: Iterable[Expr], frame: ReferenceFrame) -> bool:
        """Whether a load's components can be evaluated from state, time and known parameters."""
        known = self._known | {*self.mechanism.u}
        return frame in self._placed and all(_variables(entry) <= known for entry in entries)

    def _located_from(self, point: Point) -> Iterator[Point]:
        for other, way in point._pos_dict.items():
            if self._is_known(way):
                yield other

    def _is_known(self, way: Vector) -> bool:
        return all(f in self._placed and self._are_known(matrix) for matrix, f in way.args)

    def _are_known(self, entries: Iterable[Expr]) -> bool:
        return all(_variables(self.expression(entry)) <= self._known for entry in entries)

    # -- what is rigid ----------------------------------------------------------------------------

    def _groups_of_frames(self) -> dict[ReferenceFrame, ReferenceFrame]:
        """Each frame's representative among those that do not turn relative to it."""
        group = {self.mechanism.frame: self.mechanism.frame}
        for frame, before in self.frames.items():
            constant = all(map(self.is_constant, before.dcm(frame)))
            group[frame] = group[before] if constant else frame
        return group

    def is_constant(self, entry: Expr) -> bool:
        """Whether an expression contains only parameters whose values are known."""
        return _variables(self.expression(entry)) <= {*self.parameters}

    def group_of(self, frame: ReferenceFrame) -> ReferenceFrame | None:
        """The representative of the frames that turn with this one; None if it is not placed."""
        return self._rigid_frames.get(frame)

    @cached_property
    def ways(self) -> list[Way]:
        """Every step of a chain of points from the origin: (from, to, vector)."""
        return [(a, b, b._pos_dict[a]) for b, a in self.points.items()]

    def carrier(self, way: Vector) -> ReferenceFrame | None:
        """The group of frames in which a vector is constant; None if there is no single one."""
        groups = {self._rigid_frames[frame] for _, frame in way.args}
        constant = all(self.is_constant(e) for matrix, _ in way.args for e in matrix)
        return groups.pop() if len(groups) == 1 and constant else None

    @cached_property
    def steps(self) -> list[tuple[Way, ReferenceFrame | None]]:
        """The steps between points that are two, each with its carrier."""
        return [(way, self.carrier(way[2])) for way in self.ways if way[2] != 0]

    def near(self, group: ReferenceFrame | None) -> Neighbours:
        """The points joined to each point by a constant vector in this group of frames."""
        found: dict[Point, dict[Point, None]] = {}
        for (a, b, _), carrier in self.steps:
            if carrier is group and group is not None:
                found.setdefault(self.same[a], {})[self.same[b]] = None
                found.setdefault(self.same[b], {})[self.same[a]] = None
        return found

    def connected_points(self, start: Point, near: Neighbours) -> list[Point]:
        """The points that chains of neighbours join to this one, itself first."""
        found = [self.same[start]]
        for point in found:
            found += [other for other in near.get(point, ()) if other not in found]
        return found

    def keeps_its_length(self, way: Vector) -> bool:
        """Whether a vector has one length in every configuration, judged at random ones."""
        parts = Vector([(matrix.applyfunc(self.expression), f) for matrix, f in way.args])
        vectors = [at.vector(parts) for at in self._configurations()]
        squares = [dot(vector, vector) for vector in vectors]
        return bool(max(squares) - min(squares) <= CONSTANT * max(squares))

    def keep_their_values(self, entries: Iterable[Expr]) -> bool:
        """Whether expressions have the same values in every configuration, judged likewise."""
        given = [self.expression(entry) for entry in entries]
        first, *others = [[at.value(x) for x in given] for at in self._configurations()]
        near = CONSTANT * max(map(abs, first), default=0.0)
        return all(abs(x - y) <= near for row in others for x, y in zip(row, first, strict=True))

    def _configurations(self) -> Iterator[Placement]:
        """Random configurations with the same values of parameters."""
        for choice in range(CHOICES):
            at = Placement(self.mechanism.frame, self.mechanism.origin, choice)
            for k, symbol in enumerate(self.parameters):
                at.assume(symbol, 0.7 + 0.6180339887 * (k + 1) % 1.0)
            yield at

    # -- points that are one ----------------------------------------------------------------------

    @cached_property
    def same(self) -> dict[Point, Point]:
        """A dict from every point to the first point that always coincides with it."""
        found = {self.mechanism.origin: self.mechanism.origin}
        for before, point, way in self.ways:
            found[point] = found[before] if way == 0 else point
        return found

    @cached_property
    def names(self) -> dict[str, Point]:
        """Points by name: those of the mechanism first, then mass centres, then all others."""
        mechanism, found = self.mechanism, dict[str, Point]()
        centres = [body.masscenter for body in self.bodies]
        others = [p for p in (*mechanism.points, *centres, *self.same) if self.is_placed(p)]
        for point in others:
            if point not in found.values():
                found[_free_name(point.name, found)] = point
        return found

    def name_of(self, point: Point) -> str:
        """The name of a placed point, or of the one that it always coincides with."""
        by_point = {point: name for name, point in self.names.items()}
        return by_point[point] if point in by_point else by_point[self.same[point]]

    @cached_property
    def rods(self) -> list[tuple[str, Point, Point]]:
        """Name and ends of each rod whose ends can be placed."""
        found = [(c.name, c.target, c.point) for c in self.mechanism.closures if c.length]
        return [(n, self.same[a], self.same[b]) for n, a, b in found if {a, b} <= {*self.same}]

    def is_placed(self, point: Point) -> bool:
        """Whether the position of a point can be evaluated from known values."""
        ways = point._pos_dict.items()
        return point in self.same or any(p in self.same and self._is_known(w) for p, w in ways)


def _variables(expression: Expr) -> set[Expr]:
    """Symbols, functions of time and derivatives."""
    kinds = (AppliedUndef, Symbol, Derivative)
    return {atom for kind in kinds for atom in expression.atoms(kind)}


def _free_name(name: str, taken: Collection[str]) -> str:
    count, free = 1, name
    while free in taken:
        count += 1
        free = f"{name} ({count})"
    return free
