"""The bicycle, compiled from a KanesMethod, against the published figures of two groups."""

import json

import numpy as np
import pytest
from mechc_codegen.library.spatial.bicycle import INDEPENDENT, NAMES, R_REAR, G, bicycle, values

import mechc
from tests.support import DATA, LOCKSTEP, by

pytestmark = pytest.mark.slow

PUBLISHED = json.loads((DATA / "bicycle.json").read_text("utf-8"))
EIGHTH_ORDER = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # coefficients of central differences
STEP = 0.007
OUTPUTS = ("energy", "multipliers", "state_jacobian", "parameter_jacobian")
TORQUES = ("lean_torque", "steer_torque")
LATERAL = ("roll", "steer", "roll_rate", "steer_rate")


@pytest.fixture(scope="module")
def model():
    return mechc.compile(bicycle(), defaults=values(), outputs=OUTPUTS)


def places(model):
    return {name: k for k, name in enumerate((*model.coordinates, *model.speeds))}


def test_one_holonomic_and_four_nonholonomic_constraints_are_found(model):
    size = len(model.coordinates) + len(model.speeds)
    assert model.constraints(np.zeros(size)).shape == (1,)
    assert model.velocity_constraints(np.zeros(size)).shape == (5,)


def test_accelerations_at_a_general_state_are_the_published_ones(model):
    """Which have 13 decimals, from a state with 13 decimals."""
    place = places(model)
    y = np.zeros(len(place))
    for name, value in PUBLISHED["general_state"].items():
        y[place[name]] = value
    np.testing.assert_allclose(model.constraints(y), 0, atol=1e-12)
    np.testing.assert_allclose(model.velocity_constraints(y), 0, atol=1e-12)
    rates = model.rhs(0.0, y)
    for name, value in PUBLISHED["general_accelerations"].items():
        assert rates[place[name]] == pytest.approx(value, abs=2e-12), name


def test_the_library_has_the_same_bicycle_by_its_constraints(model):
    """Written as a mechanism with five constraint rows, instead of read from Kane's method."""
    library = mechc.load("bicycle", outputs=("energy",))
    assert len(library.constraint_names) == 5
    assert library.defaults == pytest.approx(values(), rel=1e-15)
    y = np.zeros(len(places(model)))
    for name, value in PUBLISHED["general_state"].items():
        y[places(model)[name]] = value
    ours = y[[places(model)[name] for name in (*library.coordinates, *library.speeds)]]
    rates = dict(zip((*library.coordinates, *library.speeds), library.rhs(0.0, ours), strict=True))
    for name, value in PUBLISHED["general_accelerations"].items():
        assert rates[name] == pytest.approx(value, abs=2e-12), name
    assert library.energy(ours) == pytest.approx(model.energy(y), rel=1e-13)


def on_the_manifold(model, speed, **lateral):
    """The state with these lateral components, the rear wheel turning for this speed."""
    place, size = places(model), len(model.coordinates)
    y = np.zeros(len(place))
    y[place["pitch"]] = np.pi / 10
    for name, value in lateral.items():
        y[place[name]] = value
    for _ in range(8):  # Newton: the constraint's slope by the pitch is that of its rate
        y[size:] = 0.0
        y[place["pitch_rate"]] = 1.0
        slope = model.velocity_constraints(y)[0]
        y[place["pitch"]] -= model.constraints(y)[0] / slope
    y[size:] = 0.0
    chosen = {"roll_rate": 0.0, "steer_rate": 0.0, **lateral, "rear_rate": -speed / R_REAR}
    free = [place[name] for name in ("roll_rate", "steer_rate", "rear_rate")]
    y[free] = [chosen[name] for name in ("roll_rate", "steer_rate", "rear_rate")]
    others = [k for k in range(size, len(y)) if k not in free]
    jacobian = model.constraint_jacobian(y)[:, np.array(others) - size]
    y[others] = -np.linalg.solve(jacobian, model.velocity_constraints(y))
    return y


def lateral_accelerations(model, speed, params=None, **lateral):
    rates = model.rhs(0.0, on_the_manifold(model, speed, **lateral), params)
    return rates[[places(model)[name] for name in ("roll_rate", "steer_rate")]]


def slopes(function, names):
    """Columns of d function / d name at zero."""

    def column(name):
        return sum(
            c / STEP * (function(**{name: k * STEP}) - function(**{name: -k * STEP}))
            for k, c in EIGHTH_ORDER.items()
        )

    return np.stack([column(name) for name in names], axis=-1)


def linearised(model, speed):
    """M, damping and stiffness: accelerations by torques, by rates and by angles."""

    def by_torque(**torques):
        return lateral_accelerations(model, speed, torques)

    def by_state(**lateral):
        return lateral_accelerations(model, speed, **lateral)

    mass = np.linalg.inv(slopes(by_torque, TORQUES))
    state = slopes(by_state, LATERAL)
    return mass, -mass @ state[:, 2:], -mass @ state[:, :2]


def by_derivatives(model, speed):
    """The same of the linear model on the constraints."""
    free = [*(name for name in NAMES if name != "pitch"), *(f"{n}_rate" for n in INDEPENDENT)]
    state = on_the_manifold(model, speed)
    linear = model.linearize(state, inputs=TORQUES, independent=free)
    place = [linear.states.index(name) for name in LATERAL]
    mass = np.linalg.inv(linear.B[place[2:]])
    slope = linear.A[np.ix_(place[2:], place)]
    return mass, -mass @ slope[:, 2:], -mass @ slope[:, :2]


@pytest.mark.parametrize("by", [linearised, by_derivatives])
@pytest.mark.parametrize("speed", [0.0, 1.0, 4.2923825363, 6.0242620154, 10.0])
def test_the_linearisation_is_the_published_one(model, speed, by):
    """About upright straight running: differences of compiled rates, and ``model.linearize``."""
    M, C1, K0, K2 = (np.array(PUBLISHED[name]) for name in ("M", "C1", "K0", "K2"))
    published = (M, speed * C1, G * K0 + speed**2 * K2)
    for found, expected in zip(by(model, speed), published, strict=True):
        largest = np.abs(expected).max(initial=1.0)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * largest)


def test_it_is_stable_between_the_published_speeds(model):
    """Weave dies out above the one, capsizing begins at the other."""
    for speed, place in (("v_weave", "weave"), ("v_capsize", "capsize")):
        mass, damping, stiffness = by_derivatives(model, PUBLISHED[speed])
        below = np.hstack([-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)])
        roots = np.linalg.eigvals(np.vstack([np.eye(2, 4, 2), below]))
        slowest = roots[np.abs(roots.real).argmin()]
        assert abs(slowest.real) < 1e-11, place
        assert (abs(slowest.imag) > 1.0) == (place == "weave")
        assert (np.delete(roots.real, np.abs(roots.real - slowest.real) < 1e-6) < 0).all()


def test_energy_is_kept_in_a_general_motion(model):
    """The power of the constraint forces vanishes: none of the wheels slips."""
    y = on_the_manifold(model, 5.0, roll=0.3, steer=0.4, roll_rate=0.7, steer_rate=-0.9)
    rates = model.rhs(0.0, y)
    change = sum(
        c / 1e-3 * (model.energy(y + k * 1e-3 * rates) - model.energy(y - k * 1e-3 * rates))
        for k, c in EIGHTH_ORDER.items()
    )
    assert abs(change) < 1e-8 * model.kinetic_energy(y)


@pytest.mark.parametrize("method", ["dop853", LOCKSTEP])
def test_bicycles_in_lockstep(model, method):
    """Of several speeds and pushes, against collocation, and each as by itself to the last bit."""
    starts = np.array([
        on_the_manifold(model, speed, roll_rate=push, steer=0.1)
        for speed, push in zip(np.linspace(3.0, 7.0, 11), np.linspace(-0.5, 0.5, 11), strict=True)
    ])  # fmt: skip
    batch = model.simulate_batch(1.0, starts, rtol=1e-10, **by(method))
    exact = model.simulate_batch(1.0, starts, rtol=1e-13, method="gauss8")
    assert batch.ok.all()
    assert np.abs(batch.y - exact.y).max() < 1e-8
    for k in (0, 5, 10):
        sol = model.simulate(1.0, starts[k], rtol=1e-10, **by(method))
        assert np.array_equal(sol.y[-1], batch.y[k])
    if (
        method == "dop853"
    ):  # alone every stage is put on the constraints, by one configuration or more
        assert batch["closure_iterations"].max() < 0.5 * batch["rhs_evaluations"].max()
