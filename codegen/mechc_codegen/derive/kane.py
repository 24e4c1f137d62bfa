"""Stage 1: Mechanism -> Equations, by Kane's method.

Input: a validated mechanism.  Output: mass matrix and forcing of the open tree, constraints,
kinematics, energies, momenta, positions and velocities.  Invariant: nothing is expanded or
simplified; products of partial velocities are formed as dot products of vectors, each in the
frames it was written in, so that a link's own axes cost no trigonometry.

M u' + J^T lambda = F with, for speeds r and s (Kane & Levinson 1985, sections 4.11 and 6.1):
M_rs = sum m v_r . v_s + omega_r . I . omega_s, and F_r = generalized active force minus the part of
the generalized inertia force without u'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sympy import Expr, S, expand, sympify
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.derive import outputs
from mechc_codegen.derive.auxiliary_reactions import reaction_values
from mechc_codegen.derive.dot_products import dot, dyadic_dot
from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.derive.joint_reactions import reaction_outputs
from mechc_codegen.derive.state_symbols import StateSymbols, state_symbols
from mechc_codegen.derive.tree.tape import V3, Tape
from mechc_codegen.description.derivatives import Derivatives
from mechc_codegen.description.given_equations import GivenEquations
from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Load, Mechanism, is_rigid, printed_name
from mechc_codegen.description.placement import reachable
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest
from mechc_codegen.description.terms import multiplier, velocity_of


@dataclass(frozen=True)
class BodyMotion:
    """One body: mass, velocity of the mass centre, angular velocity, central inertia."""

    mass: Expr
    velocity: Vector
    angular_velocity: Vector
    inertia: Dyadic | None
    masscentre: Point

    @property
    def spin(self) -> Vector:
        """Angular momentum about the mass centre."""
        return (
            Vector(0) if self.inertia is None else dyadic_dot(self.inertia, self.angular_velocity)
        )

    @property
    def kinetic_energy(self) -> Expr:
        energy = self.mass * dot(self.velocity, self.velocity) / 2
        return energy + (
            S.Zero if self.inertia is None else dot(self.angular_velocity, self.spin) / 2
        )


def derive(mechanism: Mechanism, request: OutputRequest = DEFAULT_REQUEST) -> Equations:
    """Derive the equations of motion and every other requested output of ``mechanism``."""
    symbols = state_symbols(mechanism)
    motions = [_motion(mechanism, body) for body in mechanism.bodies]
    of_states = (mechanism.rates[x.diff(dynamicsymbols._t)] for x in mechanism.x)
    derived = [
        *_equations_of_motion(mechanism, motions),
        outputs.coordinate_rates(mechanism, (*mechanism.kinematics, *of_states)),
        *_constraints(mechanism),
        *(_energies(mechanism, motions) if request.includes("energy") else ()),
        *(_momenta(mechanism, motions) if request.includes("momenta") else ()),
        *(_points(mechanism) if request.includes("points") else ()),
        *([] if mechanism.preference is None else [outputs.preference(mechanism.preference)]),
        outputs.cut_directions(mechanism, (a.dot(b) for _, a, b in mechanism.aligned_axes)),
    ]
    solved = [
        *(_accelerations(mechanism) if request.includes("accelerations") else ()),
        *(_reactions(mechanism, motions) if request.includes("reactions") else ()),
        *outputs.user_outputs(request, _auxiliary_reactions(mechanism, motions)),
    ]
    to_symbols = StateSymbols(mechanism, symbols, request)
    return Equations(
        symbols=symbols,
        outputs={o.name: to_symbols.output(o) for o in derived}
        | {o.name: to_symbols.motion_output(o) for o in solved},
        parameter_defaults=to_symbols.defaults(mechanism),
        holonomic=len(mechanism.holonomic),
        nonholonomic=len(mechanism.motion_constraints),
        identity_kinematics=mechanism.has_identity_kinematics,
        speed_names=tuple(printed_name(u) for u in mechanism.u),
        mass_scale=to_symbols.expression(sum((sympify(b.mass) for b in mechanism.bodies), S.Zero))
        if mechanism.bodies
        else S.One,
        states=len(mechanism.states),
    )


def _motion(mechanism: Mechanism, body: RigidBody | Particle) -> BodyMotion:
    if not is_rigid(body):
        velocity = _velocity(mechanism, body.point)
        return BodyMotion(body.mass, velocity, Vector(0), None, body.point)
    return BodyMotion(
        body.mass,
        _velocity(mechanism, body.masscenter),
        _velocity(mechanism, body.frame),
        body.central_inertia,
        body.masscenter,
    )


def _velocity(mechanism: Mechanism, place: Point | ReferenceFrame) -> Vector:
    """The angular velocity of a frame; of a point the velocity that the user set, or else the rate
    of the position.

    SymPy would use the nearest point whose velocity is known, and store the result.
    """
    frame = mechanism.frame
    given = isinstance(place, ReferenceFrame) or frame in place._vel_dict
    if given or mechanism.origin not in reachable([place]):
        return velocity_of(place, frame).xreplace(mechanism.rates)
    return place.pos_from(mechanism.origin).dt(frame).xreplace(mechanism.rates)


def _equations_of_motion(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    mass, forcing = _kanes_equations(mechanism, motions)
    if mechanism.lagrangian is not None:
        _add_lagranges_equations(mechanism, mass, forcing)
    if mechanism.equations is not None:
        _add_given_equations(mechanism, mechanism.equations, mass, forcing)
    size = len(forcing)
    symmetric = [mass[min(r, c)][max(r, c)] for r in range(size) for c in range(size)]
    equation = "M = sum of m v_r . v_s + omega_r . I . omega_s over the bodies"
    if not mechanism.bodies and mechanism.equations is not None:
        equation = "M as it is given"
    return outputs.equations_of_motion(mechanism, equation, symmetric, forcing)


def _add_lagranges_equations(
    mechanism: Mechanism, mass: list[list[Expr]], forcing: list[Expr]
) -> None:
    """Add d/dt dL/du - dL/dq = 0, u = q', as coefficients of u' and the remaining terms."""
    assert mechanism.lagrangian is not None
    time = dynamicsymbols._t
    lagrangian = mechanism.lagrangian.xreplace(mechanism.rates)
    no_accelerations = {u.diff(time): S.Zero for u in mechanism.u}
    for row, (q, u) in enumerate(zip(mechanism.q, mechanism.u, strict=True)):
        momentum = lagrangian.diff(u)
        for column in range(row, len(mechanism.u)):
            entry = momentum.diff(mechanism.u[column])
            mass[row][column] += expand(entry) if entry.has(*mechanism.u) else entry
        rate = momentum.diff(time).xreplace(no_accelerations).xreplace(mechanism.rates)
        forcing[row] += lagrangian.diff(q) - rate


def _add_given_equations(
    mechanism: Mechanism, given: GivenEquations, mass: list[list[Expr]], forcing: list[Expr]
) -> None:
    for row in range(len(forcing)):
        forcing[row] += given.forcing[row].xreplace(mechanism.rates)
        for column in range(row, len(forcing)):
            mass[row][column] += given.mass_matrix[row][column]


def _kanes_equations(
    mechanism: Mechanism, motions: list[BodyMotion]
) -> tuple[list[list[Expr]], list[Expr]]:
    """The upper triangle of M, and F, by Kane's method."""
    speeds, frame = mechanism.u, mechanism.frame
    size, no_accelerations = len(speeds), {u.diff(dynamicsymbols._t): S.Zero for u in speeds}
    mass = [[S.Zero] * size for _ in speeds]
    forcing = _generalized_active_forces(mechanism)
    for motion in motions:
        linear = _partials(motion.velocity, speeds)
        angular = _partials(motion.angular_velocity, speeds)
        carried = (motion.mass * motion.velocity, motion.spin)
        changes = (p.dt(frame).xreplace(no_accelerations) for p in carried)
        force_rate, moment_rate = (change.xreplace(mechanism.rates) for change in changes)
        spins = [] if motion.inertia is None else [dyadic_dot(motion.inertia, w) for w in angular]
        for row in range(size):
            for column in range(row, size):
                term = motion.mass * dot(linear[row], linear[column])
                mass[row][column] += term + (dot(angular[row], spins[column]) if spins else S.Zero)
            forcing[row] -= dot(force_rate, linear[row]) + dot(moment_rate, angular[row])
    for added in mechanism.added_inertia:
        for row, partial in enumerate(_partials_at(mechanism, added.place)):
            for column in range(row, size):
                load = added.per_acceleration[column].xreplace(mechanism.rates)
                mass[row][column] -= dot(load, partial)
    return mass, forcing


def _generalized_active_forces(mechanism: Mechanism) -> list[Expr]:
    forces = [S.Zero] * len(mechanism.u)
    for place, load in (*mechanism.loads, *_weights(mechanism)):
        for k, partial in enumerate(_partials_at(mechanism, place)):
            forces[k] += dot(load.xreplace(mechanism.rates), partial)
    return forces


def _partials_at(mechanism: Mechanism, place: Point | ReferenceFrame) -> list[Vector]:
    """Partial velocities of a point, partial angular velocities of a frame."""
    return _partials(_velocity(mechanism, place).xreplace(mechanism.rates), mechanism.u)


def _partials(velocity: Vector, speeds: Sequence[Expr]) -> list[Vector]:
    """Derivatives of a velocity by the speeds, on which no frame's orientation depends."""
    by = Derivatives({*speeds}).of
    return [
        Vector([(m.applyfunc(lambda e, u=u: by(e, u)), frame) for m, frame in velocity.args])
        for u in speeds
    ]


def _weights(mechanism: Mechanism) -> list[Load]:
    if mechanism.gravity is None:
        return []
    return [(body.masscenter, body.mass * mechanism.gravity) for body in mechanism.bodies]


def _constraints(mechanism: Mechanism) -> list[Output]:
    cut = [c for closure in mechanism.closures for c in closure.constraints()]
    configuration = [*mechanism.configuration_constraints, *cut]
    motion = mechanism.motion_constraints
    held = (c.expression.xreplace(mechanism.rates) for c in motion)
    return [
        outputs.constraints((c.expression for c in configuration), (c.name for c in configuration)),
        outputs.array(
            "motion_constraints", "constraints on the speeds alone", held, (c.name for c in motion)
        ),
    ]


def _energies(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    kinetic = sum((motion.kinetic_energy for motion in motions), S.Zero)
    potential = sum((sympify(b.potential_energy) for b in mechanism.bodies), S.Zero)
    if mechanism.potential is not None:
        potential = mechanism.potential
    if mechanism.lagrangian is not None:
        of_speeds, rest = _jacobi_energy(mechanism)
        kinetic, potential = kinetic + of_speeds, potential + rest
    if mechanism.equations is not None:
        given = mechanism.equations.energies
        if given is None:
            return []
        kinetic, potential = kinetic + given[0].xreplace(mechanism.rates), potential + given[1]
    for place, weight in _weights(mechanism):
        potential -= dot(weight, place.pos_from(mechanism.origin))
    return outputs.energies(mechanism, kinetic, sympify(potential).xreplace(mechanism.rates))


def _jacobi_energy(mechanism: Mechanism) -> tuple[Expr, Expr]:
    """Jacobi's energy u . dL/du - L = T2 - L0, in its parts quadratic in and free of the speeds.

    L0 is L at rest; T2 = (u . d(L - L0)/du) - (L - L0).  The energy T + V where
    the kinetic energy is quadratic in the speeds.
    """
    assert mechanism.lagrangian is not None
    lagrangian = mechanism.lagrangian.xreplace(mechanism.rates)
    at_rest = lagrangian.xreplace(dict.fromkeys(mechanism.u, S.Zero))
    moving = sum((u * lagrangian.diff(u) for u in mechanism.u), S.Zero) - lagrangian + at_rest
    return moving, -at_rest


def _auxiliary_reactions(mechanism: Mechanism, motions: list[BodyMotion]) -> dict[Expr, Expr]:
    momenta: list[Load] = [(m.masscentre, m.mass * m.velocity) for m in motions]
    pairs = zip(mechanism.bodies, motions, strict=True)
    momenta += [(body.frame, motion.spin) for body, motion in pairs if is_rigid(body)]
    return reaction_values(mechanism, (*mechanism.loads, *_weights(mechanism)), momenta)


def _momenta(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    linear, angular = list[V3](), list[V3]()
    for motion in motions:
        momentum = motion.mass * motion.velocity
        arm = motion.masscentre.pos_from(mechanism.origin)
        linear.append(_along(momentum, mechanism.frame))
        angular.append(_along(arm.cross(momentum) + motion.spin, mechanism.frame))
    return outputs.momenta(mechanism, linear, angular)


def _points(mechanism: Mechanism) -> list[Output]:
    frame, named = mechanism.frame, mechanism.points
    positions = [_along(point.pos_from(mechanism.origin), frame) for point in named]
    velocities = [_along(_velocity(mechanism, point), frame) for point in named]
    return outputs.points(mechanism, positions, velocities)


def _accelerations(mechanism: Mechanism) -> list[Output]:
    frame = mechanism.frame
    rates = (_velocity(mechanism, point).dt(frame) for point in mechanism.points)
    return [outputs.point_accelerations(mechanism, (_along(rate, frame) for rate in rates))]


def _reactions(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    momenta = {
        body: (motion.mass * motion.velocity, motion.spin)
        for body, motion in zip(mechanism.bodies, motions, strict=True)
    }
    return reaction_outputs(mechanism, WrittenKinetics(mechanism, momenta))


class WrittenKinetics(Tape):
    """Positions and rates of momentum for joint reactions, as full expressions of coordinates,
    speeds and their rates, none of them named.

    ``momenta``: linear momentum of each body, and angular momentum about its mass centre.
    """

    def __init__(self, mechanism: Mechanism, momenta: Mapping[Body, tuple[Vector, Vector]]) -> None:
        super().__init__(())
        self.mechanism, self.momenta = mechanism, momenta

    def keep(self, value: Expr) -> Expr:
        return value

    def along(self, vector: Vector) -> V3:
        return _along(vector, self.mechanism.frame)

    def position(self, point: Point) -> V3:
        return self.along(point.pos_from(self.mechanism.origin))

    def multiplier(self, row: int) -> Expr:
        return multiplier(row)

    def momentum_rates(self, body: Body) -> tuple[V3, V3]:
        linear, angular = (self.along(p.dt(self.mechanism.frame)) for p in self.momenta[body])
        return linear, angular


def _along(vector: Vector, frame: ReferenceFrame) -> V3:
    return dot(vector, frame.x), dot(vector, frame.y), dot(vector, frame.z)
