"""Cut joints hold directions, not their opposites: turned configurations are none.

Judged by an Oldham coupling, whose shafts turn by the same angle, and by a wrist, which reaches an
attitude in two ways.
"""

from dataclasses import replace

import numpy as np
import pytest
from mechc_codegen.errors import MechanismError
from sympy import Symbol
from sympy.physics.mechanics import (
    PinJoint,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

APART = 0.05  # of the shafts, m
EULER = (0.3, 0.7, -0.4)


def bodies(*names):
    found = [RigidBody(name) for name in names]
    for k, body in enumerate(found):
        body.mass, body.central_inertia = 1 + k, inertia(body.frame, 1, 2, 3 + k)
    return found


@pytest.fixture(scope="module")
def oldham():
    """Two shafts about parallel axes; a disc between them slides in a slot of each."""
    ground, (driver, driven, disc) = RigidBody("ground"), bodies("driver", "driven", "disc")
    about = {"joint_axis": ground.z}
    joints = [
        PinJoint("in", ground, driver, *dynamicsymbols("a omega"), **about),
        PinJoint(
            "out", ground, driven, *dynamicsymbols("b v"), Symbol("d") * ground.x, **about
        ),
        PrismaticJoint("slot", driver, disc, *dynamicsymbols("s w"), joint_axis=driver.x),
        mechc.Cut.prismatic("cross slot", driven, disc, joint_axis=driven.y),
    ]  # fmt: skip
    return mechc.compile(mechc.from_joints("oldham", joints, parameters={"d": APART}))


def in_step(angles):
    """The coordinates in closed form: the shafts turn alike, the disc moves on a circle."""
    return np.column_stack([angles, angles, APART * np.cos(angles)])


ANGLES = np.linspace(-3.0, 3.0, 13)


def test_the_shafts_of_an_oldham_coupling_turn_alike(oldham):
    """Without a guess, from one, in all assemblies, in a batch, in a sweep."""
    expected = in_step(ANGLES)
    alone = [oldham.assemble({"a": angle}) for angle in ANGLES]
    np.testing.assert_allclose(np.array(alone)[:, :3], expected, rtol=0, atol=1e-12)
    half_away = oldham.assemble({"a": 0.4}, guess={"b": 0.4 - np.pi, "s": 0.0})
    turn = np.round((half_away[1] - 0.4) / (2 * np.pi)) * 2 * np.pi
    np.testing.assert_allclose(half_away[:3] - [0, turn, 0], in_step([0.4])[0], atol=1e-12)
    (only,) = oldham.assemblies({"a": 0.4})
    np.testing.assert_allclose(only[:3], in_step([0.4])[0], rtol=0, atol=1e-12)
    batch = oldham.simulate_batch(0.01, mechc.Assembly({"a": ANGLES}, {"omega": 1.0}))
    np.testing.assert_allclose(batch["y0"][:, :3], expected, rtol=0, atol=1e-12)
    assert batch.counts == {"finished": len(ANGLES)}
    sweep = oldham.sweep_positions("a", ANGLES)
    np.testing.assert_allclose(sweep.q, expected, rtol=0, atol=1e-9)


def test_a_turned_start_is_refused_in_words(oldham):
    turned = np.array([0.4, 0.4 - np.pi, APART * np.cos(0.4), 0.0, 0.0, 0.0])
    assert np.abs(oldham.constraints(turned)).max() < 1e-15
    told = "the joint cross slot turned: disc_frame.x of its child points against driven_frame.x"
    with pytest.raises(mechc.AssemblyError, match=f"y0 leaves the loops closed with {told}"):
        oldham.simulate(0.01, turned)
    names = dict(zip(oldham.coordinates, turned, strict=False))
    with pytest.raises(mechc.AssemblyError, match=f"coordinates given leave .* {told}"):
        oldham.assemble(names)
    shafts = {name: names[name] for name in ("a", "b")}
    with pytest.raises(mechc.AssemblyError, match=f"no configuration was found at .* {told}"):
        oldham.assemble(shafts)
    right = np.append(in_step([0.4])[0], [0.0, 0.0, 0.0])
    batch = oldham.simulate_batch(0.01, np.array([right, turned]))
    assert batch.counts == {"finished": 1, "open at the start": 1}
    assert oldham.simulate_batch(0.01, right).ok.all()


def test_no_equilibrium_is_turned(oldham):
    """Every attitude is one, as no load acts: what is found obeys the coupling."""
    found = np.array([each.y for each in oldham.equilibria()])
    np.testing.assert_allclose(np.cos(found[:, 0] - found[:, 1]), 1.0, rtol=0, atol=1e-12)


def wrist():
    """Pins about z, y and z, all through one point, and the weld of the hand to an attitude."""
    ground, (one, two, hand) = RigidBody("ground"), bodies("one", "two", "hand")
    mount = ReferenceFrame("mount")
    mount.orient_body_fixed(ground.frame, EULER, "XYZ")
    pins = [
        PinJoint("first", ground, one, *dynamicsymbols("a u"), joint_axis=ground.z),
        PinJoint("second", one, two, *dynamicsymbols("b v"), joint_axis=one.y),
        PinJoint("third", two, hand, *dynamicsymbols("c w"), joint_axis=two.z),
    ]
    place = {"parent_point": ground.masscenter, "parent_interframe": mount}
    return ground, pins, mechc.Cut.weld("grip", ground, hand, **place), hand


def test_a_welded_wrist_has_two_assemblies():
    """(a, b, c) and (a + pi, -b, c + pi); perpendicular axes alone have sixteen: three half turns
    and four turns of 120 degrees besides, to each of which the wrist has two ways."""
    ground, pins, grip, hand = wrist()
    model = mechc.compile(mechc.from_joints("wrist", [*pins, grip], ground=ground))
    found = model.assemblies({})[:, :3]
    z_y_z = ground.frame.dcm(hand.frame)
    for angles in found:
        values = dict(zip((q for pin in pins for q in pin.coordinates), angles, strict=True))
        turn = np.array(z_y_z.subs(values), float)
        x, y, z = (np.array(m, float) for m in rotations(*EULER))
        np.testing.assert_allclose(turn, x @ y @ z, rtol=0, atol=1e-12)
    assert len(found) == 2
    loose = mechc.from_joints("loose", [*pins, replace(grip, aligned=())], ground=ground)
    assert len(mechc.compile(loose).assemblies({})) == 16


def rotations(a, b, c):
    """About x, y and z."""
    return (
        [[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]],
        [[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]],
        [[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]],
    )


def test_an_axis_that_always_points_against_its_other_is_refused():
    ground, (crank,) = RigidBody("ground"), bodies("crank")
    pin = PinJoint("axle", ground, crank, *dynamicsymbols("a u"), joint_axis=ground.z)
    over = ReferenceFrame("over")
    over.orient_axis(crank.frame, crank.x, np.pi)
    place = {"parent_point": ground.masscenter, "child_interframe": over}
    cut = mechc.Cut.pin("second axle", ground, crank, **place, joint_axis=ground.z)
    with pytest.raises(MechanismError, match=r"second axle: over\.z .* against .* every conf"):
        mechc.from_joints("door", [pin, cut], ground=ground)
