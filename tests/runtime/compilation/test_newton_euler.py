"""Accelerations of compiled scenes beside Newton's and Euler's equations by numbers alone."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sm
from mechc_codegen.derive import kane
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dot,
    dynamicsymbols,
    inertia,
)

import mechc

t = dynamicsymbols._t


def pendulum(length):
    """A rod about a pivot; ``length``: its symbol, which makes the scene another one."""
    q, u = dynamicsymbols("q u")
    m, g, c = sm.symbols("m g c")
    N, A = ReferenceFrame("N"), ReferenceFrame("A")
    A.orient_axis(N, q, N.z)
    A.set_ang_vel(N, u * N.z)
    pivot = Point("P")
    pivot.set_vel(N, 0)
    centre = pivot.locatenew("G", length / 2 * A.x)
    centre.v2pt_theory(pivot, N, A)
    rod = RigidBody("rod", centre, A, m, (inertia(A, 0, 0, m * length**2 / 12), centre))
    method = KanesMethod(N, [q], [u], kd_eqs=[u - q.diff(t)])
    method.kanes_equations([rod], [(centre, m * g * N.x), (A, -c * u * N.z)])
    defaults = {length: 1.3, m: 2.0, g: 9.81, c: 0.4}
    return mechc.compile(method, defaults=defaults)


def checked(model):
    return model.simulate(2.0, np.array([1.0, 0.5])).check()


def test_a_pendulum_with_a_damper():
    found = checked(pendulum(sm.Symbol("l")))
    assert found.ok
    assert found.rates < 1e-11


def test_a_load_with_the_wrong_sign_is_found(monkeypatch):
    forces = kane._generalized_active_forces
    monkeypatch.setattr(
        kane, "_generalized_active_forces", lambda mechanism: [-f for f in forces(mechanism)]
    )
    found = checked(pendulum(sm.Symbol("l_of_the_wrong_sign")))
    assert found.rates > 0.1
    assert any("the rate of u is not that of the description" in each for each in found.warnings)


def test_a_wrong_inertia_is_found(monkeypatch):
    motion = kane._motion

    def heavier(mechanism, body):
        found = motion(mechanism, body)
        return replace(found, inertia=found.inertia * sm.Rational(1001, 1000))

    monkeypatch.setattr(kane, "_motion", heavier)
    found = checked(pendulum(sm.Symbol("l_of_the_wrong_inertia")))
    assert 1e-5 < found.rates < 1e-2
    assert not found.ok


def test_a_rolling_disc_whose_velocities_are_given():
    """Positions alone do not tell its velocities: the contact point moves on."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    r, m, g = sm.symbols("r m g")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q[0], N.z])
    L = Y.orientnew("L", "Axis", [q[1], Y.x])
    R = L.orientnew("R", "Axis", [q[2], L.y])
    turning = R.ang_vel_in(N)
    R.set_ang_vel(N, u[0] * L.x + u[1] * L.y + u[2] * L.z)
    contact = Point("C")
    contact.set_vel(N, 0)
    centre = contact.locatenew("G", r * L.z)
    centre.v2pt_theory(contact, N, R)
    disc = RigidBody(
        "disc", centre, R, m, (inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2), centre)
    )
    rates = [dot(R.ang_vel_in(N) - turning, axis) for axis in L]
    method = KanesMethod(N, q_ind=q, u_ind=u, kd_eqs=rates)
    method.kanes_equations([disc], [(centre, -m * g * Y.z)])
    model = mechc.compile(method, defaults={r: 0.5, m: 2.0, g: 9.81})
    found = model.simulate(1.0, np.array([0.0, 0.2, 0.0, 0.1, 4.0, 0.3])).check()
    assert found.ok
    assert found.rates < 1e-9
    assert found.energy < 1e-11


def pulled(mass):
    """A body of 1 kg, tied to a light one that a force pulls."""
    x, v = dynamicsymbols("x1:3"), dynamicsymbols("v1:3")
    light, force = sm.Symbol("light"), sm.Symbol(f"F_{mass:.0e}".replace("-", "_"))
    N, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(N, 0)
    bodies, places = [], []
    for k, m in enumerate((sm.Integer(1), light)):
        place = origin.locatenew(f"P{k}", x[k] * N.x)
        place.set_vel(N, v[k] * N.x)
        places.append(place)
        bodies.append(Particle(f"B{k}", place, m))
    method = KanesMethod(
        N, x[:1], v[:1], kd_eqs=[a - b.diff(t) for a, b in zip(v, x, strict=True)],
        q_dependent=x[1:], u_dependent=v[1:], configuration_constraints=[x[0] - x[1]],
        velocity_constraints=[v[0] - v[1]],
    )  # fmt: skip
    method.kanes_equations(bodies, [(places[1], force * N.x)])
    return mechc.compile(method, defaults={light: mass, force: 1.0})


@pytest.mark.parametrize("mass", [1.0, 1e-6])
def test_a_load_is_judged_by_what_it_does_within_the_constraints(monkeypatch, mass):
    """By itself it would give the light body a millionfold acceleration."""
    forces = kane._generalized_active_forces
    monkeypatch.setattr(
        kane,
        "_generalized_active_forces",
        lambda mechanism: [f * sm.Rational(101, 100) for f in forces(mechanism)],
    )
    found = pulled(mass).simulate(1.0, np.zeros(4)).check()
    assert found.rates == pytest.approx(0.01, rel=0.02)
    assert not found.ok


def test_wrong_kinematics_are_found(monkeypatch):
    rates = kane.outputs.coordinate_rates
    monkeypatch.setattr(
        kane.outputs,
        "coordinate_rates",
        lambda mechanism, values: rates(mechanism, [v * sm.Rational(1001, 1000) for v in values]),
    )
    q, u = dynamicsymbols("q u")
    m = sm.Symbol("m_of_wrong_kinematics")
    N, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(N, 0)
    place = origin.locatenew("P", q * N.x)
    place.set_vel(N, 2 * u * N.x)
    method = KanesMethod(N, [q], [u], kd_eqs=[2 * u - q.diff(t)])
    method.kanes_equations([Particle("B", place, m)], [(place, -q * N.x)])
    found = mechc.compile(method, defaults={m: 1.0}).simulate(1.0, np.array([1.0, 0.0])).check()
    assert any("the rate of q is not that of the description" in each for each in found.warnings)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["andrews", "bicycle", "car_axis", "flyball_governor", "rigid_body", "slider_crank",
             "spatial_chain", "windows"]
)  # fmt: skip
def test_the_library(name):
    model = mechc.load(name)
    found = model.simulate(0.03, model.assemble()).check()
    assert found.ok, str(found)
    assert found.rates < 1e-7


def test_why_equations_are_not_compared():
    x, v = dynamicsymbols("x v")
    k = sm.Symbol("k")
    given = mechc.from_equations([x], [v], sm.Matrix([[1]]), sm.Matrix([-k * x]), defaults={k: 4.0})
    model = mechc.compile(given)
    found = model.simulate(1.0, np.array([1.0, 0.0])).check()
    assert found.rates is None
    assert "the equations of motion: they were given as matrices" in found.notes
    assert max(found.error) < 1e-8


@pytest.mark.parametrize("inertia_about_the_axis", [0.1, 0.7])
def test_a_wheel_whose_angle_is_no_coordinate(inertia_about_the_axis):
    """The frame of the wheel, and a point of it, are turned by a function that the equations do not
    contain: they have the velocities that are given."""
    x, b, v, w, alpha = dynamicsymbols("x b v w alpha")
    m, g, r, h, I = sm.symbols("m g r h I")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    wheel, rod = N.orientnew("A", "Axis", (alpha, N.z)), N.orientnew("B", "Axis", (b, N.z))
    wheel.set_ang_vel(N, v / r * N.z)
    rod.set_ang_vel(N, w * N.z)
    hub = O.locatenew("P", x * N.x)
    hub.set_vel(N, v * N.x)
    bob = hub.locatenew("G", h * rod.x)
    bob.v2pt_theory(hub, N, rod)
    bodies = [
        RigidBody("wheel", hub, wheel, m, (inertia(wheel, 0, 0, I), hub)),
        Particle("bob", bob, m),
    ]
    method = KanesMethod(N, [x, b], [v, w], kd_eqs=[x.diff(t) - v, b.diff(t) - w])
    brake = (w - v / r) * N.z
    method.kanes_equations(bodies, [(bob, -m * g * N.y), (wheel, brake), (rod, -brake)])
    values = {m: 1.0, g: 9.81, r: 0.5, h: 0.3, I: inertia_about_the_axis}
    model = mechc.compile(method, defaults=dict.fromkeys(values, 1.0))
    assert model.inputs == ()
    found = model.simulate(1.0, [0.1, 0.3, 0.2, 0.0], values).check()
    assert found.ok
    assert found.rates < 1e-11
