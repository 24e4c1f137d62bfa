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

from mechc_codegen.convert.algebra import evaluator, random_point
from mechc_codegen.convert.checks.accelerations import Flow
from mechc_codegen.convert.classify_constraints import RateRows, Rates
from mechc_codegen.description.mechanism import is_rigid
from mechc_codegen.description.placement import (
    ZERO,
    Number3,
    Placement,
    apply,
    cross,
    dot,
    minus,
    plus,
    steps_from,
    way_to,
)
from mechc_codegen.description.source import Source
from mechc_codegen.errors import MechanismError

SAME = 1e-7  # of the larger angular velocity, or of 1 rad/s
_UNIT = 1e-9


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
    anywhere, turns = Rotations(source, rates, {}), dict[ReferenceFrame, ImmutableDenseMatrix]()
    claims = list[_Claim]()
    for claim in _claims(source.frame, _frames(source, bodies)):
        found = None if anywhere.holds(claim) else _turns(claim, source)
        if found is not None:
            claims.append(claim)
            turns |= found
    for values in motions(source, rates, motion, turns.values()) if claims else ():
        at = Rotations(source, rates, values)
        for claim in claims:
            at.refuse_other(claim)


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


def _turns(claim: _Claim, source: Source) -> dict[ReferenceFrame, ImmutableDenseMatrix] | None:
    """The direction cosines of each step to the frames of a claim, by the frame that it leads to;
    None where the claim cannot be checked."""
    return turns_in(source, [claim.frame, claim.other], [claim.rate])


def turns_in(
    source: Source, frames: Iterable[ReferenceFrame], vectors: Iterable[Vector]
) -> dict[ReferenceFrame, ImmutableDenseMatrix] | None:
    """The direction cosines of each step to these frames and to those of vectors, by the frame that
    it leads to; None where a frame is not oriented, or where specified functions of time enter."""
    before = steps_from(source.frame, lambda f: f._dcm_dict)
    entries = [(matrix, frame) for vector in vectors for matrix, frame in vector.args]
    every = [*frames, *(frame for _, frame in entries)]
    try:
        steps = [step for frame in every for step in way_to(frame, before, {source.frame: None})]
    except KeyError:  # not oriented step by step
        return None
    turns = {step: step._dcm_dict[before[step]].T for step in steps}
    matrices = (*turns.values(), *(matrix for matrix, _ in entries))
    held = {f for matrix in matrices for e in matrix for f in e.atoms(AppliedUndef)}
    return turns if held <= {*source.q, *source.u, *source.auxiliary} else None


def motions(
    source: Source, rates: Rates, motion: Sequence[Expr], turns: Iterable[ImmutableDenseMatrix]
) -> Iterator[Mapping[Expr, float]]:
    """Random motions on the constraints, with quaternions of length one: values of everything."""
    rows = [[rates.in_symbols(e.xreplace(rates.moving)) for e in list(turn)[:3]] for turn in turns]
    lengths = [sum((x**2 for x in row), -S.One) for row in rows]
    closed = [rates.in_symbols(e) for e in source.configuration]
    held = [rates.in_symbols(e) for e in motion]
    point = random_point(None, len(rates.symbols), seed=3) or []
    at = evaluator(rates.symbols, lengths)(*point)
    closed += [length for length, gap in zip(lengths, at, strict=True) if abs(gap) > _UNIT]
    configurations = RateRows(rates, closed)
    flow = Flow(rates, held, [])
    for point in configurations.points():
        try:
            yield rates.values_of(flow.with_speeds(point))
        except (ValueError, ZeroDivisionError, OverflowError):
            continue  # outside the domain of a root or logarithm


class Rotations:
    """One motion, of which every step from frame to frame is evaluated once, so that long chains
    are fast.

    ``values``: of coordinates, speeds and parameters; random ones without, which need not satisfy
    the constraints.
    """

    def __init__(self, source: Source, rates: Rates, values: Mapping[Expr, float]) -> None:
        self.placement = Placement(source.frame, Point("O"), seed=4)
        for symbol, value in values.items():
            self.placement.assume(symbol, value)
        for symbol, rate in rates.moving.items():
            self.placement.assume(symbol, self.placement.value(rate))
        self._before = steps_from(source.frame, lambda f: f._dcm_dict)
        self._spins: dict[ReferenceFrame, Number3] = {source.frame: ZERO}

    def holds(self, claim: _Claim) -> bool:
        """Whether the given angular velocity is the rate of the orientation in this motion."""
        try:
            said, _, gap = self._sizes(claim)
        except KeyError:  # not oriented step by step
            return False
        return gap <= SAME * max(1.0, said)

    def refuse_other(self, claim: _Claim) -> None:
        """Refuse a claim that does not hold; not where a root or logarithm has no real value."""
        try:
            said, derived, gap = self._sizes(claim)
        except (ValueError, ZeroDivisionError, OverflowError, TypeError):
            return
        if self.placement.is_real and gap > SAME * max(1.0, said, derived):
            raise MechanismError(
                f"the angular velocity that was set for frame {claim.frame.name} in "
                f"{claim.other.name} is not the rate of its orientation: {said:.3g} and "
                f"{derived:.3g} rad/s, {gap:.3g} rad/s apart, in a random motion. "
                f"Accelerations would depend on which of the two is right: omit the set_ang_vel "
                f"of {claim.frame.name}, or set there the rate of the orientation "
                f"({claim.frame.name}.ang_vel_in({claim.other.name}) before it is set, with the "
                "kinematic differential equations for it)"
            )

    def _sizes(self, claim: _Claim) -> tuple[float, float, float]:
        """Sizes of the angular velocity that was set, of the derived one, of their difference."""
        said = self.placement.vector(claim.rate)
        spins = self.spin(claim.frame), self.spin(claim.other)
        derived = minus(*spins)
        return hypot(*said), hypot(*derived), hypot(*minus(said, derived))

    def spin(self, frame: ReferenceFrame) -> Number3:
        """The angular velocity by the rates of the direction cosines: that of R' R^T."""
        for step in way_to(frame, self._before, self._spins):
            before = self._before[step]
            rows = step._dcm_dict[before].T.tolist()
            turn = [[self.placement.value(e) for e in row] for row in rows]
            rate = [[self._rate(e) for e in row] for row in rows]
            axis = [dot(rate[i - 1], turn[i - 2]) for i in range(3)]
            local = apply(self.placement.rotation(before), axis)
            self._spins[step] = plus(self._spins[before], local)
        return self._spins[frame]

    def rate(self, vector: Vector) -> Number3:
        """The rate of a vector in the inertial frame."""
        total = ZERO
        for matrix, frame in vector.args:
            turn = self.placement.rotation(frame)
            own = apply(turn, [self._rate(entry) for entry in matrix])
            carried = apply(turn, [self.placement.value(entry) for entry in matrix])
            total = plus(total, own, cross(self.spin(frame), carried))
        return total

    def _rate(self, entry: Expr) -> float:
        moves = not entry.is_Number
        return self.placement.value(entry.diff(dynamicsymbols._t)) if moves else 0.0
