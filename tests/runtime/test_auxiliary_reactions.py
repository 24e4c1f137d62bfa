"""Forces that keep auxiliary speeds zero: those of SymPy's own auxiliary equations."""

from __future__ import annotations

import numpy as np
import pytest
import sympy.physics.mechanics as me
from sympy import Matrix, Symbol, sin, symbols

import mechc

t = me.dynamicsymbols._t
g, m, r = symbols("g m r")


def pendulum():
    """A simple pendulum whose bob may leave its circle along the string, by an auxiliary speed."""
    q, u, ua = me.dynamicsymbols("q u u_a")
    N, pivot, T = me.ReferenceFrame("N"), me.Point("O"), Symbol("T")
    A = N.orientnew("A", "Axis", (q, N.z))
    A.set_ang_vel(N, u * N.z)
    pivot.set_vel(N, 0)
    bob = pivot.locatenew("B", -r * A.y)
    bob.set_vel(N, r * u * A.x + ua * A.y)
    kane = me.KanesMethod(N, [q], [u], [q.diff(t) - u], u_auxiliary=[ua])
    kane.kanes_equations([me.Particle("bob", bob, m)], [(bob, -m * g * N.y + T * A.y)])
    return kane, T


def rolling_disc(forces):
    """All six speeds of a disc, three of them dependent, and the forces at its contact."""
    q, u = me.dynamicsymbols("q_1:4"), me.dynamicsymbols("u_1:7")
    contact_speeds = me.dynamicsymbols("a_1:4")
    height, rates = me.dynamicsymbols("h"), [x.diff(t) for x in q]
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q[0], N.z])
    B = A.orientnew("B", "Axis", [q[1], A.x])
    C = B.orientnew("C", "Axis", [q[2], B.y])
    C.set_ang_vel(N, u[0] * B.x + u[1] * B.y + u[2] * B.z)
    P = me.Point("P")
    P.set_vel(N, sum((a * axis for a, axis in zip(contact_speeds, A, strict=True)), 0 * A.x))
    centre = P.locatenew("C", height * A.z + r * sin(q[1]) * A.y)
    centre.set_vel(N, u[3] * A.x + u[4] * A.y + u[5] * A.z)
    turning = rates[0] * A.z + rates[1] * B.x + rates[2] * B.y
    rising = centre.pos_from(P).diff(t, A) + A.ang_vel_in(N).cross(centre.pos_from(P))
    kinematic = [(turning - C.ang_vel_in(N)).dot(axis) for axis in B]
    kinematic.append((rising - centre.vel(N)).dot(A.z))
    slip = centre.vel(N) - (P.vel(N) + C.ang_vel_in(N).cross(centre.pos_from(P)))
    kane = me.KanesMethod(
        N, q, u[:3], kinematic,
        q_dependent=[height], configuration_constraints=[-r * B.z.dot(A.z) - height],
        u_dependent=u[3:], velocity_constraints=[slip.dot(axis) for axis in A],
        u_auxiliary=contact_speeds,
    )  # fmt: skip
    disc = me.RigidBody(
        "disc", centre, C, m, (me.inertia(B, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4), centre)
    )
    push = sum((f * axis for f, axis in zip(forces, A, strict=True)), 0 * A.x)
    kane.kanes_equations([disc], [(centre, m * g * A.z), (P, push)])
    return kane


def of_sympy(kane, forces, model, y):
    """The reactions at a state by SymPy's auxiliary equations, with the accelerations of mechc."""
    numbers = {**model.defaults}
    states = dict(zip([*kane.q, *kane.u], y, strict=True))
    equations = Matrix(kane.auxiliary_eqs)
    rates = model.rhs(0.0, y)
    nq = len(kane.q)
    values = {x.diff(t): rate for x, rate in zip([*kane.q, *kane.u], rates, strict=True)}
    values |= {x.diff(t): 0 for x in kane._uaux}
    plain = equations.xreplace(values).xreplace(dict.fromkeys(kane._uaux, 0)).xreplace(states)
    plain = plain.xreplace({Symbol(name): x for name, x in numbers.items()})
    matrix = np.array(plain.jacobian(forces), dtype=float)
    rest = np.array(plain.xreplace(dict.fromkeys(forces, 0)), dtype=float)[:, 0]
    assert nq + len(kane.u) == len(y)
    return np.linalg.solve(matrix, -rest)


def test_the_tension_of_a_pendulum_is_that_of_its_circle():
    kane, T = pendulum()
    model = mechc.compile(
        kane, reactions=T, outputs={"twice": 2 * T}, defaults={m: 2.0, g: 9.81, r: 0.7},
    )  # fmt: skip
    assert set(model.parameters) == {"m", "g", "r"}
    for q, u in ((0.4, 1.3), (2.0, -0.2), (np.pi / 2, 3.0)):
        tension = 2.0 * (9.81 * np.cos(q) + 0.7 * u**2)
        assert model.output("T", [q, u]) == pytest.approx(tension, rel=1e-14)
        assert model.output("twice", [q, u]) == pytest.approx(2 * tension, rel=1e-14)


def test_the_contact_forces_of_a_rolling_disc_are_sympys():
    """The constraints contain the auxiliary speeds, and the normal force keeps a configuration."""
    forces = symbols("F_x F_y F_z")
    kane = rolling_disc(forces)
    model = mechc.compile(
        kane, reactions=forces, outputs={"contact": list(forces)},
        defaults={m: 3.0, g: 9.81, r: 0.4},
    )  # fmt: skip
    for lean, speeds in ((0.3, (0.1, 4.0, 0.6)), (-0.7, (-1.0, 2.0, -0.3))):
        y = model.assemble(
            {"q_1": 0.2, "q_2": lean, "q_3": 0.5},
            dict(zip(("u_1", "u_2", "u_3"), speeds, strict=True)),
            guess={"h": -0.4},
        )
        expected = of_sympy(kane, forces, model, y)
        assert model.output("contact", y) == pytest.approx(expected, rel=1e-10)
        assert expected[2] < 0  # the ground pushes up, along -A.z


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda T, q: T**2, "not linear in T"),
        (lambda T, q: T * 0, "there is no symbol 'T' here"),
    ],
)
def test_reactions_that_cannot_be_found_are_refused(change, match):
    kane, T = pendulum()
    kane._forcelist = [(p, v.xreplace({T: change(T, kane.q[0])})) for p, v in kane.loads]
    with pytest.raises(mechc.MechanismError, match=match):
        mechc.compile(kane, reactions=[T])


def test_a_force_that_moves_the_mechanism_is_no_reaction():
    kane, T = pendulum()
    bob, vector = kane.loads[0]
    kane._forcelist = [(bob, vector + T * kane._inertial.x)]
    with pytest.raises(mechc.MechanismError, match="acts on the motion"):
        mechc.compile(kane, reactions=["T"])


def test_reactions_need_auxiliary_speeds():
    q, u = me.dynamicsymbols("q u")
    N, P, F = me.ReferenceFrame("N"), me.Point("P"), Symbol("F")
    P.set_vel(N, u * N.x)
    kane = me.KanesMethod(N, [q], [u], [q.diff(t) - u])
    kane.kanes_equations([me.Particle("p", P, m)], [(P, F * N.x)])
    with pytest.raises(mechc.MechanismError, match="has no auxiliary speeds"):
        mechc.compile(kane, reactions=[F])
