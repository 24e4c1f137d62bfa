"""Orientation and rates of frames, each expressed by those of the frame it is oriented in.

All vectors are in components along the inertial frame's axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sympy import Expr, S, diff, eye
from sympy.physics.mechanics import ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.tape import V3, ZERO, Tape, vanishes
from mechc_codegen.description.placement import steps_from

Matrix3 = Sequence[V3]


class NotATreeError(Exception):
    """An error for a mechanism that is no tree of links as this package needs; says why."""


@dataclass(frozen=True)
class FrameMotion:
    """A frame: orientation, angular velocity, angular acceleration free of u'.

    ``columns`` are the partial angular velocities against the frame it is oriented in.  Frames
    fixed to each other share one ``body``, the first of them.
    """

    frame: ReferenceFrame
    carrier: FrameMotion | None
    body: ReferenceFrame
    rotation: Matrix3
    omega: V3
    bias: V3
    columns: dict[int, V3]


class Local:
    """Expressions of one joint: in state symbols, with rates along the motion."""

    def __init__(
        self, symbols: Symbols, rates: Sequence[Expr], to_symbols: Callable[[Expr], Expr]
    ) -> None:
        self.symbols, self.rates, self.to_symbols = symbols, rates, to_symbols
        self._moving = {*symbols.q, *symbols.u, symbols.time}
        self._moving |= {value for chain in symbols.inputs for value in chain}
        self._rate_of = dict(zip(symbols.q, rates, strict=True))

    def entries(self, values: Sequence[Expr]) -> V3:
        x, y, z = (self.to_symbols(S(v)) for v in values)
        return (x, y, z)

    def constant(self, values: Sequence[Expr]) -> bool:
        return not any(v.free_symbols & self._moving for v in values)

    def rate(self, value: Expr) -> Expr:
        """Time derivative at constant speeds."""
        moving = [q for q in self.symbols.q if q in value.free_symbols]
        along = sum((diff(value, q) * self._rate_of[q] for q in moving), S.Zero)
        driven = self.symbols.rates_of_inputs(value)
        along += sum((diff(value, r) * rate for r, rate in driven), S.Zero)
        return along + diff(value, self.symbols.time)

    def rates_of(self, values: Sequence[Expr]) -> V3:
        x, y, z = map(self.rate, values)
        return (x, y, z)

    def columns(self, values: Sequence[Expr]) -> dict[int, V3]:
        """Partial derivatives by the speeds that occur."""
        found = {}
        for k, u in enumerate(self.symbols.u):
            if any(u in v.free_symbols for v in values):
                x, y, z = (diff(v, u) for v in values)
                found[k] = (x, y, z)
        return found

    def at_rest(self, values: Sequence[Expr]) -> bool:
        """Whether the vector vanishes with all speeds."""
        still = dict.fromkeys(self.symbols.u, S.Zero)
        return vanishes(v.xreplace(still) for v in values)


class Frames:
    """The motions of frames, from the inertial one outwards."""

    def __init__(self, inertial: ReferenceFrame, tape: Tape, local: Local) -> None:
        self.tape, self.local = tape, local
        x, y, z = eye(3).tolist()
        unit = (tuple(x), tuple(y), tuple(z))
        self.inertial = FrameMotion(inertial, None, inertial, unit, ZERO, ZERO, {})
        self._found = {inertial: self.inertial}
        self._parents = steps_from(inertial, lambda frame: frame._dcm_dict)

    def motion(self, frame: ReferenceFrame) -> FrameMotion:
        """The motion of a frame.

        Raises
        ------
        NotATreeError
            Where the frame is not oriented, step by step, against the inertial frame, or its
            rates are not set against the frame that it is oriented in.
        """
        path = [frame]
        while path[-1] not in self._found:
            if path[-1] not in self._parents:
                raise NotATreeError(f"frame {path[-1].name} is not oriented in the inertial frame")
            path.append(self._parents[path[-1]])
        for child in reversed(path[:-1]):
            self._found[child] = self._next(self._found[self._parents[child]], child)
        return self._found[frame]

    def along(self, vector: Vector) -> V3:
        """The components of a vector along the inertial axes."""
        parts = [
            self.tape.transform(self.motion(frame).rotation, self.local.entries(matrix))
            for matrix, frame in vector.args
        ]
        return self.tape.total(*parts) if parts else ZERO

    def _next(self, carrier: FrameMotion, frame: ReferenceFrame) -> FrameMotion:
        tape = self.tape
        turn = [self.local.entries(row) for row in carrier.frame.dcm(frame).tolist()]
        columns_of_turn = list(zip(*turn, strict=True))
        product = [[tape.dot(row, c) for c in columns_of_turn] for row in carrier.rotation]
        rotation = [tape.vector(row) for row in product]
        given = frame._ang_vel_dict.get(carrier.frame)
        if given is None:
            raise NotATreeError(
                f"the angular velocity of {frame.name} in {carrier.frame.name} is not set"
            )
        bias, columns, relative = carrier.bias, dict[int, V3](), ZERO
        for entries, written_in in given.args:
            value = self.local.entries(entries)
            if not self.local.at_rest(value):
                raise NotATreeError(f"frame {frame.name} turns even if all speeds are zero")
            rows = rotation if written_in is frame else self.motion(written_in).rotation
            relative = tape.total(relative, tape.transform(rows, value))
            for k, column in self.local.columns(value).items():
                columns[k] = tape.total(columns.get(k, ZERO), tape.transform(rows, column))
            bias = tape.total(bias, tape.transform(rows, self.local.rates_of(value)))
        omega = tape.total(carrier.omega, relative)
        for entries, written_in in given.args:
            own = len(given.args) == 1 and written_in in (frame, carrier.frame)
            turns = written_in is frame
            turning = omega if turns else self.motion(written_in).omega
            rows = rotation if turns else self.motion(written_in).rotation
            turned = tape.transform(rows, self.local.entries(entries))
            bias = tape.total(bias, tape.cross(carrier.omega if own else turning, turned))
        still = not given.args and all(self.local.constant(row) for row in turn)
        return FrameMotion(
            frame,
            carrier,
            carrier.body if still else frame,
            rotation,
            omega,
            bias,
            columns,
        )
