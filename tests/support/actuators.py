"""Mechanisms with SymPy's actuators on its pathways, as Systems formed by Kane's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sympy import Symbol, cos, sin, symbols
from sympy.physics.biomechanics import (
    FirstOrderActivationDeGroote2016,
    MusculotendonDeGroote2016,
)
from sympy.physics.mechanics import (
    CoulombKineticFriction,
    DuffingSpring,
    ForceActuator,
    LinearDamper,
    LinearPathway,
    LinearSpring,
    ObstacleSetPathway,
    Particle,
    PinJoint,
    Point,
    RigidBody,
    System,
    TorqueActuator,
    WrappingCylinder,
    WrappingPathway,
    dynamicsymbols,
    inertia,
)
from sympy.physics.vector import Vector

k, c, F, r, l_0 = symbols("k c F r l_0", positive=True)
a, b, h = symbols("a b h")
q, u = dynamicsymbols("q u")


def sliding(*make: Callable[[Any], Any]) -> System:
    """A particle on a line, with actuators on the pathway from the origin to it."""
    system, block = System(), Particle("block", mass=Symbol("m"))
    block.masscenter.set_pos(system.fixed_point, q * system.x)
    block.masscenter.set_vel(system.frame, u * system.x)
    system.add_bodies(block)
    pathway = LinearPathway(system.fixed_point, block.masscenter)
    system.q_ind, system.u_ind, system.kdes = [q], [u], [q.diff() - u]
    system.add_actuators(*(each(pathway) for each in make))
    system.form_eoms()
    return system


def swinging(*make: Callable[[Any, Any, Any], Any]) -> System:
    """A rod on a pin; actuators are made of the joint, the ground and a point of the rod."""
    ground, rod = RigidBody("ground"), RigidBody("rod", mass=Symbol("m"))
    rod.central_inertia = inertia(rod.frame, 0, 0, Symbol("I"))
    system = System.from_newtonian(ground)
    joint = PinJoint(
        "pin", ground, rod, q, u, child_point=-Symbol("l") * rod.x, joint_axis=ground.z
    )
    system.add_joints(joint)
    tip = rod.masscenter.locatenew("tip", h * rod.x)
    tip.set_vel(rod.frame, 0)
    tip.v2pt_theory(rod.masscenter, ground.frame, rod.frame)
    system.add_actuators(*(each(joint, system, tip) for each in make))
    system.form_eoms()
    return system


def fixed(name: str, system: System, place: Vector) -> Point:
    """A point of the ground."""
    point = system.fixed_point.locatenew(name, place)
    point.set_vel(system.frame, 0)
    return point


def stretched(actuator: Callable[[Any], Any]) -> Callable[..., Any]:
    """The actuator on a straight line from a hook on the ground to the rod's tip."""
    return lambda _, system, tip: actuator(LinearPathway(fixed("hook", system, a * system.y), tip))


def past_an_eye(_: Any, system: System, tip: Point) -> Any:
    """A spring from the hook through an eye, both of the ground, to the tip."""
    hook, eye = fixed("hook", system, a * system.y), fixed("eye", system, b * system.x)
    return LinearSpring(k, ObstacleSetPathway(hook, eye, tip))


def wrapped(_: Any, system: System, tip: Point) -> Any:
    """A spring around a cylinder on the ground, to a point on it that turns with the rod."""
    start = fixed("start", system, r * system.x)
    end = Point("end")
    end.set_pos(system.fixed_point, r * (cos(q) * system.x + sin(q) * system.y))
    end.set_vel(system.frame, r * u * (-sin(q) * system.x + cos(q) * system.y))
    cylinder = WrappingCylinder(r, system.fixed_point, system.frame.z)
    return LinearSpring(k, WrappingPathway(start, end, cylinder))


def muscle(pathway: LinearPathway) -> Any:
    """A muscle with a rigid tendon; its activation is a specified function of time."""
    activation = FirstOrderActivationDeGroote2016("biceps")
    return MusculotendonDeGroote2016("biceps", pathway, activation_dynamics=activation)


ACTUATED: dict[str, Callable[[], System]] = {
    "spring and damper": lambda: sliding(
        lambda line: LinearSpring(k, line, l_0), lambda line: LinearDamper(c, line)
    ),
    "Duffing spring": lambda: sliding(lambda line: DuffingSpring(k, c, line, l_0)),
    "Coulomb friction": lambda: sliding(lambda line: CoulombKineticFriction(c, F, line)),
    "Stribeck friction": lambda: sliding(
        lambda line: CoulombKineticFriction(c, F, line, v_s=Symbol("v_s"), sigma=k)
    ),
    "torque at a pin": lambda: swinging(
        lambda joint, *_: TorqueActuator.at_pin_joint(-k * q - c * u, joint)
    ),
    "force of time": lambda: swinging(
        stretched(lambda line: ForceActuator(dynamicsymbols("f"), line))
    ),
    "stretched spring and damper": lambda: swinging(
        stretched(lambda line: LinearSpring(k, line, l_0)),
        stretched(lambda line: LinearDamper(c, line)),
    ),
    "spring past an obstacle": lambda: swinging(past_an_eye),
    "spring around a cylinder": lambda: swinging(wrapped),
    "muscle": lambda: swinging(stretched(muscle)),
}
