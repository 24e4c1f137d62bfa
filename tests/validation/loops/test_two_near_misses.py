"""One crank drives two four-bars past near misses, against motion along the tangent of the closure.

Without gravity the kinetic energy is constant: q' is along the null vector of the closure's
Jacobian, whose components are its minors, as long as the energy says.  There are no accelerations
and no multipliers in it.
"""

import numpy as np
import pytest
import sympy as sm
from scipy.integrate import solve_ivp
from sympy.physics import mechanics as me

import mechc

pytestmark = pytest.mark.slow  # the references take most of the time
T = 3.0  # s
TIME = me.dynamicsymbols._t
LOOPS = ((0, 1, 2), (0, 3, 4))  # angles of crank, coupler and rocker
MASSES = (1.0, 0.8, 1.7)  # kg, of the crank's end, of the first loop's links, of the second's


def masses(length):
    """Each particle: its mass, and the arms (angle, length) that lead to it."""
    crank = (0, length[0])
    return [
        (MASSES[0], [crank]),
        (MASSES[1], [crank, (1, length[1] / 2)]),
        (MASSES[1], [(2, length[2] / 2)]),
        (MASSES[2], [crank, (3, length[3] / 2)]),
        (MASSES[2], [(4, length[4] / 2)]),
    ]


@pytest.fixture(scope="module")
def model():
    """Both ground links lie along x."""
    q, u = me.dynamicsymbols("q:5"), me.dynamicsymbols("u:5")
    length = sm.symbols("l:7")
    frame, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    rates = dict(zip([x.diff(TIME) for x in q], u, strict=True))

    def along(arms):
        return sum(
            (r * (sm.cos(q[j]) * frame.x + sm.sin(q[j]) * frame.y) for j, r in arms), me.Vector(0)
        )

    bodies = []
    for number, (mass, arms) in enumerate(masses(length)):
        point = origin.locatenew(f"P{number}", along(arms))
        point.set_vel(frame, along(arms).dt(frame).subs(rates))
        bodies.append(me.Particle(f"particle_{number}", point, mass))
    ends = [along([(j, length[j]) for j in loop]) for loop in LOOPS]
    gaps = [
        (end - ground * frame.x).dot(axis)
        for end, ground in zip(ends, length[5:], strict=True)
        for axis in (frame.x, frame.y)
    ]
    kane = me.KanesMethod(
        frame, q_ind=q[:1], u_ind=u[:1], q_dependent=q[1:], u_dependent=u[1:],
        kd_eqs=[speed - rate for rate, speed in rates.items()], configuration_constraints=gaps,
        velocity_constraints=[gap.diff(TIME).subs(rates) for gap in gaps],
    )  # fmt: skip
    kane.kanes_equations(bodies, [])
    return mechc.compile(kane)


def along_the_tangent(length, y0):
    """The end of the motion."""

    def jacobian(q):
        rows = np.zeros((4, 5))
        for k, loop in enumerate(LOOPS):
            for j in loop:
                rows[2 * k : 2 * k + 2, j] = length[j] * np.array([-np.sin(q[j]), np.cos(q[j])])
        return rows

    def twice_kinetic(q, u):
        turned = np.array([-np.sin(q), np.cos(q)]) * u
        return sum(
            mass * np.sum(sum(r * turned[:, j] for j, r in arms) ** 2)
            for mass, arms in masses(length)
        )

    def null_vector(q):
        rows = jacobian(q)
        return np.array([(-1) ** i * np.linalg.det(np.delete(rows, i, 1)) for i in range(5)])

    q0, u0 = y0[:5], y0[5:]
    energy, way = twice_kinetic(q0, u0), np.sign(null_vector(q0) @ u0)

    def rates(t, q):
        along = way * null_vector(q)
        return along * np.sqrt(energy / twice_kinetic(q, along))

    return solve_ivp(rates, (0.0, T), q0, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def drawn(model, seed):
    """Lengths whose gaps are 1e-6 to 1e-3 of the ground links, and a start."""
    draw = np.random.default_rng(seed)
    while True:
        crank, links = draw.uniform(0.5, 1.5), draw.uniform(1.0, 3.0, 4)
        grounds = links[::2] + links[1::2] - crank
        missed = 1.0 + draw.choice([-1, 1], 2) * 10.0 ** draw.uniform(-6, -3, 2)
        length = np.array([crank, *links, *grounds * missed])
        angle, speed = draw.uniform(-3.0, 3.0), draw.choice([-3.0, 3.0])
        params = {f"l{i}": value for i, value in enumerate(length)}
        if (grounds < 0.3).any():
            continue
        try:
            return length, params, model.assemble({"q0": angle}, {"u0": speed}, params=params)
        except mechc.MechcError:  # the loops do not reach so far
            continue


@pytest.mark.parametrize("seed", range(8))
def test_the_motion_is_the_one_along_the_tangent(model, seed):
    length, params, y0 = drawn(model, seed)
    exact = along_the_tangent(length, y0)
    for method in ("gauss8", "dop853"):
        sol = model.simulate(T, y0, params, rtol=1e-9, method=method)
        assert sol.status.ok
        np.testing.assert_allclose(sol.q[-1], exact, rtol=0, atol=1e-6 * np.abs(exact).max())
