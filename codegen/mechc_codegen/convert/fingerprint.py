"""A Source as text for a cache key, in which every subexpression is written once.

Input: what was read from a SymPy object.  Output: a digest that is the same in every process for
the same mechanism, and the symbols and functions of time in it.  Invariant: what decides the
derivation is in the text, nothing is expanded, and shared subexpressions are visited once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from copy import copy
from typing import TYPE_CHECKING

from sympy import (
    Basic,
    Dummy,
    Expr,
    Float,
    Integer,
    Rational,
    Symbol,
    cos,
    sin,
    sympify,
    tan,
)
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import is_rigid

if TYPE_CHECKING:
    from mechc_codegen.description.joints.tree import Joint


class Fingerprint:
    """The lines written so far, with the symbols, functions and frames found in them."""

    def __init__(self, frame: ReferenceFrame) -> None:
        self.lines: list[str] = []
        self.leaves: set[Expr] = set()
        self.angles: set[Expr] = set()  # angles of orientations
        self.inertial = frame
        self._nodes: dict[Basic, int] = {}
        self._frames: dict[int, int] = {}
        self._points: dict[int, int] = {}
        self._kept: list[object] = []  # keeps objects alive, so that ids stay unique
        self._turning: set[frozenset[int]] = set()
        self.frame(frame)

    def digest(self) -> str:
        """Hash of the text so far."""
        return hashlib.sha256("\n".join(self.lines).encode()).hexdigest()

    def without(self, symbols: set[Expr]) -> Fingerprint:
        """A copy of the fingerprint without some symbols."""
        other = copy(self)
        other.leaves = self.leaves - symbols
        return other

    def write(self, label: str, items: Iterable[str]) -> None:
        self.lines.append(f"{label}: {' '.join(items)}")

    def expression(self, expression: Expr) -> str:
        """The number of an expression; its text is written when it is new."""
        known = self._nodes.get(expression)
        if known is None:
            known = self._new(expression)
        return str(known)

    def _new(self, expression: Expr) -> int:
        args = [self.expression(a) for a in expression.args]
        own = isinstance(expression, AppliedUndef)  # its class is named by the user
        kind = "function" if own else type(expression).__name__
        self.lines.append(f"{kind}({','.join(args)}){self._leaf(expression)}")
        if isinstance(expression, (Symbol, AppliedUndef)):
            self.leaves.add(expression)
        self._nodes[expression] = len(self._nodes)
        return self._nodes[expression]

    def _leaf(self, expression: Expr) -> str:
        if isinstance(expression, Symbol):
            dummy = expression.dummy_index if isinstance(expression, Dummy) else ""
            assumed = sorted(expression._assumptions_orig.items())
            return f"{expression.name!r}{assumed}{dummy}"
        if isinstance(expression, AppliedUndef):
            assumed = sorted(expression.func._kwargs.items())
            return f"{expression.func.__name__!r}{assumed}"
        if isinstance(expression, Float):
            return f"{expression._mpf_}{expression._prec}"
        if isinstance(expression, (Integer, Rational)):
            return f"{expression.p}/{expression.q}"
        return "" if expression.args else str(expression)

    def vector(self, vector: Vector) -> str:
        parts = [f"[{self.entries(matrix)}]{self.frame(frame)}" for matrix, frame in vector.args]
        return "+".join(parts) or "0"

    def dyadic(self, dyadic: Dyadic) -> str:
        if dyadic == 0:
            return "0"
        parts = [
            f"{self.expression(scale)}*{self.vector(one)}*{self.vector(other)}"
            for scale, one, other in dyadic.args
        ]
        return "+".join(parts) or "0"

    def placing(self, entries: Iterable[Expr]) -> str:
        """Expressions of a position or an orientation; the angles in them are collected."""
        listed = list(entries)
        for entry in listed:
            self.angles |= {f.args[0] for f in sympify(entry).atoms(sin, cos, tan)}
        return self.entries(listed)

    def entries(self, matrix: Iterable[Expr]) -> str:
        return ",".join(self.expression(entry) for entry in matrix)

    def frame(self, frame: ReferenceFrame) -> str:
        """The number of a frame; its orientations relative to other frames are written."""
        if id(frame) in self._frames:
            return f"f{self._frames[id(frame)]}"
        number = self._frames[id(frame)] = len(self._frames)
        self._kept.append(frame)
        for other, matrix in frame._dcm_dict.items():
            if id(other) not in self._frames:
                entries = self.placing(matrix)
                self.write(f"f{number}", [self.frame(other), entries])
        for other, velocity in frame._ang_vel_dict.items():
            pair = frozenset((id(frame), id(other)))
            if pair not in self._turning:
                self._turning.add(pair)
                text = self.vector(velocity)
                self.write(f"f{number} turns", [self.frame(other), text])
        return f"f{number}"

    def point(self, point: Point) -> str:
        """The number of a point; its positions relative to other points are written."""
        if id(point) in self._points:
            return f"p{self._points[id(point)]}"
        number = self._points[id(point)] = len(self._points)
        self._kept.append(point)
        self.lines.append(f"p{number}={point.name!r}")
        for other, vector in point._pos_dict.items():
            if id(other) not in self._points:
                text = self.vector(vector)
                self.write(f"p{number}", [self.point(other), text])
                self.placing(entry for matrix, _ in vector.args for entry in matrix)
        if self.inertial in point._vel_dict:
            velocity = point._vel_dict[self.inertial]
            self.write(f"p{number} moves", [self.vector(velocity)])
            self.placing(entry for matrix, _ in velocity.args for entry in matrix)
        return f"p{number}"

    def motion(self, place: Point | ReferenceFrame) -> str:
        """The number of a point or frame, with the acceleration that was set by the user."""
        if isinstance(place, ReferenceFrame):
            number, given = self.frame(place), place._ang_acc_dict.get(self.inertial)
        else:
            number, given = self.point(place), place._acc_dict.get(self.inertial)
        return " ".join([number, *([] if given is None else [self.vector(given)])])

    def body(self, body: RigidBody | Particle) -> None:
        parts = [repr(body.name), self.expression(body.mass)]
        parts.append(self.motion(body.masscenter))
        parts.append(self.expression(body.potential_energy))
        if is_rigid(body):
            parts.append(self.motion(body.frame))
            parts.append(self.dyadic(body.central_inertia))
        self.write("body", parts)

    def joint(self, joint: Joint, bodies: Sequence[RigidBody | Particle]) -> None:
        sides = (str(bodies.index(b)) if b in bodies else "" for b in (joint.parent, joint.child))
        points = (self.point(p) for p in (joint.parent_point, joint.child_point))
        frames = (joint.parent_interframe, joint.child_interframe)
        parts = [repr(joint.name), *sides, *points]
        parts += ["" if frame is None else self.frame(frame) for frame in frames]
        self.write("joint", [*parts, *(self.expression(u) for u in joint.speeds)])


def fingerprint(source: Source) -> Fingerprint:
    """The fingerprint of a whole Source."""
    text = Fingerprint(source.frame)
    text.lines.append(source.kind)
    for label in ("q", "u", "kinematics", "configuration", "motion", "auxiliary"):
        text.write(label, [text.placing([e]) for e in getattr(source, label)])
    text.write("mixed", [str(source.mixed)])
    if source.lagrangian is not None:
        text.write("lagrangian", [text.placing([source.lagrangian])])
    if source.equations is not None:
        text.write("equations", [text.placing(e for _, e in source.equations.terms())])
    for body in source.bodies:
        text.body(body)
    for place, vector in source.loads:
        text.write("load", [text.motion(place), text.vector(vector)])
    for joint in source.joints:
        text.joint(joint, source.bodies)
    if source.origin is not None:
        text.write("origin", [text.point(source.origin)])
    return text
