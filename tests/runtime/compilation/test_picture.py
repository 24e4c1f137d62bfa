"""Promises of pictures on demand: the points of models of the literature where SymPy has them,
and muscles around surfaces against closed forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mechc_codegen.description.drawing import Drawing, Muscle, Wrap
from mechc_codegen.description.placement import reachable
from mechc_codegen.drawing.plan import ARC
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Float, Symbol, cos, sin
from sympy.physics.mechanics import PinJoint, Point, RigidBody, dynamicsymbols

from mechc.compilation.picture import described_picture
from mechc.compilation.request import read_compilable
from tests.support.actuators import q, r, u
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


def path_of(wrap: Any, height: float, angle: float) -> np.ndarray[Any, Any]:
    """The points of a muscle from (r, 0, 0) to the angle q and a height above, at one state."""
    ground, rod = RigidBody("ground"), RigidBody("rod", mass=Symbol("m"))
    pin = PinJoint("pin", ground, rod, q, u, child_point=-Symbol("l") * rod.x, joint_axis=ground.z)
    start = ground.masscenter.locatenew("start", r * ground.x)
    end = Point("end")
    end.set_pos(ground.masscenter, r * (cos(q) * ground.x + sin(q) * ground.y) + height * ground.z)
    muscle = Muscle("m", (start, wrap(ground.masscenter, ground), end), 1)  # type: ignore[arg-type]
    arm = from_joints("arm", [pin], ground=ground, loads=[], drawing=Drawing(muscles=(muscle,)))
    described = lambda: (arm, SimpleNamespace(fixed={}))  # noqa: E731
    drawn: Any = SimpleNamespace(parameters=("m", "l", "r"))
    picture = described_picture(drawn, described, Drawing(links=(("path", ("start", "end")),)))
    y = np.array([[0.5, 0.0], [angle, 0.0]])
    points = picture.points(y, np.array([1.0, 0.4, 2.0]), 0.0)
    (strut,) = picture.struts
    assert (strut.kind, len(strut.points)) == ("muscle", ARC + 1)
    return points[1, [list(picture.point_names).index(name) for name in strut.points]]


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0, 4.0, 6.0])
@pytest.mark.parametrize("height", [0.0, 0.7])
def test_around_a_cylinder_a_path_is_a_helix(angle: float, height: float) -> None:
    """By the right-hand rule about the axis, beyond half a turn too, as SymPy's length is."""
    found = path_of(lambda centre, ground: Wrap(centre, 3 * ground.frame.z), height, angle)
    share = np.linspace(0.0, 1.0, ARC + 1)
    helix = [2 * np.cos(share * angle), 2 * np.sin(share * angle), share * height]
    np.testing.assert_allclose(found, np.stack(helix, axis=-1), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0, 4.0, 6.0])
def test_on_a_sphere_a_path_is_the_short_part_of_a_great_circle(angle: float) -> None:
    found = path_of(lambda centre, ground: Wrap(centre), 0.0, angle)
    short = (angle + np.pi) % (2 * np.pi) - np.pi
    share = np.linspace(0.0, 1.0, ARC + 1)
    circle = [2 * np.cos(share * short), 2 * np.sin(share * short), 0 * share]
    np.testing.assert_allclose(found, np.stack(circle, axis=-1), atol=1e-12)
