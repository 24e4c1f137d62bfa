"""Motors: what they do on speeds, their torques against Lagrange's equations, their errors."""

import numpy as np
import pytest
from mechc_codegen.description.joints.motors import Motor
from mechc_codegen.errors import MechanismError
from mechc_codegen.export.variables import StartValues, variables
from mechc_codegen.frontend.sympy_joints import from_joints
from scipy.integrate import cumulative_simpson
from sympy import Symbol, cos, diff, lambdify, sin, symbols
from sympy.physics.mechanics import (
    CylindricalJoint,
    PinJoint,
    PlanarJoint,
    PrismaticJoint,
    RigidBody,
    SphericalJoint,
    WeldJoint,
    dynamicsymbols,
    inertia,
)

import mechc

t = dynamicsymbols._t
INERTIA = (0.03, 0.05, 0.04)


def heavy(name):
    body = RigidBody(name, mass=0.7)
    body.central_inertia = inertia(body.frame, *INERTIA)
    return body


def jointed(kind, name, parent, child, *more, **axis):
    places = {"parent_point": 0.3 * parent.y, "child_point": 0.2 * child.x - 0.1 * child.z}
    return kind(name, parent, child, *more, **places, **axis)


def arm():
    """A chain with a joint of every kind that has an axis."""
    ground, *bodies = (heavy(name) for name in ("ground", *(f"body_{k}" for k in range(6))))
    turned, slid, both, screwed, plane, last = bodies
    return ground, [
        jointed(PinJoint, "pin", ground, turned, joint_axis=0.6 * ground.x + 0.8 * ground.y),
        jointed(PrismaticJoint, "slide", turned, slid, joint_axis=turned.y),
        jointed(CylindricalJoint, "both", slid, both, joint_axis=slid.z),
        jointed(mechc.ScrewJoint, "screw", both, screwed, 0.05, joint_axis=both.x),
        jointed(PlanarJoint, "plane", screwed, plane),
        jointed(mechc.UniversalJoint, "universal", plane, last),
    ]


DRIVEN = {  # the joint or coordinate -> its speed, and whether it slides
    "pin": ("u_pin", False),
    "slide": ("u_slide", True),
    "q0_both": ("u0_both", False),
    "q1_both": ("u1_both", True),
    "screw": ("u_screw", False),
    "q0_plane": ("u0_plane", False),
    "q1_plane": ("u1_plane", True),
    "q2_plane": ("u2_plane", True),
    "q0_universal": ("u0_universal", False),
    "q1_universal": ("u1_universal", False),
}


@pytest.fixture(scope="module")
def driven():
    ground, joints = arm()
    names = {x.name: x for joint in joints for x in joint.coordinates}
    motors = [
        Motor(names.get(one, one), gear=k + 2 if k % 2 else None, name=f"m_{k}",
              **{"force" if slides and not k % 2 else "torque": Symbol(f"T_{k}")})
        for k, (one, (_, slides)) in enumerate(DRIVEN.items())
    ]  # fmt: skip
    return mechc.compile(from_joints("arm", joints, motors=motors, ground=ground))


@pytest.mark.slow
def test_a_torque_does_its_gear_times_itself_on_its_speed_and_nothing_on_others(driven):
    rng = np.random.default_rng(2)
    y = rng.uniform(-0.7, 0.7, len(driven.coordinates) + len(driven.speeds))
    none = dict.fromkeys(driven.parameters, 0.0)
    without = driven.forcing(y, none)
    for k, (speed, _) in enumerate(DRIVEN.values()):
        done = driven.forcing(y, none | {f"T_{k}": 1.3}) - without
        expected = 1.3 * (k + 2 if k % 2 else 1) * (np.array(driven.speeds) == speed)
        assert np.allclose(done, expected, rtol=0, atol=1e-12)


def test_units_and_names_of_outputs(driven):
    assert driven.units["T_0"] == driven.units["T_1"] == "N m"
    assert driven.units["T_8"] == "N m"
    assert driven.units["T_6"] == "N"
    y = np.zeros(len(driven.coordinates) + len(driven.speeds))
    y[len(driven.coordinates) + driven.speeds.index("u_slide")] = 0.5
    given = dict.fromkeys(driven.parameters, 0.0) | {"T_1": 2.0}
    assert driven.output("m_1_torque", y, given) == 2.0
    assert driven.output("m_1_power", y, given) == pytest.approx(2.0 * 3 * 0.5, rel=1e-15)
    assert driven.output("m_6_force", y, given) == 0.0
    with pytest.raises(mechc.UnknownNameError):
        driven.output("m_1_force", y, given)
    numbers = [0.0] * len(driven.parameters)
    of_unit = variables(driven.system.data, StartValues(y, numbers, [False] * len(numbers), 0.0))
    units = {each.name: each.unit for each in of_unit}
    assert [units[f"m_{k}"] for k in ("1_torque", "6_force", "6_power")] == ["N m", "N", "W"]


# -- two links in a plane, against Lagrange's equations of both links and rotors ------------------

q1, q2, u1, u2 = symbols("q1 q2 u1 u2")
L1, L2, M1, M2, I1, I2, G = 0.5, 0.4, 1.3, 0.8, 0.02, 0.01, 9.81
N1, N2, J1, J2 = 7.0, -11.0, 3e-4, 2e-4


def torques_at_joints():
    """Of both joints, a function of q1, q2, u1, u2 and accelerations."""
    x1, y1 = L1 / 2 * cos(q1), L1 / 2 * sin(q1)
    x2, y2 = 2 * x1 + L2 / 2 * cos(q1 + q2), 2 * y1 + L2 / 2 * sin(q1 + q2)
    q, u, a = (q1, q2), (u1, u2), symbols("a1 a2")
    rate = lambda x: sum(diff(x, one) * v for one, v in zip(q, u, strict=True))  # noqa: E731
    kinetic = M1 * (rate(x1) ** 2 + rate(y1) ** 2) / 2 + M2 * (rate(x2) ** 2 + rate(y2) ** 2) / 2
    kinetic += I1 * u1**2 / 2 + I2 * (u1 + u2) ** 2 / 2
    kinetic += J1 * (N1 * u1) ** 2 / 2 + J2 * (u1 + N2 * u2) ** 2 / 2
    potential = G * (M1 * y1 + M2 * y2)
    found = []
    for k in range(2):
        momentum = diff(kinetic, u[k])
        change = rate(momentum) + sum(diff(momentum, v) * w for v, w in zip(u, a, strict=True))
        found.append(change - diff(kinetic - potential, q[k]))
    return lambdify([*q, *u, *a], found)


def two_links(**names):
    ground, upper, lower = RigidBody("ground"), RigidBody("upper", mass=M1), RigidBody("lower")
    lower.mass = M2
    upper.central_inertia = inertia(upper.frame, 0, 0, I1)
    lower.central_inertia = inertia(lower.frame, 0, 0, I2)
    joints = [
        PinJoint("shoulder", ground, upper, child_point=-L1 / 2 * upper.x, joint_axis=ground.z),
        PinJoint("elbow", upper, lower, parent_point=L1 / 2 * upper.x,
                 child_point=-L2 / 2 * lower.x, joint_axis=upper.z),
    ]  # fmt: skip
    motors = [
        Motor(name, gear=gear, inertia=size, **names[name])
        for name, gear, size in (("shoulder", N1, J1), ("elbow", N2, J2))
    ]
    made = from_joints("links", joints, gravity=-G * ground.y, motors=motors)
    return mechc.compile(made, outputs=("energy", "accelerations", "reactions"))


@pytest.mark.parametrize(
    "given",
    [
        {"shoulder": {"angle": dynamicsymbols("path")}, "elbow": {"speed": 2 * cos(5 * t)}},
        {"shoulder": {"torque": 2 * sin(9 * t), "effort": 0.6}, "elbow": {"angle": sin(3 * t)}},
    ],
)
def test_torques_are_those_of_lagrange_s_equations_and_powers_change_the_energy(given):
    model = two_links(**given)
    if model.inputs:
        model = model.with_inputs({"path": "0.4 - cos(2*t)"})
    held = [name for name in given if "angle" in given[name]]
    start = {f"q_{n}": 0.3 for n in given if n not in held}
    free = {f"u_{n}": 0.1 for n in given if "torque" in given[n]}
    t_eval = np.linspace(0, 1, 4001)
    sol = model.simulate(1.0, model.assemble(start, speeds=free), t_eval=t_eval, rtol=1e-11)
    expected = torques_at_joints()(*sol.q.T, *sol.u.T, *sol.output("rates").T[2:])
    work, kinks = np.zeros(len(sol.t) - 1), False
    for name, gear, torque in zip(("shoulder", "elbow"), (N1, N2), expected, strict=True):
        found, power = sol[f"{name}_torque"], sol[f"{name}_power"]
        assert abs(gear * found - torque).max() < 1e-9
        assert np.allclose(power, found * gear * sol[f"u_{name}"], rtol=0, atol=1e-12)
        work += cumulative_simpson(power, x=sol.t)
        bound = given[name].get("effort")
        assert bound is None or abs(found).max() == bound
        kinks = kinks or bound is not None
    assert abs(sol.energy[1:] - sol.energy[0] - work).max() < (1e-5 if kinks else 1e-8)
    if kinks:
        assert abs(sol["q_elbow"] - np.sin(3 * sol.t)).max() < 1e-12
    else:
        assert abs(sol["q_shoulder"] - 0.4 + np.cos(2 * sol.t)).max() < 1e-12
        assert abs(sol["u_elbow"] - 2 * np.cos(5 * sol.t)).max() < 1e-12
    weight = sol.output("point_accelerations")[:, model.point_names.index("lower_masscenter")]
    reaction = sol.output("reaction_forces")[:, model.joint_names.index("elbow")]
    assert np.allclose(reaction, M2 * (weight + np.array([0, G, 0])), rtol=0, atol=1e-9)


# -- errors ---------------------------------------------------------------------------------------


def refused(made, *motors):
    ground, joints = made
    with pytest.raises(MechanismError) as error:
        from_joints("arm", joints, motors=motors, ground=ground)
    return str(error.value)


def test_motors_that_do_not_fit_their_joints_are_refused():
    q, made = dynamicsymbols("q_slide"), arm()
    words = {
        Motor("pin"): "turns: give one of speed=, angle=, torque=, not none",
        Motor("pin", speed=1, torque=2): "not speed= and torque=",
        Motor("pin", position=1): "turns: give one of",
        Motor("slide", torque=1): "slides: give one of speed=, position=, force=, not torque=",
        Motor(
            "slide", force=1, gear=9
        ): "with a gear in rad/m: give one of speed=, position=, torq",
        Motor("plane", torque=1): "has the coordinates q0_plane, q1_plane, q2_plane: give the one",
        Motor("hinge", torque=1): "the joints are pin, slide",
        Motor("pin", speed=1, effort=2): "compare the output pin_torque",
        Motor("pin", angle=2 * q): "angle= contains q_slide",
        Motor("pin", speed=q.diff()): "speed= contains q_slide",
        Motor("pin", torque=1, effort=-2): "effort=-2 must be a positive number",
        Motor("pin", torque=1, gear=0): "gear=0 must be a number other than zero",
        Motor("pin", torque=1, gear=t): "varies with time",
        Motor("slide", force=1, inertia=1e-3): "without gear= in rad/m",
        Motor("q1_universal", torque=1, inertia=1e-3): "turns against the parent",
        Motor("pin", torque="3 N m"): "is not an expression",
        Motor("pin", torque=1, name="slide"): "another name",
        "pin": "motors are mechc.Motor",
    }
    for motor, said in words.items():
        assert said in refused(made, motor), said
    assert "another name" in refused(made, Motor("pin", torque=1), Motor("pin", torque=2))


def test_a_joint_without_a_coordinate_or_an_axis_is_not_driven():
    ground, upper, lower = (heavy(name) for name in ("ground", "upper", "lower"))
    joints = [SphericalJoint("ball", ground, upper), WeldJoint("weld", upper, lower)]
    assert "no coordinate" in refused((ground, joints), Motor("weld", torque=1))
    assert "by itself" in refused((ground, joints), Motor("q0_ball", torque=1))
    quaternion = mechc.BallJoint("ball", ground, heavy("other"))
    name = quaternion.coordinates[0].name
    assert "by itself" in refused((ground, [quaternion]), Motor(name, torque=1))
