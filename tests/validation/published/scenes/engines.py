"""Modelica's engines of one and of six cylinders, written with SymPy's joints and mechc's cuts."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from sympy import Piecewise, Rational, cos, pi, sin, symbols
from sympy.physics.mechanics import (
    Force,
    PinJoint,
    PrismaticJoint,
    RigidBody,
    Torque,
    inertia,
)

import mechc

from .loops import LOOPS, Example, G, box, cylinder


def gas_pressure(s, v, length):
    """Modelica's gas in Pa: s from the top, v its rate; below 0.933 of the length, as here."""
    x = 1 - s / length
    compressed = 177.4132 * x**4 - 287.2189 * x**3 + 151.8252 * x**2 - 24.9973 * x + 2.4
    expanded = 145.930 * x**4 - 131.707 * x**3 + 17.3438 * x**2 + 17.9272 * x + 2.4
    return 1e5 * Piecewise((compressed, v < 0), (expanded, True))


def crank_moment():
    """Of the parts of the crank about its axis, and its moment of mass along y (kg m)."""
    shaft, journal = cylinder(0.1, 0.05), cylinder(0.1, 0.03)
    web = box(0.1, 0.05, 0.02)
    about_axis = shaft[1] + journal[1] + journal[0] * 0.1**2 + 2 * (web[3] + web[0] * 0.05**2)
    return about_axis, journal[0] * 0.1 + 2 * web[0] * 0.05


@dataclass(frozen=True)
class Cylinder:
    """Lengths (m), masses (kg) and moments (kg m²) of one cylinder of an engine of six."""

    crank: float
    rod: float
    rod_centre: float  # from the crank's pin
    rod_mass: float
    rod_moment: float
    piston_mass: float
    top: float = 0.42
    piston: float = 0.1

    @property
    def gas_length(self):
        return self.top - (self.piston + self.rod - self.crank)


def _long_box():
    mass, _, _, across = box(0.22, 0.06, 0.02)
    return Cylinder(0.1, 0.2, 0.09, mass, across, cylinder(0.1, 0.1)[0])


ANGLES = ((-30, -30), (90, 30), (210, -30), (210, 30), (90, -30), (-30, 30))  # crank, cylinder
V6, V6_ANALYTIC = _long_box(), Cylinder(0.05, 0.175, 0.0875, 1.0, 0.006, 6.0)


def v6_moment():
    """Of the crank of EngineV6 with its load: its shafts are drawn longer than they are."""
    shaft, journal, web = cylinder(0.12, 0.05), cylinder(0.12, 0.03), box(0.1, 0.05, 0.02)
    one = shaft[1] + journal[1] + journal[0] * 0.1**2 + 2 * (web[3] + web[0] * 0.05**2)
    return 6 * one + 1


@cache
def v6():
    """Six cylinders on one balanced crank, with gas, and a load that brakes by its speed."""
    J, a, length, c, m, I, M, top, L = symbols("J a l c m_r I_r m_p top L")
    world, crank = RigidBody("world"), RigidBody("crank", mass=1)
    crank.central_inertia = inertia(crank.frame, J, 0, 0)
    bearing = PinJoint("bearing", world, crank, joint_axis=world.x)
    speed = bearing.speeds[0]
    joints, loads = [bearing], [Torque(crank, -100 * (speed / 200) ** 2 * world.x)]
    for k, (offset, inclination) in enumerate(ANGLES):
        rod, piston = RigidBody(f"rod{k}", mass=m), RigidBody(f"piston{k}", mass=M)
        rod.central_inertia = inertia(rod.frame, I, 0, 0)
        piston.central_inertia = inertia(piston.frame, 0, 0, 0)
        throw, bore = (
            cos(Rational(angle, 180) * pi) * body.y + sin(Rational(angle, 180) * pi) * body.z
            for body, angle in ((crank, offset), (world, inclination))
        )
        big_end = PinJoint(
            f"big{k}",
            crank,
            rod,
            parent_point=a * throw,
            child_point=-c * rod.y,
            joint_axis=crank.x,
        )
        slide = PrismaticJoint(
            f"slide{k}", world, piston, parent_point=top * bore, joint_axis=-bore
        )
        small_end = mechc.Cut.pin(
            f"small{k}",
            rod,
            piston,
            parent_point=(length - c) * rod.y,
            joint_axis=rod.x,
        )
        gas = gas_pressure(slide.coordinates[0] - Rational(1, 10), slide.speeds[0], L)
        loads.append(Force(piston.masscenter, -gas * pi * 0.1**2 / 4 * bore))
        joints += [big_end, slide, small_end]
    mechanism = mechc.from_joints(
        "v6",
        joints,
        gravity=-G * world.y,
        loads=loads,
        parameters=dict.fromkeys((J, a, length, c, m, I, M, top, L), 1.0),
    )
    return mechc.compile(mechanism, outputs=())


@cache
def engine():
    """One cylinder: crank, rod, piston, and gas where p = 1."""
    p = symbols("p")
    world, crank, rod, piston = (RigidBody(n) for n in ("world", "crank", "rod", "piston"))
    moment, first_moment = crank_moment()
    crank.mass = first_moment / 0.1  # all at the pin, which the moment about the axis makes good
    crank.central_inertia = inertia(crank.frame, moment + 1 - first_moment * 0.1, 0, 0)
    mass, _, _, across = box(0.2, 0.06, 0.02)
    rod.mass, rod.central_inertia = mass, inertia(rod.frame, across, 0, 0)
    piston.mass, piston.central_inertia = cylinder(0.1, 0.1)[0], inertia(piston.frame, 0, 0, 0)
    bearing = PinJoint("bearing", world, crank, child_point=-crank.y / 10, joint_axis=world.x)
    b2 = PinJoint("b2", crank, rod, child_point=-rod.y / 10, joint_axis=crank.x)
    slide = PrismaticJoint(
        "slide",
        world,
        piston,
        parent_point=Rational(9, 20) * world.y,
        child_point=piston.y / 20,
        joint_axis=-world.y,
    )
    b1 = mechc.Cut.pin(
        "b1",
        rod,
        piston,
        parent_point=rod.y / 10,
        child_point=-piston.y / 20,
        joint_axis=rod.x,
    )
    s, v = slide.coordinates[0], slide.speeds[0]
    gas = p * gas_pressure(s, v, 0.35) * pi * 0.1**2 / 4
    mechanism = mechc.from_joints(
        "engine",
        [bearing, b2, slide, b1],
        gravity=-G * world.y,
        loads=[Force(piston.masscenter, -gas * world.y)],
        parameters={p: 0.0},
    )
    return mechc.compile(mechanism, outputs=())


def _engine(path, gas):
    return Example(
        path,
        engine,
        {"inertia.phi": "q_bearing", "inertia.w": "u_bearing"},
        0.5 if gas else 5.0,
        {"p": float(gas)},
        {"q_bearing": 0.0},
        {"u_bearing": 10.0},
        {"q_b2": 0.0, "q_slide": 0.05},
    )


def _v6(path, one, moment):
    """At the start each piston pin is where the crank's angle puts it."""
    guess = {}
    for k, (offset, inclination) in enumerate(ANGLES):
        angle = np.deg2rad(offset - inclination)
        lean = np.arcsin(one.crank * np.sin(angle) / one.rod)  # of the rod to its bore
        pin = one.crank * np.cos(angle) + one.rod * np.cos(lean)
        guess |= {f"q_slide{k}": one.top - pin, f"q_big{k}": np.deg2rad(inclination) - lean}
    values = {
        "J": moment, "a": one.crank, "l": one.rod, "c": one.rod_centre, "m_r": one.rod_mass,
        "I_r": one.rod_moment, "m_p": one.piston_mass, "top": one.top, "L": one.gas_length,
    }  # fmt: skip
    signals = {"load.phi": "q_bearing", "load.w": "u_bearing"}
    start, speeds = {"q_bearing": 0.0}, {"u_bearing": 10.0}
    return Example(path, v6, signals, 1.01, values, start, speeds, guess)


EXAMPLES = [
    _engine(LOOPS + "Engine1a", gas=False),
    _engine(LOOPS + "Engine1b", gas=True),
    _engine(LOOPS + "Engine1b_analytic", gas=True),
    _v6(LOOPS + "EngineV6", V6, v6_moment()),
    _v6(LOOPS + "EngineV6_analytic", V6_ANALYTIC, 1.1),
]
