"""The outputs that every derivation has, from their elements: names, equations, shapes, labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sympy import Expr, S, Symbol

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.mechanism import Mechanism, printed_name
from mechc_codegen.description.request import OutputRequest

AXES = ("x", "y", "z")
V3 = tuple[Expr, Expr, Expr]


def array(name: str, equation: str, elements: Iterable[Expr], labels: Iterable[str]) -> Output:
    """An output with one axis."""
    values = tuple(elements)
    return Output(name, equation, values, (len(values),), tuple(labels))


def vectors(name: str, equation: str, of: Sequence[str], found: Iterable[V3]) -> Output:
    """Vectors in the inertial frame, each of a named thing."""
    labels = tuple(f"{what} along {axis}" for what in of for axis in AXES)
    return Output(name, equation, tuple(c for v in found for c in v), (len(of), 3), labels)


def equations_of_motion(
    mechanism: Mechanism, equation: str, mass: Iterable[Expr], forcing: Iterable[Expr]
) -> list[Output]:
    """M, by this equation, and F."""
    names = [printed_name(u) for u in mechanism.u]
    labels = tuple(f"M[{a}, {b}]" for a in names for b in names)
    active = "F = generalized active forces less inertia forces free of accelerations"
    return [
        Output("mass_matrix", equation, tuple(mass), (len(names),) * 2, labels),
        array("forcing", active, forcing, (f"F[{a}]" for a in names)),
    ]


def coordinate_rates(mechanism: Mechanism, rates: Iterable[Expr]) -> Output:
    """The rates of the coordinates and states."""
    labels = [f"rate of {printed_name(q)}" for q in (*mechanism.q, *mechanism.x)]
    equation = "kinematic differential equations: rates of the coordinates"
    return array("coordinate_rates", equation, rates, labels)


def kinematic_matrix(rates: Sequence[Expr], speeds: Sequence[Symbol], coordinates: int) -> Output:
    """N; displacements do not change the states, which come after so many ``coordinates``."""
    elements = tuple(
        rate.diff(u) if k < coordinates else S.Zero for k, rate in enumerate(rates) for u in speeds
    )
    shape = (len(rates), len(speeds))
    labels = tuple(f"N[{r}, {c}]" for r in range(shape[0]) for c in range(shape[1]))
    equation = "N: derivative of the coordinates' rates by the speeds"
    return Output("kinematic_matrix", equation, elements, shape, labels)


def constraints(elements: Iterable[Expr], names: Iterable[str]) -> Output:
    """The configuration constraints."""
    equation = "configuration constraints: the loop closes where these vanish"
    return array("constraints", equation, elements, names)


def rates_of_constraints(
    velocity: Iterable[Expr], gamma: Iterable[Expr], names: Sequence[str]
) -> tuple[Output, Output]:
    """The constraints on the speeds, and on their rates."""
    return (
        array("velocity_constraints", "J u + b = 0", velocity, names),
        array("gamma", "J u' = gamma", gamma, names),
    )


def velocity_bias(elements: Iterable[Expr], names: Iterable[str]) -> Output:
    """The velocity constraints at speeds of zero."""
    return array("velocity_bias", "b of J u + b = 0", elements, names)


def energies(mechanism: Mechanism, kinetic: Expr, potential: Expr) -> list[Output]:
    """The kinetic energy, and the potential energy where it is known."""
    equation = "T = sum of m v.v/2 + omega.I.omega/2"
    found = [Output("kinetic_energy", equation, (kinetic,), (), ("T",))]
    if not mechanism.unknown_potentials:
        equation = "V, of the loads that have one"
        found.append(Output("potential_energy", equation, (potential,), (), ("V",)))
    return found


def momenta(mechanism: Mechanism, linear: Iterable[V3], angular: Iterable[V3]) -> list[Output]:
    """Linear and angular momentum of each body."""
    names, about = [body.name for body in mechanism.bodies], "of each body, about the origin"
    return [
        vectors("linear_momenta", "m v of each body", names, linear),
        vectors("angular_momenta", f"r x m v + I . omega {about}", names, angular),
    ]


def points(mechanism: Mechanism, positions: Iterable[V3], velocities: Iterable[V3]) -> list[Output]:
    """Positions and velocities of the named points."""
    names = [point.name for point in mechanism.points]
    return [
        vectors("points", "positions of the named points", names, positions),
        vectors("point_velocities", "velocities of the named points", names, velocities),
    ]


def point_accelerations(mechanism: Mechanism, found: Iterable[V3]) -> Output:
    """Accelerations of the named points."""
    names = [point.name for point in mechanism.points]
    return vectors("point_accelerations", "accelerations of the named points", names, found)


def preference(value: Expr) -> Output:
    """The expression that decides among several assemblies."""
    equation = "of several assemblies the one where this is largest is taken"
    return Output("preference", equation, (value,), (), ("preference",))


def constraint_gradient(rows: Sequence[Sequence[Expr]], names: Iterable[str]) -> Output:
    """The derivatives of the configuration constraints by the coordinates, a row each."""
    width = len(rows[0]) if rows else 0
    labels = tuple(f"d({name})/dq{k}" for name in names for k in range(width))
    equation = "derivative of the configuration constraints by the coordinates"
    elements = tuple(entry for row in rows for entry in row)
    return Output("constraint_gradient", equation, elements, (len(rows), width), labels)


def cut_directions(mechanism: Mechanism, cosines: Iterable[Expr]) -> Output:
    """The output that tells configurations of cut joints from those with axes turned by half."""
    axes = mechanism.aligned_axes
    equation = "1 where an axis that a cut joint holds points the right way, 0 or -1 elsewhere"
    labels = (f"{name}: {one} along {other}" for name, one, other in axes)
    return array("cut_directions", equation, cosines, labels)


def user_outputs(request: OutputRequest, reactions: Mapping[Expr, Expr]) -> list[Output]:
    """The user-defined outputs, with the values of the reactions in them."""
    return [
        Output(name, "user-defined output", (expression.xreplace(reactions),), (), (name,))
        for name, expression in request.expressions.items()
    ]
