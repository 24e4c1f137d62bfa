"""Stage 1: Mechanism -> Equations, by Kane's method.

Input: a validated mechanism.  Output: mass matrix and forcing of the open tree, constraints,
kinematics, energies, momenta, positions and velocities.  Invariant: nothing is expanded or
simplified; products of partial velocities are formed as dot products of vectors, each in the
frames it was written in, so that a link's own axes cost no trigonometry.

M u' + J^T lambda = F with, for speeds r and s (Kane & Levinson 1985, sections 4.11 and 6.1):
M_rs = sum m v_r . v_s + omega_r . I . omega_s, and F_r = generalized active force minus what of
the generalized inertia force is free of u'.
"""

from __future__ import annotations

from dataclasses import dataclass

from sympy import Expr, S, Symbol, sympify
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.equations import Equations, Output, Symbols
from mechc_codegen.mechanism import Mechanism, printed_name

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class BodyMotion:
    """One body: mass, velocity of the mass centre, angular velocity, central inertia."""

    mass: Expr
    velocity: Vector
    angular_velocity: Vector
    inertia: Dyadic | None
    masscentre: Point


def derive(mechanism: Mechanism) -> Equations:
    """Derive the equations of motion and every other output of ``mechanism``."""
    symbols = _plain_symbols(mechanism)
    motions = [_motion(mechanism, body) for body in mechanism.bodies]
    outputs = [
        *_kanes_equations(mechanism, motions),
        *_kinematics(mechanism),
        *_constraints(mechanism),
        *_energies(mechanism, motions),
        *_momenta(mechanism, motions),
        *_points(mechanism),
        *_preference(mechanism),
    ]
    to_plain = _replacement(mechanism, symbols)
    return Equations(
        symbols=symbols,
        outputs={o.name: _replaced(o, to_plain) for o in outputs},
        parameter_defaults=tuple(
            sympify(p.default).xreplace(to_plain) for p in mechanism.parameters
        ),
        holonomic=len(mechanism.configuration_constraints),
        nonholonomic=len(mechanism.motion_constraints),
        identity_kinematics=tuple(mechanism.kinematics) == mechanism.u,
        speed_names=tuple(printed_name(u) for u in mechanism.u),
    )


def _plain_symbols(mechanism: Mechanism) -> Symbols:
    def numbered(prefix: str, count: int) -> tuple[Symbol, ...]:
        return tuple(Symbol(f"{prefix}{k}", real=True) for k in range(count))

    return Symbols(
        Symbol("t", real=True),
        numbered("q", len(mechanism.coordinates)),
        numbered("u", len(mechanism.speeds)),
        numbered("p", len(mechanism.parameters)),
    )


def _replacement(mechanism: Mechanism, symbols: Symbols) -> dict[Expr, Expr]:
    named = [*mechanism.q, *mechanism.u, *(p.symbol for p in mechanism.parameters)]
    plain = [*symbols.q, *symbols.u, *symbols.parameters]
    return dict(zip(named, plain, strict=True)) | {dynamicsymbols._t: symbols.time}


def _replaced(output: Output, to_plain: dict[Expr, Expr]) -> Output:
    elements = tuple(sympify(e).xreplace(to_plain) for e in output.elements)
    return Output(output.name, output.equation, elements, output.shape, output.labels)


def _motion(mechanism: Mechanism, body: RigidBody | Particle) -> BodyMotion:
    frame, rates = mechanism.frame, mechanism.rates
    if isinstance(body, Particle):
        velocity = body.point.vel(frame).xreplace(rates)
        return BodyMotion(body.mass, velocity, Vector(0), None, body.point)
    return BodyMotion(
        body.mass,
        body.masscenter.vel(frame).xreplace(rates),
        body.frame.ang_vel_in(frame).xreplace(rates),
        body.central_inertia,
        body.masscenter,
    )


def _kanes_equations(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    speeds, frame = mechanism.u, mechanism.frame
    partials = [_partial_velocities(motion, speeds, frame) for motion in motions]
    size = len(speeds)
    mass = [[S.Zero] * size for _ in speeds]
    forcing = _generalized_active_forces(mechanism)
    for motion, (linear, angular) in zip(motions, partials, strict=True):
        force_rate, moment_rate = _inertia_without_accelerations(mechanism, motion)
        for row in range(size):
            for column in range(row, size):
                mass[row][column] += _mass_term(motion, linear, angular, row, column)
            forcing[row] -= force_rate.dot(linear[row]) + moment_rate.dot(angular[row])
    symmetric = [mass[min(r, c)][max(r, c)] for r in range(size) for c in range(size)]
    names = [printed_name(u) for u in speeds]
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


def _partial_velocities(
    motion: BodyMotion, speeds: tuple[Expr, ...], frame: ReferenceFrame
) -> tuple[list[Vector], list[Vector]]:
    return (
        [motion.velocity.diff(u, frame, var_in_dcm=False) for u in speeds],
        [motion.angular_velocity.diff(u, frame, var_in_dcm=False) for u in speeds],
    )


def _mass_term(
    motion: BodyMotion, linear: list[Vector], angular: list[Vector], row: int, column: int
) -> Expr:
    term = motion.mass * linear[row].dot(linear[column])
    if motion.inertia is not None:
        term += angular[row].dot(motion.inertia.dot(angular[column]))
    return term


def _inertia_without_accelerations(
    mechanism: Mechanism, motion: BodyMotion
) -> tuple[Vector, Vector]:
    """d(m v)/dt and dH/dt of a body where every u' is left out."""
    force_rate = _rate_at_constant_speeds(mechanism, motion.mass * motion.velocity)
    if motion.inertia is None:
        return force_rate, Vector(0)
    momentum = motion.inertia.dot(motion.angular_velocity)
    return force_rate, _rate_at_constant_speeds(mechanism, momentum)


def _rate_at_constant_speeds(mechanism: Mechanism, vector: Vector) -> Vector:
    time = dynamicsymbols._t
    no_accelerations = {u.diff(time): S.Zero for u in mechanism.u}
    return vector.dt(mechanism.frame).xreplace(no_accelerations).xreplace(mechanism.rates)


def _generalized_active_forces(mechanism: Mechanism) -> list[Expr]:
    forces = [S.Zero] * len(mechanism.u)
    for place, load in mechanism.loads:
        velocity = (
            place.ang_vel_in(mechanism.frame)
            if isinstance(place, ReferenceFrame)
            else place.vel(mechanism.frame)
        ).xreplace(mechanism.rates)
        for k, u in enumerate(mechanism.u):
            partial = velocity.diff(u, mechanism.frame, var_in_dcm=False)
            forces[k] += load.xreplace(mechanism.rates).dot(partial)
    return forces


def _kinematics(mechanism: Mechanism) -> list[Output]:
    names = [printed_name(q) for q in mechanism.q]
    return [
        Output(
            "coordinate_rates",
            "kinematic differential equations: rates of the coordinates",
            tuple(mechanism.kinematics),
            (len(names),),
            tuple(f"rate of {name}" for name in names),
        )
    ]


def _constraints(mechanism: Mechanism) -> list[Output]:
    configuration = mechanism.configuration_constraints
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
    return [
        Output("kinetic_energy", "T = sum of m v.v/2 + omega.I.omega/2", (kinetic,), (), ("T",)),
        Output("potential_energy", "V, of the loads that have one", (potential,), (), ("V",)),
    ]


def _kinetic_energy(motion: BodyMotion) -> Expr:
    energy = motion.mass * motion.velocity.dot(motion.velocity) / 2
    if motion.inertia is not None:
        spin = motion.angular_velocity
        energy += spin.dot(motion.inertia.dot(spin)) / 2
    return energy


def _momenta(mechanism: Mechanism, motions: list[BodyMotion]) -> list[Output]:
    linear, angular = [], []
    for motion in motions:
        momentum = motion.mass * motion.velocity
        arm = motion.masscentre.pos_from(mechanism.origin)
        about_origin = arm.cross(momentum)
        if motion.inertia is not None:
            about_origin += motion.inertia.dot(motion.angular_velocity)
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
    velocities = [p.vel(mechanism.frame).xreplace(mechanism.rates) for p in mechanism.points]
    frame = mechanism.frame
    return [
        _vectors("points", "positions of the named points", frame, names, positions),
        _vectors("point_velocities", "velocities of the named points", frame, names, velocities),
    ]


def _vectors(
    name: str, equation: str, frame: ReferenceFrame, of: list[str], vectors: list[Vector]
) -> Output:
    components = [vector.dot(axis) for vector in vectors for axis in (frame.x, frame.y, frame.z)]
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
