"""Check that accelerations set by the user are the derivatives of the velocities; find the origin.

KanesMethod uses accelerations as they are set; here M and F follow from velocities alone.  Where
the two differ although the constraints hold, the description contradicts itself.  This happens, for
example, when ``a2pt_theory`` is used with a contact point whose acceleration was never set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Expr, S
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.algebra import evaluator, solve_least
from mechc_codegen.convert.classify_constraints import RateRows, Rates, SpeedRows
from mechc_codegen.description.mechanism import is_rigid
from mechc_codegen.description.placement import reachable
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import velocity_of
from mechc_codegen.errors import MechanismError

_SAME = 1e-7


def refuse_other_accelerations(
    source: Source, bodies: Sequence[RigidBody | Particle], rates: Rates, motion: Sequence[Expr]
) -> None:
    """Compare accelerations set by the user with derivatives, at random motions that satisfy
    the constraints.

    ``motion``: everything that constrains the speeds, rates of configuration constraints among it.
    """
    replaced = rates.moving | {u.diff(dynamicsymbols._t): S.Zero for u in source.auxiliary}
    places: list[Point | ReferenceFrame] = [b.masscenter for b in bodies]
    places += [b.frame for b in bodies if is_rigid(b)]
    for place in places:
        difference = _difference(source.frame, place, replaced)
        if difference is not None:
            components = list(difference.to_matrix(source.frame))
            if not _vanish(components, source, rates, motion):
                _refuse(place)


# -- the point at rest --------------------------------------------------------------------------


def origin_of(source: Source, rates: Rates, motion: Sequence[Expr]) -> Point | None:
    """A point at rest in the inertial frame from which the bodies' positions are known.

    The velocity of a point may be zero though its place moves: that of the point of a wheel which
    touches the ground is.  Then the origin is the point beyond it from which the velocities of the
    bodies follow, if there is one.  ``motion``: everything that constrains the speeds.
    """
    found = point_at_rest(source)
    if found is None:
        return None
    frame, points = source.frame, _points(source)
    still = (p for p in points[points.index(found) + 1 :] if p._vel_dict.get(frame, 0) == 0)
    moving = [p for p in still if found.pos_from(p).dt(frame) != 0]
    near = reachable([found])
    centres = [body.masscenter for body in source.bodies if body.masscenter in near]
    centres = [centre for centre in centres if centre._vel_dict.get(frame, 0) != 0]
    if not moving or not centres:
        return found

    def follows_from(origin: Point) -> bool:
        difference = centres[0].pos_from(origin).dt(frame) - centres[0]._vel_dict[frame]
        difference = difference.xreplace(rates.moving)
        return _vanish(list(difference.to_matrix(frame)), source, rates, motion)

    if follows_from(found):
        return found
    return next(filter(follows_from, moving), found)


def point_at_rest(source: Source) -> Point | None:
    """The first point whose velocity is zero, from the bodies and loads on."""
    velocities = ((p, p._vel_dict.get(source.frame)) for p in _points(source))
    return next((point for point, v in velocities if v is not None and v == 0), None)


def _points(source: Source) -> list[Point]:
    starts = [body.masscenter for body in source.bodies]
    starts += [place for place, _ in source.loads if isinstance(place, Point)]
    return reachable(starts)


# -- what vanishes in a motion --------------------------------------------------------------------


def _vanish(
    components: Sequence[Expr], source: Source, rates: Rates, motion: Sequence[Expr]
) -> bool:
    """Whether expressions of q, u and u' vanish in every motion that the constraints allow."""
    accelerations = [rates.in_symbols(u.diff(dynamicsymbols._t)) for u in source.u]
    values = [rates.in_symbols(c) for c in components]
    rows = [rates.in_symbols(e) for e in motion]
    configuration = RateRows(rates, [rates.in_symbols(e) for e in source.configuration])
    if len(rates.symbols) > rates.known + len(accelerations):
        return True  # points moved by specified functions of time are not checked
    evaluate = evaluator([*rates.symbols, *rates.u], values)
    flow = Flow(rates, rows, [rates.symbols.index(a) for a in accelerations])
    states = (flow.moving(point) for point in configuration.points())
    return all(max(map(abs, evaluate(*state))) < _SAME for state in states)


class Flow:
    """Speeds and accelerations that the constraints allow, at a configuration."""

    def __init__(self, rates: Rates, rows: Sequence[Expr], accelerations: Sequence[int]) -> None:
        symbols = [*rates.symbols, *rates.u]
        self.rows, self.speeds = SpeedRows(rates, rows), len(rates.u)
        self.residual = evaluator(symbols, list(rows))
        self.kinematics = evaluator(symbols, rates.kinematics)
        self.q = [symbols.index(q) for q in rates.q]
        self.time = symbols.index(rates.time)
        self.accelerations = accelerations

    def with_speeds(self, point: Sequence[float]) -> list[float]:
        """The point with speeds appended."""
        state = [*point, *(0.3 + 0.17 * k for k in range(self.speeds))]
        jacobian = self.rows.at(point)
        if jacobian:
            change = solve_least(jacobian, self.residual(*state))
            state[-self.speeds :] = [
                a - b for a, b in zip(state[-self.speeds :], change, strict=True)
            ]
        return state

    def moving(self, point: Sequence[float]) -> list[float]:
        """The point extended by speeds, with consistent accelerations in their places."""
        state, jacobian = self.with_speeds(point), self.rows.at(point)
        direction = [0.0] * len(state)
        direction[self.time] = 1.0
        for place, rate in zip(self.q, self.kinematics(*state), strict=True):
            direction[place] = rate
        found = [0.7 - 0.19 * k for k in range(self.speeds)]
        if jacobian:
            pushed = self.residual.slope(state, direction)
            open_by = [
                sum(a * b for a, b in zip(row, found, strict=True)) + c
                for row, c in zip(jacobian, pushed, strict=True)
            ]
            found = [a - b for a, b in zip(found, solve_least(jacobian, open_by), strict=True)]
        for place, value in zip(self.accelerations, found, strict=True):
            state[place] = value
        return state


def _refuse(place: Point | ReferenceFrame) -> None:
    kind = "angular acceleration" if isinstance(place, ReferenceFrame) else "acceleration"
    raise MechanismError(
        f"the {kind} that was set for {place.name} is not the derivative of its velocity; omit "
        "it (set_acc, set_ang_acc and a2pt_theory are not needed), it is derived"
    )


def _difference(
    frame: ReferenceFrame, place: Point | ReferenceFrame, replaced: Mapping[Expr, Expr]
) -> Vector | None:
    """The value set minus the derivative; None where nothing was set or both are the same
    expression."""
    turning = isinstance(place, ReferenceFrame)
    given = (place._ang_acc_dict if turning else place._acc_dict).get(frame)
    if given is None:
        return None
    time = dynamicsymbols._t
    second = {first.diff(time): rate.diff(time) for first, rate in replaced.items() if rate != 0}
    difference = given - velocity_of(place, frame).xreplace(dict(replaced)).dt(frame)
    difference = difference.xreplace(second).xreplace(dict(replaced))
    return None if difference == 0 else difference
