"""A slider-crank with an elastic rod, a driven crank: CRANK of the IVP Test Set, of index 2."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import LagrangesMethod, ReferenceFrame, dynamicsymbols

import mechc

# Mazzia & Magherini, Test Set for IVP Solvers 2.4 (2008); Simeon (1996), Math. Modelling of
# Systems 2, 1-18: two sines across the rod, a parabola along it.
PI = 3.1415927  # as the problem has it
M_2, M_3, L_1, L_2, J_1, J_2 = 0.151104, 0.075552, 0.15, 0.30, 0.002727, 0.0045339259
STIFFNESS, WIDTH, HEIGHT, DENSITY, RATE = 2e11, 0.008, 0.008, 7870.0, 150.0
START = {"q_3": 0.103339863e-4, "q_4": 0.169327969e-4}
RATES = [0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5]
PLACES = [15.0, -0.3311734987910881, 0.1697373326718410, 1.893192460247178e-04,
          2.375751865617931e-05, -5.323907988763734e-06, -8.363283141616840e-06]  # fmt: skip
SPEEDS = [150.0, 60.25346682645789, -8.753116989887888, -0.03005536801092212,
          -0.005500488291932075, 4.978243404809343e-04, 1.104933470696396e-03]  # fmt: skip


def elastic_rod() -> LagrangesMethod:
    phi_1, phi_2, x_3 = dynamicsymbols("phi_1 phi_2 x_3")
    q = sm.Matrix(dynamicsymbols("q_1:5"))
    w_1, w_2, dq = phi_1.diff(), phi_2.diff(), q.diff(dynamicsymbols._t)
    c, s = sm.cos(phi_1 - phi_2), sm.sin(phi_1 - phi_2)
    area = WIDTH * HEIGHT
    volume = area * L_2
    mass = (
        DENSITY * volume * sm.Matrix([[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 8, 1], [0, 0, 1, 2]])
    )
    bending = PI**4 / 24 * (HEIGHT / L_2) ** 2
    stiffness = STIFFNESS * area / L_2 * sm.Matrix(
        [[bending, 0, 0, 0], [0, 16 * bending, 0, 0], [0, 0, 16 / 3, -8 / 3], [0, 0, -8 / 3, 7 / 3]]
    )  # fmt: skip
    across = volume * sm.Matrix([2 / PI, 0, 0, 0])
    along = volume * sm.Matrix([0, 0, 2 / 3, 1 / 6])
    stretching = volume * L_2 * sm.Matrix([0, 0, 1 / 3, 1 / 6])
    turning = volume * L_2 * sm.Matrix([1 / PI, -0.5 / PI, 0, 0])
    mixed = sm.zeros(4)
    mixed[0, 2], mixed[0, 3], mixed[1, 3] = -16 / PI**3, 8 / PI**3 - 1 / PI, 0.5 / PI
    mixed = volume * (mixed - mixed.T)
    kinetic = (
        (J_1 + M_2 * L_1**2) * w_1**2 / 2
        + (J_2 + q.dot(mass * q) + 2 * DENSITY * stretching.dot(q)) * w_2**2 / 2
        + L_1 * (L_2 * M_2 * c / 2 + DENSITY * (s * across + c * along).dot(q)) * w_1 * w_2
        + DENSITY * L_1 * w_1 * (c * across - s * along).dot(dq)
        + DENSITY * w_2 * (turning + mixed.T * q).dot(dq)
        + dq.dot(mass * dq) / 2
        + M_3 * x_3.diff() ** 2 / 2
    )
    rod = L_2 + q[3]
    closing = [
        L_1 * sm.sin(phi_1) + rod * sm.sin(phi_2),
        x_3 - L_1 * sm.cos(phi_1) - rod * sm.cos(phi_2),
        phi_1 - RATE * dynamicsymbols._t,
    ]
    lagrangian = kinetic - q.dot(stiffness * q) / 2
    method = LagrangesMethod(
        lagrangian, [phi_1, phi_2, x_3, *q], hol_coneqs=closing, frame=ReferenceFrame("N")
    )
    method.form_lagranges_equations()
    return method


@pytest.mark.thorough
def test_an_elastic_rod_ends_where_the_test_set_says():
    """Its fastest components swing with 6e4 rad/s; all methods agree better than with it."""
    model = mechc.compile(elastic_rod())
    start = model.assemble(
        {"phi_1": 0.0, "phi_2": 0.0, "q_1": 0.0, "q_2": 0.0, **START},
        dict(zip(model.speeds[3:], RATES, strict=True)),
    )
    ends = {}
    for method in ("auto", "dop853"):
        ends[method] = model.simulate(0.1, start, method=method, rtol=1e-11).y[-1]
        np.testing.assert_allclose(ends[method][:7], PLACES, rtol=0, atol=5e-11)
        np.testing.assert_allclose(ends[method][7:], SPEEDS, rtol=0, atol=1e-6)
    np.testing.assert_allclose(ends["auto"], ends["dop853"], rtol=0, atol=1e-8)
