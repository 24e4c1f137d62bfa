"""Lookup tables: against SciPy's splines, in C and NumPy, with exact derivatives."""

import numpy as np
import pytest
import sympy as sm
from scipy.interpolate import CubicSpline, RectBivariateSpline
from sympy.physics.mechanics import (
    PinJoint,
    PrismaticJoint,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from benchmarks.problems.particle import particle
from mechc.errors import ValueOutOfBoundsError
from tests.compiler.export.test_standalone import NATIVE, Exported

X, Y = np.linspace(0.0, 3.0, 8) ** 1.2, np.linspace(-1.0, 1.0, 6)
CURVE = np.sin(2 * X)
SURFACE = np.cos(np.multiply.outer(X, Y)) + X[:, None]
q, u = dynamicsymbols("q u")
k = sm.Symbol("k")


def inside(count, seed=1):
    rng = np.random.default_rng(seed)
    return rng.uniform(X[0], X[-1], count), rng.uniform(-1, 1, count)


def test_values_are_those_of_scipys_splines():
    x, y = inside(50)
    beyond = np.linspace(-0.5, X[-1] + 0.5, 41)
    curve, surface = mechc.Table(X, CURVE), mechc.Table(X, Y, SURFACE)
    np.testing.assert_allclose(curve(beyond), CubicSpline(X, CURVE)(beyond), rtol=0, atol=1e-14)
    known = RectBivariateSpline(X, Y, SURFACE).ev(x, y)
    np.testing.assert_allclose(surface(x, y), known, rtol=1e-14)
    np.testing.assert_allclose(surface(X[:, None], Y), SURFACE, rtol=1e-15)
    lines = mechc.Table(X, CURVE, kind="linear")
    np.testing.assert_allclose(lines(x), np.interp(x, X, CURVE), rtol=0, atol=1e-15)
    assert isinstance(curve(0.3), float)


def test_beyond_the_samples():
    held = mechc.Table(X, Y, SURFACE, outside=("hold", "extend"))
    x, y = inside(5)
    np.testing.assert_array_equal(held(x - 10, y), held(np.full(5, X[0]), y))
    np.testing.assert_array_equal(held(x + 10, y), held(np.full(5, X[-1]), y))
    closed = np.append(CURVE[:-1], CURVE[0])
    around = mechc.Table(X, closed, outside="repeat")
    known = CubicSpline(X, closed, bc_type="periodic")
    np.testing.assert_allclose(around(x + 5 * X[-1]), known(x), rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "given",
    [
        ([0, 1, 2], [0, 1, 2]), ([0, 1, 1, 2], [0, 1, 2, 3]), ([0, 1, 2, 3], [0, 1, np.nan, 2]),
        ([0, 1, 2, 3], [0, 1, 2]), (X, Y, SURFACE.T), (X,), ("abcd", X),
    ],
)  # fmt: skip
def test_samples_that_are_none_are_refused(given):
    with pytest.raises(ValueOutOfBoundsError):
        mechc.Table(*given)


LARGE = [1e308, -1e308, 1e308, -1e308]


@pytest.mark.parametrize("kind", ["linear", "cubic"])
@pytest.mark.parametrize(
    "given",
    [
        ([0, 1, 2, 3], LARGE), ([0, 5e-324, 1e-323, 2e-323], [0, 1, 0, 1]),
        ([-1.7e308, -1e308, 1e308, 1.7e308], [0, 1, 0, 1]),
        ([0, 1, 2, 3], [0, 1, 2, 3], np.outer([1, -1, 1, -1], LARGE)),
    ],
)  # fmt: skip
def test_samples_beyond_doubles_are_refused_in_words(kind, given):
    """Their slopes were NaN, or 0 where a distance was infinite."""
    with pytest.raises(ValueOutOfBoundsError, match="within the range of doubles"):
        mechc.Table(*given, kind=kind)


def test_a_period_beyond_doubles_is_refused_and_far_ends_are_held():
    with pytest.raises(ValueOutOfBoundsError, match="within the range of doubles"):
        mechc.Table([-1e308, 0, 1e308], [0, 1, 0], kind="linear", outside="repeat")
    far = mechc.Table([-1e301, 1e300, 1e301], [5, 4, 3], kind="linear", outside="hold")
    assert [far(x) for x in (-1e308, -1e301, 1e301, 1e308)] == [5, 5, 3, 3]


def test_one_period_ends_where_it_begins():
    with pytest.raises(ValueOutOfBoundsError, match="last value equal to its first"):
        mechc.Table(X, CURVE, outside="repeat")


@pytest.fixture(scope="module")
def described():
    """A mass whose load is read from both tables, with their derivatives as outputs."""
    curve, surface = mechc.Table(X, CURVE), mechc.Table(X, Y, SURFACE)
    kane = particle([q], [u], [-k * surface(q, u) - curve(q)], 2)
    across = surface(q, u)
    outputs = {
        "slope": curve(q).diff(q), "bend": curve(q).diff(q, 2), "third": curve(q).diff(q, 3),
        "fourth": curve(q).diff(q, 4), "mixed": across.diff(q).diff(u),
        "by_u": across.diff(u, 2), "chained": curve(q**2 / 3).diff(q),
    }  # fmt: skip
    return kane, outputs


@pytest.fixture(scope="module")
def model(described):
    outputs = ("sensitivities", described[1])
    return mechc.compile(described[0], defaults={k: 3.0}, outputs=outputs)


@pytest.mark.slow
def test_exported_c_has_the_models_bits_at_samples_at_ends_and_beyond(tmp_path):
    """Of every kind, with slopes; C that no warning is given for."""
    at = np.array([0.0, 0.1, 0.25, 0.7, 1.0, 1.3])
    values = [0.0, 0.3, 0.2, -0.4, 0.1, 0.0]
    tables = [
        mechc.Table(at, values, kind=kind, outside=outside)(q)
        for kind in ("linear", "cubic")
        for outside in ("extend", "hold", "repeat")
    ]
    surface = mechc.Table(at, at[:4], np.outer(np.cos(at), at[:4]), outside=("hold", "extend"))
    found = [*tables, *(table.diff(q) for table in tables), surface(q, u)]
    outputs = {f"table {i}": each for i, each in enumerate(found)}
    kane = particle([q], [u], [0], 1)
    model = mechc.compile(kane, outputs=(outputs,))
    mechc.export_c(kane, tmp_path, name="tables", outputs=(outputs,))
    fused = (*NATIVE, "-march=native", "-ffp-contract=off")  # as models are compiled
    exported = Exported(tmp_path, "tables", 2, [], np.zeros(2), fused)
    near = [*at, *np.nextafter(at, -9), *np.nextafter(at, 9)]
    for x in (*near, -1e-3, -5.2, -2.6, 0.55, 2.6, 7.0, 1e6, -1e6, 1e18, -1e200, 1e-300):
        y = [x, 0.33]
        for i, name in enumerate(outputs):
            known = np.ravel(model.output(name, y))
            np.testing.assert_array_equal(exported.output(f"own_{i}", 1, y), known)


def test_derivatives_are_exact_in_compiled_code(model):
    x, y = inside(40, seed=2)
    states = np.column_stack([x, y])
    curve, surface = CubicSpline(X, CURVE), RectBivariateSpline(X, Y, SURFACE)
    known = {
        "slope": curve(x, 1), "bend": curve(x, 2), "third": curve(x, 3), "fourth": 0 * x,
        "mixed": surface.ev(x, y, 1, 1), "by_u": surface.ev(x, y, 0, 2),
        "chained": curve(x**2 / 3, 1) * 2 * x / 3,
    }  # fmt: skip
    for name, values in known.items():
        np.testing.assert_allclose(model.output(name, states), values, rtol=1e-11, atol=1e-11)


@pytest.mark.slow
def test_motions_and_their_derivatives(model):
    """The same in a batch to the last bit, and by differences of a parameter."""
    sol = model.simulate(5.0, [0.5, 0.1], rtol=1e-11)
    assert sol.status.ok
    starts = np.array([[0.5, 0.1], [1.5, -0.3], [2.0, 0.0], [0.7, 0.2], [1.0, 0.5]])
    batch = model.simulate_batch(5.0, starts, t_eval=[5.0], rtol=1e-11)
    for start, states in zip(starts, batch.y, strict=True):
        single = model.simulate(5.0, start, t_eval=[5.0], rtol=1e-11)
        np.testing.assert_array_equal(np.ravel(states), single.y[-1])
    derived = model.simulate(5.0, [0.5, 0.1], rtol=1e-11, sensitivities=["k"])
    step = 1e-4
    sides = [model.simulate(5.0, [0.5, 0.1], {k: 3 + d}, rtol=1e-12).y[-1] for d in (-step, step)]
    difference = (sides[1] - sides[0])[0] / (2 * step)
    np.testing.assert_allclose(
        derived.sensitivity_of("q", "k")[-1], difference, rtol=1e-5, atol=1e-6
    )


def test_events_and_resets_with_tables_are_compiled(model):
    """Against functions of Python over SciPy's splines, and in a batch."""
    curve, surface = mechc.Table(X, CURVE), mechc.Table(X, Y, SURFACE)
    one, two = CubicSpline(X, CURVE), RectBivariateSpline(X, Y, SURFACE)
    wall = mechc.Event(curve(q) - k / 10, reset={u: -u * (1 + surface(q, u / 4)) / 4})

    def turned(t, at, speed):
        return at, -speed * (1 + two.ev(at, speed / 4)) / 4

    by_python = mechc.Event(lambda t, y: one(y[0]) - 0.3, reset=turned)
    sol, other = (
        model.simulate(2.6, [0.6, 0.9], events=event, rtol=1e-12) for event in (wall, by_python)
    )
    assert len(sol.events[0].t) == len(other.events[0].t) >= 2
    np.testing.assert_allclose(sol.events[0].t, other.events[0].t, atol=1e-11)
    np.testing.assert_allclose(sol.y[-1], other.y[-1], atol=1e-10)
    batch = model.simulate_batch(2.6, [[0.6, 0.9]] * 3, events=wall, rtol=1e-12)
    np.testing.assert_array_equal(batch.y[1], sol.y[-1])
    assert batch.event_latest[1, 0] == sol.events[0].t[-1]


@pytest.mark.slow
def test_a_cam_by_samples_over_many_turns():
    """A table that repeats is the lift; the follower is where its samples' spline says."""
    turn = np.linspace(0.0, 2 * np.pi, 25)
    rise = 0.02 * (1 - np.cos(turn)) + 0.004 * np.sin(2 * turn)
    rise[-1] = rise[0]
    lift = mechc.Table(turn, rise, outside="repeat")
    ground, disc, follower = (RigidBody(name, mass=1.0) for name in ("ground", "disc", "follower"))
    disc.central_inertia = inertia(disc.frame, 0, 0, 0.05)
    pin = PinJoint("pin", ground, disc, joint_axis=ground.z)
    slide = PrismaticJoint(
        "slide", ground, follower, parent_point=0.1 * ground.y, joint_axis=ground.y
    )
    contact = mechc.Coupling.cam("contact", pin, slide, lift(pin.coordinates[0]))
    mechanism = mechc.from_joints("cam", [pin, slide, contact], gravity=-9.81 * ground.y)
    model = mechc.compile(mechanism, outputs=("energy",))
    sol = model.simulate(3.0, model.assemble({"q_pin": 0.1}, {"u_pin": 20.0}), rtol=1e-9)
    assert sol.status.ok
    assert sol["q_pin"][-1] > 8 * np.pi
    known = CubicSpline(turn, rise, bc_type="periodic")(sol["q_pin"])
    np.testing.assert_allclose(sol["q_slide"], known, atol=1e-13)
    assert np.ptp(sol.energy) < 1e-7 * sol.energy.max()


def test_a_function_of_state_is_what_a_table_says():
    """street(q), undefined in the description, in a System's or a method's loads."""
    street = sm.Function("street")
    kane = particle([q], [u], [street(q).diff(q)], 2)
    table = mechc.Table(X, CURVE)
    bound = mechc.compile(kane, inputs={street(q): table}, outputs=())
    known = CubicSpline(X, CURVE)(1.3, 1) / 2
    assert bound.rhs(0.0, [1.3, 0.2])[1] == pytest.approx(known, rel=1e-13)
