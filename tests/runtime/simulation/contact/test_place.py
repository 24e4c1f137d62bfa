"""The compiled equations of contacts against a system of equations solved in another way."""

from typing import Any, NamedTuple

import numpy as np
import pytest

import mechc
from mechc.compilation.event_unit import COMPILER
from mechc.native._codes import NOT_CLOSED, RUNNING, SINGULAR_MASS
from mechc.simulation.contact.laws import Laws, contact_laws
from mechc.simulation.contact.manifold import ContactManifold
from mechc.simulation.contact.modes import State
from mechc.simulation.contact.place import Contacts
from mechc.simulation.events.event import FunctionFailedError
from mechc.simulation.events.expressions import Compiler, checked_events
from tests.support.impacts import TIP_GAP, TIP_SLIP, rod

FRICTION, FORCE = 0.3, 0.7
CLIMB = 0.4  # m/s or rad/s: a stop that moves, so that what touches it does


class Scene(NamedTuple):
    """A system at a state with a stop and a place of dry friction.

    Of the stop the row of the gap, its acceleration without u', the row of the slip and its rate
    without u'; of the other place the row of the slip: functions of q and u.
    """

    system: Any
    p: Any
    y: Any
    events: Any
    gap: Any
    bend: Any
    slip: Any
    drift: Any
    other: Any


@pytest.fixture(scope="module", name="linkage")
def four_bar_with_contacts():
    """A four-bar whose rocker leans on a stop that moves, with friction in the crank's pivot."""
    model = mechc.load("four_bar")
    y = np.asarray(model.assemble({"theta_0": 1.2}, speeds={"omega_0": 2.0}), np.float64)
    gap = f"sin(theta_2) - {float(np.sin(y[2]))!r} - {CLIMB}*t - 0.3*t**2"
    stop = mechc.Stop(gap, 0.2, friction=FRICTION, slip="0.1*omega_0 + omega_1")
    return Scene(
        model.system, model.system.parameter_set.resolve(None), y,
        [stop, mechc.DryFriction("omega_0", mu=FORCE)],
        lambda q: (0.0, 0.0, np.cos(q[2])), lambda q, u: -np.sin(q[2]) * u[2] ** 2 - 0.6,
        lambda q: (0.1, 1.0, 0.0), lambda q, u: 0.0, (1.0, 0.0, 0.0),
    )  # fmt: skip


@pytest.fixture(scope="module", name="tip")
def rod_on_a_rising_floor():
    model, l = rod(), 1.0
    p = model.system.parameter_set.resolve(None)
    y = np.array([0.1, l * np.sin(0.5), 0.5, 0.8, 0.2, -0.6])
    stop = mechc.Stop(f"{TIP_GAP} - {CLIMB}*t", friction=FRICTION, slip=TIP_SLIP)
    return Scene(
        model.system, p, y, [stop, mechc.DryFriction("v_x - 0.2*v_y", mu=FORCE)],
        lambda q: (0.0, 1.0, -l * np.cos(q[2])), lambda q, u: l * np.sin(q[2]) * u[2] ** 2,
        lambda q: (1.0, 0.0, l * np.sin(q[2])), lambda q, u: l * np.cos(q[2]) * u[2] ** 2,
        (1.0, -0.2, 0.0),
    )  # fmt: skip


def contacts_of(system, p, given, *, compiled=True):
    compiler = Compiler(*COMPILER)
    laws = contact_laws(checked_events(given, system, p, compiler))
    used = compiler.compile if compiled else None
    return Contacts(Laws(laws, system, p, used), system, p, (0.0, 1.0))


def solved(scene, y, mode):
    """u' with multipliers of loops and contacts, of one system of linear equations."""
    system, p, split = scene.system, scene.p, len(scene.system.coordinates)
    q, u, free = y[:split], y[split:], system.rates(y, p)[split:]
    mass, jacobian = system.mass_matrix(y, p), system.constraint_jacobian(y, p)
    gap, slip, other = (np.array(row) for row in (scene.gap(q), scene.slip(q), scene.other))
    rows, columns, aims = [], [], []
    known = mass @ free - FORCE * mode[1].way * other
    if mode[0] is not State.OPEN:
        rows.append(gap)
        columns.append(gap - FRICTION * mode[0].way * slip)
        aims.append(-scene.bend(q, u))
    for state, row, drift in ((mode[0], slip, scene.drift(q, u)), (mode[1], other, 0.0)):
        if state is State.STICKS:
            rows.append(row)
            columns.append(row)
            aims.append(-drift)
    n, nc, m = len(u), len(jacobian), len(rows)
    whole = np.zeros((n + nc + m, n + nc + m))
    whole[:n, :n], whole[:n, n : n + nc], whole[n : n + nc, :n] = mass, jacobian.T, jacobian
    if m:
        whole[:n, n + nc :], whole[n + nc :, :n] = -np.array(columns).T, np.array(rows)
    right = np.concatenate([known, jacobian @ free, aims])
    return np.linalg.lstsq(whole, right, rcond=1e-13)[0][:n]


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [
        ("linkage", State.OPEN, State.SLIDES_ON),
        ("linkage", State.OPEN, State.STICKS),
        ("linkage", State.SLIDES_BACK, State.SLIDES_ON),
        ("linkage", State.SLIDES_ON, State.SLIDES_BACK),
        ("tip", State.STICKS, State.SLIDES_BACK),
        ("tip", State.SLIDES_ON, State.STICKS),
        ("tip", State.STICKS, State.STICKS),
    ],
)
@pytest.mark.parametrize("compiled", [True, False])
def test_the_rates_in_a_mode_solve_the_equations_of_motion(name, first, second, compiled, request):
    scene, mode = request.getfixturevalue(name), (first, second)
    system, p, split = scene.system, scene.p, len(scene.system.coordinates)
    manifold = ContactManifold(contacts_of(system, p, scene.events, compiled=compiled), mode)
    states, found = manifold.settle(np.array([0.0]), scene.y[None] + 1e-6)
    assert found.status.tolist() == [RUNNING]
    y, q, u = states[0], states[0, :split], states[0, split:]
    if first is not State.OPEN:
        place = manifold.contacts.place(0.0, y)
        assert abs(place.numbers.gap[0]) < 1e-15
        assert abs(np.dot(scene.gap(q), u) - CLIMB) < 1e-14
    for state, row in ((first, scene.slip(q)), (second, scene.other)):
        assert state is not State.STICKS or abs(np.dot(row, u)) < 1e-14
    assert np.abs(system.constraint_jacobian(y, p) @ u).max(initial=0.0) < 1e-13
    exact, size = solved(scene, y, mode), np.abs(system.rates(y, p)).max()
    np.testing.assert_allclose(found.rates[0, split:], exact, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(manifold.rates(0.0, y), found.rates[0], rtol=0, atol=1e-13 * size)


def test_the_coordinates_rates_may_be_no_speeds(linkage):
    """N, and q'' by differences, where that q' = u is not made use of."""
    system, p, y, given = linkage[:4]
    plain, other = (contacts_of(system, p, given) for _ in range(2))
    other.plain = False
    one, two = plain.place(0.0, y), other.place(0.0, y)
    np.testing.assert_allclose(two.kinematic, np.eye(len(y) - len(one.v)), rtol=0, atol=1e-15)
    np.testing.assert_allclose(two.normal, one.normal, rtol=1e-13)
    for found, expected in zip(two.free, one.free, strict=True):
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=1e-9 * np.abs(one.free.rates).max()
        )


def test_laws_without_a_value_and_states_without_a_mass_are_told(linkage):
    system, p, y = linkage[:3]
    bush = contacts_of(system, p, [mechc.Stop("-sqrt(theta_2 - 10)")])
    with pytest.raises(FunctionFailedError, match=r"event 0 has no rate.* at t = 0\.5 s"):
        bush.place(0.5, y)
    massless = contacts_of(system, np.zeros_like(p), [mechc.DryFriction("omega_0", mu=FORCE)])
    manifold = ContactManifold(massless, (State.SLIDES_ON,))
    assert manifold.settled(0.0, y)[0] in (SINGULAR_MASS, NOT_CLOSED)
