"""Scenes and evaluators that the compiler's tests share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import mpmath
import numpy as np
from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import (
    Constraint,
    Coordinate,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
)
from mechc_codegen.ir.lower import lower
from mechc_codegen.ir.program import Program, SineCosine
from mechc_codegen.library.catalogue import shipped_mechanism
from sympy import Add, Expr, Mul, Pow, Symbol, cos, exp, lambdify, sin, sqrt, symbols
from sympy.physics.mechanics import (
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

EVERYTHING: Mapping[str, bool | str] = {
    "crank_torque": True,
    "crank_speed": "2 + sin(3*t)/4",
    "friction": True,
    "coupler_point": True,
}
t = dynamicsymbols._t
ONE, LENGTH, MASS = Quantity("1", "number"), Quantity("m", "length", 0), Quantity("kg", "mass", 0)


def swing(*, guided: bool = False) -> Mechanism:
    """A rod hung from a slider; across the rod's end a pearl slides against a spring.

    Speeds are not rates of the coordinates, a force and (where ``guided``) a constraint on the
    speeds depend on time, a default follows others through a sine.
    """
    x, phi, s = dynamicsymbols("x phi s")
    u, w, v = dynamicsymbols("u w v")
    m, mr, mb, l, I, k, c, g, f = symbols("m m_r m_b l I k c g f", real=True)
    kinematics = (u - l * w * cos(phi) / 2, w / 2 + sin(t) / 10, v + x * w)
    rates = dict(zip((x.diff(t), phi.diff(t), s.diff(t)), kinematics, strict=True))
    r = ReferenceFrame("r")
    rod = r.orientnew("rod", "Axis", (phi, r.z))
    origin = Point("O")
    origin.set_vel(r, 0)
    slider = origin.locatenew("S", x * r.x)
    centre = slider.locatenew("G", -l / 2 * rod.y)
    end = slider.locatenew("E", -l * rod.y)
    bob = end.locatenew("B", s * rod.x)
    for point in (slider, centre, end, bob):
        point.set_vel(r, point.pos_from(origin).dt(r).xreplace(rates))
    rod.set_ang_vel(r, rates[phi.diff(t)] * r.z)
    block = Particle("block", slider, m)
    body = RigidBody("rod", centre, rod, mr, (inertia(rod, 0, 0, I), centre))
    pearl = Particle("pearl", bob, mb)
    body.potential_energy = mr * g * centre.pos_from(origin).dot(r.y)
    pearl.potential_energy = mb * g * bob.pos_from(origin).dot(r.y) + k * s**2 / 2
    spring = -k * s * rod.x
    quantities = (ONE, ONE, ONE)
    return Mechanism(
        name="swing",
        title="Swing",
        frame=r,
        origin=origin,
        coordinates=tuple(map(Coordinate, (x, phi, s), quantities)),
        speeds=tuple(map(Speed, (u, w, v), quantities)),
        kinematics=kinematics,
        parameters=(
            Parameter(m, 2.0, MASS),
            Parameter(mr, m / 2, MASS),
            Parameter(mb, sqrt(m) * sin(l) / 3, MASS),
            Parameter(l, 1.5, LENGTH),
            Parameter(I, mr * l**2 / 12, ONE),
            Parameter(k, 30.0, ONE),
            Parameter(c, 0.25, ONE),
            Parameter(g, 9.81, ONE),
            Parameter(f, 3.0, ONE),
        ),
        bodies=(block, body, pearl),
        loads=(
            (centre, -mr * g * r.y),
            (bob, -mb * g * r.y + spring),
            (end, -spring),
            (slider, f * sin(5 * t) * exp(-t / 9) * r.x),
            (rod, -c * w * r.z),
        ),
        motion_constraints=(Constraint("guide", u + w * cos(t) - t, "1"),) if guided else (),
        points=(slider, centre, end, bob),
    )


def bead() -> Mechanism:
    """No parameters, no frames, no constraint: a bead of 2 kg on a curve."""
    q, u = dynamicsymbols("q u")
    path, velocity = (q, cos(q)), (u, -sin(q) * u)
    return _bead(2, path, velocity, lambda r: -20 * r.y)


def bead_with(load: Expr, *, default: Expr | float = 1.0, name: str = "f") -> Mechanism:
    """A bead on a line under a force of its coordinate ``q``, speed ``u`` and a parameter."""
    q, u = dynamicsymbols("q u")
    parameter = Parameter(Symbol(name), default, ONE)
    return _bead(1, (q, 0), (u, 0), lambda r: load * r.x, parameter)


def bead_over_tables() -> Mechanism:
    """A bead under forces by tables: a spline, lines that repeat, a surface of two numbers."""
    q, u = dynamicsymbols("q u")
    at, over = np.linspace(-3.0, 3.0, 7), np.linspace(-2.0, 2.0, 5)
    curve = mechc.Table(at, np.sin(at))
    lines = mechc.Table(at, np.abs(at) - 1.0, kind="linear", outside="repeat")
    surface = mechc.Table(at, over, np.cos(np.add.outer(at, over)), outside=("hold", "extend"))
    return bead_with(-q + curve(q) + Symbol("f") * lines(2 * q + 0.1) - surface(q, u))


def drawn_bead() -> Mechanism:
    """A bead that a spring and a damper, both of the parameter ``f``, draw along sin(t)."""
    (q, u), f = dynamicsymbols("q u"), Symbol("f")
    return bead_with(-f * (u - cos(t)) - f * sin(q - sin(t)) + sin(3 * t) * cos(q))


def _bead(
    mass: int,
    path: tuple[Expr, Expr],
    velocity: tuple[Expr, Expr],
    force: Callable[[ReferenceFrame], Expr],
    *parameters: Parameter,
) -> Mechanism:
    """A particle in the plane with the coordinate ``q`` and the speed ``u``."""
    q, u = dynamicsymbols("q u")
    r, origin, bob = ReferenceFrame("r"), Point("O"), Point("B")
    origin.set_vel(r, 0)
    bob.set_pos(origin, path[0] * r.x + path[1] * r.y)
    bob.set_vel(r, velocity[0] * r.x + velocity[1] * r.y)
    return Mechanism(
        name="bead",
        title="Bead",
        frame=r,
        origin=origin,
        coordinates=(Coordinate(q, ONE),),
        speeds=(Speed(u, ONE),),
        kinematics=(u,),
        parameters=parameters,
        bodies=(Particle("bead", bob, mass),),
        loads=((bob, force(r)),),
        points=(bob,),
    )


SCENES = {
    "four_bar": lambda: shipped_mechanism("four_bar"),
    "everything": lambda: shipped_mechanism("four_bar", EVERYTHING),
    "swing": swing,
    "guided swing": lambda: swing(guided=True),
    "bead": bead,
}


@cache
def equations(scene: str) -> Equations:
    """The derived equations of a scene, with Jacobians."""
    return differentiate(derive(SCENES[scene]()))


@cache
def lowered(scene: str) -> Program:
    """The program of a scene before optimisation."""
    return lower(equations(scene))


def arguments(derived: Equations) -> list[Symbol]:
    """Every input: time, coordinates, speeds, parameters."""
    symbols_ = derived.symbols
    return [symbols_.time, *symbols_.q, *symbols_.u, *symbols_.parameters]


def exact(derived: Equations, *names: str) -> Callable[..., list[list[mpmath.mpf]]]:
    """A function of all inputs that gives the derived outputs, one list each, by mpmath."""
    elements = [list(derived.outputs[name].elements) for name in names]
    evaluate: Callable[..., list[list[mpmath.mpf]]] = lambdify(
        arguments(derived), elements, modules="mpmath", cse=True
    )
    return evaluate


Known = dict[Expr, mpmath.mpf]


def value(expression: Expr, known: Known) -> mpmath.mpf:
    """The value of an expression by walking it: no rewriting, no printing.

    ``known``, to begin with the values of symbols, remembers what it met.
    """
    if expression not in known:
        known[expression] = _value(expression, known)
    return known[expression]


def _value(expression: Expr, known: Known) -> mpmath.mpf:
    if expression.is_Rational:
        return mpmath.mpf(int(expression.p)) / int(expression.q)
    if not expression.args:
        return mpmath.mpmathify(expression.evalf(50))
    args = [value(a, known) for a in expression.args]
    if isinstance(expression, Add):
        return mpmath.fsum(args)
    if isinstance(expression, Mul):
        return mpmath.fprod(args)
    if isinstance(expression, Pow):
        return mpmath.power(*args)
    return getattr(mpmath, type(expression).__name__.replace("Abs", "fabs"))(*args)


def run_program(
    program: Program, inputs: Mapping[Symbol, mpmath.mpf]
) -> dict[str, list[mpmath.mpf]]:
    """Every output of a program, statement by statement."""
    known = run_statements(program, inputs)
    return {o.name: [value(e, known) for e in o.elements] for o in program.outputs}


def run_statements(program: Program, inputs: Mapping[Symbol, mpmath.mpf]) -> Known:
    """The values of all symbols after a program's statements."""
    known: Known = dict(inputs)
    for statement in (*program.hoisted, *program.body):
        result = value(statement.value, known)
        if isinstance(statement, SineCosine):
            known[statement.sine], known[statement.cosine] = mpmath.sin(result), mpmath.cos(result)
        else:
            known[statement.target] = result
    return known
