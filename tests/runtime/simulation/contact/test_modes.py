"""The rates of a motion in contact against equations of motion that are solved in another way."""

import numpy as np
import pytest

import mechc
from mechc.errors import EventError
from tests.support.impacts import rod
from tests.support.pendulums import pushed_mass

FRICTION, FORCE = 0.3, 0.7
RISE = 200.0  # m/s^2 or rad/s^2: what a stop rises by, so that what touches it is pressed
WAYS = {"slides +": 1.0, "slides -": -1.0}


class Linkage:
    """A four-bar whose rocker leans on a stop that rises, with friction in the crank's pivot."""

    gap, slip, other = "sin(theta_2)", "0.1*omega_0 + omega_1", "omega_0"

    def __init__(self):
        self.model = mechc.load("four_bar")
        self.y = self.model.assemble({"theta_0": 1.2}, speeds={"omega_0": 2.0})

    def rows(self, q, u):
        """The gap, its acceleration without u', the slip, its rate without u', the other slip."""
        bend = -np.sin(q[2]) * u[2] ** 2
        return (
            np.array([0.0, 0.0, np.cos(q[2])]),
            bend,
            np.array([0.1, 1.0, 0.0]),
            0.0,
            np.eye(3)[0],
        )


class Tip:
    """A rod on a floor that rises, and friction against a board that slopes."""

    gap, slip, other = "y - l*sin(theta)", "v_x + l*sin(theta)*omega", "v_x - 0.2*v_y"

    def __init__(self):
        self.model = rod()
        self.y = np.array([0.1, np.sin(0.5), 0.5, 0.8, 0.2, -0.6])

    def rows(self, q, u):
        s, c = np.sin(q[2]), np.cos(q[2])
        along = np.array([1.0, 0.0, s])
        return np.array([0.0, 1.0, -c]), s * u[2] ** 2, along, c * u[2] ** 2, np.array([1, -0.2, 0])


@pytest.fixture(scope="module", name="scenes")
def scenes_in_contact():
    return {"linkage": Linkage(), "tip": Tip()}


def accelerations(scene, y, states):
    """u' with multipliers of loops and contacts, of one system of linear equations."""
    system = scene.model.system
    p, split = system.parameter_set.resolve(None), len(y) // 2
    gap, bend, slip, drift, other = scene.rows(y[:split], y[split:])
    free = system.rates(y, p)[split:]
    mass, jacobian = system.mass_matrix(y, p), system.constraint_jacobian(y, p)
    ways = [WAYS.get(state, 0.0) for state in states]
    known = mass @ free - FORCE * ways[1] * other
    held = []  # row, the column along which its force acts, the acceleration aimed at
    if states[0] != "open":
        held.append((gap, gap - FRICTION * ways[0] * slip, RISE - bend))
    held += [
        (row, row, -rate)
        for state, row, rate in zip(states, (slip, other), (drift, 0.0), strict=True)
        if state == "sticks"
    ]  # fmt: skip
    n, nc, m = len(free), len(jacobian), len(held)
    whole = np.zeros((n + nc + m, n + nc + m))
    whole[:n, :n], whole[:n, n : n + nc], whole[n : n + nc, :n] = mass, jacobian.T, jacobian
    for k, (row, column, _) in enumerate(held, n + nc):
        whole[:n, k], whole[k, :n] = -column, row
    right = np.concatenate([known, jacobian @ free, [aim for *_, aim in held]])
    return np.linalg.lstsq(whole, right, rcond=1e-13)[0][:n]


def started(scene, states, compiled):
    """A run that begins in these states of its two contacts, and which they are."""
    model, y = scene.model, np.asarray(scene.y)
    split = len(y) // 2
    gap, _, slip, _, other = scene.rows(y[:split], y[split:])
    is_open = states[0] == "open"
    reached = {"sin(theta_2)": np.sin(y[2])}.get(scene.gap, 0.0) - float(is_open)
    slips = [
        f"{expression} - ({float(row @ y[split:]) - WAYS.get(state, 0.0)!r})"
        for expression, row, state in zip(
            (scene.slip, scene.other), (slip, other), states, strict=True
        )
    ]
    stuck = [1e3 if state == "sticks" else None for state in states]
    height = (
        f"{scene.gap} - ({float(reached)!r}) - ({float(gap @ y[split:])!r})*t - {RISE / 2}*t**2"
    )
    events = [
        mechc.Stop(height, friction=FRICTION, static=stuck[0], slip=slips[0]),
        mechc.DryFriction(slips[1], mu=FORCE, static=stuck[1]),
    ]
    if not compiled:  # one function of Python, and none is compiled
        events.append(mechc.Event(lambda t, y: 1.0 + t))
    sol = model.simulate(1e-3, y, events=events, first_step=1e-4, rtol=1e-3)
    return sol, sol.segments[0].contacts[:2]


@pytest.mark.parametrize(
    ("name", "states"),
    [
        ("linkage", ("open", "slides +")),
        ("linkage", ("open", "sticks")),
        ("linkage", ("slides -", "slides +")),
        ("linkage", ("slides +", "slides -")),
        ("tip", ("sticks", "slides -")),
        ("tip", ("slides +", "sticks")),
        ("tip", ("sticks", "sticks")),
    ],
)
@pytest.mark.parametrize("compiled", [True, False])
def test_the_rates_in_a_mode_solve_the_equations_of_motion(name, states, compiled, scenes):
    scene = scenes[name]
    sol, found = started(scene, states, compiled)
    assert found == states
    steps = sol.record.pieces[0].steps
    t, y = steps.states()
    rows = steps.rows()[0]
    split = y.shape[1] // 2
    rates = (rows[0] + rows[1]) / (t[1] - t[0])  # first stage: Hairer, Norsett & Wanner (1993)
    np.testing.assert_allclose(y[0], scene.y, rtol=0, atol=1e-14)
    np.testing.assert_allclose(rates[:split], y[0, split:], rtol=1e-11)
    exact = accelerations(scene, y[0], states)
    np.testing.assert_allclose(rates[split:], exact, rtol=0, atol=1e-10 * np.abs(exact).max())


def test_laws_without_a_value_are_told(scenes):
    with pytest.raises(EventError, match=r"event 0 has no rate.* at t = 0 s"):
        scenes["tip"].model.simulate(1.0, scenes["tip"].y, events=mechc.Stop("-sqrt(theta - 10)"))


@pytest.mark.parametrize("method", ["auto", "dopri5", "dop853", "radau5"])
def test_a_body_breaks_away_under_a_force_that_grows_from_nothing(method):
    """At rest its rates are rounding, beside which no error of a step is large."""
    model = mechc.compile(pushed_mass(), defaults={"m": 1.3, "k": 0.0}, inputs=["F"])
    drag = mechc.DryFriction("u", 0.5)
    sol = model.simulate(3.0, {"q": 0}, inputs={"F": "0.5*t"}, events=drag, method=method)
    assert sol.status.ok
    assert sol.events[0].t == pytest.approx([1.0], abs=1e-9)
    assert sol["q"][-1] == pytest.approx(0.5 * 2.0**3 / 6 / 1.3, rel=1e-9)  # m q'' = (t - 1) / 2
