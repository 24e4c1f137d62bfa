"""Promises of pictures on demand: the points of models of the literature where SymPy has them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mechc_codegen.description.placement import reachable
from sympy import Float
from sympy.physics.mechanics import dynamicsymbols

from mechc.compilation.picture import described_picture
from mechc.compilation.request import read_compilable
from tests.validation.models.catalogue import MODELS

# Model -> labels of its links with how many points they join, and the ground.
DRAWN = {
    "furuta_pendulum": ([("arm", 2), ("rod", 2)], ["O"]),
    "five_link_walker": ([(f"B{k}", 2) for k in range(1, 6)], ["O"]),
    "falling_cat": ([("front", 2), ("back", 2)], []),
    "links_on_a_cart": ([(f"Pa{k}", 2) for k in range(1, 5)], []),
    "watt_six_bar": (
        [("link1", 2), ("link2", 2), ("link3", 3), ("link4", 2), ("link5", 2)],
        ["O", "O2", "O3"],
    ),
    "quadrotor_by_quaternions": ([("drone", 1)], []),
}


@pytest.mark.filterwarnings("ignore::mechc.UnusedValueWarning")
@pytest.mark.parametrize("name", DRAWN)
def test_points_are_where_sympy_places_them(name: str) -> None:
    script = MODELS[name].derive()
    request, _ = read_compilable(script.method, None, None, **script.further)
    mechanism, requested = request.description()
    parameters = tuple(p.symbol.name for p in mechanism.parameters)
    system: Any = SimpleNamespace(parameters=parameters)
    picture = described_picture(system, lambda: (mechanism, requested))
    links, ground = DRAWN[name]
    assert [(label, len(line)) for label, line in picture.skeleton] == links
    assert list(picture.ground) == ground

    draw = np.random.default_rng(5)
    q = draw.uniform(0.3, 0.9, size=len(mechanism.q))
    y, p = np.concatenate([q, np.zeros(len(mechanism.u))]), draw.uniform(0.5, 1.5, len(parameters))
    values = dict(zip((*mechanism.q, dynamicsymbols._t), map(Float, (*q, 0.4)), strict=True))
    values |= {x.symbol: Float(v) for x, v in zip(mechanism.parameters, p, strict=True)}
    got = picture.points(y, p, 0.4)
    known = {point.name: point for point in reachable([mechanism.origin])}
    for point, place in zip(picture.point_names, got, strict=True):
        way = known[point].pos_from(mechanism.origin).to_matrix(mechanism.frame)
        expected = np.array(way.xreplace(values).evalf(30), dtype=float).ravel()
        np.testing.assert_allclose(place, expected, rtol=0, atol=1e-13)
