"""Check that angular velocities set by the user are the rates of the orientations.

SymPy differentiates vectors with the angular velocity that was set; M and F here come from the
direction cosines.  Where the two do not agree on the constraints the description contradicts
itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from sympy import Expr, ImmutableDenseMatrix, S
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.algebra import Rows, evaluator, random_point
from mechc_codegen.convert.check_accelerations import Flow
from mechc_codegen.convert.classify_constraints import RateRows, Rates
from mechc_codegen.description.mechanism import is_rigid
from mechc_codegen.description.placement import ZERO, Number3, Placement, steps_from
from mechc_codegen.description.source import Source
from mechc_codegen.errors import MechanismError

_SAME = 1e-7  # of the larger angular velocity, or of 1 rad/s
_UNIT = 1e-9
_IDENTITY: Rows = [[float(i == j) for j in range(3)] for i in range(3)]

Numbers = Mapping[object, Sequence[float]]


def refuse_other_angular_velocities(
    source: Source, bodies: Sequence[RigidBody | Particle], rates: Rates, motion: Sequence[Expr]
) -> None:
    """Compare the angular velocities of all frames in use with their direction cosines.

    Most agree at any motion, which one random motion shows; the others are compared at random
    motions on the constraints, with quaternions of length one.  Frames without an orientation are
    not checked, nor those that specified functions of time turn.

    Raises
    ------
    MechanismError
        With the frame's name, both angular velocities and what to do.
    """
    anywhere, turns = _AnyMotion(source, rates), _Turns(source, rates)
    claims = [c for c in _claims(source.frame, _frames(source, bodies)) if not anywhere.holds(c)]
    claims = [claim for claim in claims if turns.takes(claim)]
    if claims:
        for numbers in turns.at_random_motions([rates.in_symbols(e) for e in motion]):
            for claim in claims:
                _compare(claim, turns, numbers)


@dataclass(frozen=True)
class _Claim:
    """The claim that ``rate``, which was set, is the angular velocity of ``frame`` in ``other``."""

    frame: ReferenceFrame
    other: ReferenceFrame
    rate: Vector


def _frames(source: Source, bodies: Sequence[RigidBody | Particle]) -> set[ReferenceFrame]:
    """The frames of bodies and torques, and those along which velocities are written."""
    frames = {b.frame for b in bodies if is_rigid(b)}
    frames |= {place for place, _ in source.loads if isinstance(place, ReferenceFrame)}
    for body in bodies:
        velocity = body.masscenter._vel_dict.get(source.frame, Vector(0))
        frames |= {frame for _, frame in velocity.args}
    return frames


def _claims(inertial: ReferenceFrame, frames: Iterable[ReferenceFrame]) -> Iterator[_Claim]:
    """Every angular velocity on the paths from the inertial frame, once."""
    before = steps_from(inertial, lambda f: f._ang_vel_dict)
    seen: set[ReferenceFrame] = set()
    for frame in sorted(frames, key=lambda f: str(f.name)):
        while frame in before and frame not in seen:
            seen.add(frame)
            yield _Claim(frame, before[frame], frame._ang_vel_dict[before[frame]])
            frame = before[frame]


def _compare(claim: _Claim, turns: _Turns, numbers: Numbers) -> None:
    said = turns.vector(claim.rate, numbers)
    spins = (turns.spin(frame, numbers) for frame in (claim.frame, claim.other))
    derived = [a - b for a, b in zip(*spins, strict=True)]
    gap = hypot(*(a - b for a, b in zip(said, derived, strict=True)))
    if gap > _SAME * max(1.0, hypot(*said), hypot(*derived)):
        raise MechanismError(
            f"the angular velocity that was set for frame {claim.frame.name} in "
            f"{claim.other.name} is not the rate of its orientation: {hypot(*said):.3g} and "
            f"{hypot(*derived):.3g} rad/s, {gap:.3g} rad/s apart, in a random motion. "
            f"Accelerations would depend on which of the two is right: omit the set_ang_vel "
            f"of {claim.frame.name}, or set there the rate of the orientation "
            f"({claim.frame.name}.ang_vel_in({claim.other.name}) before it is set, with the "
            "kinematic differential equations for it)"
        )


def _rates_of(source: Source, rates: Rates) -> dict[Expr, Expr]:
    """A dict from q' and auxiliary speeds to their expressions."""
    time = dynamicsymbols._t
    moving = {q.diff(time): rate for q, rate in zip(source.q, rates.original, strict=True)}
    return moving | dict.fromkeys(source.auxiliary, S.Zero)


class _AnyMotion:
    """One motion at random values of everything, which need not satisfy the constraints.

    Every step from frame to frame is evaluated once, so that long chains are fast.
    """

    def __init__(self, source: Source, rates: Rates) -> None:
        self._placement = Placement(source.frame, Point("O"), seed=4)
        for symbol, rate in _rates_of(source, rates).items():
            self._placement.assume(symbol, self._placement.value(rate))
        self._before = steps_from(source.frame, lambda f: f._dcm_dict)
        self._spins: dict[ReferenceFrame, Number3] = {source.frame: ZERO}

    def holds(self, claim: _Claim) -> bool:
        """Whether the given angular velocity is the rate of the orientation in this motion."""
        try:
            said = self._placement.vector(claim.rate)
            spins = self._spin(claim.frame), self._spin(claim.other)
        except KeyError:  # not oriented step by step
            return False
        apart = (a - b + c for a, b, c in zip(said, *spins, strict=True))
        return hypot(*apart) <= _SAME * max(1.0, hypot(*said))

    def _spin(self, frame: ReferenceFrame) -> Number3:
        way = []
        while frame not in self._spins:
            way.append(frame)
            frame = self._before[frame]
        for step in reversed(way):
            before = self._before[step]
            turn = [self._value_and_rate(e) for e in step._dcm_dict[before].T]
            axis = _axis([value for value, _ in turn], [rate for _, rate in turn])
            local = _times(list(self._placement.rotation(before)), axis)
            x, y, z = (a + b for a, b in zip(self._spins[before], local, strict=True))
            self._spins[step] = (x, y, z)
            frame = step
        return self._spins[frame]

    def _value_and_rate(self, entry: Expr) -> tuple[float, float]:
        if entry.is_Number:
            return float(entry), 0.0
        value = self._placement.value
        return value(entry), value(entry.diff(dynamicsymbols._t))


class _Turns:
    """Rotations and angular velocities of frames in the inertial one, by direction cosines.

    Every step from frame to frame is evaluated separately.
    """

    def __init__(self, source: Source, rates: Rates) -> None:
        self._source, self._rates = source, rates
        self._before = steps_from(source.frame, lambda f: f._dcm_dict)
        self._moving = _rates_of(source, rates)
        self._known = {*source.q, *source.u, *source.auxiliary}
        self._entries: dict[object, Sequence[Expr]] = {}

    def takes(self, claim: _Claim) -> bool:
        """Whether this claim can be checked; evaluates all that the check needs."""
        frames = [claim.frame, claim.other, *(frame for _, frame in claim.rate.args)]
        steps = {frame: list(self._steps(frame)) for frame in frames}
        if any(frame is not way[-1] for frame, way in steps.items()):
            return False
        turned = [self._turn(frame) for way in steps.values() for frame in way[1:]]
        vectors = [matrix for matrix, _ in claim.rate.args]
        held = {f for matrix in (*turned, *vectors) for e in matrix for f in e.atoms(AppliedUndef)}
        if not held <= self._known:
            return False
        for matrix, frame in claim.rate.args:
            self._entries[id(claim.rate), frame] = list(matrix)
        for way in steps.values():
            for frame in way[1:]:
                turn = self._turn(frame)
                self._entries["turn", frame] = list(turn)
                self._entries["rate", frame] = list(turn.diff(dynamicsymbols._t))
        return True

    def _steps(self, frame: ReferenceFrame) -> Sequence[ReferenceFrame]:
        """The frames from the inertial one to ``frame``; that one alone where none leads there."""
        way = [frame]
        while way[-1] in self._before:
            way.append(self._before[way[-1]])
        return way[::-1] if way[-1] is self._source.frame else [self._source.frame]

    def _turn(self, frame: ReferenceFrame) -> ImmutableDenseMatrix:
        """Matrix that transforms components in ``frame`` into components in the frame before it."""
        return frame._dcm_dict[self._before[frame]].T

    def at_random_motions(self, motion: Sequence[Expr]) -> Iterator[Numbers]:
        """Values of all entries at random motions that satisfy the constraints."""
        plain = {
            key: [self._rates.in_symbols(e.xreplace(self._moving)) for e in entries]
            for key, entries in self._entries.items()
        }
        closed = [self._rates.in_symbols(e) for e in self._source.configuration]
        closed += self._lengths(plain)
        flow = Flow(self._rates, motion, [])
        evaluate = evaluator(
            [*self._rates.symbols, *self._rates.u], [e for es in plain.values() for e in es]
        )
        for point in RateRows(self._rates, closed).points():
            try:
                values = iter(evaluate(*flow.with_speeds(point)))
            except (ValueError, ZeroDivisionError, OverflowError):
                continue  # outside the domain of a root or logarithm
            yield {key: [next(values) for _ in entries] for key, entries in plain.items()}

    def _lengths(self, plain: Mapping[object, Sequence[Expr]]) -> list[Expr]:
        """Expressions that are zero where quaternions have length one."""
        rows = [e[:3] for key, e in plain.items() if isinstance(key, tuple) and key[0] == "turn"]
        lengths = [sum((x**2 for x in row), -S.One) for row in rows]
        point = random_point(None, len(self._rates.symbols), seed=3) or []
        at = evaluator(self._rates.symbols, lengths)(*point)
        return [length for length, gap in zip(lengths, at, strict=True) if abs(gap) > _UNIT]

    def vector(self, vector: Vector, numbers: Numbers) -> list[float]:
        """An angular velocity that was set, along the inertial axes."""
        total = [0.0, 0.0, 0.0]
        for _, frame in vector.args:
            part = _times(self.rotation(frame, numbers), numbers[id(vector), frame])
            total = [a + b for a, b in zip(total, part, strict=True)]
        return total

    def rotation(self, frame: ReferenceFrame, numbers: Numbers) -> Rows:
        """Rows that turn components in ``frame`` into inertial ones."""
        rows = _IDENTITY
        for step in self._steps(frame)[1:]:
            rows = _product(rows, _square(numbers["turn", step]))
        return rows

    def spin(self, frame: ReferenceFrame, numbers: Numbers) -> list[float]:
        """The angular velocity by the rates of the direction cosines: R' R^T."""
        rows, total = _IDENTITY, [0.0, 0.0, 0.0]
        for step in self._steps(frame)[1:]:
            local = _axis(numbers["turn", step], numbers["rate", step])
            total = [a + b for a, b in zip(total, _times(rows, local), strict=True)]
            rows = _product(rows, _square(numbers["turn", step]))
        return total


def _axis(turn: Sequence[float], rate: Sequence[float]) -> list[float]:
    """The angular velocity of a rotation R and its rate: that of the skew matrix R' R^T."""
    columns = [list(column) for column in zip(*_square(turn), strict=True)]
    skew = _product(_square(rate), columns)
    return [skew[2][1], skew[0][2], skew[1][0]]


def _square(entries: Sequence[float]) -> Rows:
    return [list(entries[k : k + 3]) for k in (0, 3, 6)]


def _product(a: Rows, b: Rows) -> Rows:
    return [_times([list(column) for column in zip(*b, strict=True)], row) for row in a]


def _times(rows: Sequence[Sequence[float]], vector: Sequence[float]) -> list[float]:
    return [sum(x * y for x, y in zip(row, vector, strict=True)) for row in rows]
