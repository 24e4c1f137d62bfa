"""Check that velocities set by the user or by SymPy's joints are those of the tree.

The tree derives velocities from positions.  Where a velocity that was set differs (it holds on the
constraints only, or the point has no position) the equations are derived in full instead.
"""

from __future__ import annotations

import random
from collections.abc import Collection, Iterator, Mapping, Sequence

from sympy import Expr, Float, Symbol
from sympy.physics.mechanics import Point

from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.links import Links
from mechc_codegen.derive.tree.tape import Tape
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.placement import dot

SAME = 1e-9  # of velocities of the order of one
SAMPLES = 2


def refuse_other_velocities(mechanism: Mechanism, links: Links) -> None:
    """Compare velocities set in the inertial frame with those of the tree, at random states.

    Raises
    ------
    NotATreeError
        If one differs; the message names the point.
    """
    placed = [body.masscenter for body in mechanism.bodies]
    placed += [place for place, _ in mechanism.loads if isinstance(place, Point)]
    points = [p for p in (*placed, *mechanism.points) if mechanism.frame in p._vel_dict]
    differences = [tuple(_difference(mechanism, links, point)) for point in points]
    for seed in range(SAMPLES if points else 0):
        found = iter(at_random(links.tape, [e for gap in differences for e in gap], seed))
        for point, difference in zip(points, differences, strict=True):
            if any(abs(next(found)) > SAME for _ in difference):
                raise NotATreeError(f"the velocity of {point.name} is not the rate of its position")


def _difference(mechanism: Mechanism, links: Links, point: Point) -> Iterator[Expr]:
    """The given velocity minus that of the tree, with nothing added to the tape."""
    rows = list[tuple[Sequence[Expr], Sequence[Expr]]]()
    for matrix, frame in point.vel(mechanism.frame).args:
        rows.append((links.frames.motion(frame).rotation, links.local.entries(matrix)))
    for axis, value in enumerate(links.motion(point).velocity):
        yield sum((dot(rotation[axis], entries) for rotation, entries in rows), -value)


def is_zero(tape: Tape, expressions: Collection[Expr]) -> bool:
    """Whether expressions, of the order of one, vanish at random states."""
    found = (at_random(tape, [*expressions], seed) for seed in range(SAMPLES))
    return all(abs(value) < SAME for each in found for value in each)


def is_constant(tape: Tape, expression: Expr) -> bool:
    """Whether an expression has one value at random states, with parameters that stay."""
    generator = random.Random(SAMPLES)
    named = sorted(tape.parameters, key=str)
    parameters = {p: Float(generator.uniform(0.4, 1.7)) for p in named}
    one, *others = (at_random(tape, [expression], seed, parameters)[0] for seed in range(SAMPLES))
    return all(abs(other - one) < SAME for other in others)


def at_random(
    tape: Tape, expressions: Sequence[Expr], seed: int, known: Mapping[Symbol, Expr] | None = None
) -> list[complex]:
    """Values of expressions, with random ones of symbols that no statement defines and that are not
    ``known``; a root of a difference of lengths may be imaginary there."""
    kept = tape.needed(expressions)
    used = {symbol for e in (*expressions, *(v for _, v in kept)) for symbol in e.free_symbols}
    generator, values = random.Random(seed), dict(known or {})
    for symbol in sorted(used - {symbol for symbol, _ in kept} - {*values}, key=str):
        values[symbol] = Float(generator.uniform(0.4, 1.7))
    for symbol, value in kept:
        values[symbol] = value.xreplace(values)
    return [complex(e.xreplace(values)) for e in expressions]
