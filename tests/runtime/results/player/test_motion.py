"""The data of a motion, as every page has them: muscles with their activation."""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np
import pytest
from mechc_codegen.description.drawing import Drawing, Muscle
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Symbol
from sympy.physics.biomechanics import FirstOrderActivationDeGroote2016, MusculotendonDeGroote2016
from sympy.physics.mechanics import (
    LinearPathway,
    PinJoint,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from mechc.errors import MechcError
from mechc.results.animation import animate
from mechc.results.panels import THICKER, THIN
from mechc.results.view.page import view_data
from mechc.results.view.recorded import packed_view, unpacked_view
from tests.support.actuators import q, u
from tests.support.page_data import floats


@pytest.fixture(scope="module")
def lifted() -> mechc.Solution:
    """A muscle from a hook lifts a rod; another pulls with an activation that the run gives."""
    ground, rod = RigidBody("ground"), RigidBody("rod", mass=Symbol("m"))
    rod.central_inertia = inertia(rod.frame, 0, 0, Symbol("I"))
    pin = PinJoint("pin", ground, rod, q, u, child_point=-0.2 * rod.x, joint_axis=ground.z)
    hook, foot = (ground.masscenter.locatenew(n, s * ground.y) for n, s in (("h", 0.3), ("f", -1)))
    biceps = MusculotendonDeGroote2016.with_defaults(
        "biceps",
        LinearPathway(hook, rod.masscenter),
        FirstOrderActivationDeGroote2016.with_defaults("biceps"),
        peak_isometric_force=90,
        optimal_fiber_length=0.15,
        tendon_slack_length=0.2,
    )
    a = dynamicsymbols("a")
    other = Muscle("other", (foot, ground.masscenter, rod.masscenter), a)
    arm = from_joints(
        "arm",
        [pin],
        ground=ground,
        loads=[biceps, (rod.masscenter, -a * rod.y)],
        states=biceps,
        gravity=-9.81 * ground.y,
        drawing=Drawing(muscles=(other,)),
    )
    model = mechc.compile(arm, defaults={"m": 1.0, "I": 0.01}, outputs=())
    excitation = mechc.Signal([0.0, 0.1, 0.3], [0.1, 0.9, 0.9], "previous")
    given = {"e_biceps": excitation, "a": lambda t: 0.5 + t}
    return model.simulate(0.3, model.assemble({"q": -0.3, "a_biceps": 0.1}), inputs=given)


def activations(sol: mechc.Solution, t: Any) -> list[Any]:
    return [sol(t)[:, sol.model.state_index("a_biceps")], 0.5 + t]


@pytest.mark.slow
def test_pages_have_the_activation_in_every_frame(lifted: mechc.Solution) -> None:
    for data in (animate(lifted).data, view_data(lifted)):
        t = np.linspace(0.0, 0.3, data["frames"])
        struts = [strut for strut in data["struts"] if strut["kind"] == "muscle"]
        by_label = {strut["label"]: strut for strut in struts}
        names = [data["points"][k] for k in by_label["other"]["points"]]
        assert names == ["f", "ground_masscenter", "rod_masscenter"]
        for label, expected in zip(("biceps", "other"), activations(lifted, t), strict=True):
            found = floats(by_label[label]["activation"])
            np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7)


def test_a_plot_has_muscles_at_both_ends_as_thick_as_they_are_active(
    lifted: mechc.Solution,
) -> None:
    axes = lifted.plot().axes[0]
    widths = [line.get_linewidth() for line in axes.lines if line.get_zorder() == 2.4]
    first, last = (activations(lifted, np.array([t])) for t in (0.0, 0.3))
    expected = [end[k][0] for end_k in (0, 1) for k, end in ((end_k, first), (end_k, last))]
    np.testing.assert_allclose(sorted(widths), sorted(THIN + THICKER * np.array(expected)))
    assert "muscles, thick if active" in [x.get_text() for x in axes.get_legend().get_texts()]


def test_a_saved_picture_has_its_muscles_and_none_that_is_damaged(lifted: mechc.Solution) -> None:
    data = unpacked_view(packed_view(lifted))
    assert data["struts"] == json.loads(json.dumps(view_data(lifted)["struts"]))
    for damage in ({"activation": "AAAA"}, {"points": [10**6, 0]}, {"kind": "script"}):
        wrong = {**data, "struts": [{**data["struts"][0], **damage}]}
        with pytest.raises(MechcError, match="damaged: 'struts'"):
            unpacked_view(zlib.compress(json.dumps(wrong).encode()))
