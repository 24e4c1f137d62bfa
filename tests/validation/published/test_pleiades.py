"""Seven stars in a plane: PLEI of the IVP Test Set, by Hairer, Norsett & Wanner (1993), II.10."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

STARS = 7
START = [3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4,
         0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0]  # fmt: skip
# Mazzia & Magherini, Test Set for IVP Solvers 2.4 (2008): x, y and their rates at t = 3
PUBLISHED = [
    0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310,
    0.3425581707156584, 1.562172101400631, -0.7003092922212495, -3.943437585517392,
    -3.271380973972550, 5.225081843456543, -2.590612434977470, 1.198213693392275,
    -0.2429682344935824, 1.091449240428980, 3.417003806314313, 1.354584501625501,
    -2.590065597810775, 2.025053734714242, -1.155815100160448, -0.8072988170223021,
    0.5952396354208710, -3.741244961234010, 0.3773459685750630, 0.9386858869551073,
    0.3667922227200571, -0.3474046353808490, 2.344915448180937, -1.947020434263292,
]  # fmt: skip


@pytest.fixture(scope="module")
def stars():
    q, u = (dynamicsymbols(f"{name}_0:{2 * STARS}") for name in "qu")
    sky, fixed = ReferenceFrame("N"), Point("O")
    fixed.set_vel(sky, 0)
    points = []
    for k in range(STARS):
        points.append(fixed.locatenew(f"P_{k}", q[k] * sky.x + q[STARS + k] * sky.y))
        points[k].set_vel(sky, u[k] * sky.x + u[STARS + k] * sky.y)
    loads = []
    for i, star in enumerate(points):
        for j, other in enumerate(points):
            if i != j:
                way = other.pos_from(star)
                loads.append((star, (i + 1) * (j + 1) / way.magnitude() ** 3 * way))
    kane = KanesMethod(sky, q, u, [a.diff() - b for a, b in zip(q, u, strict=True)])
    bodies = [Particle(f"star_{k}", each, sm.Integer(k + 1)) for k, each in enumerate(points)]
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "error"), [("auto", 5e-13), ("dop853", 1e-11), ("radau5", 1e-9)]
)
def test_seven_stars_end_where_the_test_set_says(stars, method, error):
    rtol = 1e-9 if method == "radau5" else 1e-12
    sol = stars.simulate(3.0, START, method=method, rtol=rtol)
    np.testing.assert_allclose(sol.y[-1], PUBLISHED, rtol=0, atol=error)
