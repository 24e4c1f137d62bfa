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

from collections.abc import Mapping
from dataclasses import dataclass

from sympy import Expr, S, sympify
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.derive.auxiliary_reactions import reaction_values
from mechc_codegen.derive.dot_products import dot, dyadic_dot
from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.derive.joint_reactions import reaction_outputs
from mechc_codegen.derive.momentum_rates import WrittenKinetics
from mechc_codegen.derive.state_symbols import StateSymbols, state_symbols
from mechc_codegen.description.mechanism import Load, Mechanism, is_rigid, printed_name
from mechc_codegen.description.request import DEFAULT_REQUEST, OutputRequest
from mechc_codegen.description.terms import velocity_of

AXES = ("x", "y", "z")


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


def derive(mechanism: Mechanism, request: OutputRequest = DEFAULT_REQUEST) -> Equations:
    """Derive the equations of motion and every other requested output of ``mechanism``."""
    symbols = state_symbols(mechanism)
    motions = [_motion(mechanism, body) for body in mechanism.bodies]
    outputs = [
        *_equations_of_motion(mechanism, motions),
        *_kinematics(mechanism),
        *_constraints(mechanism),
        *(_energies(mechanism, motions) if request.includes("energy") else ()),
        *(_momenta(mechanism, motions) if request.includes("momenta") else ()),
        *(_points(mechanism) if request.includes("points") else ()),
        *_preference(mechanism),
    ]
    reactions = _auxiliary_reactions(mechanism, motions)
    solved = [
        *(_point_accelerations(mechanism) if request.includes("accelerations") else ()),
        *(_reactions(mechanism, motions) if request.includes("reactions") else ()),
        *_user_outputs(request, reactions),
    ]
    to_symbols = StateSymbols(mechanism, symbols, request)
    return Equations(
        symbols=symbols,
        outputs={o.name: to_symbols.output(o) for o in outputs}
        | {o.name: to_symbols.motion_output(o) for o in solved},
        parameter_defaults=tuple(to_symbols.default(p.default) for p in mechanism.parameters),
        holonomic=len(mechanism.holonomic),
        nonholonomic=len(mechanism.motion_constraints),
        identity_kinematics=tuple(mechanism.kinematics) == mechanism.u and not mechanism.states,
        speed_names=tuple(printed_name(u) for u in mechanism.u),
        mass_scale=to_symbols.expression(sum((sympify(b.mass) for b in mechanism.bodies), S.Zero))
        if mechanism.bodies
        else S.One,
        states=len(mechanism.states),
    )


def _motion(mechanism: Mechanism, body: RigidBody | Particle) -> BodyMotion:
    frame, rates = mechanism.frame, mechanism.rates
    if not is_rigid(body):
        velocity = _velocity(mechanism, body.point)
        return BodyMotion(body.mass, velocity, Vector(0), None, body.point)
    return BodyMotion(
        body.mass,
        _velocity(mechanism, body.masscenter),
        body.frame.ang_vel_in(frame).xreplace(rates),
        body.central_inertia,
        body.masscenter,
    )


def _velocity(mechanism: Mechanism, point: Point) -> Vector:
    """The velocity that the user set, or else the rate of the position.

    SymPy would use the nearest point whose velocity is known, and store the result.
    """
    frame = mechanism.frame
    if frame in point._vel_dict or mechanism.origin not in _reachable_points(point):
        return velocity_of(point, frame).xreplace(mechanism.rates)
    return point.pos_from(mechanism.origin).dt(frame).xreplace(mechanism.rates)


def _reachable_points(point: Point) -> set[Point]:
    """All points that are connected to this one by positions."""
    found, waiting = {point}, [point]
    for at in waiting:
        new = at._pos_dict.keys() - found
        found |= new
        waiting += new
    return found


def _equations_of_motion(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    mass, forcing = _kanes_equations(mechanism, motions)
    if mechanism.lagrangian is not None:
        _add_lagranges_equations(mechanism, mass, forcing)
    size = len(forcing)
    symmetric = [mass[min(r, c)][max(r, c)] for r in range(size) for c in range(size)]
    names = [printed_name(u) for u in mechanism.u]
    return [
        Output(
            "mass_matrix",
            "M = sum of m v_r . v_s + omega_r . I . omega_s over the bodies",
            tuple(symmetric),
            (size, size),
            tuple(f"M[{a}, {b}]" for a in names for b in names),
        ),
        Output(
            "forcing",
            "F = generalized active forces less inertia forces free of accelerations",
            tuple(forcing),
            (size,),
            tuple(f"F[{a}]" for a in names),
        ),
    ]


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
            mass[row][column] += momentum.diff(mechanism.u[column])
        rate = momentum.diff(time).xreplace(no_accelerations).xreplace(mechanism.rates)
        forcing[row] += lagrangian.diff(q) - rate


def _kanes_equations(
    mechanism: Mechanism, motions: list[BodyMotion]
) -> tuple[list[list[Expr]], list[Expr]]:
    """The upper triangle of M, and F, by Kane's method."""
    speeds, frame = mechanism.u, mechanism.frame
    partials = [_partial_velocities(motion, speeds, frame) for motion in motions]
    size = len(speeds)
    mass = [[S.Zero] * size for _ in speeds]
    forcing = _generalized_active_forces(mechanism)
    for motion, (linear, angular) in zip(motions, partials, strict=True):
        force_rate, moment_rate = _inertia_without_accelerations(mechanism, motion)
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


def _partial_velocities(
    motion: BodyMotion, speeds: tuple[Expr, ...], frame: ReferenceFrame
) -> tuple[list[Vector], list[Vector]]:
    return (
        [motion.velocity.diff(u, frame, var_in_dcm=False) for u in speeds],
        [motion.angular_velocity.diff(u, frame, var_in_dcm=False) for u in speeds],
    )


def _inertia_without_accelerations(
    mechanism: Mechanism, motion: BodyMotion
) -> tuple[Vector, Vector]:
    """d(m v)/dt and dH/dt of a body with every u' zero."""
    force_rate = _rate_at_constant_speeds(mechanism, motion.mass * motion.velocity)
    if motion.inertia is None:
        return force_rate, Vector(0)
    momentum = dyadic_dot(motion.inertia, motion.angular_velocity)
    return force_rate, _rate_at_constant_speeds(mechanism, momentum)


def _rate_at_constant_speeds(mechanism: Mechanism, vector: Vector) -> Vector:
    time = dynamicsymbols._t
    no_accelerations = {u.diff(time): S.Zero for u in mechanism.u}
    return vector.dt(mechanism.frame).xreplace(no_accelerations).xreplace(mechanism.rates)


def _generalized_active_forces(mechanism: Mechanism) -> list[Expr]:
    forces = [S.Zero] * len(mechanism.u)
    for place, load in (*mechanism.loads, *_weights(mechanism)):
        for k, partial in enumerate(_partials_at(mechanism, place)):
            forces[k] += dot(load.xreplace(mechanism.rates), partial)
    return forces


def _partials_at(mechanism: Mechanism, place: Point | ReferenceFrame) -> list[Vector]:
    """Partial velocities of a point, partial angular velocities of a frame."""
    velocity = (
        place.ang_vel_in(mechanism.frame)
        if isinstance(place, ReferenceFrame)
        else _velocity(mechanism, place)
    ).xreplace(mechanism.rates)
    return [velocity.diff(u, mechanism.frame, var_in_dcm=False) for u in mechanism.u]


def _weights(mechanism: Mechanism) -> list[Load]:
    if mechanism.gravity is None:
        return []
    return [(body.masscenter, body.mass * mechanism.gravity) for body in mechanism.bodies]


def _kinematics(mechanism: Mechanism) -> list[Output]:
    names = [printed_name(q) for q in (*mechanism.q, *mechanism.x)]
    of_states = (mechanism.rates[x.diff(dynamicsymbols._t)] for x in mechanism.x)
    return [
        Output(
            "coordinate_rates",
            "kinematic differential equations: rates of the coordinates",
            (*mechanism.kinematics, *of_states),
            (len(names),),
            tuple(f"rate of {name}" for name in names),
        )
    ]


def _constraints(mechanism: Mechanism) -> list[Output]:
    cut = [c for closure in mechanism.closures for c in closure.constraints()]
    configuration = [*mechanism.configuration_constraints, *cut]
    motion = mechanism.motion_constraints
    return [
        Output(
            "constraints",
            "configuration constraints: the loop closes where these vanish",
            tuple(c.expression for c in configuration),
            (len(configuration),),
            tuple(c.name for c in configuration),
        ),
        Output(
            "motion_constraints",
            "constraints on the speeds alone",
            tuple(c.expression.xreplace(mechanism.rates) for c in motion),
            (len(motion),),
            tuple(c.name for c in motion),
        ),
    ]


def _energies(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    kinetic = sum((_kinetic_energy(motion) for motion in motions), S.Zero)
    potential = sum((sympify(b.potential_energy) for b in mechanism.bodies), S.Zero)
    if mechanism.potential is not None:
        potential = mechanism.potential
    if mechanism.lagrangian is not None:
        of_speeds, rest = _jacobi_energy(mechanism)
        kinetic, potential = kinetic + of_speeds, potential + rest
    for place, weight in _weights(mechanism):
        potential -= dot(weight, place.pos_from(mechanism.origin))
    potential = sympify(potential).xreplace(mechanism.rates)
    return [
        Output("kinetic_energy", "T = sum of m v.v/2 + omega.I.omega/2", (kinetic,), (), ("T",)),
        *_potential(mechanism, potential),
    ]


def _potential(mechanism: Mechanism, potential: Expr) -> list[Output]:
    if mechanism.unknown_potentials:
        return []
    return [Output("potential_energy", "V, of the loads that have one", (potential,), (), ("V",))]


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


def _user_outputs(request: OutputRequest, reactions: Mapping[Expr, Expr]) -> list[Output]:
    return [
        Output(name, "user-defined output", (expression.xreplace(reactions),), (), (name,))
        for name, expression in request.expressions.items()
    ]


def _kinetic_energy(motion: BodyMotion) -> Expr:
    energy = motion.mass * dot(motion.velocity, motion.velocity) / 2
    if motion.inertia is not None:
        spin = motion.angular_velocity
        energy += dot(spin, dyadic_dot(motion.inertia, spin)) / 2
    return energy


def _momenta(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    linear, angular = [], []
    for motion in motions:
        momentum = motion.mass * motion.velocity
        arm = motion.masscentre.pos_from(mechanism.origin)
        about_origin = arm.cross(momentum)
        if motion.inertia is not None:
            about_origin += dyadic_dot(motion.inertia, motion.angular_velocity)
        linear.append(momentum)
        angular.append(about_origin)
    names = [body.name for body in mechanism.bodies]
    return [
        _vectors("linear_momenta", "m v of each body", mechanism.frame, names, linear),
        _vectors(
            "angular_momenta",
            "r x m v + I . omega of each body, about the origin",
            mechanism.frame,
            names,
            angular,
        ),
    ]


def _points(mechanism: Mechanism) -> list[Output]:
    names = [point.name for point in mechanism.points]
    positions = [point.pos_from(mechanism.origin) for point in mechanism.points]
    velocities = [_velocity(mechanism, p) for p in mechanism.points]
    frame = mechanism.frame
    return [
        _vectors("points", "positions of the named points", frame, names, positions),
        _vectors("point_velocities", "velocities of the named points", frame, names, velocities),
    ]


def _point_accelerations(mechanism: Mechanism) -> list[Output]:
    frame, points = mechanism.frame, mechanism.points
    accelerations = [_velocity(mechanism, point).dt(frame) for point in points]
    equation, names = "accelerations of the named points", [point.name for point in points]
    return [_vectors("point_accelerations", equation, frame, names, accelerations)]


def _reactions(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    momenta = {
        body: (motion.mass * motion.velocity, motion.spin)
        for body, motion in zip(mechanism.bodies, motions, strict=True)
    }
    return reaction_outputs(mechanism, WrittenKinetics(mechanism, momenta))


def _vectors(
    name: str, equation: str, frame: ReferenceFrame, of: list[str], vectors: list[Vector]
) -> Output:
    components = [dot(vector, axis) for vector in vectors for axis in (frame.x, frame.y, frame.z)]
    labels = tuple(f"{what} along {axis}" for what in of for axis in AXES)
    return Output(name, equation, tuple(components), (len(of), 3), labels)


def _preference(mechanism: Mechanism) -> list[Output]:
    if mechanism.preference is None:
        return []
    return [
        Output(
            "preference",
            "of several assemblies the one where this is largest is taken",
            (mechanism.preference,),
            (),
            ("preference",),
        )
    ]
