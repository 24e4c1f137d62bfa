"""Rows of constraints that are written out, linear in speeds.

Such a row acts on each link that one of its speeds moves, and on the link's parent, with opposite
wrenches that do the power of its partial derivatives on these speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from sympy import Expr, S, Symbol

from mechc_codegen.derive.tree.cuts import Accelerations, CutRow, Pair
from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.links import Links, moving_columns
from mechc_codegen.derive.tree.tape import V3, ZERO, Tape, vanishes
from mechc_codegen.derive.tree.velocities import is_constant, is_zero
from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.placement import dot


@dataclass(frozen=True)
class WrittenRow:
    """A constraint that is written out, on the configuration or on the speeds.

    ``expression``: of the constraint; ``along``: its rate, or of one on the speeds itself;
    ``beyond``: the rate of that at constant speeds; all over symbols of the state.  ``partials``:
    speed -> derivative of ``along``.
    """

    label: str
    expression: Expr
    along: Expr
    beyond: Expr
    partials: Mapping[int, Expr]
    speeds: Sequence[Symbol]
    pairs: tuple[Pair, ...]

    def value(self, tape: Tape) -> Expr:
        return tape.keep(self.expression)

    def rate(self, tape: Tape) -> Expr:
        return tape.keep(self.along)

    def rate_at_rest(self, tape: Tape) -> Expr:
        return tape.keep(self.along.xreplace(dict.fromkeys(self.speeds, S.Zero)))

    def second_rate(self, tape: Tape, by: Accelerations) -> Expr:
        parts = (partial * by.of_speed(k) for k, partial in self.partials.items())
        return tape.keep(sum(parts, self.beyond))


Row = CutRow | WrittenRow


def written_rows(
    constraints: Iterable[Constraint], links: Links, of_speeds: bool, plain: Callable[[Expr], Expr]
) -> Iterator[WrittenRow]:
    """The rows of constraints that are written out; ``plain``: writes one in symbols of the state.

    Raises
    ------
    NotATreeError
        Where one is not linear in the speeds, or contains none.
    """
    tape, local = links.tape, links.local
    for constraint in constraints:
        expression = plain(constraint.expression)
        along = expression if of_speeds else local.rate(expression)
        partials = {k: partial for k, (partial, *_) in local.columns((along,) * 3).items()}
        kept = {k: tape.keep(partial) for k, partial in partials.items()}
        if any(partial.free_symbols & {*local.symbols.u} for partial in partials.values()):
            raise NotATreeError(f"{constraint.name} is not linear in the speeds")
        yield WrittenRow(
            constraint.name, expression, along, local.rate(along), kept, local.symbols.u,
            tuple(_pairs_along(constraint.name, links, kept)),
        )  # fmt: skip


def _pairs_along(name: str, links: Links, partials: Mapping[int, Expr]) -> Iterator[Pair]:
    """Wrenches on links and their parents that do the power of these partials on the speeds."""
    tape, left = links.tape, {**partials}
    for number, link in enumerate(links.links):
        own = [k for k in moving_columns(link) if k in left and _is_steady(links, number, k)]
        if not own:
            continue
        force, moment = ZERO, ZERO
        for k in own:
            turning, sliding = _dual(name, links, number, k)
            factor = left.pop(k)
            moment = tape.total(moment, tape.scale(factor, turning))
            force = tape.total(force, tape.scale(factor, sliding))
        at = links.reference(number)
        yield Pair(((number, at), (link.parent, at)), force, moment)
    if left or not partials:
        raise NotATreeError(
            f"{name} contains no speed, or one that moves no link alike wherever it is"
        )


def _is_steady(links: Links, number: int, speed: int) -> bool:
    """Whether a link moves by a speed alike wherever it is: the others have dead points."""
    turning, sliding = moving_columns(links.links[number])[speed]
    square = dot(turning, turning) if not vanishes(turning) else dot(sliding, sliding)
    return is_constant(links.tape, square)


def _dual(name: str, links: Links, number: int, speed: int) -> tuple[V3, V3]:
    """The moment and force on a link that do a unit of power on one of its speeds, and none on the
    others: along the axis of that speed."""
    tape, columns = links.tape, moving_columns(links.links[number])
    turning, sliding = columns[speed]
    turns = not vanishes(turning)
    along = turning if turns else sliding
    wrench = (along, ZERO) if turns else (ZERO, along)
    powers = {
        k: dot(wrench[0], angular) + dot(wrench[1], linear)
        for k, (angular, linear) in columns.items()
    }
    own = powers.pop(speed)
    if not is_zero(tape, powers.values()):
        raise NotATreeError(f"{name} acts on several speeds of a link that are not perpendicular")
    if not is_zero(tape, (own - 1,)):
        along = tape.scale(1 / own, along)
    return (along, ZERO) if turns else (ZERO, along)
