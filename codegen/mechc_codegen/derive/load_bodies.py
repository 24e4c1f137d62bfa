"""The body that a load acts on: the one its point or frame is fixed to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sympy import Derivative, Expr
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.errors import MechanismError


class LoadBodies:
    """Points and frames of every body, those of its joints among them."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._points: dict[Point, list[Body | None]] = {}
        self._frames: dict[ReferenceFrame, list[Body | None]] = {}
        self._own(self._points, mechanism.origin, None)
        self._own(self._frames, mechanism.frame, None)
        for body in mechanism.bodies:
            self._own(self._points, body.masscenter, body)
            if hasattr(body, "frame"):
                self._own(self._frames, body.frame, body)
        for joint in mechanism.joints:
            self._own(self._points, joint.parent_point, joint.parent)
            self._own(self._points, joint.child_point, joint.child)

    def of(self, place: Point | ReferenceFrame) -> Body | None:
        """The body, or None for the ground.

        Raises
        ------
        MechanismError
            If it is none, or more than one.
        """
        if isinstance(place, Point):
            return self._of_point(place)
        for frame in _fixed_to(place):
            if frame in self._frames:
                return self._single(place, self._frames[frame])
        raise self._unknown(place, "no body turns with it")

    def _own(
        self,
        places: dict[Point, list[Body | None]] | dict[ReferenceFrame, list[Body | None]],
        place: Point | ReferenceFrame,
        body: Body | None,
    ) -> None:
        owners = places.setdefault(place, [])
        if body not in owners:
            owners.append(body)

    def _of_point(self, point: Point) -> Body | None:
        """The body of the nearest point from which its position is constant in the body's axes."""
        waiting: list[tuple[Point, list[ReferenceFrame]]] = [(point, [])]
        seen = {point}
        for at, axes in waiting:
            owners = self._points.get(at, [])
            turning = (
                {body for frame in _fixed_to(axis) for body in self._frames.get(frame, ())}
                for axis in axes
            )
            if owners and all(not bodies.isdisjoint(owners) for bodies in turning):
                return self._single(point, owners)
            for other, way in at._pos_dict.items():
                if other not in seen and at not in self._points and _constant(way):
                    seen.add(other)
                    waiting.append((other, [*axes, *(frame for _, frame in way.args)]))
        raise self._unknown(point, "no body carries it")

    def _single(self, place: Point | ReferenceFrame, owners: Sequence[Body | None]) -> Body | None:
        if len(owners) > 1:
            names = " and ".join("the ground" if b is None else b.name for b in owners)
            raise self._unknown(place, f"it belongs to {names}")
        return owners[0]

    def _unknown(self, place: Point | ReferenceFrame, why: str) -> MechanismError:
        kind = "force" if isinstance(place, Point) else "torque"
        return MechanismError(
            f"{self.mechanism.name}: for joint reactions it must be known which body the {kind} "
            f"on {place.name} acts on, and {why}; use a point or frame that is fixed to one body"
        )


def _fixed_to(frame: ReferenceFrame) -> Iterable[ReferenceFrame]:
    """The frame and all frames fixed to it, the nearest first."""
    waiting = [frame]
    for at in waiting:
        yield at
        for other in at._dcm_dict:
            if other not in waiting and not _moves(at.dcm(other)):
                waiting.append(other)


def _constant(way: Vector) -> bool:
    return not any(_moves(matrix) for matrix, _ in way.args)


def _moves(entries: Iterable[Expr]) -> bool:
    time = dynamicsymbols._t
    return any(e.has(AppliedUndef, Derivative) or time in e.free_symbols for e in entries)
