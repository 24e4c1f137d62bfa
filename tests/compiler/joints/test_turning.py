"""Universal joints and screws against their closed forms."""

import numpy as np
import pytest
from sympy import symbols
from sympy.physics.mechanics import PinJoint, RigidBody, Torque, inertia

import mechc

I, MASS, G = 0.3, 1.5, 9.81
BEND = 0.5  # rad between the shafts


def shaft(name):
    body = RigidBody(name, mass=MASS)
    body.central_inertia = inertia(body.frame, 0.1, 0.1, I)
    return body


def bearing(name, ground, body, bend):
    """A pin whose axis is the body's z, leant by an angle about the ground's x."""
    frame = ground.frame.orientnew(f"{name}_frame", "Axis", (bend, ground.x))
    return PinJoint(
        name, ground, body, parent_interframe=frame, child_interframe=body.frame,
        joint_axis=frame.z,
    )  # fmt: skip


def cut_open():
    """Both shafts in bearings, and the cross a cut."""
    ground, one, two = RigidBody("ground"), shaft("one"), shaft("two")
    first, second = bearing("first", ground, one, 0), bearing("second", ground, two, BEND)
    cross = mechc.Cut.universal("cross", one, two)
    return ground, one, two, [first, second, cross]


def in_line():
    """The second shaft on the first by a universal joint, and its bearing a cut."""
    ground, one, two = RigidBody("ground"), shaft("one"), shaft("two")
    first = bearing("first", ground, one, 0)
    cross = mechc.UniversalJoint("cross", one, two)
    leant = ground.frame.orientnew("leant", "Axis", (BEND, ground.x))
    held = mechc.Cut.pin("second", ground, two, parent_interframe=leant, joint_axis=leant.z)
    return ground, one, two, [first, cross, held]


@pytest.fixture(scope="module", params=[cut_open, in_line])
def shafts(request):
    ground, one, two, joints = request.param()
    mechanism = mechc.from_joints(
        "shafts", joints, loads=[Torque(one, 2.0 * ground.z)], gravity=-G * ground.y
    )
    outputs = ("reactions", "momenta", {"spin": two.frame.ang_vel_in(ground.frame)})
    return mechc.compile(mechanism, outputs=outputs)


def test_a_universal_joint_turns_its_shafts_as_the_closed_form_says(shafts):
    """w_2 / w_1 = cos b / (1 - sin(b)^2 cos(a)^2), a from where the first axis is across both."""
    for angle in (0.0, 0.4, 1.3):
        y = shafts.assemble({"q_first": angle}, {"u_first": 3.0})
        spin = np.linalg.norm(shafts.output("spin", y))
        # the first axis of the cross, x of the first shaft, is across both shafts at angle 0
        ratio = np.cos(BEND) / (1 - np.sin(BEND) ** 2 * np.sin(angle) ** 2)
        assert spin == pytest.approx(3.0 * ratio, rel=1e-12)


def test_the_cross_carries_a_torque_across_its_axes(shafts):
    """T_1 along the first shaft and T_2 along the second are parts of one torque.

    Both bearings and the cross hold one point: which of them has the weight is not determined.
    """
    y = shafts.assemble({"q_first": 0.4}, {"u_first": 3.0})
    with pytest.warns(mechc.UndeterminedReactionWarning, match="first: force y"):
        _, torque = shafts.reactions(y)
    cross = torque[shafts.joint_names.index("cross")]
    first_axis = np.array([np.cos(0.4), np.sin(0.4), 0])
    along = np.array([0, -np.sin(BEND), np.cos(BEND)])
    second_axis = np.cross(first_axis, along)
    assert abs(cross @ first_axis) < 1e-12
    assert abs(cross @ second_axis) < 1e-12
    bent, sine = np.cos(BEND), np.sin(BEND) ** 2 * np.sin(0.4) ** 2
    ratio = bent / (1 - sine)
    slope = bent / (1 - sine) ** 2 * np.sin(BEND) ** 2 * np.sin(0.8)
    a = shafts.rhs(0.0, y)[len(shafts.coordinates) + shafts.speeds.index("u_first")]
    assert cross @ along == pytest.approx(I * (ratio * a + slope * 3.0**2), rel=1e-11)


def test_a_screw_falls_and_turns():
    """(I + m h^2) a = -m g h with h = lead / (2 pi), left-handed too, and T = -F h."""
    lead = symbols("lead")
    ground, nut = RigidBody("ground"), shaft("nut")
    screw = mechc.ScrewJoint("screw", ground, nut, lead, joint_axis=ground.z)
    mechanism = mechc.from_joints(
        "screw", [screw], gravity=-G * ground.z, parameters={"lead": 0.02}
    )
    model = mechc.compile(mechanism, outputs=("reactions", "points", "energy"))
    assert (model.coordinates, model.speeds) == (("q_screw",), ("u_screw",))
    assert model.quantities["q_screw"].unit == "rad"
    for way in (0.02, -0.5):
        p, h = {"lead": way}, way / (2 * np.pi)
        a = -MASS * G * h / (I + MASS * h**2)
        assert model.rhs(0.0, [0.3, 2.0], p)[1] == pytest.approx(a, rel=1e-13)
        force, torque = model.reactions([0.3, 2.0], p)
        assert force[0] == pytest.approx([0, 0, MASS * (G + h * a)], rel=1e-12, abs=1e-12)
        assert torque[0, 2] == pytest.approx(-force[0, 2] * h, rel=1e-12)
        assert model.points([0.3, 2.0], p)[-1, 2] == pytest.approx(0.3 * h, rel=1e-13)
