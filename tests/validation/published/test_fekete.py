"""Twenty charges on a sphere until they rest: Fekete's problem of the IVP Test Set, of index 2."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc

RINGS = (  # points, latitude, longitude before the first, which point is the first
    (3, 3 * np.pi / 8, np.pi / 13, 1),
    (7, np.pi / 8, np.pi / 29, 1),
    (6, -2 * np.pi / 15, np.pi / 7, 1),
    (4, -3 * np.pi / 10, np.pi / 17, 0),
)
# Mazzia & Magherini, Test Set for IVP Solvers 2.4 (2008): x, y, z of each at t = 1000
PUBLISHED = [
    -0.4070263380333202, 0.3463758772791802, 0.8451942450030429, 0.07752934752521549,
    -0.2628662719972299, 0.9617122871829146, 0.7100577833343567, 0.1212948055586120,
    0.6936177005172217, 0.2348267744557627, 0.7449277976923311, 0.6244509285956391,
    -0.4341114738782885, 0.8785430442262876, 0.1992720444237660, -0.9515059600312596,
    0.2203508762787005, 0.2146669498274008, -0.6385191643609878, -0.4310833259390688,
    0.6375425027722121, -0.1464175087914336, -0.9380871635228862, 0.3139337298744690,
    0.5666974065069942, -0.6739221885076542, 0.4740073135462156, 0.9843259538440293,
    -0.1696995357819996, -0.04800504290609090, 0.1464175087914331, 0.9380871635228875,
    -0.3139337298744656, -0.7092757549979014, 0.5264062637139616, -0.4688542938854929,
    -0.8665731819284478, -0.4813878059756024, -0.1315929352982178, -0.2347897778700538,
    -0.8594340408013130, -0.4541441287957579, 0.5530976940074118, -0.7674370265615124,
    -0.3242273140037833, 0.7711050969896927, 0.6357041816577034, 0.03573685519777001,
    0.7103951209379591, 0.2403570431280519, -0.6614886725910596, -0.03038208738735660,
    0.4501923293640461, -0.8924145871442046, -0.5772996158107093, -0.1766763414971813,
    -0.7971892020969544, 0.2414481766969039, -0.3416456818373135, -0.9082846503446250,
]  # fmt: skip


@pytest.mark.thorough
def test_twenty_charges_rest_where_the_test_set_says():
    places = [sm.Matrix(dynamicsymbols(f"x_{k} y_{k} z_{k}")) for k in range(20)]
    rates = [sm.Matrix(dynamicsymbols(f"vx_{k} vy_{k} vz_{k}")) for k in range(20)]
    forces = []
    for i, place in enumerate(places):
        force = -rates[i] / 2
        for j, other in enumerate(places):
            if j != i:
                force += (place - other) / (place - other).dot(place - other)
        forces += list(force)
    charges = mechc.from_equations(
        [x for place in places for x in place],
        [v for rate in rates for v in rate],
        sm.eye(60),
        forces,
        constraints=[place.dot(place) - 1 for place in places],
    )
    start = []
    for count, latitude, longitude, first in RINGS:
        for k in range(first, first + count):
            angle = 2 * np.pi * k / count + longitude
            across = np.cos(latitude)
            start += [np.cos(angle) * across, np.sin(angle) * across, np.sin(latitude)]
    model = mechc.compile(charges)
    for rtol in (1e-9, 1e-12):
        sol = model.simulate(1000.0, [*start, *(60 * [0.0])], rtol=rtol)
        np.testing.assert_allclose(sol.y[-1, :60], PUBLISHED, rtol=0, atol=1e-11)
        assert abs(sol.y[-1, 60:]).max() < 1e-12
