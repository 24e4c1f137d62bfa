"""Taylor series of the motion: closed forms, members of batches, ends, and what is refused."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from sympy import Symbol, cos, exp, lambdify, log, sin, sqrt, symbols, tan
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc
from benchmarks.problems.particle import particle
from mechc.errors import ValueOutOfBoundsError
from tests.support.impacts import points_on_a_line
from tests.support.scenes import bead_with

RATE = np.sqrt(9.81)
LEVEL = np.array([np.pi / 2, 0.0])
MODULUS = 0.5  # squared, of a pendulum that starts level
SPIN = np.array([0.0, 0.0, 0.0, 0.0, 150.0, -4.61538])


def swung(t):
    """Angle and speed of the pendulum of 1 m from rest with its link level."""
    sn, cn, dn, _ = ellipj(ellipk(MODULUS) - RATE * np.asarray(t), MODULUS)
    k = np.sqrt(MODULUS)
    speed = -2 * k * RATE * cn * dn / np.sqrt(1 - (k * sn) ** 2)
    return np.stack([2 * np.arcsin(k * sn), speed], axis=-1)


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum", links=1)


@pytest.fixture(scope="module")
def top():
    return mechc.load("heavy_top")


@pytest.mark.parametrize("end", [7.0, -7.0])
def test_the_error_follows_rtol_also_between_the_steps(pendulum, end):
    """From rest: of a motion that is even in time every other coefficient vanishes."""
    times = np.linspace(0.0, end, 257)
    errors = []
    for decade in range(3, 14):
        sol = pendulum.simulate(end, LEVEL, rtol=10.0**-decade, method="taylor", t_eval=times)
        assert sol.status.ok
        np.testing.assert_array_equal(sol.t, times)
        errors.append(np.abs(sol.y - swung(times)).max())
        assert errors[-1] < max(20 * 10.0**-decade, 1e-12)
    for before, after in zip(errors, errors[2:], strict=False):
        assert after < max(before / 5, 1e-12), errors
    assert sol.stats["method"] == "taylor"
    assert sol.stats["steps"] < 60


@pytest.mark.parametrize(("scene", "start", "end"), [("top", SPIN, 0.3), ("pendulum", LEVEL, 2.0)])
def test_a_member_of_a_batch_has_the_bits_of_a_run(request, scene, start, end):
    """Many sums over lower orders lie in the lanes of a run, few are added up one by one."""
    model, random = request.getfixturevalue(scene), np.random.default_rng(18)
    states = start + random.normal(scale=0.05, size=(11, len(start)))
    times = np.linspace(0.0, end, 7)
    for rtol in (1e-4, 1e-9, 1e-13):
        batch = model.simulate_batch(end, states, rtol=rtol, method="taylor", t_eval=times)
        assert batch.ok.all()
        for member in (0, 3, 7, 8, 10):
            one = model.simulate(end, states[member], rtol=rtol, method="taylor", t_eval=times)
            np.testing.assert_array_equal(batch.y[member], one.y[-1])
            np.testing.assert_array_equal(batch.y_eval[member], one.y)


def test_tolerances_of_each_component_and_steps_given(pendulum):
    each = np.array([1e-8, 1e-7])
    states = np.stack([LEVEL, 0.5 * LEVEL])
    given = {"rtol": 1e-8, "atol": each, "method": "taylor", "max_step": 0.1, "first_step": 0.004}
    sol = pendulum.simulate(3.0, LEVEL, **given)
    steps = np.diff(sol.t)
    assert steps[0] == pytest.approx(0.004, rel=1e-12)
    assert steps.max() <= 0.1 * (1 + 1e-12)
    np.testing.assert_allclose(sol.y, swung(sol.t), rtol=0, atol=1e-6)
    batch = pendulum.simulate_batch(3.0, states, **given)
    np.testing.assert_array_equal(batch.y[0], sol.y[-1])


@pytest.mark.slow
def test_steps_are_bounded_where_coefficients_vanish(pendulum):
    """A fall is a polynomial, and at rest all rates vanish: any step would do."""
    fall = points_on_a_line("fall", 1, lambda q, u, m: -9.81 * m).simulate(
        100.0, [0.0, 3.0], method="taylor"
    )
    np.testing.assert_allclose(fall.y[-1], [300 - 9.81 * 5000, 3 - 981.0], rtol=1e-14)
    rest = pendulum.simulate(100.0, [0.0, 0.0], method="taylor")
    np.testing.assert_array_equal(rest.y[-1], 0.0)
    for sol in (fall, rest):
        steps = np.diff(sol.t)
        assert (steps[1:] <= 8.1 * steps[:-1]).all()


def test_a_run_goes_on_stops_at_events_and_comes_back(pendulum):
    quarter = ellipk(MODULUS) / RATE
    sol = pendulum.simulate(
        5.0, LEVEL, rtol=1e-11, method="taylor", events=[mechc.Event("theta_0", terminal=True)]
    )
    assert sol.events[0].t[0] == pytest.approx(quarter, rel=1e-11)
    half = pendulum.simulate(1.3, LEVEL, rtol=1e-11, method="taylor")
    whole = half.continue_to(4.0)
    np.testing.assert_allclose(whole.y, swung(whole.t), rtol=0, atol=1e-9)
    back = pendulum.simulate((4.0, 0.0), whole.y[-1], rtol=1e-11, method="taylor")
    np.testing.assert_allclose(back.y[-1], LEVEL, rtol=0, atol=1e-9)


def test_a_step_does_not_lead_through_what_its_series_does_not_know():
    """Free flight against a wall exp(200 (q - 10)) / 200, and back with the same speed."""
    q = dynamicsymbols("q")
    model = mechc.compile(bead_with(-exp(200 * (q - 10))), outputs=())
    for rtol in (1e-6, 1e-9):
        sol = model.simulate(20.0, [0.0, 1.0], rtol=rtol, method="taylor")
        energy = sol.y[:, 1] ** 2 / 2 + np.exp(200 * (sol.y[:, 0] - 10)) / 200
        assert sol["u"][-1] == pytest.approx(-1.0, abs=10 * rtol)
        assert np.abs(energy - 0.5).max() < 10 * rtol
        assert sol.stats["rejected"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_the_phase_error_grows_about_as_the_time(pendulum, method):
    """As its square it would be a hundred times as large after ten times as many swings."""
    ends, errors = ellipk(MODULUS) / RATE * (4 * np.array([1000, 10000]) + 1), []
    for end in ends:
        last = pendulum.simulate(end, LEVEL, rtol=1e-9, method=method, dense=False).y[-1]
        errors.append(abs(last[0]) / RATE)
    assert errors[1] < 30 * errors[0] + 1e-8
    assert errors[1] < 1e-4


@pytest.mark.slow
def test_every_operation_has_its_recurrence():
    """Against SciPy's integrator on the equation as SymPy writes it."""
    q, u = dynamicsymbols("q u")
    t, f = dynamicsymbols._t, Symbol("f")
    laws = [
        -f * q + log(2 + q**2) * exp(-u) / 5,
        sqrt(1 + q**2) - (2 + cos(t)) ** f * q,
        sin(t * f) / (1 + q**2) ** 2 + tan(q / 3) - 4 * q**3,
    ]
    law = sum(laws)
    model = mechc.compile(bead_with(law, default=1.3), outputs=())
    x, v, s = (Symbol(name) for name in "xvs")
    rate = lambdify((s, x, v), law.subs({q: x, u: v, f: 1.3}).subs(t, s))
    wanted = solve_ivp(
        lambda s, y: [y[1], rate(s, *y)], (0, 2), [0.3, 0.0], "DOP853", rtol=3e-14, atol=1e-15
    ).y[:, -1]
    for rtol in (1e-6, 1e-9, 1e-12):
        end = model.simulate(2.0, [0.3, 0.0], rtol=rtol, method="taylor").y[-1]
        np.testing.assert_allclose(end, wanted, rtol=0, atol=10 * rtol)


def through_the_middle(start, end):
    """The state at the end of q'' = -2q - 0.6 (1 + 2 q^2) / sqrt(1 + q^2) sign(q) - q^9."""
    t, y = 0.0, np.array(start)
    while t < end:
        begun, side = t, np.sign(y[0] or y[1])

        def rate(t, y, side=side):
            corner = 0.6 * side * (1 + 2 * y[0] ** 2) / np.sqrt(1 + y[0] ** 2)
            return [y[1], -2 * y[0] - corner - y[0] ** 9]

        def middle(t, y, begun=begun, side=side):
            return y[0] if t > begun + 1e-3 else side

        middle.terminal = True
        part = solve_ivp(rate, (t, end), y, "DOP853", rtol=3e-14, atol=1e-15, events=middle)
        t, y = part.t[-1], part.y[:, -1] * [part.status == 0, 1.0]
    return y


@pytest.mark.slow
def test_roots_that_touch_zero_and_steps_far_beyond_the_series():
    """sqrt(q^2 + q^4 + f) has a corner where f = 0, while its series goes on smoothly, and beside a
    small f a radius of convergence of 1e-10; the recurrence of a power divides by q."""
    q, f = dynamicsymbols("q"), Symbol("f")
    law = -2 * q - 0.6 * (q + 2 * q**3) / sqrt(q**2 + q**4 + f) - q**9
    model = mechc.compile(bead_with(law, default=0.0), outputs=())
    states = np.stack([np.linspace(-1.2, 1.1, 11), np.linspace(0.8, -1.0, 11)], axis=-1)
    for rtol in (1e-6, 1e-9, 1e-12):
        batch = model.simulate_batch(5.0, states, rtol=rtol, method="taylor")
        for member, start in enumerate(states):
            sol = model.simulate(5.0, start, rtol=rtol, method="taylor")
            wanted = through_the_middle(start, 5.0)
            np.testing.assert_allclose(sol.y[-1], wanted, rtol=0, atol=max(30 * rtol, 1e-10))
            np.testing.assert_array_equal(batch.y[member], sol.y[-1])
    start, bound = [0.0, 1.0], {"rtol": 1e-12, "first_step": 0.1, "method": "taylor"}
    one = model.simulate(0.5, start, {"f": 1e-20}, **bound)
    together = model.simulate_batch(0.5, [start] * 3, {"f": 1e-20}, **bound)
    np.testing.assert_allclose(one.y[-1], through_the_middle(start, 0.5), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(together.y, one.y[[-1] * 3])


@pytest.mark.parametrize("at", [0.0, 1e-9, 0.3])
def test_a_power_whose_series_ends_where_the_motion_goes_on(at):
    """(1 + sin x)^(3/2), near |x + pi/2|^3, has no series where sin x is -1 to the last digit."""
    (x,), (u,) = dynamicsymbols("x:1"), dynamicsymbols("u:1")
    model = mechc.compile(mechc.from_equations([x], [u], None, [2 * (1 + sin(x)) ** 1.5]))
    start = [-np.pi / 2 + at, -1.0]
    ends = [model.simulate(1.0, start, rtol=1e-9, method=m) for m in ("taylor", "dop853")]
    together = model.simulate_batch(1.0, [start] * 5, rtol=1e-9, method="taylor", progress=False)
    np.testing.assert_allclose(ends[0].y[-1], ends[1].y[-1], atol=1e-8)
    np.testing.assert_array_equal(together.y[3], ends[0].y[-1])
    assert ends[0].stats["steps"] < 30


def test_a_step_may_end_at_the_zero_of_a_root_or_a_little_before_it():
    """f - a |x| x sqrt(1 + x^2) - d u - k x, written as a root: its series and that of x have their
    zeros apart by the error of a step; where x and u vanish together the root touches its zero."""
    (x,), (u,) = dynamicsymbols("x:1"), dynamicsymbols("u:1")
    a, d, k, f = symbols("a d k f")
    law = f - a * sqrt(x**4 + x**2) * x - d * u - k * x
    model = mechc.compile(mechc.from_equations([x], [u], None, [law]))
    for start, values, rtol, end in (
        ((0.0, 0.0), (1.334152307400306, 0.0, 1.0, 0.5), 1e-12, 20.0),
        ((0.0, 0.0007679838174838895), (17.00425482895635, 0.0, 1.0, 0.5), 1e-11, -2.0),
        ((0.0339, 0.0), (4.855499392560904, 0.1, 0.0, 0.0), 1e-9, 5.0),
        ((-2e-5, -0.6561), (0.2046055245879644, 0.1, 1.0, 0.0), 1e-5, 5.0),
    ):

        def rate(t, y, v=values):
            force = v[3] - v[0] * abs(y[0]) * np.sqrt(1 + y[0] ** 2) * y[0]
            return [y[1], force - v[1] * y[1] - v[2] * y[0]]

        params = dict(zip("adkf", values, strict=True))
        wanted = solve_ivp(rate, (0, end), start, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        sol = model.simulate(end, start, params, rtol=rtol, method="taylor")
        assert sol.status.ok
        np.testing.assert_allclose(sol.y[-1], wanted, rtol=0, atol=max(30 * rtol, 1e-10))
        batch = model.simulate_batch(
            end, [start] * 5, params, rtol=rtol, method="taylor", progress=False
        )
        np.testing.assert_array_equal(batch.y[3], sol.y[-1])


def bead_on_a_turning_rod():
    """A coordinate in M, and forces along and across the rod that follow the time."""
    r, a, v, w = dynamicsymbols("r a v w")
    t, ground = dynamicsymbols._t, ReferenceFrame("N")
    rod = ground.orientnew("A", "Axis", (a, ground.z))
    rod.set_ang_vel(ground, w * ground.z)
    centre = Point("O")
    centre.set_vel(ground, 0)
    place = centre.locatenew("P", r * rod.x)
    place.set_vel(rod, v * rod.x)
    place.v1pt_theory(centre, ground, rod)
    bodies = [RigidBody("rod", centre, rod, 1, (inertia(rod, 0, 0, 0.8), centre))]
    bodies.append(Particle("bead", place, 1))
    force = (sin(3 * t + r) - 30 * (r - 1)) * rod.x + cos(2 * t) * rod.y - 9.81 * ground.y
    motion = KanesMethod(ground, [r, a], [v, w], [r.diff() - v, a.diff() - w])
    motion.kanes_equations(bodies, [(place, force)])
    return motion


def bead_rates(t, y):
    r, a, v, w = y
    along = r * w**2 - 9.81 * np.sin(a) - 30 * (r - 1) + np.sin(3 * t + r)
    across = r * (np.cos(2 * t) - 9.81 * np.cos(a)) - 2 * r * v * w
    return [v, w, along, across / (0.8 + r**2)]


@pytest.mark.slow
def test_a_mass_matrix_of_coordinates():
    """The motion by its momenta, against SciPy's integrator on equations written by hand."""
    model, start = mechc.compile(bead_on_a_turning_rod(), outputs=()), [1.3, 0.2, 0.1, 0.4]
    wanted = solve_ivp(bead_rates, (0, 3), start, "DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    for rtol in (1e-6, 1e-9, 1e-12):
        end = model.simulate(3.0, start, rtol=rtol, method="taylor").y[-1]
        np.testing.assert_allclose(end, wanted, rtol=0, atol=20 * rtol)
        batch = model.simulate_batch(3.0, [start] * 3, rtol=rtol, method="taylor")
        np.testing.assert_array_equal(batch.y[1], end)


def test_scenes_without_a_series_are_refused():
    with pytest.raises(ValueOutOfBoundsError, match="needs a small scene without constraints"):
        mechc.load("four_bar").simulate(1.0, np.zeros(6), method="taylor")


@pytest.mark.parametrize("name", ["pendulum", "heavy_top", "rigid_body"])
def test_derivatives_follow_the_tolerance(name):
    """Forwards, backwards, between checkpoints, within their own tolerance; beside collocation."""
    model = mechc.load(name)
    start, by = model.assemble(), list(model.parameters)[:2]
    if name == "heavy_top":
        start[:] = [0.0, 0.6, 0.0, 1.0, 50.0, -2.0]
    weights = np.ones(len(start))
    exact = model.simulate(1.5, start, rtol=1e-14, method="gauss8", sensitivities=["y0", *by])
    for rtol in (1e-4, 1e-8, 1e-11):
        given = {"rtol": rtol, "method": "taylor"}
        sol = model.simulate(1.5, start, sensitivities=["y0", *by], **given)
        held = model.simulate(1.5, start, sensitivities=by, sensitivity_error_control=True, **given)
        kept = model.simulate(1.5, start, checkpoints=20_000.0, **given)
        gradients = [each.gradient(end=weights, by=by) for each in (sol, kept)]
        for parameter in ("y0", *by):
            wanted = exact.sensitivity[parameter][-1]
            bound = 30.0 * rtol * np.abs(wanted).max() + 1e-11
            assert np.abs(sol.sensitivity[parameter][-1] - wanted).max() < bound
            between = sol.sensitivity(1.1)[parameter] - exact.sensitivity(1.1)[parameter]
            assert np.abs(between).max() < bound + 1e-9 * np.abs(wanted).max()
            if parameter != "y0":
                assert np.abs(held.sensitivity[parameter][-1] - wanted).max() < bound
                for each in gradients:
                    assert each[parameter] == pytest.approx(weights @ wanted, abs=5.0 * bound)


def test_sines_of_parameters_are_constants():
    """Their argument has no series: alone and in the lanes, against collocation."""
    q, u = dynamicsymbols("q u")
    a, k = Symbol("a"), Symbol("k")
    force = -sin(a) * sin(q + a) - cos(a) * u * q**2 - k * tan(a) * q
    model = mechc.compile(
        particle([q], [u], [force]), defaults={"m": 1.0, k: 2.0, a: 0.7}, outputs=()
    )
    start = [1.0, 0.3]
    exact = model.simulate(5.0, start, method="gauss8", rtol=1e-13).y[-1]
    sol = model.simulate(5.0, start, method="taylor", rtol=1e-11)
    np.testing.assert_allclose(sol.y[-1], exact, rtol=0, atol=1e-11)
    batch = model.simulate_batch(5.0, [start] * 9, rtol=1e-11, progress=False)
    assert batch.method == "taylor in lockstep"
    np.testing.assert_array_equal(batch.y[4], sol.y[-1])


@pytest.mark.parametrize("method", ["auto", "taylor", "gauss8"])
@pytest.mark.parametrize("explicit", [True, False])
def test_a_sum_of_parameters_that_multiplies_a_series(method, explicit):
    """I(x) x'' = -I'(x) x'^2 / 2 keeps I x'^2, for I = A + (B - 1) sin x."""
    x, v = dynamicsymbols("x v")
    a, b = Symbol("A"), Symbol("B")
    inertia_at = a + (b - 1) * sin(x)
    force = -inertia_at.diff(x) * v**2 / 2
    given = (None, [force / inertia_at]) if explicit else ([[inertia_at]], [force])
    model = mechc.compile(mechc.from_equations([x], [v], *given))
    sol = model.simulate(5.0, [0.3, 1.5], {"A": 3.0, "B": 2.5}, method=method)
    assert sol.status.ok
    kept = (3.0 + 1.5 * np.sin(sol.y[:, 0])) * sol.y[:, 1] ** 2
    np.testing.assert_allclose(kept, kept[0], rtol=1e-8)


def test_sums_that_the_last_order_shares_with_others():
    """A rider that turns on a slider, held by a spring to a place: speeds follow from M u."""
    N, origin = ReferenceFrame("N"), Point("O")
    s, angle, v, omega = dynamicsymbols("s angle v omega")
    slider, centre, rider = Point("S"), Point("C"), ReferenceFrame("R")
    origin.set_vel(N, 0)
    slider.set_pos(origin, s * N.z)
    slider.set_vel(N, v * N.z)
    rider.orient_axis(N, angle, N.x)
    centre.set_pos(slider, 0.5 * rider.x - 0.05 * rider.y)
    centre.v2pt_theory(slider, N, rider)
    bodies = [
        Particle("slider", slider, 1),
        RigidBody("rider", centre, rider, 1, (inertia(rider, 0.3, 0.3, 0.5), centre)),
    ]
    apart = centre.pos_from(origin) - 2.5 * N.x - 2.2 * N.y
    length = sqrt(apart.dot(apart))
    pull = (centre, -Symbol("k") * (length - 0.5) * apart / length)
    equations = KanesMethod(N, [s, angle], [v, omega], [s.diff() - v, angle.diff() - omega])
    equations.kanes_equations(bodies, [pull])
    model, start = mechc.compile(equations), [-0.4, 0.7, 0.6, 0.6]
    expected = model.simulate(2.0, start, {"k": 2.0}, method="gauss8", rtol=1e-12)
    sol = model.simulate(2.0, start, {"k": 2.0}, method="taylor", rtol=1e-10)
    assert sol.status.ok
    np.testing.assert_allclose(sol.y[-1], expected.y[-1], atol=1e-8)
