"""Gears, belts, racks and cams against Newton's and Euler's equations written by hand."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, Torque, inertia

import mechc

I_1, I_2, TORQUE, MASS, G = 0.3, 0.7, 2.0, 1.5, 9.81
R_1, R_2 = 0.2, 0.5


def wheel(name, moment, mass=MASS):
    body = RigidBody(name, mass=mass)
    body.central_inertia = inertia(body.frame, 0, 0, moment)
    return body


def pins(distance, more=()):
    """(ground, wheels, pins) with their axes along z, the second at a distance along x."""
    ground, one, two = RigidBody("ground"), wheel("one", I_1), wheel("two", I_2)
    first = PinJoint("first", ground, one, joint_axis=ground.z)
    place = distance * ground.x
    second = PinJoint("second", ground, two, parent_point=place, joint_axis=ground.z)
    return ground, (one, two), (first, second)


def solved(joints, loads, **more):
    mechanism = mechc.from_joints("coupled", joints, loads=loads, **more)
    return mechc.compile(mechanism, outputs=("reactions", "multipliers"))


def of(model, y, joint):
    force, torque = model.reactions(y)
    at = model.joint_names.index(joint)
    return force[at], torque[at]


@pytest.mark.parametrize("internal", [False, True])
def test_two_gears(internal):
    """I_1 a_1 = T - r_1 F, I_2 a_2 = -+ r_2 F with a_2 = -+ a_1 r_1 / r_2."""
    sign = 1 if internal else -1
    ground, (one, _), (first, second) = pins(R_2 - R_1 if internal else R_1 + R_2)
    mesh = mechc.Coupling.gear("mesh", first, second, (R_1, R_2), internal=internal)
    model = solved([first, second, mesh], [Torque(one, TORQUE * ground.z)])
    y = model.assemble({"q_first": 0.3}, {"u_first": 2.0})
    assert y == pytest.approx([0.3, sign * 0.3 * R_1 / R_2, 2.0, sign * 2.0 * R_1 / R_2])
    a_1 = TORQUE / (I_1 + I_2 * (R_1 / R_2) ** 2)
    tooth = (TORQUE - I_1 * a_1) / R_1  # against the first's turning, down at its right
    assert model.rhs(0.0, y)[2:] == pytest.approx([a_1, sign * a_1 * R_1 / R_2], rel=1e-13)
    force, torque = of(model, y, "mesh")  # on the second
    up = (
        1 if not internal else -1
    )  # of an internal pair the pitch point is at the left of the first
    assert force == pytest.approx([0, up * tooth, 0], rel=1e-13, abs=1e-13)
    assert torque == pytest.approx(0, abs=1e-13)
    assert of(model, y, "second")[0] == pytest.approx(-force, abs=1e-13)
    assert of(model, y, "first")[0] == pytest.approx(force, abs=1e-13)


def planetary(ring_fixed):
    """Sun, arm and planet, and where the ring is fixed its mesh."""
    ground, sun, arm = RigidBody("ground"), wheel("sun", 0.1), wheel("arm", 0.2)
    planet = wheel("planet", 0.05)
    of_sun = PinJoint("of_sun", ground, sun, joint_axis=ground.z)
    of_arm = PinJoint("of_arm", ground, arm, joint_axis=-ground.z)  # against the others
    of_planet = PinJoint("of_planet", arm, planet, parent_point=0.5 * arm.x, joint_axis=arm.z)
    meshes = [mechc.Coupling.gear("inner", of_sun, of_planet, (30, 20), carrier=of_arm)]
    if ring_fixed:
        meshes.append(
            mechc.Coupling.gear("outer", ground, of_planet, (70, 20), internal=True, carrier=of_arm)
        )
    return solved([of_sun, of_arm, of_planet, *meshes], [Torque(sun, TORQUE * ground.z)])


def test_a_planetary_gear_obeys_williss_equation():
    """With the ring at rest the arm turns by 30 / (30 + 70) of the sun."""
    model = planetary(ring_fixed=True)
    y = model.assemble({"q_of_sun": 1.0}, {"u_of_sun": 1.0})
    arm = -0.3  # its axis points down
    assert y[:3] == pytest.approx([1.0, arm, -(1.0 - 0.3) * 30 / 20], rel=1e-13)
    # with all speeds per unit of the sun's: energy gives its inertia
    whole = 0.1 + 0.2 * 0.3**2 + 0.05 * (0.3 - 1.05) ** 2 + MASS * (0.5 * 0.3) ** 2
    assert model.rhs(0.0, y)[3] == pytest.approx(TORQUE / whole, rel=1e-13)


def test_reactions_of_a_planetary_gear_balance_each_body():
    """Of the planet, from its own acceleration; of the sun, from its torque."""
    model = planetary(ring_fixed=True)
    y = model.assemble({"q_of_sun": 0.0}, {"u_of_sun": 2.0})
    a = model.rhs(0.0, y)[3]
    inner, outer, pin = (of(model, y, n)[0] for n in ("inner", "outer", "of_planet"))
    # at angle 0 all centres are on x: teeth at 0.3 (radius of the sun) and at 0.7
    assert inner[1] * 0.3 == pytest.approx(TORQUE - 0.1 * a, rel=1e-12)
    assert 0.05 * (0.3 - 1.05) * a == pytest.approx(0.2 * (outer[1] - inner[1]), rel=1e-11)
    inward = MASS * 0.5 * (0.3 * 2.0) ** 2
    assert inner + outer + pin == pytest.approx([-inward, MASS * 0.15 * a, 0], abs=1e-12)


def test_rims_are_drawn_at_the_pitch_circles_about_their_wheels():
    """Of 30, 20 and 70 teeth, 0.5 m apart; wherever the arm is, neighbours touch."""
    model = planetary(ring_fixed=True)
    y = model.assemble({"q_of_sun": 2.0})
    picture = model.picture
    places = picture.points(y, np.zeros(0), 0.0)
    rims = {}
    for label, line in picture.skeleton:
        corners = [k for k, name in enumerate(picture.point_names) if name in line[1:]]
        if len(corners) > 20:
            hub = places[list(picture.point_names).index(line[0])]
            rims[label] = (hub, np.linalg.norm(places[corners] - hub, axis=-1))
            assert all(name.startswith(".") for name in line[1:])
    radii = {"sun": 0.3, "planet": 0.2, "ground": 0.7}
    for label, radius in radii.items():
        assert rims[label][1] == pytest.approx(radius, rel=1e-13)
    arm = -0.6  # down, by 30 / 100 of the sun's angle
    middle = 0.5 * np.array([np.cos(-arm), np.sin(-arm), 0])
    assert rims["planet"][0] == pytest.approx(middle, abs=1e-13)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt(crossed):
    """The two strands' difference turns both pulleys; their slope pulls at the bearings."""
    sign = -1 if crossed else 1
    ground, (one, _), (first, second) = pins(0.9)
    belt = mechc.Coupling.belt("belt", first, second, (R_1, R_2), crossed=crossed)
    model = solved([first, second, belt], [Torque(one, TORQUE * ground.z)])
    y = model.assemble({"q_first": 0.4}, {"u_first": 1.0})
    assert y[1] == pytest.approx(sign * 0.4 * R_1 / R_2)
    a_1 = TORQUE / (I_1 + I_2 * (R_1 / R_2) ** 2)
    assert model.rhs(0.0, y)[2:] == pytest.approx([a_1, sign * a_1 * R_1 / R_2], rel=1e-13)
    force, torque = of(model, y, "belt")
    strands = (TORQUE - I_1 * a_1) / R_1  # difference of tensions
    slope = (R_1 - sign * R_2) / 0.9  # sine of each strand's angle with the line of centres
    assert force == pytest.approx([0, strands * slope, 0], rel=1e-12, abs=1e-13)
    assert torque == pytest.approx([0, 0, sign * R_2 * strands], rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("reverse", [False, True])
def test_a_rack_and_pinion(reverse):
    """(I / r^2 + m) s'' = T / r - m g with the rack upright."""
    sign = -1 if reverse else 1
    ground, pinion, rack = RigidBody("ground"), wheel("pinion", I_1), wheel("rack", 0)
    pin = PinJoint("pin", ground, pinion, joint_axis=ground.z)
    slide = PrismaticJoint(
        "slide", ground, rack, parent_point=sign * R_1 * ground.x, joint_axis=ground.y
    )
    teeth = mechc.Coupling.rack_and_pinion("teeth", pin, slide, R_1, reverse=reverse)
    loads = [Torque(pinion, sign * TORQUE * ground.z)]
    model = solved([pin, slide, teeth], loads, gravity=-G * ground.y)
    y = model.assemble({"q_pin": 0.5 * sign}, {"u_pin": sign})
    assert y[1::2] == pytest.approx([0.5 * R_1, R_1], rel=1e-13)
    a = (TORQUE / R_1 - MASS * G) / (I_1 / R_1**2 + MASS)
    assert model.rhs(0.0, y)[2:] == pytest.approx([sign * a / R_1, a], rel=1e-13)
    force, _ = of(model, y, "teeth")
    assert force == pytest.approx([0, MASS * (a + G), 0], rel=1e-12, abs=1e-13)
    assert of(model, y, "slide")[0] == pytest.approx(0, abs=1e-12)
    torque = of(model, y, "slide")[1]  # the force acts at the teeth, the mass centre is there too
    assert torque == pytest.approx(0, abs=1e-12)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("shape", ["roller", "flat"])
def test_a_cam(shape):
    """m s'' = N - m g and I phi'' = -N s' with s = f(phi); the guide takes the contact's rest."""
    ground, disc, follower = RigidBody("ground"), wheel("disc", I_1), wheel("follower", 0)
    pin = PinJoint("pin", ground, disc, joint_axis=ground.z)
    slide = PrismaticJoint(
        "slide", ground, follower, parent_point=0.3 * ground.y - 0.02 * ground.x,
        joint_axis=ground.y,
    )  # fmt: skip
    phi = pin.coordinates[0]
    lift = 0.05 * (1 - sm.cos(phi)) + 0.01 * sm.sin(2 * phi)
    contact = mechc.Coupling.cam("contact", pin, slide, lift, shape=shape)
    model = solved([pin, slide, contact], [], gravity=-G * ground.y)
    y = model.assemble({"q_pin": 0.8}, {"u_pin": 7.0})
    at, w = 0.8, 7.0
    first = 0.05 * np.sin(at) + 0.02 * np.cos(2 * at)
    second = 0.05 * np.cos(at) - 0.04 * np.sin(2 * at)
    a = -(MASS * first * (second * w**2 + G)) / (I_1 + MASS * first**2)
    rise = 0.05 * (1 - np.cos(at)) + 0.01 * np.sin(2 * at)
    assert y[1] == pytest.approx(rise, rel=1e-13)
    assert y[3] == pytest.approx(first * w, rel=1e-13)
    assert model.rhs(0.0, y)[2] == pytest.approx(a, rel=1e-12)
    push = MASS * (first * a + second * w**2 + G)
    force, torque = of(model, y, "contact")
    assert force[1] == pytest.approx(push, rel=1e-12)
    # the force and its moment about the cam's axis, by which alone the cam is braked
    moment = torque[2] + (-0.02) * force[1] - (0.3 + rise) * force[0]
    assert moment == pytest.approx(-I_1 * a, rel=1e-11)
    assert (force[0] == 0) == (shape == "flat")
    if shape == "roller":
        assert torque == pytest.approx(0, abs=1e-13)


def test_what_cannot_be_coupled_is_refused():
    ground, _, (first, second) = pins(0.5)
    skew = PinJoint("skew", ground, wheel("third", 1), joint_axis=ground.x)
    shaft = PinJoint("shaft", ground, wheel("fourth", 1), joint_axis=ground.z)
    slide = PrismaticJoint("slide", ground, wheel("fifth", 1), joint_axis=ground.z)
    gear, rack = mechc.Coupling.gear, mechc.Coupling.rack_and_pinion
    with pytest.raises(mechc.MechanismError, match="not parallel"):
        gear("mesh", first, skew, (1, 2))
    with pytest.raises(mechc.MechanismError, match="coincide"):
        gear("mesh", first, shaft, (1, 2))
    with pytest.raises(mechc.MechanismError, match="not a PinJoint"):
        gear("mesh", first, slide, (1, 2))
    with pytest.raises(mechc.MechanismError, match="not across"):
        rack("teeth", first, slide, 0.1)
    across = PrismaticJoint("across", ground, wheel("sixth", 1), joint_axis=ground.x)
    with pytest.raises(mechc.MechanismError, match="an expression of the cam's coordinate"):
        mechc.Coupling.cam("contact", first, across, 0.1)
    on_two = PinJoint("on_two", second.child, wheel("seventh", 1), joint_axis=ground.z)
    with pytest.raises(mechc.MechanismError, match="not the carrier"):
        gear("mesh", first, on_two, (1, 2))
